"""Drawn photographs and exact tracks for the hard cases of tracers: sand, blade and layers as lines."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from ploughval.axes import SURFACE_COLUMNS
from ploughval.scene import Bands, Blade, Camera, Piv, Scene, Soil, TestTable, Tracers

Floats = NDArray[np.float64]
Line = Callable[[Floats], Floats]

SHAPE, MM_PER_PX, TIP_PX = (230, 520), 0.2, (60.3, 195.4)
FINE = 4  # parts of a pixel across in which a slope is drawn
BLADE_MM = 4.0


class Scale:
    """Scale and tip, written down apart from ploughval.photos."""

    mm_per_px = MM_PER_PX
    _axes = MM_PER_PX * np.array([1.0, -1.0])

    def to_mm(self, px: object) -> Floats:
        """World mm of image px."""
        return np.asarray((np.asarray(px, float) - TIP_PX) * self._axes)

    def to_px(self, mm: object) -> Floats:
        """Image px of world mm."""
        return np.asarray(np.asarray(mm, float) / self._axes + TIP_PX)


SCALE = Scale()


def scene_of(layers: Sequence[float] = ()) -> Scene:
    """25 mm of sand before a blade of 4 mm."""
    return Scene(
        test=TestTable(name="drawn"),
        blade=Blade(depth_mm=25.0, width_mm=200.0, thickness_mm=BLADE_MM),
        soil=Soil(unit_weight_kN_m3=16, peak_friction_deg=45, residual_friction_deg=35),
        camera=Camera(photos="*.png", mm_per_px=MM_PER_PX, tip_px=TIP_PX),
        tracers=Tracers(layers_mm=tuple(layers), dyed=True, thickness_mm=2.0) if layers else None,
        piv=Piv(subset_px=21),
    )


def below(line: Line) -> Floats:
    """Share of each pixel under a line y = line(x), mm."""
    part = (np.arange(FINE) + 0.5) / FINE - 0.5
    columns = (np.arange(SHAPE[1])[:, None] + part).ravel()
    x = SCALE.to_mm(np.stack([columns, np.zeros_like(columns)], axis=-1))[:, 0]
    row = SCALE.to_px(np.stack([x, line(x)], axis=-1))[:, 1]
    share = np.clip(np.arange(SHAPE[0])[:, None] + 0.5 - row, 0, 1)
    return np.asarray(share.reshape(SHAPE[0], -1, FINE).mean(axis=2))


def ahead(x_mm: float) -> Floats:
    """Share of each column of pixels that lies ahead of a place."""
    return np.clip(0.5 + np.arange(SHAPE[1]) - SCALE.to_px([x_mm, 0.0])[0], 0, 1)


def photograph(
    u_mm: float,
    surface: Line,
    *,
    seed: int,
    layers: Sequence[Line] = (),
    half_mm: Callable[[Floats], Floats] | None = None,
) -> NDArray[np.uint8]:
    """A photograph: blade at u_mm, sand under surface(x) ahead of it, dark layers of 2 mm about layers(x)."""
    rng = np.random.default_rng(seed)
    front, floor, top = ahead(u_mm), below(np.zeros_like), below(surface)
    blade = (ahead(u_mm - BLADE_MM) - front) * (1 - floor)
    sand = floor + front * (top - floor)
    half = half_mm or np.ones_like
    dyed = np.zeros(SHAPE)
    for line in layers:
        upper, lower = (below(lambda x, c=line, s=sign: c(x) + s * half(x)) for sign in (1.0, -1.0))
        dyed += front * np.minimum(upper - lower, top)
    grains = gaussian_filter(rng.standard_normal(SHAPE), 1.2)
    grains = 130 + 22 * grains / grains.std()
    rest = 1 - (sand + blade)
    picture = (sand - dyed) * grains + dyed * grains * 0.5 + blade * 210.0 + rest * 60.0
    picture = gaussian_filter(picture, 0.7) + rng.normal(0, 1.5, SHAPE)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


@dataclass(frozen=True)
class Block:
    """Sand over a line from the tip to an outcrop that may move, carried along by the blade.

    outcrop(u) is where the band comes out of a surface at ``depth_mm`` that stays flat: its heap is taken
    away. ``second`` cuts the block again, at this share of its reach: the sand ahead of it goes half as fast.
    """

    outcrop: Callable[[float], float]
    depth_mm: float = 30.0
    second: float | None = None

    def carry(self, points: Floats, u0: float, u1: float, steps: int = 40) -> Floats:
        """Points (N, 2) after the blade has gone from u0 to u1."""
        points, du = points.copy(), (u1 - u0) / steps
        for k in range(steps):
            u = u0 + (k + 0.5) * du
            slope = self.depth_mm / (self.outcrop(u) - u)
            moving = (points[:, 0] > u) & (points[:, 1] > (points[:, 0] - u) * slope)
            speed = np.ones(len(points))
            if self.second is not None:
                steep = slope / self.second
                speed[points[:, 1] < (points[:, 0] - u) * steep] = 0.5
            points[moving] += (speed[:, None] * [du, du * slope])[moving]
        return points


def tracks_of(block: Block, u: Floats, *, noise: float = 0.0, last_x: float = 150.0) -> xr.Dataset:
    """Tracks of a grid of points through a block's motion, with noise, mm."""
    rng = np.random.default_rng(5)
    axes = np.arange(1, last_x, 2.0), np.arange(-6.3, 30, 2.0)
    start = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    places = [start]
    for u0, u1 in pairwise(u):
        places.append(block.carry(places[-1], u0, u1))
    place = np.array(places)
    status = np.where(place[..., 0] < u[:, None], 8, 0).astype(np.int8)
    place = place + rng.normal(0, noise, place.shape) if noise else place
    place[status != 0] = np.nan
    both, one = ("frame", "point"), "point"
    return xr.Dataset(
        {
            "x_mm": (both, place[..., 0]), "y_mm": (both, place[..., 1]),
            "std_mm": (both, np.full(place.shape[:2], max(noise, 1e-4))),
            "zncc": (both, np.ones(place.shape[:2])), "status": (both, status),
            "x0_mm": (one, start[:, 0]), "y0_mm": (one, start[:, 1]),
            "layer_mm": (one, np.full(len(start), np.nan)),
            "time_s": ("frame", u), "u_mm": ("frame", u), "blade_x_mm": ("frame", u),
        },
        coords={"frame": np.arange(len(u))},
    )  # fmt: skip


def flat_surface(u: Floats, height: float = 30.0, last_x: float = 200.0) -> pd.DataFrame:
    """A surface that stays flat."""
    rows = [(k, one, x, height) for k, one in enumerate(u) for x in np.arange(one, last_x, 5.0)]
    return pd.DataFrame(rows, columns=list(SURFACE_COLUMNS))


def band_scene() -> Scene:
    """A scene with [bands], 30 mm deep."""
    camera = Camera(photos="*.png", mm_per_px=0.2, tip_px=(0, 0))
    return Scene(
        test=TestTable(name="t"), blade=Blade(depth_mm=30, width_mm=200), camera=camera, bands=Bands()
    )
