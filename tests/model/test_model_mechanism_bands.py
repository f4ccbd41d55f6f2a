"""Bands to any place of any surface, on leaning faces and under load, against polygons and plain searches."""

import math

import numpy as np
import pytest

from ploughval.model.mechanism import (
    band_force,
    block_areas,
    block_force,
    cheapest_band,
    force_factor,
    initial_force,
)


def tangents(*degrees):
    return [math.tan(math.radians(angle)) for angle in degrees]


def triangles(corners, tip):
    """Areas of the fan of triangles from a tip, summed up to each corner (M,)."""
    x, y = (np.asarray(corners, float) - tip).T
    return np.concatenate([[0.0], np.cumsum(0.5 * (x[1:] * y[:-1] - x[:-1] * y[1:]))])


def rough_ground(seed, nodes=14):
    """Nodes some millimetres apart, steeper than any sand, that come down to below the tip."""
    rng = np.random.default_rng(seed)
    x = np.concatenate([[0.0], np.cumsum(rng.uniform(2.0, 12.0, nodes - 1))])
    y = np.linspace(30.0, rng.uniform(-12.0, 25.0), nodes) + rng.normal(0.0, 5.0, nodes)
    y[0] = 30.0
    return x, y


# --- Eq. 1 ------------------------------------------------------------------------------------------------


def test_block_on_a_smooth_blade_needs_its_weight_times_the_tangent():
    assert block_force(2.5, 20.0, 25.0) == pytest.approx(2.5, rel=1e-14)  # tan 45
    assert block_force(1.0, 0.0, 30.0) == pytest.approx(math.tan(math.radians(30.0)), rel=1e-14)


def test_force_of_a_rough_blade_is_equilibriums():
    # the blade pushes forwards and down by the wall friction, the band back and up by beta + phi
    for beta, phi, wall in [(10.0, 35.0, 12.0), (25.0, 40.0, 8.0), (-5.0, 30.0, 20.0)]:
        b, w = math.radians(beta + phi), math.radians(wall)
        system = np.array([[math.cos(w), -math.sin(b)], [-math.sin(w), math.cos(b)]])
        push, _ = np.linalg.solve(system, [0.0, 3.0])
        assert block_force(3.0, beta, phi, wall) == pytest.approx(push, rel=1e-13)
        assert 3.0 * force_factor(*tangents(beta, phi, wall)) == pytest.approx(push, rel=1e-13)


def test_block_locks_where_the_angles_reach_ninety_degrees():
    assert force_factor(1.0, 1.0, 0.0) == math.inf  # 45 + 45
    assert force_factor(*tangents(30.0, 50.0, 12.0)) == math.inf
    assert math.isfinite(force_factor(*tangents(30.0, 50.0, 9.9)))


# --- Coulomb's closed form --------------------------------------------------------------------------------


def test_first_force_is_infinite_from_ninety_degrees_on():
    assert initial_force(30.0, 16e-6, 45.0, 45.0) == math.inf
    assert initial_force(30.0, 16e-6, 50.0, 20.0, inclination_deg=15.0, slope_deg=10.0) == math.inf
    assert math.isfinite(initial_force(30.0, 16e-6, 50.0, 20.0, inclination_deg=15.0, slope_deg=4.0))


# --- areas ------------------------------------------------------------------------------------------------


def test_area_to_every_node_is_the_fan_of_triangles_from_the_tip():
    x, y = rough_ground(3)
    surface = np.column_stack([x + 4.0, y])
    np.testing.assert_allclose(block_areas(surface, 4.0), triangles(surface, (4.0, 0.0)), atol=1e-11)


# --- one band ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("lean", [-9.0, 0.0, 7.0])
@pytest.mark.parametrize("load", [0.0, 2.5])
def test_force_of_a_band_is_its_polygons_weight_and_load_times_the_factor(lean, load):
    x, y = rough_ground(1)
    x = x + 3.0
    tip = np.array([3.0 - lean, 0.0])
    tan_phi, tan_wall = tangents(25.0, 8.0)
    places = [x[0] + 0.3, x[1], 0.5 * (x[3] + x[4]), x[6], x[6] + 1.0]
    checked = 0
    for place in places:
        top = float(np.interp(place, x, y))
        block = np.vstack([np.column_stack([x, y])[x < place], [(place, top)]])
        weight = triangles(block, tip)[-1] + load * (place - x[0])
        reach = place - tip[0]
        found = band_force(x, y, len(x), place, tan_phi, tan_wall, load, lean)
        if reach <= 0.0:
            assert found == math.inf
            continue
        expected = block_force(weight, math.degrees(math.atan(top / reach)), 25.0, 8.0)
        assert found == (expected if np.isinf(expected) else pytest.approx(float(expected), rel=1e-12))
        checked += bool(np.isfinite(expected))
    assert checked >= 2


def test_band_that_would_end_above_or_behind_the_tip_is_none():
    x, y = np.array([0.0, 40.0]), np.array([30.0, 30.0])
    assert band_force(x, y, 2, 10.0, 0.5, 0.0, 0.0, -10.0) == math.inf
    assert band_force(x, y, 2, 9.0, 0.5, 0.0, 0.0, -10.0) == math.inf


def test_band_past_the_last_node_ends_at_its_height():
    x, y = np.array([0.0, 20.0, 40.0]), np.array([30.0, 34.0, 25.0])
    longer = np.append(x, 90.0), np.append(y, 25.0)
    short, long = (band_force(*line, len(line[0]), 70.0, 0.6, 0.1, 1.0, 2.0) for line in ((x, y), longer))
    assert short == pytest.approx(long, rel=1e-14)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("scale", [2.0**-10, 2.0**10])
def test_units_of_length_do_not_matter(seed, scale):
    x, y = rough_ground(seed)
    other_x, other_y, n, load, lean = scale * x, scale * y, len(x), 2.0, -5.0
    place = 0.5 * (x[5] + x[6])
    one = band_force(x, y, n, place, 0.5, 0.1, load, lean)
    other = band_force(other_x, other_y, n, scale * place, 0.5, 0.1, scale * load, scale * lean)
    assert other == scale**2 * one
    for lean in (-5.0, 0.0, 5.0):
        one, place = cheapest_band(x, y, n, 0.8, 0.1, load, lean)
        other, there = cheapest_band(other_x, other_y, n, 0.8, 0.1, scale * load, scale * lean)
        assert other == scale**2 * one
        assert there == scale * place


# --- the cheapest one -------------------------------------------------------------------------------------


def searched(x, y, phi, wall, *, load, lean):
    """Least force and its outcrop over 40 000 places that the tip sees through the sand, none below it."""
    tip = x[0] - lean
    dense = np.union1d(np.linspace(x[0], x[-1], 40_001), x)
    nodes = np.column_stack([dense, np.interp(dense, x, y)])
    reach = nodes[:, 0] - tip
    ahead = reach > 0.0
    tan_beta = np.where(ahead, nodes[:, 1] / np.where(ahead, reach, 1.0), np.inf)
    seen = ahead & (tan_beta <= np.minimum.accumulate(tan_beta)) & (nodes[:, 1] >= 0.0)
    weights = triangles(nodes, (tip, 0.0)) + load * (dense - x[0])
    forces = block_force(weights, np.degrees(np.arctan(np.where(seen, tan_beta, 0.0))), phi, wall)
    forces = np.where(seen & (weights > 0.0), forces, np.inf)
    best = int(np.argmin(forces))
    return forces[best], dense[best]


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(
    ("phi", "wall", "load", "lean"),
    [(35.0, 0.0, 0.0, 0.0), (45.0, 12.0, 3.0, 0.0), (30.0, 20.0, 0.5, 8.0), (40.0, 5.0, 1.0, -14.0)],
)
def test_cheapest_band_is_that_of_a_plain_search(seed, phi, wall, load, lean):
    x, y = rough_ground(seed)
    force, place = cheapest_band(x, y, len(x), *tangents(phi, wall), load, lean)
    best, at = searched(x, y, phi, wall, load=load, lean=lean)
    # places 2 um apart on slopes of up to 5
    assert force == (math.inf if np.isinf(best) else pytest.approx(best, rel=1e-4))
    assert force <= best * (1.0 + 1e-12)
    assert place == (x[-1] if np.isinf(best) else pytest.approx(at, abs=0.1))


def test_least_force_of_level_sand_under_load_is_rankines_with_the_loads_weight():
    x, y = np.array([2.0, 900.0]), np.array([30.0, 30.0])
    force, place = cheapest_band(x, y, 2, math.tan(math.radians(40.0)), 0.0, 4.0)
    passive = math.tan(math.radians(65.0)) ** 2
    assert force == pytest.approx((0.5 * 30.0**2 + 4.0 * 30.0) * passive, rel=1e-12)
    assert place == pytest.approx(2.0 + 30.0 * math.tan(math.radians(65.0)), rel=1e-12)


def test_no_band_ends_where_all_of_them_lock():
    x, y = np.array([0.0, 10.0, 20.0]), np.array([30.0, 40.0, 50.0])
    assert cheapest_band(x, y, 3, *tangents(60.0, 31.0)) == (math.inf, 20.0)
    assert cheapest_band(x, y, 3, *tangents(50.0, 0.0)) == (math.inf, 20.0)  # all outcrops above 40 degrees


def test_sand_that_rises_as_steeply_as_bands_lock_still_has_a_cheapest_one():
    # on a slope of 45 degrees, with 45 degrees of friction, how far a place is from locking does not change
    # along it: the ground behind decides
    x, y = np.array([0.0, 50.0, 60.0, 400.0]), np.array([10.0, 10.0, 20.0, 20.0])
    force, place = cheapest_band(x, y, 4, 1.0, 0.0)
    best, at = searched(x, y, 45.0, 0.0, load=0.0, lean=0.0)
    assert force == pytest.approx(best, rel=1e-6)
    assert place == pytest.approx(at, abs=0.02)


def test_sand_that_falls_as_steeply_as_its_friction_has_a_cheapest_band():
    # y + x tan(phi) is then the same all along the slope
    x, y = np.array([0.0, 20.0, 45.0, 300.0]), np.array([30.0, 30.0, 5.0, 5.0])
    force, place = cheapest_band(x, y, 4, 1.0, 0.0)
    best, at = searched(x, y, 45.0, 0.0, load=0.0, lean=0.0)
    assert force == pytest.approx(best, rel=1e-6)
    assert place == pytest.approx(at, abs=0.02)


def test_sand_that_only_just_reaches_the_tip_of_a_blade_that_leans_back_costs_nothing():
    # down from the top of the face straight to the tip, and up again: no sand above the line to the crest
    x, y = np.array([0.0, 10.0, 60.0, 200.0]), np.array([30.0, 0.0, 20.0, 20.0])
    assert cheapest_band(x, y, 4, *tangents(30.0, 5.0), 0.0, -10.0)[0] == 0.0


def test_ditch_ahead_draws_the_band_to_its_far_corner():
    # from the far corner on a straight band would leave the sand; without the ditch it would go on to 66.6 mm
    x = np.array([0.0, 30.0, 40.0, 42.0, 60.0, 62.0, 200.0])
    y = np.array([30.0, 30.0, 30.0, 15.0, 15.0, 30.0, 30.0])
    force, place = cheapest_band(x, y, 7, *tangents(35.0, 5.0))
    area = triangles([(0.0, 30.0), (40.0, 30.0), (42.0, 15.0), (60.0, 15.0)], (0.0, 0.0))[-1]
    beta = math.degrees(math.atan(15.0 / 60.0))
    assert place == 60.0
    assert force == pytest.approx(float(block_force(area, beta, 35.0, 5.0)), rel=1e-12)
    level, beyond = cheapest_band(x, np.full(7, 30.0), 7, *tangents(35.0, 5.0))
    assert beyond > 66.0
    assert level > force


@pytest.mark.parametrize("slope", [0.25, 0.3, 0.4])
def test_ground_that_stays_hidden_behind_a_ditch_has_no_outcrop(slope):
    # the line of sight over the ditch's far corner rises by a quarter: no steeper ground comes into view,
    # however cheap the bands would be that cross the empty ditch
    x = np.array([0.0, 30.0, 31.0, 60.0, 61.0, 121.0])
    y = np.array([30.0, 30.0, 15.0, 15.0, 30.0, 30.0 + 60.0 * slope])
    force, place = cheapest_band(x, y, 6, *tangents(10.0, 0.0))
    area = triangles(np.column_stack([x, y])[:4], (0.0, 0.0))[-1]
    beta = math.degrees(math.atan(0.25))
    assert place == 60.0
    assert force == pytest.approx(float(block_force(area, beta, 10.0)), rel=1e-12)


def test_node_where_a_band_just_locks_and_slope_along_which_every_band_does_are_passed_over():
    x, y = np.array([0.0, 30.0, 200.0]), np.array([30.0, 30.0, 30.0])
    force, place = cheapest_band(x, y, 3, 1.0, 0.0)  # a band to the node at 30 mm rises by 45 degrees
    assert 0.5 * 30.0 * place * (30.0 / place + 1.0) / (1.0 - 30.0 / place) == pytest.approx(force)
    assert place == pytest.approx(30.0 * math.tan(math.radians(67.5)), rel=1e-12)
    x, y = np.array([0.0, 20.0, 400.0]), np.array([30.0, 50.0, 50.0])  # 45 degrees up from the face
    force, place = cheapest_band(x, y, 3, 1.0, 0.0)
    best, at = searched(x, y, 45.0, 0.0, load=0.0, lean=0.0)
    assert force == pytest.approx(best, rel=1e-6)
    assert place == pytest.approx(at, abs=0.1)


def test_cut_of_a_segment_in_two_changes_nothing():
    x, y = rough_ground(7)
    middle = 0.5 * (x[4] + x[5])
    other_x, other_y = np.insert(x, 5, middle), np.insert(y, 5, 0.5 * (y[4] + y[5]))
    one = cheapest_band(x, y, len(x), *tangents(38.0, 6.0), 1.0, 0.0)
    two = cheapest_band(other_x, other_y, len(other_x), *tangents(38.0, 6.0), 1.0, 0.0)
    assert two == pytest.approx(one, rel=1e-10)
