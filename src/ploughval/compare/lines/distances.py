"""Normal distance between measured tracer layers (or the free surface) and the model's lines."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Floats = NDArray[np.float64]
DISTANCE_COLUMNS = (
    "frame", "u_mm", "layer", "source", "points", "beyond", "rms_mm", "median_mm", "p95_mm", "std_mm",
)  # fmt: skip
_MOST_POINTS = 300  # of one line in one frame; more (dyed layers: one a pixel) are thinned evenly


@dataclass(frozen=True, slots=True)
class Distances:
    """Distances of many lines: a row a frame and layer, and all points together."""

    table: pd.DataFrame
    distance_mm: Floats
    std_mm: Floats


def polyline_distance(points_mm: Floats, line_mm: Floats) -> Floats:
    """Distance of points from a polyline, along its normal or to its nearest corner.

    Parameters
    ----------
    points_mm : (N, 2) float
        All finite.
    line_mm : (M, 2) float
        Rows of NaN tear the line: no segment spans them.

    Returns
    -------
    (N,) float, mm
        NaN for points whose nearest place lies beyond the line's outermost ends, where there is no normal,
        and everywhere where the line has no segment.
    """
    start, end = _segments(line_mm)
    if not len(start):
        return np.full(len(points_mm), np.nan)
    along = end - start
    length2 = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
    offset = points_mm[:, None, :] - start
    part = np.einsum("nmk,mk->nm", offset, along) / length2
    gap = offset - np.clip(part, 0.0, 1.0)[:, :, None] * along
    squared = np.einsum("nmk,nmk->nm", gap, gap)
    nearest = squared.argmin(axis=1)
    rows = np.arange(len(points_mm))
    distance: Floats = np.sqrt(squared[rows, nearest])
    share = part[rows, nearest]
    slack = 1e-9
    beyond = ((nearest == 0) & (share < -slack)) | ((nearest == len(start) - 1) & (share > 1 + slack))
    distance[beyond] = np.nan
    return distance


def _segments(line_mm: Floats) -> tuple[Floats, Floats]:
    """Starts and ends of the segments between neighbours; a vertex alone between tears is one too."""
    known: NDArray[np.bool_] = np.asarray(np.isfinite(line_mm).all(axis=1))
    joined = known[:-1] & known[1:]
    alone = known & ~np.append(joined, False) & ~np.append(False, joined)
    first = np.flatnonzero(np.append(joined, False) | alone)
    return line_mm[first], line_mm[np.where(alone[first], first, first + 1)]


def line_distances(measured: pd.DataFrame, model: pd.DataFrame) -> Distances:
    """Distances of measured lines from the model's, frame by frame and layer by layer.

    Parameters
    ----------
    measured : DataFrame
        LAYER_COLUMNS; of a layer that both tracks and dye show in a frame the tracks are taken.
    model : DataFrame
        LAYER_COLUMNS for the same frames.
    """
    lines = {key: part for key, part in model.groupby([model["frame"], model["layer"].round(6)], sort=False)}
    rows, all_distances, all_stds = [], [], []
    for (frame, layer), part in measured.groupby([measured["frame"], measured["layer"].round(6)], sort=True):
        tracked = part[part["source"] == "tracks"]
        known = tracked[["x_mm", "y_mm"]].notna().all(axis=1).any()
        used = tracked if known else part[part["source"] != "tracks"]
        points = used[["x_mm", "y_mm", "std_mm"]].to_numpy(dtype=np.float64)
        points = points[np.isfinite(points[:, :2]).all(axis=1)]
        line = lines.get((frame, layer))
        if not len(points) or line is None:
            continue
        if len(points) > _MOST_POINTS:
            points = points[np.linspace(0, len(points) - 1, _MOST_POINTS).round().astype(int)]
        distance = polyline_distance(points[:, :2], line[["x_mm", "y_mm"]].to_numpy(dtype=np.float64))
        met = np.isfinite(distance)
        d, std = distance[met], points[met, 2]
        u = float(used["u_mm"].iloc[0])
        rows.append(
            (frame, u, layer, used["source"].iloc[0], d.size, int((~met).sum()), *_summary(d), rms(std))
        )
        all_distances.append(d)
        all_stds.append(std)
    table = pd.DataFrame(rows, columns=list(DISTANCE_COLUMNS))
    return Distances(table, _joined(all_distances), _joined(all_stds))


def surface_as_layer(surface: pd.DataFrame) -> pd.DataFrame:
    """The measured free surface as one layer (height NaN-free: 0), so that it is compared like the others."""
    return surface.assign(layer=0.0, source="tracks", std_mm=np.nan)


def rms(values: Floats) -> float:
    """Root mean square of the finite values; NaN without any."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def _summary(distance: Floats) -> tuple[float, float, float]:
    if distance.size == 0:
        return (float("nan"),) * 3
    return rms(distance), float(np.median(distance)), float(np.percentile(distance, 95))


def _joined(parts: list[Floats]) -> Floats:
    return np.concatenate(parts) if parts else np.empty(0)
