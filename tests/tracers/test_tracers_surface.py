"""Free surface and sand mask of drawn photographs, against the line and the areas that were drawn."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from ploughval.axes import Direction
from ploughval.tracers import Watcher
from ploughval.tracers.surface_kernel import border_costs, likeliest_path, profiles

HEAP = ((0.0, 33.0), (12.0, 36.0), (30.0, 25.0), (200.0, 25.0))  # mm ahead of the face: a kinked line


def flat(x):
    return np.full_like(x, 25.0)


def heap(u):
    place, height = np.array(HEAP).T
    return lambda x: np.interp(x - u, place, height)


def see(drawn, u=7.3):
    watcher = Watcher(drawn.scene, drawn.calibration)
    watcher.see(0, drawn.draw(0.0, flat, seed=1))
    return watcher.see(1, drawn.draw(u, heap(u), seed=2))


@pytest.mark.parametrize("direction", list(Direction))
@pytest.mark.parametrize("look", [{}, {"vignetting": 0.3}, {"air": 215.0, "blade": 40.0}])
def test_the_surface_is_found_within_half_a_pixel(stage, direction, look):
    drawn = stage(direction=direction, **look)
    line = see(drawn).surface_mm
    error = (line[:, 1] - heap(7.3)(line[:, 0])) / drawn.mm_per_px
    assert np.sqrt(np.mean(error**2)) < 0.5  # the figure to reach
    assert abs(np.mean(error)) < 0.2
    assert np.abs(error).max() < 2.5  # at the kinks
    assert (np.diff(line[:, 0]) > 0).all()
    assert line[0, 0] == pytest.approx(7.3, abs=1.5)  # from the face ...
    assert line[-1, 0] > 85.0  # ... to the end of the view, 91.9 mm


def test_its_stated_deviation_covers_the_error(stage):
    drawn = stage()
    sight = see(drawn)
    error = np.abs(sight.surface_mm[:, 1] - heap(7.3)(sight.surface_mm[:, 0]))
    assert (
        np.mean(error < 2 * sight.surface_std_mm) > 0.75
    )  # 0.95 on a smooth line; less by the kinks of this one
    assert np.median(sight.surface_std_mm) < 0.5 * drawn.mm_per_px


@pytest.mark.parametrize("direction", list(Direction))
def test_the_mask_is_the_sand_ahead_and_below_the_tip_without_the_blade(stage, direction):
    drawn = stage(direction=direction)
    u = 7.3
    sand = see(drawn, u).sand
    rows, cols = np.mgrid[: drawn.shape[0], : drawn.shape[1]]
    mm = drawn.calibration.to_mm(np.stack([cols, rows], axis=-1))
    x, y = mm[..., 0], mm[..., 1]
    true = (y < 0) | ((x > u) & (y < heap(u)(x)))
    assert np.sum(sand != true) / true.sum() < 0.01
    clear = 2 * drawn.mm_per_px
    assert not sand[(x < u - clear) & (y > clear)].any()  # neither blade nor trench
    assert not sand[(y > heap(u)(x) + 3 * clear) & (x > u)].any()  # nor air


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("upper", [60, 75, 100])
def test_a_surface_above_the_picture_is_absent_with_a_reason(stage, upper):
    """At rest it stands in row 70: just inside the view, above it, far above it."""
    drawn = stage()
    scene = drawn.scene.model_copy(
        update={"camera": drawn.scene.camera.model_copy(update={"view_px": (0, upper, 520, 230)})}
    )
    watcher = Watcher(scene, drawn.calibration)
    for k, u in enumerate((0.0, 2.0, 4.0)):
        sight = watcher.see(k, drawn.draw(u, lambda x, k=k: flat(x) + 1.5 * k, seed=k))
    if upper > 60:
        assert len(sight.surface_mm) == 0
        assert any(reason.startswith("surface: not seen") for reason in sight.reasons)
    assert abs(sight.blade_x_mm - 4.0) < 0.2 * drawn.mm_per_px


def test_a_heap_that_leaves_the_picture_is_said_to(stage):
    """All that is seen rises by 1 mm while the blade goes 2 mm."""
    drawn = stage()
    watcher = Watcher(drawn.scene, drawn.calibration)
    for k in range(4):
        reasons = watcher.see(k, drawn.draw(2.0 * k, lambda x, k=k: flat(x) + k, seed=k + 1)).reasons
        assert k > 0 or reasons == ()
    assert reasons == ("surface: the moving heap reaches the end of the picture",)


def test_sand_further_back_that_shows_above_the_surface_is_not_taken_for_the_surface(stage):
    """The uppermost sand is a dark layer; behind it sand paler than any before rises above it."""
    drawn = stage(air=90.0, layers=(24.0,))
    u = 7.3
    first = drawn.draw(0.0, flat, seed=1, layers=[lambda x: flat(x) - 1])
    later = drawn.draw(u, heap(u), seed=2, layers=[lambda x: heap(u)(x) - 1]).astype(float)
    rows, cols = np.mgrid[: drawn.shape[0], : drawn.shape[1]]
    mm = drawn.calibration.to_mm(np.stack([cols, rows], axis=-1))
    over = mm[..., 1] - heap(u)(mm[..., 0])
    later[(over > 0) & (over < 3) & (mm[..., 0] > u)] = 200.0
    watcher = Watcher(drawn.scene, drawn.calibration)
    watcher.see(0, first)
    line = watcher.see(1, later.astype(np.uint8)).surface_mm
    error = (line[:, 1] - heap(u)(line[:, 0])) / drawn.mm_per_px
    assert np.median(np.abs(error)) < 1.0
    assert np.mean(np.abs(error) < 3.0) > 0.9


def test_the_likeliest_path_is_the_cheapest_of_all_paths():
    """Against every path through a small table, the price of a rise being 0.5 a row, up to 2 rows.

    Each column's strip begins at a row of its own.
    """
    rng = np.random.default_rng(0)
    for _ in range(20):
        cost = rng.normal(0, 1, (4, 5))
        first = rng.integers(0, 3, 4)
        grid = np.stack(np.meshgrid(*[np.arange(5)] * 4, indexing="ij"), axis=-1).reshape(-1, 4)
        rise = np.abs(np.diff(grid + first, axis=1))
        grid, rise = grid[(rise <= 2).all(axis=1)], rise[(rise <= 2).all(axis=1)]
        price = cost[np.arange(4), grid].sum(axis=1) + 0.5 * rise.sum(axis=1)
        assert likeliest_path(cost, first, 2, 0.5).tolist() == (grid[np.argmin(price)] + first).tolist()


def test_profiles_are_those_of_bilinear_sampling():
    """Against scipy's sampling of order 1 along and across the line; rounding of float32 alone."""
    rng = np.random.default_rng(1)
    grey = rng.uniform(0, 255, (40, 60)).astype(np.float32)
    column, row, slope = np.array([20.5, 31.0, 2.2]), np.array([20.3, 4.0, 30.7]), np.array([0.3, -0.8, 0.0])
    along, across = np.arange(-4, 5), np.arange(-9, 10)
    cols = np.broadcast_to(column[:, None, None] + along[None, :, None], (3, 9, 19))
    rows = (row[:, None] + slope[:, None] * along)[:, :, None] + across
    expected = map_coordinates(grey, [rows, cols], order=1, mode="nearest", output=float).mean(axis=1)
    assert np.abs(profiles(grey, column, row, slope, 4, 9) - expected).max() < 1e-3


def test_costs_of_a_border_are_sums_of_logarithms_over_the_strip():
    """Against the definition, pixel by pixel in numpy: air above the border, four rows of skin, then sand."""
    rng = np.random.default_rng(2)
    level = rng.integers(0, 256, (30, 12), dtype=np.uint8)
    change = rng.integers(0, 2048, level.shape, dtype=np.uint16)
    known = rng.integers(0, 15, 12)
    tables = rng.uniform(0.001, 0.1, (11, 256)).astype(np.float32)
    first, strip = np.array([3, 5, 2, 6]), 12
    cost = np.empty((4, strip + 1))
    border_costs(
        (level.astype(np.float32), level, change), known, tables, np.array([2, 2, 4, 30]), first, cost
    )
    row = np.arange(30)[:, None]
    same = np.where(row < known, tables[3:].ravel()[change], 0.0)
    air = np.log(tables[0][level] + same)
    for k in range(4):
        for r in range(strip + 1):
            part = slice(2 + 2 * k, 4 + 2 * k)
            border, last = first[k] + r, first[k] + strip + 4
            expected = air[first[k] : border, part].sum() + tables[1][level[border : border + 4, part]].sum()
            expected += tables[2][level[border + 4 : last, part]].sum()
            assert cost[k, r] == pytest.approx(-expected / 2, abs=1e-4)
