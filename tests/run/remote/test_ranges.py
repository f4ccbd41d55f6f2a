"""A test behind a URL: the same bytes as by its path; what an interrupted run kept is gone on from."""

import json
from dataclasses import replace

import pytest

from ploughval import process
from ploughval.errors import DataError, PloughvalError
from ploughval.piv import Tracker
from ploughval.run.process import process_folder
from ploughval.run.remote.ranges import Pace, run_staged
from ploughval.synth import EXAMPLE, make_folder

fsspec = pytest.importorskip("fsspec")

RECIPE = replace(EXAMPLE, seed=3, frames=7, mm_per_px=0.8, displacement_mm=6.0)
RANGES = Pace(first_frames=3, piece_s=0.0)


@pytest.fixture
def memory():
    system = fsspec.filesystem("memory")
    yield system
    system.store.clear()
    system.pseudo_dirs[:] = [""]


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    return made(tmp_path_factory.mktemp("seen") / "test", RECIPE)


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    return made(tmp_path_factory.mktemp("bare") / "test", replace(RECIPE, photographs=False))


def made(folder, recipe):
    make_folder(folder, replace(recipe, name="made"))
    process_folder(folder, out=folder.parent / "here")
    return folder


def upload(system, folder, target):
    for path in folder.rglob("*"):
        if path.is_file():
            system.pipe_file(f"{target}/{path.relative_to(folder).as_posix()}", path.read_bytes())


def stored(system, root):
    return {name[len(root) + 1 :]: system.cat_file(name) for name in system.find(root)}


def results_of(files):
    return {
        name: data for name, data in files.items() if not name.startswith(".store") and name != "run.json"
    }


def files_of(folder):
    paths = [path for path in folder.rglob("*") if path.is_file()]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def test_a_store_gets_the_bytes_of_a_run_by_path_and_the_url_in_its_record(bare, memory):
    upload(memory, bare, "/b/test")
    memory.pipe_file("/b/test/results/peaks.csv", b"of an earlier run")
    memory.pipe_file("/b/test/results/mine.txt", b"of the user")
    outcome = process("memory://b/test/", workers=1)
    process(bare, out=bare.parent / "page")
    found, expected = stored(memory, "/b/test/results"), files_of(bare.parent / "page")
    assert found.pop("mine.txt") == b"of the user"
    assert results_of(found) == results_of(expected)
    assert "report.html" in found
    assert "peaks.csv" not in expected or found["peaks.csv"] == expected["peaks.csv"]
    ours, theirs = (json.loads(files["run.json"]) for files in (found, expected))
    assert ours["folder"] == "memory://b/test"
    assert ours["inputs"] == theirs["inputs"]
    assert ours["settings_hash"] == theirs["settings_hash"]
    assert (outcome.results, outcome.report) == (
        "memory://b/test/results",
        "memory://b/test/results/report.html",
    )


def test_photographs_behind_a_url_are_walked_range_by_range_to_the_same_bytes(seen, memory, tmp_path):
    upload(memory, seen, "/s")
    run_staged(process_folder, "memory://s", out=str(tmp_path / "o"), pace=RANGES)
    assert results_of(files_of(tmp_path / "o")) == results_of(files_of(seen.parent / "here"))
    assert json.loads((tmp_path / "o" / "run.json").read_text())["folder"] == "memory://s"


def test_a_run_that_ends_early_leaves_its_ranges_in_the_store_for_the_next(seen, memory, monkeypatch):
    tracked = []
    advance = Tracker.advance

    def ends(self, image, sand, camera=None):
        tracked.append(len(tracked))
        if len(tracked) == 5:
            raise KeyboardInterrupt
        return advance(self, image, sand, camera)

    monkeypatch.setattr(Tracker, "advance", ends)
    with pytest.raises(KeyboardInterrupt):
        run_staged(process_folder, str(seen), out="memory://o", pace=RANGES)
    assert {name.partition("-")[0] for name in stored(memory, "/o")} == {".store/walk", ".store/walked"}
    run_staged(process_folder, str(seen), out="memory://o", pace=RANGES)
    assert len(tracked) == RECIPE.frames - 1 + 3, "frames 3 to 5 of the second range are walked again"
    found = stored(memory, "/o")
    assert results_of(found) == results_of(files_of(seen.parent / "here"))
    assert not [name for name in found if "walk" in name]


def test_starting_over_forgets_what_the_store_holds(bare, memory):
    memory.pipe_file("/o/.store/force-" + "0" * 32 + ".npz", b"old")
    outcome = run_staged(process_folder, str(bare), out="memory://o")
    again = run_staged(process_folder, str(bare), out="memory://o")
    fresh = run_staged(process_folder, str(bare), out="memory://o", fresh=True)
    assert "force" not in outcome.reused
    assert "force" in again.reused
    assert "force" not in fresh.reused


def test_a_refusal_names_the_url_and_leaves_earlier_results(bare, memory):
    upload(memory, bare, "/r")
    memory.pipe_file("/r/results/run.json", b"{}")
    memory.pipe_file("/r/test.toml", b"[test]\nname = 3\n")
    with pytest.raises(PloughvalError, match=r"^memory://r/test\.toml: "):
        process("memory://r")
    assert stored(memory, "/r/results") == {"run.json": b"{}"}


def test_a_store_that_fails_at_the_end_has_no_record_of_whole_results(bare, memory, monkeypatch):
    put = type(memory).put_file

    def breaks(self, local, remote, **options):
        if remote.endswith("metrics.json"):
            raise OSError("connection reset")
        return put(self, local, remote, **options)

    memory.pipe_file("/o/run.json", b"{}")
    monkeypatch.setattr(type(memory), "put_file", breaks)
    with pytest.raises(DataError, match=r"memory://o: the store does not answer.*connection reset"):
        run_staged(process_folder, str(bare), out="memory://o")
    assert "run.json" not in stored(memory, "/o")
