"""Broken test folders: each is answered with file, place, value and remedy, and nothing is touched."""

import ctypes
import logging
from contextlib import contextmanager, nullcontext

import pytest
from typer.testing import CliRunner

import ploughval.report
from broken.base import make_sound
from broken.run import judge, make, tree
from broken_folders import KINDS, all_cases
from ploughval.cli import app

CASES = [case for case in all_cases() if not case.heavy]
_EACH = 4  # of the many that are alike or take a second; the script runs all


def _chosen():
    """All that are refused at once but the settings; of these, and of what is processed, one in so many."""
    settings = [case for case in CASES if case.name.startswith(("setting: ", "path: "))]
    others = [case for case in CASES if case not in settings and not case.slow]
    refused = [case for case in others if case.codes == (2,)]
    processed = [case for case in others if case not in refused]
    return [*refused, *processed[::_EACH], *settings[::_EACH]]


@pytest.fixture(scope="session")
def sound(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sound") / "sound"
    make_sound(folder)
    return folder


@pytest.fixture(autouse=True)
def no_page(monkeypatch):
    """The page of results, which takes longest, is not written."""

    def no_more_than_a_word(results, progress):
        (results / "report.html").write_text("page")
        return results / "report.html"

    monkeypatch.setattr(ploughval.report, "write_single", no_more_than_a_word)
    yield
    logging.getLogger().handlers.clear()


_OVERRIDE = 0b110  # CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH


@contextmanager
def as_any_user():
    """Without what lets root read and write everything, where this process has it."""
    libc = ctypes.CDLL(None, use_errno=True)
    head, powers = (ctypes.c_uint32 * 2)(0x20080522, 0), (ctypes.c_uint32 * 6)()
    if not hasattr(libc, "capget") or libc.capget(head, powers):
        pytest.skip("the powers of this process cannot be read")
    effective = powers[0]
    powers[0] &= ~_OVERRIDE
    if libc.capset(head, powers):
        pytest.skip("the powers of this process cannot be laid down")
    try:
        yield
    finally:
        powers[0] = effective
        libc.capset(head, powers)


@pytest.mark.parametrize("case", _chosen(), ids=lambda case: case.name)
def test_a_broken_folder_is_answered(case, sound, tmp_path):
    folder, out = make(case, sound, tmp_path / "case"), tmp_path / "case" / "out"
    before = tree(folder.parent)
    with as_any_user() if case.name.startswith("permission") else nullcontext():
        result = CliRunner().invoke(app, ["process", "--workers", "1", "--out", str(out), "--", str(folder)])
    said = result.output
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    after = tree(folder.parent)
    changed = [name for name in before | after if before.get(name) != after.get(name)]
    assert judge(case, result.exit_code, said, out, changed) == (), said


def test_there_are_at_least_150_broken_folders_of_names_of_their_own():
    names = [case.name for kind in KINDS for case in kind.cases()]
    assert len(names) == len(set(names)) >= 150
