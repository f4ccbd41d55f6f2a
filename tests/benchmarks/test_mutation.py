"""What mutation testing takes for granted of its modules, and its list of equivalent mutants."""

import ast
from pathlib import Path

import pytest

from mutation.mutant import Mutant
from mutation.table import Kept, counted, explained, judged
from mutation.targets import TARGETS

ROOT = Path(__file__).parents[2]
MODULES = {
    target.module: ROOT / "src" / f"{target.module.replace('.', '/')}.py" for target in TARGETS.values()
}


def test_every_equivalent_mutant_changes_a_line_that_still_stands_where_it_is_said_to():
    for row in explained():
        text = MODULES[row.module].read_text(encoding="utf-8")
        body = ast.parse(text).body
        parts = [part for node in body for part in ([node, *getattr(node, "body", [])])]
        name = row.function.rsplit(".", 1)[-1]
        spans = [p for p in parts if getattr(p, "name", None) == name] if name else body
        lines = {
            line.strip() for span in spans for line in text.splitlines()[span.lineno - 1 : span.end_lineno]
        }
        assert row.before in lines, row
        assert row.before != row.after
        assert len(row.why) > 20


def test_every_module_and_every_test_of_it_is_there():
    for target in TARGETS.values():
        assert MODULES[target.module].is_file()
        for test in target.tests:
            file, _, name = test.partition("::")
            assert f"def {name}" in (ROOT / file).read_text(encoding="utf-8")


def test_survivor_is_equivalent_only_where_it_is_explained():
    row = next(iter(explained()))
    known = Mutant("", row.function, 1, row.before, row.after, "", "")
    other = Mutant("", row.function, 1, row.before, f"{row.after} + 1", "", "")
    fates = judged(row.module, [(known, "survived"), (known, "killed"), (other, "survived")])
    assert [fate for _, fate in fates] == ["equivalent", "killed", "surviving"]
    assert counted(fate for _, fate in fates) == [3, 1, 0, 1, 1]


@pytest.mark.parametrize(
    ("fate", "older"), [("killed", "killed"), ("timed out", "timed out"), ("survived", None)]
)
def test_verdicts_are_kept_for_the_tests_that_gave_them(tmp_path, fate, older):
    test, mutant = tmp_path / "test_a.py", Mutant("", "f", 1, "a", "b", "part", "source")
    test.write_text("one")
    Kept(tmp_path / "kept.csv", [test]).add(mutant, fate)
    assert Kept(tmp_path / "kept.csv", [test]).fate(mutant, older=False) == fate
    test.write_text("one and another")
    assert Kept(tmp_path / "kept.csv", [test]).fate(mutant, older=False) is None
    assert Kept(tmp_path / "kept.csv", [test]).fate(mutant, older=True) == older
