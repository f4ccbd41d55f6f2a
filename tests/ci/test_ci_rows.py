"""The rows of Pythons and dependencies, and the trial of the wheel: what they run, skip and stop at."""

import sys

import pytest

PINS = "numpy==2.1.0\nscipy==1.14.0\n"


@pytest.fixture
def rows(script, monkeypatch, tmp_path):
    module = script("rows")
    monkeypatch.setattr(module, "PLACE", tmp_path / "rows")
    return module


@pytest.fixture
def environments(script):
    return script("environments.py")


def stated(rows, monkeypatch, tmp_path, *dependencies):
    """Let pyproject.toml state these dependencies, and extras without any."""
    extras = "".join(f"{extra} = []\n" for extra in rows.EXTRAS)
    project = f"[project]\ndependencies = {list(dependencies)}\n[project.optional-dependencies]\n{extras}"
    (tmp_path / "pyproject.toml").write_text(project)
    monkeypatch.setattr(rows, "ROOT", tmp_path)


def test_lowest_versions_that_are_the_stated_bounds_pass(rows, monkeypatch, tmp_path):
    stated(rows, monkeypatch, tmp_path, "numpy>=2.1", "scipy>=1.14.0,<2")
    assert rows.not_as_stated(PINS) == []


def test_a_bound_below_what_can_be_installed_is_named_with_what_can(rows, monkeypatch, tmp_path):
    stated(rows, monkeypatch, tmp_path, "numpy>=2.0", "scipy>=1.14")
    assert rows.not_as_stated(PINS) == ["numpy>=2.0 gives 2.1.0"]


def test_a_row_without_its_python_is_skipped_and_said(rows, monkeypatch, capsys):
    monkeypatch.setattr(rows, "python_of", lambda version: None)
    assert rows.main(["3.12"]) == 0
    assert "row 3.12: SKIPPED: there is no python3.12 on the path" in capsys.readouterr().out


def test_a_row_that_fails_does_not_keep_the_others_from_running_and_ends_with_1(rows, monkeypatch, capsys):
    monkeypatch.setattr(
        rows, "outcome", lambda row, tests: "FAILED" if row.python == "3.12" else " ".join(tests)
    )
    assert rows.main(["3.12", "3.13"]) == 1
    assert [line.rpartition(" (")[0] for line in capsys.readouterr().out.splitlines()] == [
        "row 3.12: FAILED",
        "row 3.13: tests",
    ]


def test_an_unknown_row_is_refused_with_the_known_ones(rows, capsys):
    with pytest.raises(SystemExit, match="2"):
        rows.main(["3.4"])
    assert "no such row: 3.4; expected of 3.11-lowest, 3.11, 3.12, 3.13" in capsys.readouterr().err


def test_rows_licences_and_the_trial_of_the_wheel_know_every_extra(rows, script, extras):
    assert set(rows.EXTRAS) - {"test"} == extras
    assert set(script("licences").EXTRAS) == extras
    assert set(script("package").EXTRAS) == extras


def test_a_program_that_ends_otherwise_than_it_should_is_told_with_what_it_said(environments):
    code = "print('so far'); raise SystemExit(3)"
    assert environments.run(sys.executable, "-c", code, code=3) == "so far\n"
    with pytest.raises(environments.Failed, match=r"(?s)ended with 3, not 0:.*so far"):
        environments.run(sys.executable, "-c", code)


def test_a_python_is_what_its_name_on_the_path_calls_itself_and_none_where_none_answers(
    environments, monkeypatch, tmp_path
):
    """As with pyenv, whose python3.12 runs only where PYENV_VERSION names it."""
    shim = tmp_path / "python3.12"
    shim.write_text('#!/bin/sh\n[ "$PYENV_VERSION" = 3.12 ] && echo /where/it/is\n')
    shim.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("PYENV_VERSION", raising=False)
    assert environments.python_of("3.12") == "/where/it/is"
    assert environments.python_of("3.13") is None
