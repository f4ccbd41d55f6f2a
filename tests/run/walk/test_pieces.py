"""A walk that is cut anywhere and continued by new objects, from stored arrays, ends with the same bytes."""

import io
from dataclasses import fields, is_dataclass, replace
from itertools import pairwise

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ploughval import load_scene
from ploughval.photos import calibrate, open_frames
from ploughval.run.walk.looks import Series
from ploughval.run.walk.pieces import Piece, join, merged
from ploughval.run.walk.walk import Walk, walk_piece, watch
from ploughval.synth import EXAMPLE, make_folder

SMALL = replace(
    EXAMPLE,
    seed=11,
    frames=8,
    displacement_mm=23.0,
    depth_mm=20.0,
    box_length_mm=150.0,
    mm_per_px=0.35,
    layers_mm=(7.0, 14.0),
    loadcells=False,
    markers=5,
    name="marked",
)
DOUBLED, KNOCKED, LOST, BLANK = 2, 3, 4, 5  # frames
PLAIN = replace(
    SMALL, frames=6, displacement_mm=6.0, dyed=False, markers=0, below_mm=12.0, bit_depth=16, name="plain"
)


def pictures_of(folder):
    paths = sorted((folder / "photos").glob("*.png"))
    return paths, [cv2.imread(str(path), cv2.IMREAD_UNCHANGED) for path in paths]


def moved(image, shift, turn_deg):
    height, width = image.shape
    matrix = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), turn_deg, 1.0)
    matrix[:, 2] += shift
    return cv2.warpAffine(
        image, matrix, (width, height), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT
    )


def series_of(folder, first=0):
    scene = load_scene(folder)
    frames = open_frames(scene)
    return Series(scene, frames, calibrate(scene, frames), first)


@pytest.fixture(scope="module")
def marked(tmp_path_factory):
    """Markers, dyed layers; a doubled frame, a knock with a turn, a lost one, and one that shows nothing."""
    folder = tmp_path_factory.mktemp("pieces") / "marked"
    make_folder(folder, SMALL)
    paths, images = pictures_of(folder)
    images[DOUBLED] = images[DOUBLED - 1]
    images[KNOCKED:] = [moved(image, (2.3, -1.4), 0.2) for image in images[KNOCKED:]]
    images[BLANK] = np.full_like(images[BLANK], 90)
    for path, image in zip(paths, images, strict=True):
        cv2.imwrite(str(path), image)
    paths[LOST].write_bytes(paths[LOST].read_bytes()[:2000])
    return series_of(folder)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """Neither markers nor dye, 16 bits; the first frame is lost, and a knock is told by the sand."""
    folder = tmp_path_factory.mktemp("pieces") / "plain"
    make_folder(folder, PLAIN)
    paths, images = pictures_of(folder)
    for path, image in zip(paths[4:], images[4:], strict=True):
        cv2.imwrite(str(path), moved(image, (-1.6, 0.9), 0.0))
    paths[0].write_bytes(paths[0].read_bytes()[:2000])
    return series_of(folder, first=1)


def stored(piece):
    """The piece as it comes back from a file."""
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **piece.to_arrays())
    file.seek(0)
    with np.load(file, allow_pickle=False) as arrays:
        return Piece.from_arrays(dict(arrays))


def parts_of(value):
    """Named parts of an object that holds others; None: it holds none."""
    if is_dataclass(value):
        return {f.name: getattr(value, f.name) for f in fields(value)}
    if isinstance(value, dict):
        return value
    if isinstance(value, (list, tuple)):
        return dict(enumerate(value))
    if type(value).__module__.startswith("ploughval."):
        return getattr(value, "__dict__", None)
    return None


def differences(one, other, path, shared):
    """Paths of all that differs between two objects, down to the bytes, types and order of arrays."""
    if one is other or id(one) in shared:
        return []
    if type(one) is not type(other):
        return [f"{path}: {type(one).__name__}, {type(other).__name__}"]
    if isinstance(one, (np.ndarray, np.generic)):
        same = (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
        return [] if same and (one.size < 2 or one.strides == other.strides) else [path]
    parts, others = parts_of(one), parts_of(other)
    if parts is None:
        return [] if one == other or (one != one and other != other) else [f"{path}: {one!r}, {other!r}"]
    if list(parts) != list(others):
        return [f"{path}: {list(parts)}, {list(others)}"]
    shared.add(id(one))
    return [
        text for name in parts for text in differences(parts[name], others[name], f"{path}.{name}", shared)
    ]


def bytes_of(record):
    return {name: (v.dtype.str, v.shape, v.tobytes()) for name, v in record.to_arrays().items()}


class Both:
    """A walk that never stops, and beside it one that is stored and made anew after every frame."""

    def __init__(self, series):
        steady, state = Walk(series, 1), None
        self.pieces, self.differences, self.references = [], [], []
        for frame in range(len(series.frames)):
            list(steady.pieces(frame + 1))
            piece = stored(walk_piece(series, state, frame + 1))
            self.pieces.append(piece.without_state())
            state = piece.state
            continued = Walk(series, 1, stored(piece).state)
            self.differences += differences(steady, continued, f"frame {frame}", set())
            self.references.append(() if steady._tracker is None else steady._tracker.reference_frames)


@pytest.fixture(scope="module")
def both(marked):
    return Both(marked)


@pytest.fixture(scope="module")
def whole(marked):
    return watch(marked.scene, marked.frames, marked.calibration, workers=2)


@pytest.fixture(scope="module")
def plain_whole(plain):
    return watch(plain.scene, plain.frames, plain.calibration, first=plain.first)


def test_the_walk_goes_through_all_that_changes_its_state(both, whole):
    assert len(both.references[KNOCKED]) > len(both.references[0])  # renewed, and frames follow
    assert list(whole.lost_frames) == [LOST]
    assert whole.notes[DOUBLED] == ["the same picture as the frame before"]
    assert "fixed markers the camera has moved" in whole.notes[KNOCKED][0]
    assert "too few fixed markers agree" in whole.notes[BLANK][0]
    assert np.isfinite(whole.dyed[whole.dyed[:, 0] == SMALL.frames - 1][:, 2]).any()
    assert len(whole.noise)


def test_a_walk_made_anew_after_any_frame_is_in_every_attribute_the_one_that_never_stopped(both):
    assert both.differences == []


def test_cut_at_every_frame_the_walk_ends_with_the_same_bytes(both, whole):
    assert len(both.pieces) == SMALL.frames
    assert bytes_of(join(both.pieces)) == bytes_of(whole)


@settings(
    max_examples=3,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(cuts=st.sets(st.integers(1, PLAIN.frames - 1), min_size=1, max_size=3), workers=st.integers(1, 2))
def test_cut_in_random_pieces_the_walk_ends_with_the_same_bytes(plain, plain_whole, cuts, workers):
    pieces, state = [], None
    for last in [*sorted(cuts), PLAIN.frames]:
        pieces.append(stored(walk_piece(plain, state, last, workers=workers)))
        state = pieces[-1].state
    assert bytes_of(join(pieces)) == bytes_of(plain_whole)


def test_frames_before_the_first_that_can_be_read_are_missing_and_the_knock_is_told_by_sand(plain_whole):
    assert list(plain_whole.lost_frames) == [0]
    assert np.isnan(plain_whole.position_px[0]).all()
    assert np.isfinite(plain_whole.position_px[1:]).any(axis=(1, 2)).all()
    assert "the camera moved by" in plain_whole.notes[4][0]


def test_pieces_that_do_not_follow_each_other_are_refused(both):
    for before, after in pairwise(both.pieces):
        assert merged([before, after]).last == after.last
    with pytest.raises(ValueError, match="begins at frame 2; expected 1"):
        join([both.pieces[0], both.pieces[2]])


def test_what_is_no_piece_is_refused(both):
    arrays = both.pieces[0].to_arrays()
    with pytest.raises(ValueError, match="not a value that was stored"):
        Piece.from_arrays({name: array for name, array in arrays.items() if "blade" not in name})
