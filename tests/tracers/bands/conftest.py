"""Tracks and surfaces of made tests in milliseconds: exact motion, measured as correlation measures.

The motion is that of made folders (synth), without photographs. What is put on top of it is what subsets do:
noise that neighbours share because their subsets overlap, points lost where a band tears their subset, and
vectors close to a band that are drawn towards the other side.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.ndimage import uniform_filter

from ploughval.axes import SURFACE_COLUMNS, Status
from ploughval.model import simulate
from ploughval.scene import Camera, Scene, Soil
from ploughval.synth import EXAMPLE
from ploughval.synth.motion import Motion, Trench, plan_motion
from ploughval.synth.options import SynthOptions

SUBSET_PX = 31
CELL_PX = 4  # of the field of noise


@dataclass(frozen=True)
class Made:
    """A test's tracks, surface and scene, and what truly happened."""

    tracks: xr.Dataset
    surface: pd.DataFrame
    scene: Scene
    bands: pd.DataFrame
    motion: Motion
    frames_u: np.ndarray

    def truth(self, first: int, last: int) -> tuple[float, float, float]:
        """Mean outcrop, inclination half-way, and share of the later band in an increment (1: no switch)."""
        u0, u1 = self.frames_u[[first, last]]
        m = self.motion
        inside = (m.u_mm >= u0 - 1e-9) & (m.u_mm < u1 - 1e-9)
        middle = (u0 + u1) / 2
        at = int(np.argmin(np.abs(m.u_mm + m.du_mm / 2 - middle)))
        starts = self.bands["u_start_mm"].to_numpy()
        switch = starts[(starts > u0 + 1e-6) & (starts < u1 - 1e-6)]
        outcrop = float(np.average(m.outcrop_x_mm[inside], weights=m.du_mm[inside]))
        after = float(m.u_mm[at] + m.du_mm[at] / 2)
        height = (m.outcrop_x_mm[at] - after) * np.tan(np.radians(m.beta_deg[at]))
        beta = np.degrees(np.arctan2(height, m.outcrop_x_mm[at] - middle))
        return outcrop, float(beta), float((u1 - switch[0]) / (u1 - u0)) if len(switch) else 1.0

    def velocity(self, first: int, last: int) -> tuple[float, float]:
        """Motion of the block for a millimetre of the blade: the mean of (1, tan beta) over an increment."""
        u0, u1 = self.frames_u[[first, last]]
        m = self.motion
        inside = (m.u_mm >= u0 - 1e-9) & (m.u_mm < u1 - 1e-9)
        return 1.0, float(np.average(np.tan(np.radians(m.beta_deg[inside])), weights=m.du_mm[inside]))


@lru_cache(maxsize=32)
def _history(peak: float, residual: float):
    return simulate(options(peak, residual).true_scene)


def options(peak: float, residual: float, **changes: object) -> SynthOptions:
    soil = Soil(unit_weight_kN_m3=15.7, peak_friction_deg=peak, residual_friction_deg=residual)
    return replace(EXAMPLE, soil=soil, **changes)


def make(
    soil: tuple[float, float] = (40.0, 33.0),
    *,
    frames: int = 30,
    mm_per_px: float = 0.25,
    noise_px: float = 0.03,
    seed: int = 0,
    u_mm: np.ndarray | None = None,
    smear: bool = True,
) -> Made:
    """A made test; the blade stands at ``u_mm`` in its photographs (evenly spread over 55 mm)."""
    rng = np.random.default_rng(seed)
    o = options(*soil, frames=frames, mm_per_px=mm_per_px)
    history = _history(*soil)
    frames_u = o.frames_u_mm if u_mm is None else np.asarray(u_mm, float)
    trench = Trench(o.depth_mm, o.thickness_mm, o.soil.slope_of_repose_deg)
    increasing = np.unique(frames_u)
    motion = plan_motion(history.increments, history.surface, increasing, trench, rounding_mm=0.01)
    start, layer = _points(o, rng)
    place = motion.positions(start)[np.searchsorted(increasing, frames_u)]
    measured, std, status = _measure(place, frames_u, motion, o, noise_px, rng, smear)
    rows = []
    for frame, u in enumerate(frames_u):
        line = motion.surfaces[motion.frame_steps[np.searchsorted(increasing, u)]]
        x = np.arange(u + 1.0, start[:, 0].max(), 2 * mm_per_px)
        error = 0.3 * mm_per_px
        y = np.interp(x, *line.T) + rng.normal(0, error, len(x))
        rows.append(pd.DataFrame({"frame": frame, "u_mm": u, "x_mm": x, "y_mm": y, "std_mm": error}))
    tracks = xr.Dataset(
        {
            "x_mm": (("frame", "point"), measured[..., 0]),
            "y_mm": (("frame", "point"), measured[..., 1]),
            "std_mm": (("frame", "point"), std),
            "zncc": (("frame", "point"), np.where(status == 0, 0.98, np.nan)),
            "status": (("frame", "point"), status),
            "x0_mm": ("point", start[:, 0]),
            "y0_mm": ("point", start[:, 1]),
            "layer_mm": ("point", layer),
            "time_s": ("frame", frames_u),
            "u_mm": ("frame", frames_u),
            "blade_x_mm": ("frame", frames_u),
        },
        coords={"frame": np.arange(len(frames_u))},
    )
    camera = Camera(photos="*.png", mm_per_px=mm_per_px, tip_px=(0, 0))
    scene = o.true_scene.model_copy(update={"camera": camera})
    bands = history.bands[history.bands["u_start_mm"] < frames_u[-1]]
    surface = pd.concat(rows)[[*SURFACE_COLUMNS, "std_mm"]]
    return Made(tracks, surface, scene, bands.reset_index(drop=True), motion, frames_u)


def _points(o: SynthOptions, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A grid of half a subset's spacing over sand to 20 px below the tip, and rows along the layers."""
    scale = o.mm_per_px
    step = max(SUBSET_PX // 2, 3.5 / scale)  # px: some thousand points however fine the scale
    far = 190.0
    x, y = (rng.uniform(0, step, 2)) * scale
    grid = np.stack(
        np.meshgrid(
            np.arange(x, far, step * scale), np.arange(y - 20 * scale, o.depth_mm - 4 * scale, step * scale)
        ),
        axis=-1,
    ).reshape(-1, 2)
    along = np.arange(2.5 * scale, far, step / 3 * scale)
    rows = [np.column_stack([along, np.full(len(along), h)]) for h in o.layers_mm]
    layer = np.concatenate([np.full(len(grid), np.nan), np.repeat(o.layers_mm, len(along))])
    return np.concatenate([grid, *rows]), layer


def _shared_noise(place: np.ndarray, scale: float, rng: np.random.Generator) -> np.ndarray:
    """Unit noise (N, 2) with the correlation of overlapping subsets."""
    cell = np.nan_to_num(place / scale / CELL_PX + 60).astype(int)
    field = rng.normal(0, 1, (2, cell[:, 0].max() + 2, cell[:, 1].max() + 2))
    width = SUBSET_PX // CELL_PX
    field = np.stack([uniform_filter(f, width, mode="wrap") for f in field]) * width
    return field[:, cell[:, 0], cell[:, 1]].T


def _measure(place, frames_u, motion, o, noise_px, rng, smear):
    """Positions with noise, what bands do to nearby vectors, and status."""
    scale = o.mm_per_px
    measured = place.copy()
    status = np.where(np.isfinite(place[..., 0]), Status.OK, Status.AVALANCHED).astype(np.int8)
    noise = np.stack([_shared_noise(p, scale, rng) for p in place]) * noise_px * scale
    measured += noise
    gone = np.zeros(place.shape[1], bool)
    for k in range(1, len(frames_u)):
        du = frames_u[k] - frames_u[k - 1]
        if smear and du > 0:
            step = place[k] - place[k - 1]
            share = step[:, 0] / du
            middle = (frames_u[k] + frames_u[k - 1]) / 2
            at = int(np.argmin(np.abs(motion.u_mm + motion.du_mm / 2 - middle)))
            beta = np.radians(motion.beta_deg[at])
            away = ((place[k, :, 1] + place[k - 1, :, 1]) / 2) * np.cos(beta)
            away -= ((place[k, :, 0] + place[k - 1, :, 0]) / 2 - middle) * np.sin(beta)
            gone |= (share > 0.1) & (share < 0.9) & (np.abs(away) < 6 * scale + du / 2)
            close = np.exp(-((away / scale / 3.0) ** 2))
            lost = rng.random(len(away)) < 0.5 * close
            pull = np.where(share > 0.5, -1.0, 1.0) * 0.15 * close * rng.random(len(away))
            measured[k] += step.max(axis=0, where=np.isfinite(step), initial=0.0) * pull[:, None]
            status[k, lost & (status[k] == 0)] = Status.LOW_CORRELATION
        status[k, gone & (status[k] == 0)] = Status.SHEARED
    measured[status != 0] = np.nan
    std = np.where(status == 0, noise_px * scale, np.nan)
    return measured, std, status


@pytest.fixture(scope="session")
def made() -> Callable[..., Made]:
    """Makes tests: see ``make``."""
    return make
