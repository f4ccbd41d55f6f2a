"""Edges of the surface's parts: ends as walls, nodes that coincide, two slopes of rest, areas by hand."""

import math

import numpy as np
import pytest

from ploughval.model.surface import area_ahead, avalanche, height_at, move_block, settle, thin


def interpolated(surface, places):
    return np.interp(places, *np.asarray(surface, float).T)


def rested(surface, fall, rise):
    """Slopes of rest of their own for falls and rises, as in oblique coordinates."""
    nodes = np.asarray(surface, float)
    x, y = np.zeros(40), np.zeros(40)
    x[: len(nodes)], y[: len(nodes)] = nodes.T
    n = settle(x, y, len(nodes), fall, rise, np.zeros((4, 40)))
    return np.column_stack([x[:n], y[:n]])


def test_area_of_two_trapezia():
    assert area_ahead([(1.0, 2.0), (3.0, 4.0), (4.0, 0.0)]) == 2.0 * 3.0 + 1.0 * 2.0


def test_height_is_linear_between_nodes_and_level_beyond_the_ends():
    x, y = np.array([1.0, 2.0, 4.0, 8.0]), np.array([5.0, 7.0, 3.0, 4.0])
    places = [0.0, 1.0, 1.25, 2.0, 3.0, 4.0, 6.0, 7.0, 8.0, 9.0]
    heights = [5.0, 5.0, 5.5, 7.0, 5.0, 3.0, 3.5, 3.75, 4.0, 4.0]
    assert [height_at(x, y, 4, place) for place in places] == heights
    assert height_at(x, y, 3, 6.0) == 3.0  # only the first three nodes count


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_step_at_a_wall_slides_as_far_as_its_area_reaches(mirror):
    # a wedge of 4 mm height and 1 mm width on level sand: 2 h^2 / (2 tan 45) of sand at rest before the wall
    area = 4.0 * 1.0
    height = math.sqrt(2.0 * area)
    surface = np.array([(0.0, 9.0), (1.0 - 1e-9, 9.0), (1.0 + 1e-9, 5.0), (20.0, 5.0)])
    expected = np.array([(0.0, 5.0 + height), (height, 5.0), (20.0, 5.0)])
    if mirror < 0.0:
        surface, expected = (np.column_stack([-s[::-1, 0], s[::-1, 1]]) for s in (surface, expected))
    np.testing.assert_allclose(avalanche(surface, 45.0), expected, atol=1e-7)


def test_mound_comes_to_rest_at_slopes_of_its_own_to_either_side():
    # a block of 2 x 6 mm: a triangle of its area whose flanks stand at 0.5 and 2
    surface = [(0.0, 0.0), (20.0 - 1e-9, 0.0), (20.0, 6.0), (22.0, 6.0), (22.0 + 1e-9, 0.0), (50.0, 0.0)]
    found = rested(surface, fall=0.5, rise=2.0)
    assert area_ahead(found) == pytest.approx(12.0, rel=1e-9)
    slopes = np.diff(found[:, 1]) / np.diff(found[:, 0])
    assert slopes.min() >= -0.5 * (1 + 1e-9)
    assert slopes.max() <= 2.0 * (1 + 1e-9)
    top = found[found[:, 1].argmax()]
    assert interpolated(found, top[0] + 2.0 * top[1]) == pytest.approx(0.0, abs=1e-6)  # front at 0.5
    # with a wall in the place of its back it all falls forwards
    forward = rested(surface[2:], fall=0.5, rise=2.0)
    height = math.sqrt(12.0)
    expected = [(20.0, height), (20.0 + 2.0 * height, 0.0), (50.0, 0.0)]
    np.testing.assert_allclose(forward, expected, atol=1e-6)


def test_slope_of_just_the_repose_stays():
    surface = np.array([(0.0, 8.0), (4.0, 8.0), (8.0, 4.0), (20.0, 4.0), (22.0, 6.0), (30.0, 6.0)])
    assert np.array_equal(avalanche(surface, 45.0), surface)
    steeper = surface.copy()
    steeper[2, 0] = 7.9
    assert not np.array_equal(avalanche(steeper, 45.0), steeper)


def test_two_slides_of_which_the_second_reaches_the_first_become_one():
    # two steps of 2 mm, 1 mm apart, at 45 degrees: together a step of 4 mm about their middle
    e = 1e-9
    surface = [(0, 9.0), (10 - e, 9.0), (10 + e, 7.0), (11 - e, 7.0), (11 + e, 5.0), (30, 5.0)]
    found = avalanche(surface, 45.0)
    np.testing.assert_allclose(found, [(0, 9.0), (8.5, 9.0), (12.5, 5.0), (30, 5.0)], atol=1e-6)


# --- the block's motion ----------------------------------------------------------------------------------


def test_block_whose_front_passes_nodes_ahead_stands_on_them_column_by_column():
    # by hand: from the outcrop at 10 on, the heights of the block's columns above its band lie on the sand
    surface = np.array([(0.0, 10.0), (6.0, 10.0), (10.0, 5.0), (11.0, 4.0), (13.0, 4.0), (20.0, 4.0)])
    tan_beta, du = 0.5, 2.0
    moved = move_block(surface, 10.0, tan_beta, du)
    np.testing.assert_allclose(moved[:2], [(2.0, 11.0), (8.0, 11.0)], atol=1e-12)
    for place in np.linspace(10.0, 12.0, 9):
        column = interpolated(surface, place - du) - tan_beta * (place - du)
        assert interpolated(moved, place) == pytest.approx(interpolated(surface, place) + column, abs=1e-12)
    np.testing.assert_allclose(moved[-2:], [(13.0, 4.0), (20.0, 4.0)], atol=1e-12)
    assert area_ahead(surface) - area_ahead(moved) == pytest.approx(0.5 * du**2 * tan_beta, abs=1e-12)


def test_nodes_of_block_and_sand_that_fall_on_one_place_become_one():
    surface = np.array([(0.0, 4.0), (2.0, 4.0), (3.0, 4.0), (4.0, 4.0), (5.0, 4.0), (8.0, 4.0)])
    moved = move_block(surface, 4.0, 1.0, 1.0)
    np.testing.assert_allclose(moved, [(1, 5), (3, 5), (4, 5), (5, 4), (8, 4)], atol=1e-12)


def test_outcrop_at_the_end_of_the_sand_moves_up_to_it():
    surface = np.array([(0.0, 4.0), (4.0, 4.0), (8.0, 4.0)])
    moved = move_block(surface, 7.0, 4.0 / 7.0, 1.0)
    assert moved[-1] == pytest.approx([8.0, 4.0])
    assert area_ahead(surface) - area_ahead(moved) == pytest.approx(2.0 / 7.0, abs=1e-12)


# --- thinning --------------------------------------------------------------------------------------------


def thinned(surface, deviation):
    x, y = np.array(surface, float).T.copy()
    n = thin(x, y, len(x), deviation)
    return np.column_stack([x[:n], y[:n]])


def test_node_that_is_dropped_leaves_its_area_to_its_neighbours():
    # 0.25 mm above the chord of 4 mm: 0.5 mm2, taken up by both over half of 2 x 4 + 2 + 2 mm
    surface = [(0.0, 5.0), (2.0, 1.0), (4.0, 1.25), (6.0, 1.0), (8.0, 5.0)]
    lift = 0.5 / 6.0
    np.testing.assert_allclose(
        thinned(surface, 0.25), [(0, 5), (2, 1 + lift), (6, 1 + lift), (8, 5)], atol=1e-12
    )
    np.testing.assert_array_equal(thinned(surface, 0.249), surface)


def test_nodes_beside_the_ends_leave_their_area_to_the_ends():
    np.testing.assert_allclose(thinned([(0, 1), (1, 1.2), (3, 1)], 0.5), [(0, 1.1), (3, 1.1)], atol=1e-12)
    first = thinned([(0, 1), (1, 1.2), (2, 1), (4, 9), (5, 0)], 0.5)  # 0.2 mm2 over 2 x 2 + 2 mm
    np.testing.assert_allclose(first, [(0, 1 + 0.2 / 3), (2, 1 + 0.2 / 3), (4, 9), (5, 0)], atol=1e-12)
    last = thinned([(0, 0), (1, 9), (3, 1), (4, 1.2), (5, 1)], 0.5)
    np.testing.assert_allclose(last, [(0, 0), (1, 9), (3, 1 + 0.2 / 3), (5, 1 + 0.2 / 3)], atol=1e-12)


def test_of_a_straight_row_every_second_node_goes():
    x = np.arange(9.0)
    np.testing.assert_array_equal(thinned(np.column_stack([x, 2.0 * x]), 1e-9)[:, 0], [0, 2, 4, 6, 8])
    assert len(thinned([(0.0, 1.0), (1.0, 2.0)], 9.0)) == 2
