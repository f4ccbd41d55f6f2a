"""Drawn photographs and tracks whose geometry is known exactly: no code under test makes them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.ndimage import gaussian_filter

from ploughval.axes import SURFACE_COLUMNS, Direction
from ploughval.scene import Blade, Camera, Piv, Scene, Soil, TestTable, Tracers

FINE = 4  # parts of a pixel across in which a slope is drawn
Line = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Scale:
    """Scale and tip: px to mm and back, written down independently of ploughval.photos."""

    mm_per_px: float
    tip_px: tuple[float, float]
    direction: Direction

    def to_mm(self, px):
        return (np.asarray(px, float) - self.tip_px) * self._axes

    def to_px(self, mm):
        return np.asarray(mm, float) / self._axes + self.tip_px

    @property
    def _axes(self):
        return self.mm_per_px * np.array([self.direction.sign, -1.0])


@dataclass(frozen=True)
class Stage:
    """A drawn test: 25 mm of sand, 0.2 mm per px, a blade of 4 mm, textured sand before pale or dark air."""

    direction: Direction = Direction.RIGHT
    mm_per_px: float = 0.2
    shape: tuple[int, int] = (230, 520)
    air: float = 60.0
    blade: float = 210.0
    vignetting: float = 0.0
    layers: tuple[float, ...] = ()
    dye: str = "dark"
    calibration: Scale = field(init=False)

    def __post_init__(self):
        x = 60.3 if self.direction is Direction.RIGHT else self.shape[1] - 1 - 60.3
        object.__setattr__(self, "calibration", Scale(self.mm_per_px, (x, 195.4), self.direction))

    @property
    def scene(self) -> Scene:
        camera = Camera(
            photos="*.png",
            mm_per_px=self.mm_per_px,
            tip_px=self.calibration.tip_px,
            direction=self.direction,
        )
        tracers = (
            Tracers(layers_mm=self.layers, dyed=True, dye=self.dye, thickness_mm=2.0) if self.layers else None
        )
        return Scene(
            test=TestTable(name="drawn"),
            blade=Blade(depth_mm=25.0, width_mm=200.0, thickness_mm=4.0),
            soil=Soil(unit_weight_kN_m3=16, peak_friction_deg=45, residual_friction_deg=35),
            camera=camera,
            tracers=tracers,
            piv=Piv(subset_px=21),
        )

    def below(self, line: Line) -> np.ndarray:
        """Share of each pixel under a line y = line(x), mm: exact in y, a mean of parts of a pixel in x."""
        part = (np.arange(FINE) + 0.5) / FINE - 0.5
        cols = (np.arange(self.shape[1])[:, None] + part).ravel()
        x = self.calibration.to_mm(np.stack([cols, np.zeros_like(cols)], axis=-1))[:, 0]
        row = self.calibration.to_px(np.stack([x, line(x)], axis=-1))[:, 1]
        share = np.clip(np.arange(self.shape[0])[:, None] + 0.5 - row, 0, 1)
        return share.reshape(self.shape[0], -1, FINE).mean(axis=2)

    def ahead(self, x_mm: float) -> np.ndarray:
        """Share of each column of pixels that lies ahead of a place, exact: (W,)."""
        column = self.calibration.to_px([x_mm, 0.0])[0]
        sign = self.direction.sign
        return np.clip(0.5 + sign * (np.arange(self.shape[1]) - column), 0, 1)

    def draw(
        self, u_mm: float, surface: Line, *, seed: int = 0, layers: Sequence[Line] = (), bits: int = 8
    ) -> np.ndarray:
        """A photograph: blade at u_mm, sand under surface(x) ahead of it, dyed layers about layers(x)."""
        rng = np.random.default_rng(seed)
        ahead = self.ahead(u_mm)
        floor = self.below(np.zeros_like)
        top = self.below(surface)
        blade = (self.ahead(u_mm - 4.0) - ahead) * (1 - floor)
        sand = floor + ahead * (top - floor)
        dyed = np.zeros(self.shape)
        for line in layers:
            upper, lower = (self.below(lambda x, c=line, d=d: c(x) + d) for d in (1.0, -1.0))
            dyed += ahead * np.minimum(upper - lower, top)
        cover = [sand - dyed, dyed, blade]
        grains = gaussian_filter(rng.standard_normal(self.shape), 1.2)
        grains = 130 + 22 * grains / grains.std()
        stain = 0.5 if self.dye == "dark" else 1.6
        rest = 1 - sum(cover)
        picture = cover[0] * grains + cover[1] * grains * stain + cover[2] * self.blade + rest * self.air
        row, col = np.mgrid[-1 : 1 : self.shape[0] * 1j, -1 : 1 : self.shape[1] * 1j]
        picture *= 1 - self.vignetting * (row**2 + col**2) / 2
        picture = gaussian_filter(picture, 0.7) + rng.normal(0, 1.5, self.shape)
        if bits == 16:
            return np.clip(np.rint(picture * 257), 0, 65535).astype(np.uint16)
        return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


@pytest.fixture
def stage():
    """The class of drawn tests."""
    return Stage


@dataclass(frozen=True)
class Block:
    """Sand over a line from the tip to an outcrop that may move, carried along by the blade.

    outcrop(u) is where the band comes out of a surface at 30 mm that stays flat: its heap is taken away.
    """

    outcrop: Callable[[float], float]
    depth_mm: float = 30.0

    def beta(self, u: float) -> float:
        return float(np.arctan2(self.depth_mm, self.outcrop(u) - u))

    def carry(self, points: np.ndarray, u0: float, u1: float, steps: int = 40) -> np.ndarray:
        """Points (N, 2) after the blade has gone from u0 to u1."""
        points = points.copy()
        du = (u1 - u0) / steps
        for k in range(steps):
            u = u0 + (k + 0.5) * du
            slope = np.tan(self.beta(u))
            moving = (points[:, 0] > u) & (points[:, 1] > (points[:, 0] - u) * slope)
            points[moving] += [du, du * slope]
        return points


def make_tracks(
    block: Block, frames_u: np.ndarray, *, spacing: float = 2.0, noise: float = 0.0, layers: tuple = ()
) -> xr.Dataset:
    """Tracks of a grid of points and rows of layer points through a block's motion."""
    rng = np.random.default_rng(5)
    grid = np.stack(np.meshgrid(np.arange(1, 150, spacing), np.arange(-6.3, 30, spacing)), axis=-1).reshape(
        -1, 2
    )
    rows = [np.column_stack([np.arange(0.5, 150, 0.5), np.full(299, h)]) for h in layers]
    start = np.concatenate([grid, *rows]).astype(float)
    layer = np.concatenate([np.full(len(grid), np.nan), *(np.full(299, h) for h in layers)])
    places = [start]
    for u0, u1 in pairwise(frames_u):
        places.append(block.carry(places[-1], u0, u1))
    place = np.array(places)
    status = np.where(place[..., 0] < np.asarray(frames_u)[:, None], 8, 0).astype(np.int8)
    place = place + rng.normal(0, noise, place.shape) if noise else place
    place[status != 0] = np.nan
    return xr.Dataset(
        {
            "x_mm": (("frame", "point"), place[..., 0]),
            "y_mm": (("frame", "point"), place[..., 1]),
            "std_mm": (("frame", "point"), np.full(place.shape[:2], max(noise, 1e-4))),
            "zncc": (("frame", "point"), np.ones(place.shape[:2])),
            "status": (("frame", "point"), status),
            "x0_mm": ("point", start[:, 0]),
            "y0_mm": ("point", start[:, 1]),
            "layer_mm": ("point", layer),
            "time_s": ("frame", np.asarray(frames_u, float)),
            "u_mm": ("frame", np.asarray(frames_u, float)),
            "blade_x_mm": ("frame", np.asarray(frames_u, float)),
        },
        coords={"frame": np.arange(len(frames_u))},
    )


def flat_surface(frames_u: np.ndarray, height: float = 30.0) -> pd.DataFrame:
    """A surface that stays flat, to 200 mm ahead."""
    rows = [(k, u, x, height) for k, u in enumerate(frames_u) for x in np.arange(u, 200.0, 5.0)]
    return pd.DataFrame(rows, columns=list(SURFACE_COLUMNS))


@pytest.fixture
def kinematics():
    """Block, tracks and surface of exact block kinematics."""
    return Block, make_tracks, flat_surface
