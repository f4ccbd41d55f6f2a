"""The one-block mechanism against closed forms of earth pressure and a plain search over nodes."""

import numpy as np
import pytest

from ploughval.model.mechanism import block_areas, block_force, cheapest_band, initial_force


@pytest.mark.parametrize("phi", [20.0, 32.0, 50.0, 65.0])
def test_level_sand_and_smooth_blade_give_rankine(phi):
    expected = 0.5 * 16e-6 * 30.0**2 * np.tan(np.radians(45 + phi / 2)) ** 2
    assert initial_force(30.0, 16e-6, phi) == pytest.approx(expected, rel=1e-12)
    x, y = np.array([0.0, 5000.0]), np.array([30.0, 30.0])
    force, place = cheapest_band(x, y, 2, np.tan(np.radians(phi)), 0.0)
    assert 16e-6 * force == pytest.approx(expected, rel=1e-9)
    assert place == pytest.approx(30.0 / np.tan(np.radians(45 - phi / 2)), rel=1e-9)


@pytest.mark.parametrize(("phi", "wall"), [(50.0, 10.0), (36.0, 20.0), (32.0, 5.0), (60.0, 29.0)])
def test_least_force_with_wall_friction_is_coulombs(phi, wall):
    x, y = np.array([0.0, 1e5]), np.array([30.0, 30.0])
    force, _ = cheapest_band(x, y, 2, np.tan(np.radians(phi)), np.tan(np.radians(wall)))
    assert 16e-6 * force == pytest.approx(initial_force(30.0, 16e-6, phi, wall), rel=1e-9)


def test_force_polygon_of_the_block_closes():
    rng = np.random.default_rng(0)
    weight, beta = rng.uniform(1, 9, 50), rng.uniform(5, 30, 50)
    phi, wall = rng.uniform(20, 45, 50), rng.uniform(0, 14, 50)
    force, down = block_force(weight, beta, phi, wall), np.radians(wall)
    # what the sand below must supply is inclined by phi to the band's normal, against the sliding
    inclination = np.degrees(np.arctan2(force * np.cos(down), weight + force * np.sin(down)))
    np.testing.assert_allclose(inclination, beta + phi, atol=1e-10)


def test_block_that_locks_needs_an_infinite_force():
    force = block_force(1.0, [39.9, 40.0, 41.0, 100.0], 40.0, 10.0)
    assert np.isfinite(force[0])
    assert np.isinf(force[1:]).all()


def test_area_above_the_line_is_the_polygons():
    # shoelace over tip, face, nodes
    surface = np.array([(2.0, 5.0), (4.0, 7.0), (9.0, 6.0), (15.0, 3.0)])
    polygon = np.vstack([(2.0, 0.0), surface])
    x, y = polygon.T
    shoelace = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    assert block_areas(surface, 2.0)[-1] == pytest.approx(shoelace, rel=1e-14)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("wall", [0.0, 12.0])
def test_closed_form_finds_what_a_plain_search_over_dense_nodes_finds(seed, wall):
    rng = np.random.default_rng(seed)
    x = np.concatenate([[0.0], np.cumsum(rng.uniform(2, 12, 40))])
    y = 30.0 + rng.normal(0, 2.0, 41)
    force, place = cheapest_band(x, y, 41, np.tan(np.radians(45.0)), np.tan(np.radians(wall)))
    dense = np.union1d(np.linspace(0, x[-1], 200_001), x)[1:]
    nodes = np.column_stack([np.append(0.0, dense), np.interp(np.append(0.0, dense), x, y)])
    tan_beta = nodes[1:, 1] / nodes[1:, 0]
    seen = tan_beta <= np.minimum.accumulate(tan_beta)  # the line must not leave the sand before
    forces = block_force(block_areas(nodes, 0.0)[1:], np.degrees(np.arctan(tan_beta)), 45.0, wall)
    best = np.argmin(np.where(seen, forces, np.inf))
    assert force == pytest.approx(forces[best], rel=1e-6)  # nodes 2 um apart in 0.3 m
    assert force <= forces[best] * (1 + 1e-12)
    assert place == pytest.approx(dense[best], abs=0.1)


def test_denominator_that_the_paper_prints_leaves_the_force_polygon_open():
    # docs/theory-model.md, Eq. (4): what is missing vertically, per weight
    beta, phi, wall = np.radians([18.0, 40.0, 15.0])
    steep, printed = np.tan(beta + phi), np.tan(beta + wall)
    force = steep / (np.cos(wall) - np.sin(wall) * printed)
    reaction = force * np.cos(wall) / np.sin(beta + phi)
    missing = reaction * np.cos(beta + phi) - force * np.sin(wall) - 1.0
    expected = -np.sin(wall) * (steep - printed) / (np.cos(wall) - np.sin(wall) * printed)
    assert missing == pytest.approx(expected, rel=1e-12)
    assert missing < -0.1


def test_denominator_that_the_paper_prints_makes_the_first_force_a_third_too_small():
    beta = np.radians(np.linspace(5.0, 39.0, 200_001))
    phi, wall = np.radians([50.0, 10.0])
    weight = 0.5 * 16e-6 * 30.0**2 / np.tan(beta)
    denominators = np.cos(wall) - np.sin(wall) * np.tan(beta + wall)
    printed = 1000.0 * np.min(weight * np.tan(beta + phi) / denominators)
    assert printed == pytest.approx(61.31, abs=0.01)
    assert 1000.0 * initial_force(30.0, 16e-6, 50.0, 10.0) == pytest.approx(94.03, abs=0.01)
