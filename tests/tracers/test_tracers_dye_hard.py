"""Dyed layers that are doubled, thinned, slipped past each other, of any colour; the real coloured wedge."""

from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from ploughval.scene import Tracers
from ploughval.tracers import Watcher
from ploughval.tracers.dye import DyeFollower
from ploughval.tracers.light import LightMeter
from ploughval.tracers.view import View

WEDGE = Path(__file__).parents[3] / "shared" / "realdata" / "sandbox_wedge_crop" / "images"
HEIGHTS = (8.0, 14.0)
CUT, SLOPE = 45.0, 0.5  # mm: where the band cuts the layers; of the block's motion
NOWHERE = -100.0


def flat(x):
    return np.full_like(x, 25.0)


def thrust(height, u):
    """The two pieces of a layer after the block has gone u: the hanging one overlaps the other by u."""
    hanging = lambda x: np.where(x < CUT + u, height + SLOPE * u, NOWHERE)  # noqa: E731
    lying = lambda x: np.where(x >= CUT, height, NOWHERE)  # noqa: E731
    return hanging, lying


def heaped(u):
    return lambda x: 25.0 + SLOPE * u * (x < CUT + u)


def photograph(drawn, u, seed):
    return drawn.draw(u, heaped(u), seed=seed, layers=[piece for h in HEIGHTS for piece in thrust(h, u)])


def scored(drawn, points, height, u):
    """Distance of each point from its own layer, px; and shares of the two pieces that were found."""
    seen = points[np.isfinite(points[:, 0])]
    pieces = [piece(seen[:, 0]) for piece in thrust(height, u)]
    error = np.min([np.abs(seen[:, 1] - y) for y in pieces], axis=0) / drawn.mm_per_px
    shares = []
    risen = height + SLOPE * u
    end = CUT if risen in HEIGHTS else CUT + u  # where two layers lie on each other either name is right
    for first, last, y in ((u + 1, end - 1, risen), (CUT + 1, 90.0, height)):
        wanted = np.arange(first, last, 0.4)
        near = seen[np.abs(seen[:, 1] - y) < 1.0, 0]
        shares.append(np.mean(np.abs(wanted[:, None] - near).min(axis=1) < 0.5) if len(near) else 0.0)
    return error, shares


@pytest.mark.parametrize("look", [{"dye": "dark"}, {"dye": "pale", "air": 40.0}])
def test_a_layer_doubled_in_a_thrust_is_two_pieces_of_one_name(stage, look):
    """After 12 mm in 8 steps the lower layer's hanging piece stands where the upper layer was at rest."""
    drawn = stage(layers=HEIGHTS, **look)
    watcher = Watcher(drawn.scene, drawn.calibration)
    for k, u in enumerate(np.linspace(0, 12, 9)):
        sight = watcher.see(k, photograph(drawn, u, k))
    for height in HEIGHTS:
        error, shares = scored(drawn, sight.dyed[height], height, 12.0)
        assert np.median(error) < 0.5
        assert np.percentile(error, 95) < 2.0
        assert min(shares) > 0.8


def test_the_sign_of_the_contrast_is_read_in_the_first_photograph(stage):
    """The scene says dark, the dye is pale: its height at rest tells what it looks like."""
    drawn = stage(layers=HEIGHTS, dye="pale", air=40.0)
    told = stage(layers=HEIGHTS, dye="dark")
    sight = Watcher(told.scene, told.calibration).see(0, photograph(drawn, 0.0, 0))
    for height in HEIGHTS:
        error = np.abs(sight.dyed[height][:, 1] - height) / drawn.mm_per_px
        assert np.nanmedian(error) < 0.5
        assert len(error) > 200


def test_points_that_tracking_carried_name_layers_after_a_leap(stage):
    """One step of 12 mm lifts the block by a spacing of the layers: only the sand itself tells them apart."""
    drawn = stage(layers=HEIGHTS)
    watcher = Watcher(drawn.scene, drawn.calibration)
    watcher.see(0, photograph(drawn, 0.0, 0))
    u, x = 12.0, np.arange(1.0, 88.0, 1.0)
    carried = {}
    for height in HEIGHTS:
        moved = np.where(x < CUT, height + SLOPE * u, height)
        mm = np.column_stack([np.where(x < CUT, x + u, x), moved])
        carried[height] = drawn.calibration.to_px(mm)
    sight = watcher.see(1, photograph(drawn, u, 1), carried=carried)
    for height in HEIGHTS:
        error, shares = scored(drawn, sight.dyed[height], height, u)
        assert np.percentile(error, 95) < 2.0
        assert min(shares) > 0.8


def test_a_layer_thinned_to_two_fifths_is_followed(stage):
    """Its thickness, 10 px at rest, shrinks to 4 px over 30 mm of its length."""
    drawn = stage(layers=(14.0,))
    grown = drawn.draw(0.0, flat, seed=4)
    watcher = Watcher(drawn.scene, drawn.calibration)
    for k, share in enumerate((1.0, 0.8, 0.6, 0.4)):
        half = lambda x, s=share: np.where((x > 30) & (x < 60), s, 1.0)  # noqa: E731
        upper = drawn.below(lambda x, w=half: 14.0 + w(x))
        lower = drawn.below(lambda x, w=half: 14.0 - w(x))
        sight = watcher.see(k, np.rint(grown * (1 - 0.5 * (upper - lower))).astype(np.uint8))
    points = sight.dyed[14.0]
    thin = points[(points[:, 0] > 32) & (points[:, 0] < 58)]
    error = np.abs(thin[:, 1] - 14.0) / drawn.mm_per_px
    assert len(thin) > 0.8 * 130 / 2
    assert np.median(error) < 0.5
    assert np.percentile(error, 95) < 2.0


def test_a_layer_that_looks_like_the_sand_is_absent_with_a_reason(stage):
    drawn = stage(layers=(14.0,))
    sight = Watcher(drawn.scene, drawn.calibration).see(0, drawn.draw(0.0, flat, seed=1))
    assert np.isnan(sight.dyed[14.0]).all()
    assert any(reason.startswith("layer 14 mm:") for reason in sight.reasons)


class Pixels:
    """A picture without a scale: mm are px, y up from its lower edge."""

    mm_per_px = 1.0

    def to_mm(self, px):
        return np.asarray(px, float) * [1, -1] + [0, 150.0]

    def to_px(self, mm):
        return (np.asarray(mm, float) - [0, 150.0]) * [1, -1]


@pytest.mark.skipif(not WEDGE.is_dir(), reason="the photographs of the coloured wedge are not here")
def test_the_real_magenta_line_goes_with_its_sand():
    """In green, over 10 photographs: against template matches that are published with them (SOURCE.md).

    They give whole pixels, so 0.5 px, and 0.5 px for the sand between the match and the line.
    """
    photographs = [cv2.imread(str(p))[..., 1] for p in sorted(WEDGE.glob("*.jpg"))]
    assert len(photographs) == 20
    x = np.arange(250.0)
    read_by_eye = [44.6, 42.1, 36.4, 32.1, 29.3, 24.3, 14.3, 1.8]
    rest = {1.0: np.interp(x, np.arange(8) * 250 / 7, read_by_eye)}
    look = SimpleNamespace(light=np.ones(250), top=np.full(250, -5.0))
    view = View(photographs[0].shape, Pixels())
    tracers = Tracers(layers_mm=[1.0], dyed=True, thickness_mm=5.0)
    follower = DyeFollower(view, tracers, photographs[0], look, rest)
    meter = LightMeter(photographs[0])
    lines = []
    for image in photographs:
        points = follower.follow(image, meter.compare(image), look.top, -10.0)[1.0]
        points = points[np.isfinite(points[:, 0])]
        lines.append(points[np.argsort(points[:, 0])])
    for place, ahead, up in ((30, 0, 6), (88, 0, 8), (150, 1, 9)):
        before = np.interp(place, lines[0][:, 0], lines[0][:, 1])
        after = np.interp(place - ahead, lines[10][:, 0], lines[10][:, 1])
        assert after - before == pytest.approx(up, abs=1.0)
    assert len(lines[19]) > 60
