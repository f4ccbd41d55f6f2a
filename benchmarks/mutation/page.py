"""The page and the tables of mutation testing."""

import csv
from collections.abc import Sequence
from pathlib import Path

from mutation.mutant import Mutant
from mutation.table import FATES, counted, explained
from mutation.targets import TARGETS

FUNCTIONS = ("module", "function", *FATES)
COMPILED = ("module", "line", "before", "after", "interpreted", "compiled")
ABOVE = """# Which small changes of the code do the tests not notice?

Made by `python benchmarks/mutation_testing.py` (extra `mutation`), which changes a module in one place at a
time by the operators of cosmic-ray and runs the module's tests on it: another arithmetic operator, another
comparison, a number that is one more or less, a condition negated, `and` for `or`, a loop not entered or not
left, a sign dropped. Operators on the bits of floats, and changes of annotations, decorators and docstrings,
are left out: every test would notice the first and hardly one the second.

- *killed*: a test fails, or the module cannot be imported. Warnings are errors, as in the whole suite.
- *timed out*: the tests take four times as long as on the module as it is, at least 10 s of the processor.
- *equivalent*: no test can notice; the reason stands below.
- *surviving*: a test is missing.

Compiled kernels can hide a mutant: numba keeps machine code by the file of the outermost function, so that a
kernel that calls the mutated one would run on with the old code in it. Mutants therefore run as the Python
that they are written in (`NUMBA_DISABLE_JIT=1`), each in a process of its own. That every function is run is
shown first by canaries: with `raise` as its first line the tests must fail.
{compiled}

Only the files named here are run: what they do not notice may still be noticed by another test of the suite.
"""


def write_tables(out: Path, module: str, fates: Sequence[tuple[Mutant, str]]) -> None:
    """Replace the rows of one module in functions.csv."""
    functions = dict.fromkeys(mutant.function for mutant, _ in fates)
    rows = [
        [
            module,
            function or "(module)",
            *counted(fate for mutant, fate in fates if mutant.function == function),
        ]
        for function in functions
    ]
    _replace(out / "functions.csv", FUNCTIONS, module, rows)


def write_compiled(out: Path, module: str, rows: Sequence[Sequence[object]]) -> None:
    """Replace the rows of one module in compiled.csv."""
    _replace(out / "compiled.csv", COMPILED, module, rows)


def write_page(out: Path) -> None:
    """README.md of the tables."""
    lines = [ABOVE.format(compiled=_compiled(out)), "## Modules\n", _head(("module", "tests", *FATES))]
    functions = _read(out / "functions.csv")
    for target in TARGETS.values():
        own = [row for row in functions if row["module"] == target.module]
        sums = [sum(int(row[fate]) for row in own) for fate in FATES]
        tests = ", ".join(Path(test).name for test in target.tests)
        lines += [_line((f"`{target.module}`", tests, *sums))] if own else []
    lines += ["\n## Functions\n", _head(FUNCTIONS)]
    lines += [
        _line((f"`{row['module']}`", f"`{row['function']}`", *(row[fate] for fate in FATES)))
        for row in functions
    ]
    lines += [
        "\n## Equivalent mutants\n",
        _head(("module", "function", "line", "mutant", "why no test can notice")),
    ]
    for row in explained():
        codes = (f"`{text.replace('|', chr(92) + '|')}`" for text in (row.before, row.after))
        lines.append(_line((row.module.rsplit(".", 1)[1], row.function, *codes, row.why)))
    (out / "README.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _compiled(out: Path) -> str:
    rows = _read(out / "compiled.csv")
    if not rows:
        return ""
    alike = sum(row["interpreted"] == row["compiled"] for row in rows)
    return (
        f"{len(rows)} mutants drawn at random ran with compiled kernels as well, each compiled anew\n"
        f"(`--compiled`, `compiled.csv`): {alike} of them met the same fate."
    )


def _replace(path: Path, columns: Sequence[str], module: str, rows: Sequence[Sequence[object]]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    others = [[row[name] for name in columns] for row in _read(path) if row["module"] != module]
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([columns, *others, *rows])


def _read(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _head(names: Sequence[str]) -> str:
    return f"{_line(names)}\n{_line(['---'] * len(names))}"


def _line(cells: Sequence[object]) -> str:
    return f"| {' | '.join(map(str, cells))} |"
