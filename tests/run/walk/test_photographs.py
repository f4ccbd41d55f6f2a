"""The stage of the photographs in its store: pieces kept on the way, gone on with, and dropped at the end."""

import errno
import shutil
from dataclasses import replace

import numpy as np
import pytest

from ploughval import load_scene
from ploughval.errors import DataError
from ploughval.photos import calibrate, open_frames
from ploughval.run.kept import written
from ploughval.run.kept.lock import locked
from ploughval.run.kept.store import Store
from ploughval.run.provenance import input_digests
from ploughval.run.walk import photographs
from ploughval.run.walk.photographs import Photographs, walk_to
from ploughval.run.walk.pieces import Piece
from ploughval.run.walk.walk import watch
from ploughval.synth import EXAMPLE, make_folder

FRAMES = 5
OPTIONS = replace(
    EXAMPLE,
    seed=11,
    frames=FRAMES,
    displacement_mm=5.0,
    depth_mm=20.0,
    box_length_mm=150.0,
    mm_per_px=0.4,
    layers_mm=(7.0,),
    dyed=False,
    loadcells=False,
    name="kept",
)


class KilledError(Exception):
    """Ends a walk as from outside."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("photographs") / "test"
    make_folder(path, OPTIONS)
    return path


@pytest.fixture(scope="module")
def opened(folder):
    scene = load_scene(folder)
    frames = open_frames(scene)
    return Photographs(scene, frames, calibrate(scene, frames), input_digests(scene))


@pytest.fixture(scope="module")
def whole(opened):
    return bytes_of(watch(opened.scene, opened.frames, opened.calibration))


@pytest.fixture
def at_once(monkeypatch):
    """Pieces of one frame each."""
    monkeypatch.setattr(photographs, "EVERY_S", 0.0)


@pytest.fixture(scope="module")
def half_way(opened, tmp_path_factory):
    """A result folder whose run was killed after three frames, with a piece for each."""
    results = tmp_path_factory.mktemp("half way")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(photographs, "EVERY_S", 0.0)
        with pytest.raises(KilledError):
            opened.window(Store(results), 0, progress=Heard(killed_at=3))
    return results


@pytest.fixture
def results(half_way, tmp_path):
    """A copy of it."""
    return shutil.copytree(half_way, tmp_path / "results")


class Heard:
    """Frames that were walked."""

    def __init__(self, killed_at=None):
        self.frames, self.killed_at = [], killed_at

    def __call__(self, stage, done, total):
        if self.killed_at is not None and done > self.killed_at:
            raise KilledError
        self.frames.append(done - 1)


def bytes_of(record):
    return {name: (v.dtype.str, v.shape, v.tobytes()) for name, v in record.to_arrays().items()}


def kept(results):
    return sorted(path.name.rsplit("-", 1)[0] for path in (results / ".store").iterdir())


def file_of(results, name):
    return next((results / ".store").glob(f"{name}-*.npz"))


def test_a_killed_walk_goes_on_from_its_last_piece_and_leaves_only_the_whole(opened, results, whole):
    assert kept(results) == ["walk-000000", "walk-000001", "walk-000002", "walked"]
    heard = Heard()
    assert bytes_of(opened.window(Store(results), 0, progress=heard)) == whole
    assert heard.frames == [3, 4]
    assert kept(results) == ["window"]
    heard = Heard()
    assert bytes_of(opened.window(Store(results), 0, progress=heard)) == whole
    assert heard.frames == []


@pytest.mark.parametrize("harm", ["cut off", "empty", "a byte changed", "another piece", "missing"])
@pytest.mark.parametrize("name", ["walk-000001", "walked"])
def test_with_a_broken_piece_or_state_nothing_is_gone_on_from(opened, results, name, harm):
    broken = file_of(results, name)
    data = broken.read_bytes()
    if harm == "missing":
        broken.unlink()
    elif harm == "another piece":
        shutil.copy2(file_of(results, "walk-000002"), broken)
    else:
        changed = bytearray(data)
        changed[len(data) // 2] ^= 1
        broken.write_bytes({"cut off": data[:-100], "empty": b"", "a byte changed": bytes(changed)}[harm])
    store = Store(results)
    shelf = photographs._Shelf(store, opened.key(0))
    assert shelf.load() == []
    assert not store.told["walked"][0]


def test_a_walk_that_is_done_again_ends_with_the_same_bytes(opened, results, whole):
    file_of(results, "walk-000001").write_bytes(b"")
    heard = Heard()
    assert bytes_of(opened.window(Store(results), 0, progress=heard)) == whole
    assert heard.frames == list(range(FRAMES))
    assert kept(results) == ["window"]


def test_a_walk_killed_between_a_piece_and_its_state_goes_on_from_the_state_before(opened, tmp_path, whole):
    store, key = Store(tmp_path), opened.key(0)
    opened.walk_to(store, 0, 2)
    state = file_of(tmp_path, "walked").read_bytes()
    opened.walk_to(store, 0, 4)
    file_of(tmp_path, "walked").write_bytes(state)
    assert [piece.last for piece in photographs._Shelf(store, key).load()] == [2]
    heard = Heard()
    assert bytes_of(opened.window(Store(tmp_path), 0, progress=heard)) == whole
    assert heard.frames == [2, 3, 4]


def test_a_state_that_cannot_be_gone_on_from_costs_the_walk_and_is_told(opened, results, whole, caplog):
    store, key = Store(results), opened.key(0)
    arrays = store.load("walked", key)
    name = next(name for name in arrays if name.endswith("sands/0"))
    store.save("walked", key, arrays | {name: np.zeros(3, np.uint8)})
    heard = Heard()
    assert bytes_of(opened.window(store, 0, progress=heard)) == whole
    assert heard.frames == list(range(FRAMES))
    assert "frame 3: the walk cannot go on from here: not a packed mask" in caplog.text
    assert not store.told["walked"][0]


def test_no_piece_holds_a_state(opened, results):
    for first in range(3):
        piece = Piece.from_arrays(Store(results).load(f"walk-{first:06d}", opened.key(0)))
        assert piece.state == {}


def test_pieces_of_other_settings_are_left_alone_and_go_at_the_end(opened, results, whole):
    scene = opened.scene.model_copy(update={"piv": opened.scene.piv.model_copy(update={"subset_px": 25})})
    other = Photographs(scene, opened.frames, opened.calibration, opened.input_digests)
    heard = Heard()
    assert bytes_of(other.window(Store(results), 0, progress=heard)) != whole
    assert heard.frames == list(range(FRAMES))
    assert kept(results) == ["window"]


def full_disk(*arguments):
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.usefixtures("at_once")
def test_a_full_disk_costs_the_pieces_and_not_the_walk(opened, tmp_path, whole, monkeypatch):
    monkeypatch.setattr(written.os, "fsync", full_disk)
    store = Store(tmp_path)
    assert bytes_of(opened.window(store, 0)) == whole
    assert [text.split(":")[0] for text in store.refused] == ["walk-000000", "window"]
    assert kept(tmp_path) == []


@pytest.mark.usefixtures("at_once")
def test_what_a_full_disk_refused_is_kept_with_the_next_piece(opened, tmp_path, whole, monkeypatch):
    heard = Heard(killed_at=3)

    def full_at_first(file, real=written.os.fsync):
        return full_disk() if len(heard.frames) < 3 else real(file)

    monkeypatch.setattr(written.os, "fsync", full_at_first)
    with pytest.raises(KilledError):
        opened.window(Store(tmp_path), 0, progress=heard)
    assert kept(tmp_path) == ["walk-000000", "walked"]
    heard = Heard()
    assert bytes_of(opened.window(Store(tmp_path), 0, progress=heard)) == whole
    assert heard.frames == [3, 4]


def test_a_walk_in_ranges_of_frames_ends_with_the_bytes_of_one_walk(opened, folder, tmp_path, whole):
    heard = Heard()
    assert walk_to(folder, out=tmp_path, frame=2, progress=heard) == (2, FRAMES)
    assert walk_to(folder, out=tmp_path, frame=2, progress=heard) == (2, FRAMES)
    assert walk_to(folder, out=tmp_path, frame=4, workers=2, progress=heard) == (4, FRAMES)
    assert walk_to(folder, out=tmp_path, frame=3, progress=heard) == (4, FRAMES)
    assert kept(tmp_path) == ["walk-000000", "walk-000002", "walked"]
    assert walk_to(folder, out=tmp_path, frame=FRAMES, progress=heard) == (FRAMES, FRAMES)
    assert heard.frames == list(range(FRAMES))
    assert kept(tmp_path) == ["window"]
    assert walk_to(folder, out=tmp_path, frame=1) == (FRAMES, FRAMES)
    assert bytes_of(opened.window(Store(tmp_path), 0)) == whole


def test_a_range_that_cannot_be_kept_is_an_error(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(written.os, "fsync", full_disk)
    with pytest.raises(DataError, match="walk-000000: not kept"):
        walk_to(folder, out=tmp_path / "results", frame=1)


def test_a_range_waits_for_no_other_run_in_its_result_folder(folder, tmp_path):
    with locked(tmp_path), pytest.raises(DataError, match="another run"):
        walk_to(folder, out=tmp_path, frame=1)


def test_a_test_without_photographs_has_no_frames_to_walk(tmp_path):
    make_folder(tmp_path / "test", replace(OPTIONS, photographs=False))
    assert walk_to(tmp_path / "test", frame=3) == (0, 0)
    assert not (tmp_path / "test" / "results").exists()
