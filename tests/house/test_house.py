"""Every file: a purpose, few lines, few arguments, nothing left to be done, no place of a machine."""

import ast
import io
import re
import tokenize

MOST_LINES = 400
MOST_CODE_LINES = 60
MOST_ARGUMENTS = 6
COMPILED = ("njit", "compiled", "inlined")
"""Decorators of kernels, whose arguments are arrays and numbers: an object of settings would cost time."""
LEFT_OVER = re.compile(r"\b(TO" + r"DO|FIX" + r"ME|XX" + r"X|HA" + r"CK)\b")
MACHINE = re.compile(r"(?<![\w.])(/ho" + r"me|/ro" + r"ot|/wo" + r"rk|/Us" + r"ers|[A-Z]:\\Us" + r"ers)[/\\]")
TEXTS = ("*.py", "*.md", "*.toml", "*.js", "*.css", "*.html", "*.jinja", "*.yaml", "*.cfg")
PLACES = ("src", "benchmarks", "tests", "docs", "reports", ".ci")
COMMENT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}


def code_lines(text, function):
    """Lines of a function that hold code: its signature too, not docstring, comments and blank lines."""
    lines = text.splitlines(keepends=True)[function.lineno - 1 : function.end_lineno]
    held = set()
    for token in tokenize.generate_tokens(io.StringIO("".join(lines)).readline):
        if token.type not in COMMENT:
            held.update(range(token.start[0], token.end[0] + 1))
    first = function.body[0]
    if ast.get_docstring(function, clean=False) is not None:
        held -= {line - function.lineno + 1 for line in range(first.lineno, first.end_lineno + 1)}
    return len(held)


def decorators(function):
    return [ast.unparse(decorator) for decorator in function.decorator_list]


def test_no_file_is_longer_than_400_lines(sources):
    long = {source.name: count for source in sources if (count := source.text.count("\n")) > MOST_LINES}
    assert not long


def test_no_function_has_more_than_60_lines_of_code(sources):
    long = {
        f"{source.name}: {function.name}": count
        for source in sources
        for function in source.functions
        if function.end_lineno - function.lineno >= MOST_CODE_LINES
        and (count := code_lines(source.text, function)) > MOST_CODE_LINES
    }
    assert not long


def test_lines_of_code_are_counted_without_docstring_comments_and_blank_lines():
    text = 'def one(a):\n    """Says.\n\n    More.\n    """\n    # why\n\n    return """\n\n    """\n'
    assert code_lines(text, ast.parse(text).body[0]) == 4


def test_no_function_takes_more_than_six_arguments_by_place(sources):
    """What goes beyond is named by its caller; kernels and commands aside."""
    many = {}
    for source in sources:
        if source.name.startswith("tests/"):
            continue
        for function in source.functions:
            told = decorators(function)
            if any(name.startswith(COMPILED) or ".command" in name or ".callback" in name for name in told):
                continue
            given = [
                a.arg
                for a in (*function.args.posonlyargs, *function.args.args)
                if a.arg not in ("self", "cls")
            ]
            if len(given) > MOST_ARGUMENTS:
                many[f"{source.name}: {function.name}"] = given
    assert not many


def test_every_file_says_what_it_is_for(sources):
    lacking = [s.name for s in sources if not (ast.get_docstring(s.tree) or "").splitlines()[:1]]
    assert not lacking


def texts(root):
    found = [path for place in PLACES for kind in TEXTS for path in (root / place).rglob(kind)]
    return [*found, *(path for kind in TEXTS for path in root.glob(kind))]


def test_nothing_is_left_to_be_done_and_no_place_of_a_machine_is_named(root):
    told = []
    for path in texts(root):
        text = path.read_text(encoding="utf-8")
        told += [
            f"{path.relative_to(root)}: {m[0]}" for m in (*LEFT_OVER.finditer(text), *MACHINE.finditer(text))
        ]
    assert not told


def test_folders_of_benchmarks_import_no_command_but_the_one_that_measures_for_them(sources):
    commands = {s.name[11:-3] for s in sources if s.name.startswith("benchmarks/") and s.name.count("/") == 1}
    assert "bench_model" in commands
    found = {
        (source.name, name)
        for source in sources
        if source.name.startswith("benchmarks/") and source.name.count("/") > 1
        for node in source.nodes
        for name in imported(node)
        if name in commands
    }
    assert found == {("benchmarks/hard/photographs.py", "study_stability")}


def imported(node):
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module] if isinstance(node, ast.ImportFrom) and node.module else []


def test_every_command_of_benchmarks_is_in_their_list_and_no_other(sources, root):
    text = (root / "benchmarks" / "README.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `(\w+)\.py", text, flags=re.MULTILINE)
    there = [s.name[11:-3] for s in sources if s.name.startswith("benchmarks/") and s.name.count("/") == 1]
    assert sorted(listed) == sorted(there)
