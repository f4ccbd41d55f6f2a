"""Compiled kernels against plain twins in python and numpy."""

from itertools import combinations, pairwise, product

import numpy as np
import pytest
from scipy.ndimage import label

from ploughval.axes import Region
from ploughval.tracers.dye_kernel import MOST_RUNS, chains, dyed_runs, names
from ploughval.tracers.masks import regions
from ploughval.tracers.straight import pieces, read_along, straightened
from ploughval.tracers.surface_kernel import surroundings


def line_through(x, y):
    slope, level = np.polyfit(x, y, 1)
    return slope, level, np.sum((y - slope * x - level) ** 2)


def test_pieces_are_those_of_the_cheapest_partition():
    """Against every partition of 14 points into pieces of at least 4."""
    rng = np.random.default_rng(3)
    for _ in range(6):
        value = np.interp(np.arange(14.0), [0, rng.integers(4, 10), 13], rng.normal(0, 4, 3))
        value += rng.normal(0, 0.3, 14)
        ways = [[0, *cuts, 14] for n in range(3) for cuts in combinations(range(4, 11), n)]
        ways = [ends for ends in ways if np.diff(ends).min() >= 4]

        def price(ends, value=value):
            parts = [np.arange(a, b) for a, b in pairwise(ends)]
            return sum(line_through(part, value[part])[2] + 0.5 for part in parts)

        found = pieces(value, 0.5, 4, 14)
        assert [0, *(np.flatnonzero(np.diff(found)) + 1), 14] == min(ways, key=price)


def test_a_point_is_read_from_the_line_through_its_neighbours_in_its_piece():
    rng = np.random.default_rng(4)
    value = rng.normal(0, 1, 40)
    piece = np.repeat([1, 0], [15, 25])
    out = np.empty((40, 4))
    read_along(value, piece, 6, out)
    for i, (first, last) in ((3, (0, 9)), (14, (8, 14)), (15, (15, 21)), (25, (19, 31)), (39, (33, 39))):
        x = np.arange(first, last + 1)
        slope, level, square = line_through(x, value[x])
        assert out[i, 0] == pytest.approx(level + slope * i, abs=1e-9)
        assert out[i, 1] == pytest.approx(np.sqrt(square / (len(x) - 2)), abs=1e-9)
        leverage = 1 / len(x) + (i - x.mean()) ** 2 / np.sum((x - x.mean()) ** 2)
        assert out[i, 2] == pytest.approx(leverage, abs=1e-9)
        assert out[i, 3] == pytest.approx(slope, abs=1e-9)


def test_a_kinked_line_is_straightened_without_rounding_its_kinks():
    """Noise 0.5, correlated over 5 points as the averaging along the surface does; kinks of 51 degrees."""
    rng = np.random.default_rng(5)
    x = np.arange(400.0)
    true = np.interp(x, [0, 100, 180, 400], [0, 0, 100, 100])
    noise = np.convolve(rng.normal(0, 1, 404), np.ones(5) / np.sqrt(5), mode="valid") * 0.5
    value, std, _ = straightened(true + noise)
    error = value - true
    near = np.abs(x[:, None] - [100, 180]).min(axis=1) < 6
    assert np.sqrt(np.mean(error**2)) < 0.3
    assert np.abs(error[near]).max() < 1.5  # rounding over 17 points would leave 2.7
    assert 0.5 < np.mean(np.abs(error) < std) < 0.9


def test_a_notch_with_steps_at_both_ends_is_bridged():
    """A dark layer 4 deep over 20 points, as it comes out of sand before a dark background."""
    rng = np.random.default_rng(6)
    true = 0.3 * np.arange(200.0)
    seen = true + rng.normal(0, 0.15, 200)
    seen[90:110] += 4.0
    value, std, _ = straightened(seen)
    assert np.abs(value - true).max() < 0.8
    assert std[95:105].min() > 1.0


def test_runs_of_dyed_pixels_are_those_of_their_half_level_crossings():
    rng = np.random.default_rng(7)
    share = rng.uniform(-0.2, 1.2, (60, 12)).astype(np.float32)
    top, bottom = rng.integers(0, 10, 12), rng.integers(45, 60, 12)
    runs = np.empty((12, MOST_RUNS, 3))
    count = dyed_runs(share, top, bottom, runs)
    for k in range(12):
        part = share[:, k].astype(float).copy()
        part[: top[k]] = part[bottom[k] :] = 0.0
        number, total = label(part > 0.5)
        assert count[k] == total
        for n in range(total):
            rows = np.flatnonzero(number == n + 1)
            before, after = part[rows[0] - 1] if rows[0] else 0.0, part[rows[-1] + 1]
            upper = rows[0] - (part[rows[0]] - 0.5) / (part[rows[0]] - before)
            lower = rows[-1] + (part[rows[-1]] - 0.5) / (part[rows[-1]] - after)
            assert runs[k, n] == pytest.approx([upper, lower, part[rows].mean()], abs=1e-5)


def test_chains_link_mutual_nearest_runs_over_short_gaps():
    """Two lines that start 8 apart; one leaps a missing column, the other three, where it is cut."""
    places = [(k, 10.0 + 0.5 * k) for k in range(12) if k != 5]
    places += [(k, 22.0 - 0.3 * k) for k in range(12) if k not in (6, 7, 8)]
    places.sort()
    column = np.array([p[0] for p in places])
    middle = np.array([p[1] for p in places])
    found = chains(column, middle, np.full(len(places), 4.0), np.array([2.0, 2.0]), 2)
    rising = np.isclose(middle, 10.0 + 0.5 * column)
    assert len(set(found[rising])) == 1
    assert len(set(found[~rising & (column < 6)])) == 1
    assert len(set(found)) == 3


def test_names_along_a_chain_are_the_cheapest():
    rng = np.random.default_rng(8)
    for _ in range(10):
        cost = rng.uniform(0, 2, (7, 3))
        chain = np.array([0, 0, 0, 0, 1, 1, 1])
        found = names(cost, chain, 0.7)

        def price(way, cost=cost, chain=chain):
            changes = sum(chain[i] == chain[i - 1] and way[i] != way[i - 1] for i in range(1, 7))
            return sum(cost[i, way[i]] for i in range(7)) + 0.7 * changes

        best = min(product(range(3), repeat=7), key=price)
        assert found.tolist() == list(best)


def test_surroundings_are_means_over_the_windows():
    rng = np.random.default_rng(9)
    grey = rng.uniform(0, 255, (60, 50)).astype(np.float32)
    level = rng.integers(0, 256, (60, 50), dtype=np.uint8)
    change = rng.integers(0, 2048, (60, 50), dtype=np.uint16)
    known = rng.integers(0, 40, 50)
    tables = rng.uniform(0.001, 0.1, (11, 256)).astype(np.float32)
    found = surroundings((grey, level, change), known, tables, np.array([20.5]), np.array([29.7]), (5, 3, 9))
    below, above, columns = slice(33, 39), slice(21, 27), slice(15, 26)
    texture = [np.sqrt(np.mean((grey[p, 17:28] - grey[p, columns]) ** 2) / 2) for p in (below, above)]
    same = np.where(np.arange(60)[:, None] < known, tables[3:].ravel()[change], 0.0)
    air = (tables[0][level] + same)[above, columns].mean()
    expected = [np.exp(tables[2][level[below, columns]]).mean(), texture[0], air, texture[1]]
    assert found[0] == pytest.approx(expected, rel=1e-5)


def test_regions_of_a_grid_follow_their_definition():
    top = np.array([np.nan, np.nan, np.nan, 3.2, 4.0, 5.9, np.nan, 2.0])
    found = regions((9, 8), top, 6.4, (0.9, 2.6))
    row = np.arange(9)[:, None]
    expected = np.full((9, 8), Region.AIR)
    expected[:, 0] = Region.TRENCH
    expected[:, 1:4] = Region.BLADE
    expected[np.broadcast_to(row > 6.4, (9, 8))] = Region.SAND
    for k in (4, 5, 7):
        expected[row[:, 0] > top[k], k] = Region.SAND
    expected[:7, 1:4] = Region.BLADE
    assert np.array_equal(found, expected)
