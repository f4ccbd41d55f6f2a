"""A disk that is full, over quota or read-only: one message, nothing half-written, and a run that goes on."""

import errno
import itertools
import os
import resource
import shutil
import stat
import subprocess
from contextlib import contextmanager

import pytest
from typer.testing import CliRunner

from broken.base import make_sound, result_bytes
from ploughval.cli import app
from ploughval.errors import DataError
from ploughval.run import process_folder

NOT_SAME = {"run.json"}  # holds timings
SYNTH = ("--frames", 2, "--displacement", 2, "--mm-per-px", 0.9)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("disk") / "test"
    make_sound(folder)
    return folder


@pytest.fixture(scope="module")
def whole(folder, tmp_path_factory):
    """Bytes of every result file where there is room."""
    return result_bytes(process_folder(folder, out=tmp_path_factory.mktemp("whole") / "out").results)


@pytest.fixture
def small_disk(tmp_path):
    """A function that mounts a file system of its own with some options; taken down at the end."""
    place = tmp_path / "disk"
    place.mkdir()
    mounted = []

    def mount(options):
        state = f"remount,{options}" if mounted else options
        line = ["mount", "-t", "tmpfs", "-o", state, "tmpfs", str(place)]
        if shutil.which("mount") is None:
            pytest.skip("no file system can be mounted here: there is no mount")
        done = subprocess.run(line, capture_output=True, text=True, check=False)
        if done.returncode and not mounted:
            pytest.skip(f"no file system can be mounted here: {done.stderr.splitlines()[0]}")
        assert done.returncode == 0, done.stderr
        mounted.append(options)
        return place

    yield mount
    if mounted:
        subprocess.run(["umount", str(place)], check=True)


@pytest.fixture
def light_page(monkeypatch):
    """A page as heavy as a small one, without the seconds of its figures."""
    monkeypatch.setattr("ploughval.report.page.single_page", lambda *_: "x" * 300_000)


def run(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def scraps(place):
    return [str(path) for path in place.rglob(".*") if path.name != ".store"]


def same(found, whole):
    return {name for name in found.keys() | whole.keys() if found.get(name) != whole.get(name)} <= NOT_SAME


def told_once(result, place):
    """Whether a command was refused in one line that names a file of the place and what to do."""
    lines = [line for line in result.stderr.splitlines() if "cannot be written" in line and "refused" in line]
    return (
        result.exit_code == 2
        and len(lines) == 1
        and str(place) in lines[0]
        and "choose another place" in lines[0].lower()
        and "Traceback" not in result.output
    )


@pytest.mark.parametrize("size_kB", [100, 200])
def test_a_full_disk_ends_process_with_a_message_and_room_lets_it_end_whole(
    size_kB, folder, whole, small_disk, light_page
):
    """At 100 kB it is tracks.nc that finds no room: HDF5 itself would end the process there."""
    place = small_disk(f"size={size_kB}k")
    result = run("process", folder, "--out", place / "out")
    assert told_once(result, place), result.stderr
    assert "no space is left" in result.stderr
    assert scraps(place) == []
    left = result_bytes(place / "out")
    assert all(data == whole[name] for name, data in left.items() if name not in NOT_SAME)
    assert "report.html" not in left
    small_disk("size=4M")
    assert run("process", folder, "--out", place / "out").exit_code == 0
    found = result_bytes(place / "out")
    assert found.pop("report.html")
    assert same(found, whole)


def test_a_disk_without_room_for_one_more_file_is_told_like_a_full_one(folder, small_disk, light_page):
    place = small_disk("nr_inodes=9")
    assert told_once(run("process", folder, "--out", place / "out"), place)
    assert not (place / "out" / "run.json").exists()


def test_a_disk_that_can_only_be_read_keeps_earlier_results_whole(folder, whole, small_disk, light_page):
    place = small_disk("size=4M")
    process_folder(folder, out=place / "out")
    small_disk("ro")
    result = run("process", folder, "--out", place / "out")
    assert told_once(result, place), result.stderr
    assert "the disk can only be read" in result.stderr
    small_disk("rw")
    assert same(result_bytes(place / "out"), whole)
    assert "run.json" in result_bytes(place / "out")


@contextmanager
def failing_write(number, code):
    """Let the n-th file fail when it comes to be synced; yields a list of those that came to that."""
    fsync, synced = os.fsync, []

    def sync(handle):
        if stat.S_ISREG(os.fstat(handle).st_mode):
            synced.append(handle)
            if len(synced) == number:
                raise OSError(code, os.strerror(code))
        fsync(handle)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", sync)
        yield synced


def refusal_of(folder, out):
    """What processing a folder is refused with; None where it is done."""
    try:
        process_folder(folder, out=out)
    except DataError as error:
        return str(error)
    return None


def test_whichever_file_fails_the_others_are_whole_and_the_record_never_lies(folder, whole, tmp_path):
    """The disk fails at the n-th file, for every n till a run gets through."""
    out, told = tmp_path / "out", []
    process_folder(folder, out=out)  # what is kept of the stages has been written
    for number in itertools.count(1):
        with failing_write(number, errno.EDQUOT) as synced:
            told.append(refusal_of(folder, out))
        found = result_bytes(out)
        assert scraps(out) == []
        assert all(data == whole[name] for name, data in found.items() if name not in NOT_SAME)
        assert ("run.json" in found) == (told[-1] is None)
        if len(synced) < number:
            break
    assert found.keys() == whole.keys()
    *refused, last = told
    assert last is None
    assert all("your quota of the disk is used up" in text for text in refused)
    assert {text.partition(": ")[0] for text in refused} == {str(out / name) for name in whole}


def test_a_stage_that_cannot_be_kept_costs_only_the_keeping(folder, whole, tmp_path):
    with failing_write(1, errno.ENOSPC):
        outcome = process_folder(folder, out=tmp_path / "out")
    assert outcome.complete
    assert same(result_bytes(outcome.results), whole)
    assert [text for text in outcome.warnings if "not kept for another run" in text and "no space" in text]


def test_a_limit_on_the_size_of_files_is_named(folder, tmp_path):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, hard))
    try:
        with pytest.raises(DataError, match=r"tracks\.nc: cannot be written: it is larger .* \(ulimit -f\)"):
            process_folder(folder, out=tmp_path / "out")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert scraps(tmp_path) == []
    assert not (tmp_path / "out" / "run.json").exists()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission_is_named(folder, tmp_path):
    tmp_path.chmod(0o500)
    assert told_once(run("process", folder, "--out", tmp_path / "out"), tmp_path)


def test_a_file_in_the_way_of_the_result_folder_is_named(folder, tmp_path):
    (tmp_path / "out").write_text("mine")
    result = run("process", folder, "--out", tmp_path / "out")
    assert told_once(result, tmp_path), result.stderr
    assert (tmp_path / "out").read_text() == "mine"


@pytest.mark.parametrize("size_kB", [4, 64])
def test_a_full_disk_ends_simulate_with_a_message(size_kB, folder, small_disk):
    place = small_disk(f"size={size_kB}k")
    assert told_once(run("simulate", folder, "--out", place / "out"), place)
    assert scraps(place) == []


def test_a_disk_that_fills_up_leaves_no_tables_of_two_model_runs(folder, small_disk):
    place = small_disk("size=4M")
    assert run("simulate", folder, "--out", place / "out", "--displacement", 20).exit_code == 0
    earlier = result_bytes(place / "out")
    small_disk(f"size={sum(map(len, earlier.values())) // 1024 + 40}k")
    assert told_once(run("simulate", folder, "--out", place / "out", "--displacement", 60), place)
    left = result_bytes(place / "out")
    assert left
    assert not set(left.values()) & set(earlier.values())


@pytest.mark.parametrize("size_kB", [4, 80])
def test_a_test_made_half_is_no_test_and_the_same_command_makes_it_whole(size_kB, small_disk):
    place = small_disk(f"size={size_kB}k")
    made = place / "made"
    result = run("synth", made, *SYNTH)
    assert told_once(result, place), result.stderr
    assert not (made / "test.toml").exists()
    assert scraps(place) == []
    small_disk("size=4M")
    again = run("synth", made, *SYNTH)
    assert again.exit_code == 0, again.stderr
    assert (made / "test.toml").is_file()


def test_no_empty_settings_are_left_where_init_finds_no_room(small_disk):
    place = small_disk("size=8k")
    (place / "photos").mkdir()
    (place / "fill").write_bytes(b"x" * 4096)
    (place / "photos" / "fill").write_bytes(b"x" * 4096)
    result = run("init", place)
    assert told_once(result, place), result.stderr
    assert not (place / "test.toml").exists()
    assert scraps(place) == []


def test_a_page_that_finds_no_room_leaves_the_earlier_one(folder, small_disk, light_page):
    place = small_disk("size=1M")
    process_folder(folder, out=place / "out")
    assert run("report", place / "out", "--out", place / "page.html").exit_code == 0
    small_disk("size=700k")
    before = (place / "page.html").read_bytes()
    assert told_once(run("report", place / "out", "--out", place / "page.html"), place)
    assert (place / "page.html").read_bytes() == before
    assert scraps(place) == []
