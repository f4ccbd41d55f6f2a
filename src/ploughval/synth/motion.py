"""Material motion in a ploughing test: rigid blocks above a band, avalanches, and the trench behind.

The sand above the line through the tip moves with the blade (Kashizadeh et al. 2014, section 2.1); sand
above the free surface has avalanched. Behind the blade the cut bed slumps into the trench: it is cut at the
slope of repose so that area is conserved (an equal-area rule in the spirit of the paper's section 2.4).
"""

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

ROUNDING_MM = 0.01
"""How far surfaces are rounded, where nothing finer is asked for."""

_CELLS = 1000
_TOUCH_MM = 1e-9


class Increment(Protocol):
    """What is needed of one increment of :func:`ploughval.model.simulate`."""

    @property
    def u_mm(self) -> float: ...  # noqa: D102
    @property
    def du_mm(self) -> float: ...  # noqa: D102
    @property
    def beta_deg(self) -> float: ...  # noqa: D102
    @property
    def outcrop_x_mm(self) -> float: ...  # noqa: D102
    @property
    def surface(self) -> Floats: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Trench:
    """The bed behind the blade.

    Attributes
    ----------
    depth_mm, thickness_mm : float
        Of the blade.
    repose_deg : float
        Slope at which the cut bed comes to rest.
    """

    depth_mm: float
    thickness_mm: float
    repose_deg: float

    @property
    def scar_x_mm(self) -> float:
        """Furthest place behind the blade's start that the slump can reach, mm (negative)."""
        return -self.thickness_mm - self.depth_mm / (2 * math.tan(math.radians(self.repose_deg)))

    def profile(self, u_mm: float) -> Floats:
        """Surface behind the blade when its face is at ``u_mm``: (M, 2) mm, up to the blade's back.

        With T = tan(repose) and travel w the line of slope T meets the back at depth - sqrt(2 depth T w)
        until that reaches the trench's floor at w = depth / (2 T); after that it stays.
        """
        slope = math.tan(math.radians(self.repose_deg))
        back, depth = u_mm - self.thickness_mm, self.depth_mm
        far = -self.thickness_mm - depth / slope - 100 * depth
        if u_mm <= 0:
            return np.array([[far, depth], [back, depth]])
        travel = min(u_mm, depth / (2 * slope))
        low = depth - math.sqrt(2 * depth * slope * travel)
        foot = travel - self.thickness_mm
        line = [[far, depth], [foot - (depth - low) / slope, depth], [foot, low]]
        return np.array([*line, [back, low]] if back > foot else line)


@dataclass(frozen=True, slots=True)
class Motion:
    """All steps of a test, cut so that every photograph lies between two steps.

    Attributes
    ----------
    u_mm, du_mm, beta_deg, outcrop_x_mm : (K,) float64
        Blade displacement before each step, its advance, the band's inclination and outcrop.
    surfaces : tuple of (M, 2) float64, mm
        Free surface ahead of the blade: before the first step, then after each (K + 1).
    frame_steps : (F,) int64
        Steps done when each photograph was taken.
    trench : Trench
    rounding_mm : float
        How far the surfaces may be off the model's.
    """

    u_mm: Floats
    du_mm: Floats
    beta_deg: Floats
    outcrop_x_mm: Floats
    surfaces: tuple[Floats, ...]
    frame_steps: NDArray[np.int64]
    trench: Trench
    rounding_mm: float = ROUNDING_MM

    @property
    def skin_mm(self) -> float:
        """Sand has avalanched when it stands this far above the surface: twice the surface's rounding."""
        return 2 * self.rounding_mm

    def __len__(self) -> int:
        return len(self.u_mm)

    def step(self, k: int, points_mm: Floats) -> Bools:
        """Move ``points_mm`` ((N, 2), in place) through step ``k``; (N,) bool: avalanched or swept."""
        gone = np.zeros(len(points_mm), dtype=np.bool_)
        u, du = float(self.u_mm[k]), float(self.du_mm[k])
        slope = math.tan(math.radians(float(self.beta_deg[k])))
        ahead, behind = self.surfaces[k + 1], self.trench.profile(u + du)
        _step(
            points_mm,
            gone,
            np.array([u, du, slope, float(self.outcrop_x_mm[k]), self.trench.thickness_mm, self.skin_mm]),
            np.ascontiguousarray(ahead.T),
            np.ascontiguousarray(behind.T),
        )
        return gone

    def positions(self, points_mm: Floats) -> Floats:
        """Material points through the photographs: (N, 2) mm before motion to (F, N, 2), NaN once gone."""
        points = np.array(points_mm, dtype=np.float64).reshape(-1, 2)
        frames = np.empty((len(self.frame_steps), *points.shape))
        done = 0
        for frame, steps in enumerate(self.frame_steps):
            for k in range(done, int(steps)):
                points[self.step(k, points)] = np.nan
            done = int(steps)
            frames[frame] = points
        return frames

    def risen_ahead(self, k: int) -> tuple[Floats, Floats]:
        """Surface ahead of the blade after the block's motion of step ``k`` and after its avalanche."""
        shift = np.array([1.0, math.tan(math.radians(float(self.beta_deg[k])))]) * self.du_mm[k]
        before, after = self.surfaces[k], self.surfaces[k + 1]
        outcrop = float(self.outcrop_x_mm[k])
        edge = np.array([[outcrop, np.interp(outcrop, *before.T)]])
        block = np.vstack([before[before[:, 0] < outcrop], edge]) + shift
        end = outcrop + shift[0]
        foot = np.array([[end, np.interp(end, *before.T)]])
        return np.vstack([block, foot, before[before[:, 0] > end]]), after

    def risen_behind(self, k: int) -> tuple[Floats, Floats]:
        """Surface behind the blade before step ``k``, with the floor laid bare, and after it."""
        u, du = float(self.u_mm[k]), float(self.du_mm[k])
        back = u - self.trench.thickness_mm
        floor = np.array([[back, 0.0], [back + du, 0.0]])
        return np.vstack([self.trench.profile(u), floor]), self.trench.profile(u + du)


def plan_motion(
    increments: Iterable[Increment],
    surface_at: Callable[[float], Floats],
    frames_u_mm: Sequence[float] | Floats,
    trench: Trench,
    *,
    rounding_mm: float = ROUNDING_MM,
) -> Motion:
    """Cut a model's increments at the photographs and round the surfaces.

    Parameters
    ----------
    increments : iterable of Increment
        In order of displacement, without gaps.
    surface_at : callable
        Free surface (M, 2) at any displacement, mm: ``History.surface``.
    frames_u_mm : (F,) float, mm
        Blade displacement of each photograph, ascending.
    trench : Trench
        The bed behind the blade.
    rounding_mm : float, mm
        How far the surfaces may be simplified.
    """
    frames = np.asarray(frames_u_mm, dtype=np.float64)
    rows: list[tuple[float, float, float, float]] = []
    surfaces = [simplify(surface_at(0.0), rounding_mm)]
    for item in increments:
        start, end = item.u_mm, item.u_mm + item.du_mm
        if start >= frames[-1] - _TOUCH_MM:
            break
        cuts = frames[(frames > start + _TOUCH_MM) & (frames < end - _TOUCH_MM)]
        for a, b in itertools.pairwise([start, *(float(c) for c in cuts), end]):
            if a >= frames[-1] - _TOUCH_MM:
                break
            rows.append((a, b - a, item.beta_deg, item.outcrop_x_mm))
            surfaces.append(simplify(item.surface if b == end else surface_at(b), rounding_mm))
    u, du, beta, outcrop = np.array(rows, dtype=np.float64).reshape(-1, 4).T.copy()
    steps = np.searchsorted(u, frames - _TOUCH_MM).astype(np.int64)
    return Motion(u, du, beta, outcrop, tuple(surfaces), steps, trench, rounding_mm)


def simplify(surface_mm: Floats, rounding_mm: float) -> Floats:
    """The same polyline to within ``rounding_mm`` with fewer nodes (Douglas and Peucker 1973)."""
    from skimage.measure import approximate_polygon  # slow to import, needed only here

    line = np.asarray(surface_mm, dtype=np.float64)
    nodes: Floats = approximate_polygon(line, rounding_mm)  # type: ignore[no-untyped-call]
    digits = math.ceil(2 - math.log10(rounding_mm))
    return nodes.round(digits)


def pour(where: Floats, before: Floats, after: Floats) -> Floats:
    """Points in the area between two surfaces where it rose.

    Parameters
    ----------
    where : (N, 2) float64 in [0, 1)
        Share of the risen area on the left of each point, and its height between the surfaces.
    before, after : (M, 2) float64, mm
        The surface before and after, as polylines with ascending x.

    Returns
    -------
    (N, 2) float64, mm
        Along the last stretch of ``after`` where nothing rose.
    """
    edges = _rising_stretch(before, after)
    if edges is None:
        x = after[-2, 0] + where[:, 0] * (after[-1, 0] - after[-2, 0])
        return np.column_stack([x, np.interp(x, *after.T)])
    middle = (edges[1:] + edges[:-1]) / 2
    gain = np.maximum(np.interp(middle, *after.T) - np.interp(middle, *before.T), 0.0)
    share = np.concatenate([[0.0], np.cumsum(gain)]) / gain.sum()
    x = np.interp(where[:, 0], share, edges)
    low, high = np.interp(x, *before.T), np.interp(x, *after.T)
    return np.column_stack([x, low + where[:, 1] * np.maximum(high - low, 0.0)])


def _rising_stretch(before: Floats, after: Floats) -> Floats | None:
    """Edges of equal cells over the stretch in which the surface rose; None where it rose nowhere."""
    nodes = np.unique(np.concatenate([before[:, 0], after[:, 0]]))
    nodes = nodes[(nodes >= max(before[0, 0], after[0, 0])) & (nodes <= min(before[-1, 0], after[-1, 0]))]
    middle = (nodes[1:] + nodes[:-1]) / 2
    rose = np.flatnonzero(np.interp(middle, *after.T) > np.interp(middle, *before.T) + 1e-9)
    return np.linspace(nodes[rose[0]], nodes[rose[-1] + 1], _CELLS + 1) if len(rose) else None


@njit(cache=True, nogil=True)
def _height(x: float, line: Floats) -> float:  # pragma: no cover
    """Height of a polyline (2, M) at x, constant beyond its ends."""
    last = line.shape[1] - 1
    if x <= line[0, 0]:
        return float(line[1, 0])
    if x >= line[0, last]:
        return float(line[1, last])
    low, high = 0, last
    while high - low > 1:
        middle = (low + high) // 2
        if line[0, middle] <= x:
            low = middle
        else:
            high = middle
    part = (x - line[0, low]) / (line[0, high] - line[0, low])
    return float(line[1, low] + part * (line[1, high] - line[1, low]))


@njit(cache=True, nogil=True)
def _step(
    points: Floats, gone: Bools, step: Floats, ahead: Floats, behind: Floats
) -> None:  # pragma: no cover
    u, du, slope, outcrop, thickness, skin = step
    face = u + du
    back = face - thickness
    lowest_ahead, lowest_behind = ahead[1].min() + skin, behind[1].min() + skin
    for i in range(points.shape[0]):
        x, y = points[i, 0], points[i, 1]
        if u - _TOUCH_MM <= x < outcrop and y > (x - u) * slope:
            x += du
            y += du * slope
            points[i, 0] = x
            points[i, 1] = y
        if x >= face - _TOUCH_MM:
            gone[i] = y > lowest_ahead and y > _height(x, ahead) + skin
        elif x > back:
            gone[i] = y > 0.0
        else:
            gone[i] = y > lowest_behind and y > _height(x, behind) + skin
