"""Dyed layers of drawn photographs, against the lines that were drawn."""

import numpy as np
import pytest

from ploughval.axes import Direction
from ploughval.tracers import Watcher

HEIGHTS = (8.0, 14.0, 20.0)
FACE_BAND = 70.0  # mm: where the band comes out of the surface


def flat(x):
    return np.full_like(x, 25.0)


def line(height, u):
    """A layer after the block has gone u along a band through (FACE_BAND, 25): risen inside it."""
    slope = 25.0 / FACE_BAND

    def at(x):
        inside = x - u < height / slope
        return np.where(inside, height + u * slope, height)

    return at


def follow(drawn, travel):
    watcher = Watcher(drawn.scene, drawn.calibration)
    for k, u in enumerate(travel):
        layers = [line(h, u) for h in HEIGHTS]
        sight = watcher.see(
            k, drawn.draw(u, lambda x, u=u: flat(x) + (x - u < 60) * u * 0.3, seed=k, layers=layers)
        )
    return sight


@pytest.mark.parametrize("direction", list(Direction))
@pytest.mark.parametrize("look", [{"dye": "dark"}, {"dye": "pale", "air": 40.0}, {"vignetting": 0.2}])
def test_layers_at_rest_are_found_within_half_a_pixel(stage, direction, look):
    drawn = stage(direction=direction, layers=HEIGHTS, **look)
    dyed = follow(drawn, [0.0]).dyed
    assert set(dyed) == set(HEIGHTS)
    for height, points in dyed.items():
        error = (points[:, 1] - height) / drawn.mm_per_px
        assert np.nanmedian(np.abs(error)) < 0.5  # the figure to reach
        assert np.nanpercentile(np.abs(error), 95) < 1.5  # the figure to reach is 2 px
        assert np.nanmax(np.abs(error)) < 3.5  # px: a layer thinned to 0.3 of 10 px from one side
        assert np.isfinite(points[:, 0]).mean() > 0.9
        assert np.nanmin(points[:, 0]) < 3.0
        assert np.nanmax(points[:, 0]) > 85.0


def test_torn_layers_are_followed_on_both_sides_of_the_band(stage):
    """Six steps: the lower layer rises past half the way to the one above, and keeps its name."""
    drawn = stage(layers=HEIGHTS)
    travel = np.linspace(0, 9, 7)
    dyed = follow(drawn, travel).dyed
    for height, points in dyed.items():
        seen = points[np.isfinite(points[:, 0])]
        true = line(height, travel[-1])(seen[:, 0])
        error = np.abs(seen[:, 1] - true) / drawn.mm_per_px
        assert np.median(error) < 0.5
        assert np.percentile(error, 95) < 2.0
        cut = travel[-1] + height / (25.0 / FACE_BAND)
        assert (seen[:, 0] < cut - 3).sum() > 20
        assert (seen[:, 0] > cut + 3).sum() > 20 or cut > 80
        gaps = np.flatnonzero(np.isnan(points[:, 0]))
        beside = np.abs(points[np.concatenate([gaps - 1, gaps + 1]), 0] - cut)
        assert len(gaps) >= 1 or cut > 85
        assert cut > 85 or beside.min() < 4.0


def test_where_a_layer_is_wiped_out_there_is_a_gap(stage):
    drawn = stage(layers=HEIGHTS)
    image = drawn.draw(0.0, flat, seed=3, layers=[line(h, 0.0) for h in HEIGHTS])
    plain = drawn.draw(0.0, flat, seed=3)
    rows, cols = np.mgrid[: drawn.shape[0], : drawn.shape[1]]
    x = drawn.calibration.to_mm(np.stack([cols, rows], axis=-1))[..., 0]
    watcher = Watcher(drawn.scene, drawn.calibration)
    watcher.see(0, image)
    points = watcher.see(1, np.where((x > 40) & (x < 50), plain, image)).dyed[14.0]
    seen = points[np.isfinite(points[:, 0]), 0]
    assert not ((seen > 42) & (seen < 48)).any()
    assert ((seen > 30) & (seen < 39)).sum() > 10
    assert ((seen > 51) & (seen < 60)).sum() > 10


def test_no_dye_in_the_scene_no_layers_in_the_sight(stage):
    drawn = stage()
    assert Watcher(drawn.scene, drawn.calibration).see(0, drawn.draw(0.0, flat)).dyed == {}
