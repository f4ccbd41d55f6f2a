"""Findings of a test made by hand: points at rest with known noise, points that move, bands, increments."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from ploughval.photos import calibrate
from ploughval.photos.reading.exif import Shot
from ploughval.photos.series.frames import FrameSeries
from ploughval.run.clock import Displacement
from ploughval.run.findings import Findings
from ploughval.scene import Scene

U_MM = np.arange(12) * 2.0
SCALE = 0.25
SHAPE = (400, 1200)


@pytest.fixture
def make_scene():
    def make(camera=None, piv=None, **tables):
        return Scene.model_validate(
            {
                "test": {"name": "practice"},
                "blade": {"depth_mm": 30.0, "width_mm": 200.0, **tables.pop("blade", {})},
                "camera": {
                    "photos": "*.png",
                    "mm_per_px": SCALE,
                    "tip_px": [100.0, 250.0],
                    **(camera or {}),
                },
                "piv": piv or {},
                **tables,
            }
        )

    return make


@pytest.fixture
def make_frames(tmp_path):
    def make(shots=(), time_s=None, count=12):
        return FrameSeries(
            paths=tuple(tmp_path / f"{k}.png" for k in range(count)),
            time_s=10.0 + 2.0 * np.arange(count) if time_s is None else time_s,
            time_std_s=np.zeros(count),
            shape=SHAPE,
            faults={},
            shots=shots or (Shot(),) * count,
        )

    return make


def tracks_of(u_mm, noise_mm, stated_mm, *, seed=0):
    """Points 4 mm apart; sand behind x = 90 mm and above the tip moves with the blade."""
    rng = np.random.default_rng(seed)
    x, y = (g.ravel() for g in np.meshgrid(np.arange(2.0, 240.0, 4.0), np.arange(-14.0, 29.0, 4.0)))
    moves = (x < 90) & (y > 0)
    shape = (len(u_mm), x.size)
    at_x = x + np.outer(u_mm, moves) + rng.normal(0, noise_mm[0], shape)
    at_y = y + 0.5 * np.outer(u_mm, moves) + rng.normal(0, noise_mm[1], shape)
    at_x[0], at_y[0] = x, y
    return xr.Dataset(
        {
            "x0_mm": ("point", x),
            "y0_mm": ("point", y),
            "layer_mm": ("point", np.full(x.size, np.nan)),
            "x_mm": (("frame", "point"), at_x),
            "y_mm": (("frame", "point"), at_y),
            "std_mm": (("frame", "point"), np.full(shape, stated_mm)),
            "zncc": (("frame", "point"), np.full(shape, 0.97)),
            "status": (("frame", "point"), np.zeros(shape, np.int8)),
        }
    )


BANDS = pd.DataFrame(
    {"band": [0, 1], "u_start_mm": [0.0, 15.0], "u_end_mm": [15.0, 22.0], "outcrop_x_mm": [90.0, 110.0]}
)


def increments_of(scatter_deg, *, seed=1, count=40, stated=0.3):
    rng = np.random.default_rng(seed)
    u = np.arange(count) * 1.0
    return pd.DataFrame(
        {
            "frame": np.arange(count),
            "u_mm": u,
            "band": (u >= 20).astype(int),
            "beta_deg": 20 + 0.2 * u + rng.normal(0, scatter_deg, count),
            "beta_std_deg": stated,
            "outcrop_x_mm": 90.0 + rng.normal(0, 0.5, count),
            "outcrop_std_mm": 0.4,
        }
    )


@pytest.fixture
def make_found(make_scene, make_frames):
    """Findings with what the keywords give; u_mm by the log."""

    def make(scene=None, u_mm=U_MM, **parts):
        scene = scene or make_scene()
        frames = parts.pop("frames", None) or make_frames(count=len(u_mm))
        displacement = Displacement(
            u_mm=np.asarray(u_mm, float),
            source=parts.pop("source", "log"),
            clock_offset_s=0.0,
            clock_offset_std_s=0.0,
            difference_rms_mm=0.0,
            scale=1.0,
            scale_std=0.0,
        )
        calibration = calibrate(scene, SimpleNamespace(shape=SHAPE))
        return Findings(frames=frames, calibration=calibration, displacement=displacement, **parts)

    return make
