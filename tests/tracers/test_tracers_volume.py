"""Heap against swept area: closed forms, the exact surfaces of a made test, and measured ones."""

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import VOLUME_COLUMNS
from ploughval.photos import calibrate, open_frames
from ploughval.scene import load_scene
from ploughval.synth import SynthOptions, make_folder
from ploughval.tracers import Watcher
from ploughval.tracers.volume import area_balance

DEPTH = 20.0


def triangle(u, std=0.05, far=200.0, step=0.5):
    """A heap 2 sqrt(DEPTH u) long and as high as makes its area DEPTH u: points as they are measured."""
    x = np.arange(u + 0.4, far, step)
    length = 2 * np.sqrt(DEPTH * max(u, 1e-9))
    height = DEPTH * u / (length / 2)
    y = DEPTH + height * np.clip(1 - (x - u) / length, 0, 1)
    return pd.DataFrame({"u_mm": u, "x_mm": x, "y_mm": y, "std_mm": std})


def series(travel, **options):
    parts = [triangle(u, **options).assign(frame=k) for k, u in enumerate(travel)]
    blade = pd.DataFrame({"frame": np.arange(len(travel)), "u_mm": travel, "blade_std_mm": 0.01})
    return pd.concat(parts, ignore_index=True), blade


def test_a_triangular_heap_balances_what_was_swept():
    """Its area is DEPTH u by construction; the first 0.4 mm ahead of the face are taken as level, 0.2 %."""
    surface, blade = series([0.0, 5.0, 20.0])
    found = area_balance(surface, blade, DEPTH)
    assert list(found.columns) == list(VOLUME_COLUMNS)
    assert found["swept_mm2"].tolist() == pytest.approx([0.0, 100.0, 400.0], abs=1e-6)
    assert found["area_mm2"].tolist() == pytest.approx([0.0, 100.0, 400.0], abs=1.0)
    assert np.isnan(found["ratio"][0])
    assert found["ratio"][2] == pytest.approx(1.0, abs=0.005)


def test_a_sloping_initial_surface_is_swept_with_its_own_shape():
    """Height 20 + 0.1 x: 10 mm of travel sweep 205 mm2."""
    x = np.arange(0.5, 150.0, 0.5)
    parts = [
        pd.DataFrame(
            {"frame": k, "u_mm": u, "x_mm": x[x > u], "y_mm": DEPTH + 0.1 * x[x > u], "std_mm": 0.05}
        )
        for k, u in enumerate((0.0, 10.0))
    ]
    blade = pd.DataFrame({"frame": [0, 1], "u_mm": [0.0, 10.0]})
    found = area_balance(pd.concat(parts), blade, DEPTH, np.array([[-50.0, 15.0], [400.0, 60.0]]))
    assert found["swept_mm2"][1] == pytest.approx(205.0, abs=1e-6)
    assert found["area_mm2"][1] == pytest.approx(0.0, abs=0.5)  # the first half mm is taken as level


@pytest.mark.parametrize(
    "spoil",
    [
        lambda s: s[~s["x_mm"].between(30, 40)],  # hidden over half a depth
        lambda s: s.assign(y_mm=s["y_mm"] + 1.0 * (s["u_mm"] > 0)),  # moved up to its end
        lambda s: s[s["u_mm"] == 0],  # not seen at all
    ],
)
def test_an_incomplete_surface_has_no_balance(spoil):
    surface, blade = series([0.0, 10.0])
    found = area_balance(spoil(surface), blade, DEPTH)
    assert found.loc[1, ["area_mm2", "ratio", "std_mm2"]].isna().all()


def test_its_deviation_grows_with_those_of_surface_and_face():
    """A face 0.1 mm off shifts the difference by the height at the face, 33 mm2 per mm here, times 0.1."""
    surface, blade = series([0.0, 10.0], std=1e-6)
    wide = area_balance(surface, blade.assign(blade_std_mm=0.1), DEPTH)
    height = DEPTH + 2 * DEPTH * 10.0 / (2 * np.sqrt(DEPTH * 10.0))
    assert wide["std_mm2"][1] == pytest.approx(0.1 * height, rel=0.02)
    loose = area_balance(*series([0.0, 10.0], std=0.2), DEPTH)
    tight = area_balance(*series([0.0, 10.0], std=0.1), DEPTH)
    assert loose["std_mm2"][1] == pytest.approx(2 * tight["std_mm2"][1], rel=0.02)


def test_a_made_test_balances_exactly_and_as_it_is_measured(tmp_path):
    """The model conserves area but for the triangles that the tip leaves, under 0.2 % here."""
    options = SynthOptions(frames=5, displacement_mm=12.0, mm_per_px=0.2, seed=12, loadcells=False)
    truth = make_folder(tmp_path / "test", options)
    exact = area_balance(truth.surface, truth.blade, options.depth_mm)
    assert (exact["ratio"][1:] - 1).abs().max() < 0.01
    scene = load_scene(tmp_path / "test")
    frames = open_frames(scene)
    watcher = Watcher(scene, calibrate(scene, frames))
    rows, blade = [], []
    for k in range(len(frames)):
        sight = watcher.see(k, frames.read(k))
        u = float(truth.blade["u_mm"].iloc[k])
        rows += [(k, u, *p, s) for p, s in zip(sight.surface_mm.tolist(), sight.surface_std_mm, strict=True)]
        blade.append((k, u, sight.blade_x_mm, sight.blade_std_mm))
    found = area_balance(
        pd.DataFrame(rows, columns=["frame", "u_mm", "x_mm", "y_mm", "std_mm"]),
        pd.DataFrame(blade, columns=["frame", "u_mm", "blade_x_mm", "blade_std_mm"]),
        options.depth_mm,
    )
    # 0.2 px along 600 px of surface of 0.2 mm: 5 of the 90 to 360 mm2 swept; later the toe leaves the picture
    assert found["difference_mm2"].abs().max() < 8.0
    assert (found["ratio"][1:] - 1).abs().max() < 0.03
    assert (found["difference_mm2"].abs()[1:] < 3 * found["std_mm2"][1:]).all()
