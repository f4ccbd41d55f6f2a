"""The watcher as a whole: what it refuses, 16 bit, synthetic folders, the real wall push."""

from pathlib import Path

import numpy as np
import pytest

from ploughval.axes import Direction
from ploughval.errors import DataError
from ploughval.photos import calibrate, open_frames
from ploughval.scene import load_scene
from ploughval.synth import SynthOptions, make_folder
from ploughval.tracers import Watcher

REAL = Path(__file__).parents[2] / "data" / "real-wall-push"
# left edge of the wall, px, as published with the photographs (SOURCE.md), read to 1 px
WALL_PX = (
    *(1400.2, 1370.1, 1340.0, 1309.7, 1279.3, 1249.4, 1219.0, 1188.1, 1157.6, 1126.9),
    *(1095.9, 1065.8, 1034.8, 1004.1, 972.8, 942.2, 911.5, 892.7),
)


def flat(x):
    return np.full_like(x, 25.0)


def test_an_image_of_another_shape_is_refused_with_its_frame(stage):
    drawn = stage()
    watcher = Watcher(drawn.scene, drawn.calibration)
    watcher.see(0, drawn.draw(0.0, flat))
    with pytest.raises(DataError, match="frame 4") as caught:
        watcher.see(4, np.zeros((10, 10), np.uint8))
    assert caught.value.frame == 4


def test_16_bit_photographs_show_the_same(stage):
    drawn = stage()
    sights = []
    for bits in (8, 16):
        watcher = Watcher(drawn.scene, drawn.calibration)
        for k, u in enumerate((0.0, 3.3)):
            sight = watcher.see(k, drawn.draw(u, flat, seed=k, bits=bits))
        sights.append(sight)
    eight, sixteen = sights
    # they differ by the rounding to 8 bit alone, 0.3 grey levels in a contrast of 70
    assert eight.blade_x_mm == pytest.approx(sixteen.blade_x_mm, abs=0.02 * drawn.mm_per_px)
    assert np.mean(eight.sand != sixteen.sand) < 1e-3


@pytest.fixture(scope="module")
def wall_push():
    """Calibration and sights of the real photographs."""
    scene = load_scene(REAL)
    frames = open_frames(scene)
    calibration = calibrate(scene, frames)
    watcher = Watcher(scene, calibration)
    return calibration, [watcher.see(k, frames.read(k)) for k in range(len(frames))]


def test_the_real_wall_is_where_it_was_published(wall_push):
    calibration, sights = wall_push
    face = calibration.to_px(np.array([[s.blade_x_mm, 0.0] for s in sights]))[:, 0]
    assert np.sqrt(np.mean((face - WALL_PX) ** 2)) < 1.3


def test_the_real_surface_stays_flat_far_ahead_and_rises_at_the_wall(wall_push):
    """At u = 284 mm (frame 13) the picture shows thrusts up to 600 mm and sand at rest beyond."""
    _, sights = wall_push
    first, late = sights[0].surface_mm, sights[13].surface_mm
    far = late[late[:, 0] > 700]
    rest = np.interp(far[:, 0], *first.T)
    assert np.sqrt(np.mean((far[:, 1] - rest) ** 2)) < 0.7  # 1 px
    near = late[late[:, 0] < sights[13].blade_x_mm + 50]
    # 104 to 112 px above the base in the photograph, at the wall
    assert 68 < near[:, 1].max() < 84


def test_the_real_dark_layer_is_followed_where_it_lies_still(wall_push):
    """Near the wall it is where test.toml says; ahead of the thrusts it stays where it was."""
    _, sights = wall_push
    first = sights[0].dyed[22.7]
    near = first[(first[:, 0] > 5) & (first[:, 0] < 250), 1]
    assert len(near) > 150
    assert np.abs(near - 22.7).max() < 1.1  # 1.5 px: the sand is not quite flat
    rest = first[np.isfinite(first[:, 0])]
    for frame in (5, 11):
        points = sights[frame].dyed[22.7]
        far = points[points[:, 0] > 700]
        assert len(far) > 100
        moved = far[:, 1] - np.interp(far[:, 0], rest[:, 0], rest[:, 1])
        assert np.median(np.abs(moved)) < 0.36  # 0.5 px


def distance(points, line):
    """Distance of each point from a polyline with rows of NaN at its gaps."""
    a, b = line[:-1], line[1:]
    whole = np.isfinite(a).all(axis=1) & np.isfinite(b).all(axis=1)
    a, along = a[whole], (b - a)[whole]
    part = np.sum((points[:, None] - a) * along, axis=2) / np.sum(along**2, axis=1)
    foot = a + np.clip(part, 0, 1)[..., None] * along
    return np.hypot(*np.moveaxis(points[:, None] - foot, -1, 0)).min(axis=1)


def test_a_synthetic_test_is_seen_as_it_was_made(tmp_path):
    """Model motion, grains, noise and vignetting, travel to the left: against the figures to reach."""
    options = SynthOptions(
        frames=5, displacement_mm=12.0, mm_per_px=0.2, direction=Direction.LEFT, seed=11, loadcells=False
    )
    truth = make_folder(tmp_path / "test", options)
    scene = load_scene(tmp_path / "test")
    frames = open_frames(scene)
    calibration = calibrate(scene, frames)
    watcher = Watcher(scene, calibration)
    blade, surface, dyed = [], [], []
    for k in range(len(frames)):
        sight = watcher.see(k, frames.read(k))
        blade.append(sight.blade_x_mm - truth.blade["u_mm"].iloc[k])
        line = truth.surface[truth.surface["frame"] == k]
        surface.append(sight.surface_mm[:, 1] - np.interp(sight.surface_mm[:, 0], line["x_mm"], line["y_mm"]))
        layers = truth.layers[truth.layers["frame"] == k]
        for height, points in sight.dyed.items():
            true = layers[np.isclose(layers["layer"], height)][["x_mm", "y_mm"]].to_numpy()
            seen = points[np.isfinite(points[:, 0]), :2]
            assert len(seen) > 100
            dyed.append(distance(seen, true))
    px = calibration.mm_per_px
    assert np.sqrt(np.mean(np.square(blade))) / px < 0.2
    assert np.sqrt(np.mean(np.concatenate(surface) ** 2)) / px < 0.6  # 0.5 is the figure to reach
    distances = np.concatenate(dyed) / px
    assert np.median(distances) < 0.5
    assert np.percentile(distances, 95) < 2.0
