"""Notes on single photographs: knocks, turns, poor and doubled pictures, a blade that goes back."""

import numpy as np
import pytest

from ploughval.piv import CameraMovement
from ploughval.run.walk.frame_notes import FrameNotes, texts_of
from ploughval.tracers import Sight


def sight(blade_mm=0.0):
    return Sight(blade_mm, 0.01, np.zeros((4, 4), np.uint8), np.zeros((0, 2)), np.zeros(0), {})


def movement(shift=(0.0, 0.0), *, drift=(0.0, 0.0), turn=0.0, zncc=0.97):
    return CameraMovement(np.array(shift, float), 0.002, np.array(drift, float), turn, zncc)


def notes_of(movements, blades=None, doubled=()):
    notes = FrameNotes(0.1, (900, 1200))
    noted = []
    for frame, camera in enumerate(movements):
        blade = float(frame) if blades is None else blades[frame]
        noted.append(notes.add(frame, sight(blade), camera, doubled=frame in doubled))
    return texts_of(noted)


def test_series_without_events_has_no_notes():
    assert notes_of([movement()] * 6) == {}


def test_knock_is_named_once_where_it_happens():
    texts = notes_of([movement()] * 3 + [movement((2.4, -1.8))] * 3)
    assert list(texts) == [3]
    assert "(+2.40, -1.80) px" in texts[3][0]


def test_slow_drift_is_no_knock_and_is_said_when_it_has_doubled():
    texts = notes_of([movement(drift=(0.11 * k, 0.0)) for k in range(12)])
    assert list(texts) == [3, 7]  # 0.33 px, then more than 0.66
    assert "crept by 0.33 px" in texts[3][0]


def test_turned_camera_is_named_with_what_it_costs_in_the_corners():
    texts = notes_of([movement()] * 2 + [movement(turn=0.1)] * 3)
    assert list(texts) == [2]
    assert "1.3 px in the corners" in texts[2][0]  # 0.1 degrees of half a diagonal of 750 px


def test_picture_in_which_still_sand_hardly_correlates_is_poor():
    texts = notes_of([movement()] * 5 + [movement(zncc=0.5)] + [movement()])
    assert list(texts) == [5]
    assert "0.50 where 0.97 is usual" in texts[5][0]


def test_doubled_picture_and_blade_that_goes_back_are_named():
    texts = notes_of([movement()] * 4, blades=[0.0, 2.0, 1.0, 3.0], doubled={3})
    assert texts[2] == ["the blade stands 1 mm behind an earlier frame: are the times in order?"]
    assert texts[3] == ["the same picture as the frame before"]


@pytest.mark.parametrize("blade", [np.nan, 5.0])
def test_what_the_picture_does_not_tell_raises_no_note(blade):
    nothing = CameraMovement(np.zeros(2), 0.0, np.full(2, np.nan), np.nan, np.nan)
    assert notes_of([movement(), nothing], blades=[5.0, blade]) == {}


def marked(shift=(0.0, 0.0), *, turn=0.0, markers=5, missing=()):
    return CameraMovement(
        np.array(shift, float), 0.002, np.zeros(2), turn, 0.97, markers=markers, missing=tuple(missing)
    )


def test_creep_told_by_markers_is_said_as_taken_off_when_it_has_doubled():
    texts = notes_of([marked((0.11 * k, 0.0)) for k in range(12)])
    assert list(texts) == [3, 7]
    assert "by 5 fixed markers the camera has moved by (+0.33, +0.00) px" in texts[3][0]
    assert "taken off all places" in texts[3][0]


@pytest.mark.parametrize(
    ("frames", "length"),
    [
        ({2}, ""),
        ({1, 2, 4}, " (in 3 photographs, the last of them frame 4)"),
        ({3, 4, 5}, ", from here to the end"),
        ({1, 5}, " (in 2 photographs, the last of them frame 5)"),
    ],
)
def test_lost_marker_is_said_once_with_how_long_it_is_lost(frames, length):
    lost = "fixed marker 2 at (9, 9) px is not seen"
    texts = notes_of([marked(missing=[lost] if k in frames else []) for k in range(6)])
    assert texts == {min(frames): [lost + length]}


def test_steady_fast_creep_is_no_knock_in_every_frame():
    texts = notes_of([marked((0.5 * k, -0.2 * k)) for k in range(40)])
    assert list(texts) == [1, 3, 7, 15, 31]  # 0.54 px, then whenever it has more than doubled


def test_knock_of_a_creeping_camera_is_said_where_it_happens():
    texts = notes_of([marked((0.5 * k + (2.0 if k >= 20 else 0.0), 0.0)) for k in range(25)])
    assert 20 in texts
    assert not {19, 22, 23, 24} & set(texts)


def test_frame_from_which_the_sand_has_to_tell_is_named():
    texts = notes_of([marked(), marked(), marked(markers=0), marked(markers=0)])
    assert list(texts) == [2]
    assert "too few fixed markers agree" in texts[2][0]
