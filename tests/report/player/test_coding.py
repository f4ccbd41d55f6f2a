"""Lines as few bytes stay where they were."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from ploughval.report.player.coding import (
    letters,
    pack,
    pack_lines,
    pieces,
    quantum_of,
    thinned,
    unpack,
    unpack_lines,
)

TOLERANCE_MM = 0.02
lines_mm = hnp.arrays(
    float, st.tuples(st.integers(1, 40), st.just(2)), elements=st.floats(-300, 300, allow_nan=False)
)
steps_mm = hnp.arrays(
    float, st.tuples(st.integers(2, 120), st.just(2)), elements=st.floats(-0.05, 0.05, allow_nan=False)
)


def distance_from_line(points, line):
    """Distance (N,) of points from a drawn line."""
    if len(line) == 1:
        return np.hypot(*(points - line[0]).T)
    start, along = line[:-1], np.diff(line, axis=0)
    length = np.maximum((along**2).sum(axis=1), 1e-300)
    offset = points[:, None] - start[None]
    share = np.clip((offset * along).sum(axis=-1) / length, 0, 1)
    return np.hypot(*np.moveaxis(offset - share[..., None] * along, -1, 0)).min(axis=1)


@settings(deadline=None)
@given(lines_mm)
def test_points_left_out_of_any_line_lie_within_the_tolerance_of_it(line):
    kept = thinned(line, TOLERANCE_MM)
    assert distance_from_line(line, kept).max() <= TOLERANCE_MM * (1 + 1e-6)
    assert (kept[0] == line[0]).all()
    assert (kept[-1] == line[-1]).all()


@settings(deadline=None)
@given(steps_mm)
def test_a_measured_line_of_small_steps_is_drawn_within_the_tolerance(steps):
    line = np.array([40.0, 15.0]) + np.cumsum(steps + np.array([0.04, 0.0]), axis=0)
    ((tag, drawn),) = unpack_lines(pack_lines([(3, line)], TOLERANCE_MM), TOLERANCE_MM)
    assert tag == 3
    # Leaving out takes 0.7 of it, rounding by half a quantum in x and y 0.24 more.
    assert distance_from_line(line, drawn).max() <= TOLERANCE_MM


def test_a_straight_line_is_its_two_ends():
    line = np.column_stack([np.linspace(0, 100, 400), np.linspace(5, 25, 400)])
    assert len(thinned(line, TOLERANCE_MM)) == 2


def test_a_fold_keeps_its_corner_within_the_tolerance():
    x = np.concatenate([np.linspace(0, 50, 101), np.linspace(50, 20, 61)[1:]])
    y = np.concatenate([np.full(101, 10.0), np.linspace(10, 12, 61)[1:]])
    line = np.column_stack([x, y])
    kept = thinned(line, TOLERANCE_MM)
    assert len(kept) <= 5
    assert np.hypot(*(kept - [50.0, 10.0]).T).min() <= TOLERANCE_MM


def test_lines_keep_their_order_tags_and_ends_to_half_a_quantum():
    lines = [
        (0, np.array([[1.0, 2.0], [3.0, 4.5]])),
        (7, np.array([[-8.0, -9.0]])),
        (7, np.array([[0.0, 0.0]])),
    ]
    back = unpack_lines(pack_lines(lines, TOLERANCE_MM), TOLERANCE_MM)
    assert [tag for tag, _ in back] == [0, 7, 7]
    for (_, given_mm), (_, drawn) in zip(lines, back, strict=True):
        assert np.abs(drawn - given_mm).max() <= quantum_of(TOLERANCE_MM) / 2 + 1e-9


@settings(deadline=None)
@given(st.lists(st.integers(0, 2**40)))
def test_numbers_come_back_from_text(numbers):
    assert unpack(pack(numbers)) == numbers


def test_a_line_falls_apart_at_its_gaps_and_isolated_points_stay():
    x = np.array([0.0, 1.0, np.nan, 3.0, np.nan, np.nan, 6.0, 7.0])
    parts = pieces(np.column_stack([x, np.ones(8)]))
    assert [part[:, 0].tolist() for part in parts] == [[0.0, 1.0], [3.0], [6.0, 7.0]]
    assert pieces(np.empty((0, 2))) == []


def test_a_letter_tells_a_value_to_half_a_step_and_a_missing_one_is_not_zero():
    values = np.array([0.0, 0.31, 1.0, 5.0, np.nan])
    text = letters(values, 2.0)
    codes = np.array(
        ["ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/".index(c) for c in text]
    )
    assert codes[-1] == 0
    assert codes[0] == 1
    assert (codes[:4] - 1) / 62 * 2.0 == pytest.approx([0.0, 0.31, 1.0, 2.0], abs=1 / 62)
