"""The lines of every frame: layers and free surfaces, measured and predicted, and bands."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.report.figures.layers import Extent, Points
from ploughval.report.player.coding import pack_lines, pieces
from ploughval.report.player.frames import Moment
from ploughval.report.stages import outcrops
from ploughval.results import Results

TOLERANCE_MM = 0.02
WIDE_PX = 900  # of the part of the world shown; a tenth of a pixel is the tolerance where that is more

Floats = NDArray[np.float64]
Kept = dict[int, pd.DataFrame]


@dataclass(frozen=True, slots=True)
class FrameLines:
    """Lines of one frame, packed as :func:`ploughval.report.player.coding.pack_lines` does.

    Tags of layers count the layers of :class:`Lines`; bands are places (K, 2) of outcrops, mm.
    """

    layers: str
    model_layers: str
    surface: str
    model_surface: str
    band_mm: Points
    model_band_mm: Points


@dataclass(frozen=True, slots=True)
class Lines:
    """What the player draws: a list of layers (source, initial height in mm), and a frame each."""

    layers: tuple[tuple[str, float], ...]
    tolerance_mm: float
    frames: tuple[FrameLines, ...]


def tolerance_mm(extent: Extent) -> float:
    """How far a drawn line may be from the one of the results, mm."""
    return max(TOLERANCE_MM, 0.1 * (extent[1] - extent[0]) / WIDE_PX)


def frame_lines(results: Results, moments: Sequence[Moment], extent: Extent) -> Lines:
    """Lines of some frames, cut to what is shown and thinned to what can be seen.

    Parameters
    ----------
    results : Results
        Tables of layers, surfaces and bands.
    moments : sequence of Moment
        Frames of the player.
    extent : tuple of float, mm
        x0, x1, y0, y1: part of the world that is shown.
    """
    tables = (results.layers, results.model_layers)
    names = sorted({key for table in tables if table is not None for key in _keys(table)})
    tags = {key: tag for tag, key in enumerate(names)}
    measured, predicted = (_by_frame(table) for table in tables)
    surface, above = _by_frame(results.surface), _by_frame(results.model_surface)
    tolerance = tolerance_mm(extent)
    frames, nan = [], float("nan")
    for moment in moments:
        now, then = surface.get(moment.frame), above.get(moment.frame)
        frames.append(
            FrameLines(
                _layers(measured.get(moment.frame), tags, extent, tolerance),
                _layers(predicted.get(moment.frame), tags, extent, tolerance),
                _line(now, extent, tolerance),
                _line(then, extent, tolerance),
                # A photograph that was lost shows no band, whatever its neighbours do.
                _bands(results.bands, nan if moment.reason else moment.u_mm, now, results.increments),
                _bands(results.model_bands, moment.u_mm, then, results.model_force),
            )
        )
    return Lines(tuple(names), tolerance, tuple(frames))


def _keys(table: pd.DataFrame) -> set[tuple[str, float]]:
    pairs = table[["source", "layer"]].drop_duplicates()
    return {(str(source), float(height)) for source, height in pairs.itertuples(index=False)}


def _by_frame(table: pd.DataFrame | None) -> Kept:
    if table is None:
        return {}
    whole = table[table["frame"].notna()].astype({"frame": int})
    return {int(str(frame)): rows for frame, rows in whole.groupby("frame", sort=False)}


def _layers(
    rows: pd.DataFrame | None, tags: dict[tuple[str, float], int], extent: Extent, tolerance: float
) -> str:
    if rows is None:
        return ""
    source, height = rows["source"].to_numpy(), rows["layer"].to_numpy(float)
    points = rows[["x_mm", "y_mm"]].to_numpy(float)
    numbers = np.array([tags[str(s), float(h)] for s, h in zip(source, height, strict=True)])
    drawn = [
        (int(tag), part)
        for tag in dict.fromkeys(numbers.tolist())
        for part in _seen(points[numbers == tag], extent)
    ]
    return pack_lines(drawn, tolerance)


def _line(rows: pd.DataFrame | None, extent: Extent, tolerance: float) -> str:
    if rows is None:
        return ""
    points = rows[["x_mm", "y_mm"]].to_numpy(float)
    return pack_lines([(0, part) for part in _seen(points, extent)], tolerance)


def _seen(points: Floats, extent: Extent) -> list[Floats]:
    """The parts of a line that cross what is shown, each with a point beyond either end."""
    x0, x1, y0, y1 = extent
    found = []
    for part in pieces(points):
        x, y = part.T
        inside = (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
        # Both ends of a segment that may cross the picture stay.
        crossing = (
            (np.minimum(x[:-1], x[1:]) <= x1)
            & (np.maximum(x[:-1], x[1:]) >= x0)
            & (np.minimum(y[:-1], y[1:]) <= y1)
            & (np.maximum(y[:-1], y[1:]) >= y0)
        )
        inside[:-1] |= crossing
        inside[1:] |= crossing
        gaps = np.where(inside[:, np.newaxis], part, np.nan)
        found += pieces(gaps)
    return found


def _bands(
    bands: pd.DataFrame | None, u_mm: float, surface: pd.DataFrame | None, history: pd.DataFrame | None
) -> Points:
    if not np.isfinite(u_mm) or (bands is None and history is None):
        return np.empty((0, 2))
    ends = outcrops(bands, u_mm, surface=surface, history=history)
    return ends[np.isfinite(ends).all(axis=1)]
