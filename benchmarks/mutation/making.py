"""Mutants of a source by cosmic-ray's operators, one change each."""

import ast
import re
from collections.abc import Iterator

from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator, operator_names

from mutation.mutant import Mutant

ARITHMETIC = {"Add", "Sub", "Mul", "Div"}
SWAPPED = {
    **{name: ARITHMETIC - {name} for name in ARITHMETIC},
    "Pow": {"Mul"},
    "FloorDiv": {"Div"},
    "Mod": {"Div"},
    "BitAnd": {"BitOr"},
    "BitOr": {"BitAnd"},
}
COMPARED = {"Eq", "NotEq", "Lt", "LtE", "Gt", "GtE"}
OTHERS = re.compile(
    r"AddNot|NumberReplacer|ReplaceAndWithOr|ReplaceOrWithAnd|ReplaceBreakWithContinue|ZeroIterationForLoop"
    r"|ReplaceContinueWithBreak|ReplaceTrueWithFalse|ReplaceFalseWithTrue|ReplaceUnaryOperator_USub_UAdd"
    r"|ReplaceUnaryOperator_Delete_\w+"
)


def mutants_of(source: str) -> list[Mutant]:
    """Every mutant that runs other code; changes of annotations, decorators and docstrings are none."""
    found, seen = [], {_running(source)}
    places = _functions(source)
    for name in sorted(filter(_wanted, operator_names())):
        for changed in _changes(source, name):
            running = _running(changed)
            if running not in seen:
                seen.add(running)
                found.append(_mutant(source, changed, name.split("/")[-1], places))
    return sorted(found, key=lambda mutant: (mutant.line, mutant.operator, mutant.after))


def canaries_of(source: str) -> list[Mutant]:
    """For each function the source in which a call of it raises: a test that reaches it has to fail."""
    canaries, lines = [], source.splitlines(keepends=True)
    for name, node in _functions(source).items():
        body = node.body[1] if _is_text(node.body[0]) and len(node.body) > 1 else node.body[0]
        at, indent = body.lineno - 1, " " * body.col_offset
        changed = "".join([*lines[:at], f"{indent}raise AssertionError('reached')\n", *lines[at:]])
        canaries.append(Mutant("Canary", name, at + 1, lines[at].strip(), "raise", name, changed))
    return canaries


def kernels_of(source: str) -> set[str]:
    """Names of the functions that numba compiles."""
    found = _functions(source).items()
    return {name for name, node in found if any("njit" in ast.unparse(part) for part in node.decorator_list)}


def _wanted(name: str) -> bool:
    """Whether a change gives code that a person could have written; bits of floats are none."""
    kind = name.split("/")[-1]
    if kind.startswith("ReplaceBinaryOperator_"):
        _, old, new = kind.split("_")
        return new in SWAPPED.get(old, set())
    if kind.startswith("ReplaceComparisonOperator_"):
        _, old, new = kind.split("_")
        return {old, new} <= COMPARED or {old, new} == {"Is", "IsNot"}
    return OTHERS.fullmatch(kind) is not None


def _changes(source: str, name: str) -> Iterator[str]:
    occurrence, operator = 0, get_operator(name)()
    while (changed := mutate_code(source.encode(), operator, occurrence)) is not None:
        if _is_python(changed):
            yield changed
        occurrence += 1


def _is_python(source: str) -> bool:
    """Whether it can be read: the star before keywords is taken for a multiplication."""
    try:
        ast.parse(source)
    except SyntaxError:
        return False
    return True


def _running(source: str) -> str:
    """What of a source runs: its tree without annotations, decorators and docstrings."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.arg):
            node.annotation = None
        elif isinstance(node, ast.FunctionDef):
            node.returns = None
            node.decorator_list = []
        elif isinstance(node, ast.ClassDef):
            node.decorator_list = []
        elif isinstance(node, ast.arguments):  # how arguments may be given, by place or by name
            node.args = [*node.posonlyargs, *node.args, *node.kwonlyargs]
            node.defaults = [*node.defaults, *(part for part in node.kw_defaults if part is not None)]
            node.posonlyargs, node.kwonlyargs, node.kw_defaults = [], [], []
        elif isinstance(node, ast.AnnAssign):
            node.annotation = ast.Constant(None)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and _is_text(node.body[0]):
            node.body[0] = ast.Pass()
    return ast.dump(tree)


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _functions(source: str) -> dict[str, ast.FunctionDef]:
    """Functions and methods by their names; a function within one is part of it."""
    found = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.FunctionDef):
            found[node.name] = node
        elif isinstance(node, ast.ClassDef):
            inner = (part for part in node.body if isinstance(part, ast.FunctionDef))
            found |= {f"{node.name}.{part.name}": part for part in inner}
    return found


def _mutant(source: str, changed: str, operator: str, places: dict[str, ast.FunctionDef]) -> Mutant:
    old, new = source.splitlines(), changed.splitlines()
    at = next(k for k, pair in enumerate(zip(old, new, strict=True)) if pair[0] != pair[1])
    inside = (name for name, node in places.items() if node.lineno <= at + 1 <= (node.end_lineno or 0))
    function = next(inside, "")
    first, last = (places[function].lineno - 1, places[function].end_lineno) if function else (at, at + 1)
    part = "\n".join([function, *new[first:last]])
    return Mutant(operator, function, at + 1, old[at].strip(), new[at].strip(), part, changed)
