"""Material points and tracer layers carried through a march (docs/theory-model-march.md, section 8)."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd
from numba import njit
from numpy.typing import NDArray

from ploughval.axes import LAYER_COLUMNS
from ploughval.model.bent_motion import velocities
from ploughval.model.law import Law
from ploughval.model.march import March
from ploughval.model.surface import height_at

if TYPE_CHECKING:
    from ploughval.model.collapse import History

Floats = NDArray[np.float64]

POINTS_PER_DEPTH = 30  # material points followed on a layer
TORN = 4.0  # neighbours that have come apart to so many times their first distance bound a tear


def carry(
    points: Floats, marched: March, law: Law, span: tuple[float, float, int], partial: Floats, slack: float
) -> None:
    """Move points (N, 2) in place over a span: from, to (displacements) and the increment of the second.

    Sand above the band and left of its outcrop moves with its block. What then stands higher than ``slack``
    above the surface at rest has avalanched and becomes NaN. ``partial`` (M, 2) is the surface at the end.
    """
    moving = np.ascontiguousarray(points.T)
    _carry(moving, marched, law.face, span, slack)
    px, py = moving
    top = np.interp(px, partial[:, 0], partial[:, 1])
    gone = (px >= partial[0, 0]) & (py > top + slack)
    points[:, 0] = np.where(gone, np.nan, px)
    points[:, 1] = np.where(gone, np.nan, py)


@njit(cache=True, nogil=True)
def _carry(moving: Floats, marched: March, face: float, span: tuple[float, float, int], slack: float) -> None:
    px, py, rows, ends, pool = moving[0], moving[1], marched.rows, marched.ends, marched.pool
    start, stop, last = span
    for k in range(min(last + 1, rows.shape[0] - 1)):
        u, du = rows[k, 0], rows[k, 1]
        move = min(u + du, stop) - max(u, start)
        if u + du <= start or move <= 0.0:
            continue
        x, y = pool[0, ends[k, 1] : ends[k + 1, 0]], pool[1, ends[k, 1] : ends[k + 1, 0]]
        whole = u + du <= stop
        before = max(u, start) - u
        now = u + before + move
        bands = bands_of(rows[k], pool[1, ends[k - 1, 1] if k > 0 else 0])
        for i in range(px.size):
            if np.isnan(px[i]):
                continue
            # a point that rode with this increment's block before `start` is judged where it came from
            if px[i] - face * py[i] - before >= u - slack:
                forward, up = velocity(px[i], py[i], before, bands)
                px[i] += move * forward
                py[i] += move * up
                if forward > 0.0 and bands.joint_x > u:
                    px[i] = max(px[i], now)  # the face overtakes sand of block 2 at its top
            if whole and px[i] >= x[0] and py[i] > height_at(x, y, x.size, px[i]) + slack:
                px[i] = np.nan
                py[i] = np.nan


class Bands(NamedTuple):
    """Tip, top of the face, joint and outcrop of an increment; slopes of its bands; pace of block 2."""

    tip: float
    face_top: float
    joint_x: float
    joint_y: float
    outcrop: float
    lower: float
    upper: float
    forward: float


@njit(cache=True, nogil=True)
def bands_of(row: Floats, face_top: float) -> Bands:
    """The bands of a row of the march."""
    joint, outcrop = (row[8], row[9]), (row[4], row[5])
    lower, upper, _ = velocities(row[0], face_top, joint, outcrop)
    return Bands(row[0], face_top, joint[0], joint[1], outcrop[0], lower, upper, row[10])


@njit(cache=True, nogil=True)
def velocity(x: float, y: float, before: float, bands: Bands) -> tuple[float, float]:
    """Velocity, for 1 of the blade's, of a point that has moved through ``before`` of an increment."""
    behind, below = bands.forward, bands.forward * bands.upper
    if block_at(x - before * behind, y - before * below, bands) == 2:
        return behind, below
    if block_at(x - before, y - before * bands.lower, bands) == 1:
        return 1.0, bands.lower
    return 0.0, 0.0


@njit(cache=True, nogil=True)
def block_at(x: float, y: float, bands: Bands) -> int:
    """The block in which a place lies: 1 at the face, 2 at the outcrop (the only one of one), 0 at rest."""
    ahead = x - bands.joint_x
    if x >= bands.outcrop or y - bands.joint_y <= ahead * (bands.upper if ahead >= 0.0 else bands.lower):
        return 0
    across = (bands.face_top - bands.joint_y) * ahead + (bands.joint_x - bands.tip) * (y - bands.joint_y)
    return 1 if bands.joint_x > bands.tip and across < 0.0 else 2


def layer_table(
    history: "History", heights_mm: Sequence[float], u_mm: Floats, frames: NDArray[np.int64]
) -> pd.DataFrame:
    """Layers as a DataFrame of LAYER_COLUMNS; see :meth:`History.layers`."""
    spacing = history.depth_mm / POINTS_PER_DEPTH
    lines = [_line(history, height, spacing) for height in heights_mm]
    gaps = [TORN * np.diff(line[:, 0]) for line in lines]
    std = float(np.median(history.marched.rows[:-1, 1])) / np.sqrt(
        12.0
    )  # where in an increment a point joined
    pieces, before = [], 0.0
    for k in np.argsort(u_mm, kind="stable"):
        here = u_mm[k]
        reached = bool(np.isfinite(here) and here <= history.end_mm * (1.0 + 1e-9))
        if reached:
            lines = [history.advect(line, before, here) for line in lines]
            before = here
        for height, line, gap in zip(heights_mm, lines, gaps, strict=True):
            shown = _broken(line, gap) if reached else np.full((1, 2), np.nan)
            pieces.append((frames[k], here, float(height), shown))
    counts = [len(piece[3]) for piece in pieces]
    frame, u, layer = (np.repeat([piece[n] for piece in pieces], counts) for n in range(3))
    xy = np.concatenate([piece[3] for piece in pieces]) if pieces else np.empty((0, 2))
    errors = np.where(np.isnan(xy[:, 0]), np.nan, std)
    columns = (frame, u, layer, np.full(len(xy), "model"), xy[:, 0], xy[:, 1], errors)
    return pd.DataFrame(dict(zip(LAYER_COLUMNS, columns, strict=True)))


def _line(history: "History", height: float, spacing: float) -> Floats:
    """Material points (N, 2) at one height in the sand, from the blade to the end of the surface.

    Two depths past the furthest outcrop nothing moves: one last point stands for the rest.
    """
    surface = history.increments.surface_before(0)
    reach = min(float(history.marched.rows[:, 4].max()) + 2.0 * history.depth_mm, surface[-1, 0])
    x = np.append(np.arange(history.law.face * height, reach, spacing), surface[-1, 0])
    x = x[np.interp(x, surface[:, 0], surface[:, 1]) >= height]
    return np.column_stack([x, np.full_like(x, height)])


def _broken(line: Floats, gap: Floats) -> Floats:
    """The line (N, 2) with one row of NaN where neighbours are more than ``gap`` (N - 1,) apart or gone."""
    step = np.hypot(*np.diff(line, axis=0).T)
    torn = np.flatnonzero(step > gap) + 1
    line = np.insert(line, torn, np.nan, axis=0)
    empty = np.isnan(line[:, 0])
    repeated = empty & np.append(False, empty[:-1])
    return np.asarray(line[~repeated])
