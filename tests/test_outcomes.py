"""What is said of several tests: as they end, in a table at the end, and in JSON, in the order given."""

import json
from pathlib import Path

import pytest

from ploughval.errors import DataError
from ploughval.outcomes import Outcomes, names_of, summary_lines
from ploughval.progress import Lines
from ploughval.run import Outcome
from ploughval.run.many.answers import ElsewhereError, LostError
from ploughval.talk import Talk

METRICS = {
    "a": {"agrees": True},
    "b": {"agrees": False},
    "c": {"agrees": None},
}
GOOD = Outcome("d30", Path("o/a"), True, (), ("a doubt",), METRICS, (), 75.0, Path("o/a/report.html"))
LOSSY = Outcome(
    "d31", Path("o/b"), False, ("frame 3: dark",), (), {}, (), 2.0, Path("o/b/report.html"), ("force",)
)
REFUSED = DataError("no rows", path="c/log.csv")
ENDS = {
    "x/a": GOOD,
    "x/b": LOSSY,
    "x/c": REFUSED,
    "x/d": LostError("SIGKILL (the system does so where memory is short)"),
    "x/e": ElsewhereError("KeyError: 'a'"),
    "x/f": KeyError("b"),
}


@pytest.fixture
def said(capsys):
    """What is said when tests end in this order, and the exit code."""

    def say(folders, order, as_json=False):
        talk = Talk(as_json)
        outcomes = Outcomes(talk, folders, Lines(lambda _: None))
        for index in order:
            outcomes.finished(index, ENDS[folders[index]])
        code = outcomes.close()
        talk.close(code)
        return code, capsys.readouterr()

    return say


def test_a_table_at_the_end_holds_every_test_in_the_order_given(said):
    code, heard = said(list(ENDS), [5, 3, 1, 0, 2, 4])
    assert code == 3
    *lines, last = heard.out.splitlines()
    assert [line.split() for line in lines[:3]] == [
        ["test", "what", "became", "of", "it", "took", "metrics", "agree", "report"],
        ["a", "done", "1", "min", "15", "s", "1", "of", "2", "o/a/report.html"],
        ["b", "incomplete", "2.0", "s", "o/b/report.html"],
    ]
    assert [line[0] for line in lines[1:]] == list("abcdef")
    assert "refused         " in lines[3]
    assert lines[3].endswith("c/log.csv: no rows")
    assert lines[4].split("  ")[-1].startswith("its process ended by SIGKILL (the system does so where")
    assert lines[5].endswith("  KeyError: 'a'")
    assert last.endswith(": 1 done, 1 incomplete, 2 internal error, 1 lost, 1 refused")
    assert last.startswith("6 tests in 0.")


def test_faults_and_ends_are_said_beside_the_output_as_they_come(said):
    _, heard = said(["x/b", "x/a", "x/d"], [1, 0, 2])
    assert heard.err.splitlines()[:5] == [
        "a: warning: a doubt",
        "a: done in 75.0 s",
        "b: frame 3: dark",
        "b: reused: force",
        "b: done, incomplete in 2.0 s",
    ]
    assert "finished stages are kept: run it again, with fewer --workers" in heard.err


@pytest.mark.parametrize(
    ("folders", "code"), [(["x/a", "x/a"], 0), (["x/a", "x/b"], 1), (["x/c", "x/b"], 2), (["x/d", "x/c"], 3)]
)
def test_the_exit_code_is_the_greatest(said, folders, code):
    assert said(folders, [1, 0])[0] == code


def test_json_has_the_tests_in_the_order_given_and_how_many_ended_how(said):
    _, heard = said(["x/c", "x/a", "x/d", "x/b"], [3, 2, 1, 0], as_json=True)
    summary = json.loads(heard.out)
    assert [row["folder"] for row in summary["tests"]] == ["x/c", "x/a", "x/d", "x/b"]
    assert [row["ending"] for row in summary["tests"]] == ["refused", "done", "lost", "incomplete"]
    assert summary["endings"] == {"refused": 1, "done": 1, "lost": 1, "incomplete": 1}
    assert summary["exit_code"] == 3


def test_one_test_has_no_table(said):
    code, heard = said(["x/a"], [0])
    assert code == 0
    assert heard.out == "d30: done in 75.0 s\nreport: o/a/report.html\n"


def test_an_internal_error_of_the_only_test_goes_on():
    outcomes = Outcomes(Talk(False), ["x/f"], Lines(lambda _: None))
    with pytest.raises(KeyError):
        outcomes.finished(0, ENDS["x/f"])


def test_what_a_test_is_called_is_one_printable_line():
    assert names_of(["x/a\n\x1b[31mb", "c"]) == ["a??[31mb", "c"]


def test_a_table_of_hundreds_has_a_line_each():
    row = {"ending": "done", "seconds": 1.0, "metrics": {}, "report": "r.html", "exit_code": 0}
    assert len(summary_lines([f"t{n}" for n in range(300)], [row] * 300, 3600.0)) == 302
