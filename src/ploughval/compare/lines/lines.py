"""Tables of layers and surfaces as lines, one a frame and layer."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Key = tuple[int, float]  # frame, and the layer's initial height in mm
_MOST_POINTS = 300  # of one line in one frame; more (dyed layers: one a pixel) are thinned evenly


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A measured line in one frame.

    Attributes
    ----------
    key : (int, float)
        Frame, and initial height of the layer above the tip, mm.
    u_mm : float
        Travel of the blade.
    source : str
        tracks or dye.
    points_mm : (N, 2) float
        Finite points in order, thinned where there are very many.
    std_mm, calibration_std_mm : (N,) float
        Standard uncertainty of each point of its own, and what the calibration leaves open of its place
        (0: not known).
    length_mm : (N,) float
        Length of line that each point stands for.
    whole_mm : (M, 2) float
        All points, rows of NaN where the line is torn.
    """

    key: Key
    u_mm: float
    source: str
    points_mm: Floats
    std_mm: Floats
    calibration_std_mm: Floats
    length_mm: Floats
    whole_mm: Floats


def measured_lines(table: pd.DataFrame) -> Iterator[Line]:
    """Lines of a measured table in order of frame and layer.

    Parameters
    ----------
    table : DataFrame
        LAYER_COLUMNS, with ``calibration_std_mm`` where that is known. Of a layer that both tracks and dye
        show in a frame the tracks are taken.

    Yields
    ------
    Line
    """
    values = table[["x_mm", "y_mm", "std_mm"]].to_numpy(dtype=np.float64)
    shared = np.zeros(len(table))
    if "calibration_std_mm" in table:
        shared = np.nan_to_num(table["calibration_std_mm"].to_numpy(dtype=np.float64))
    source, u_mm = table["source"].to_numpy(dtype=object), table["u_mm"].to_numpy(dtype=np.float64)
    for key, rows in grouped(table).items():
        tracked = rows[source[rows] == "tracks"]
        known = tracked.size > 0 and np.isfinite(values[tracked, :2]).all(axis=1).any()
        used = tracked if known else rows[source[rows] != "tracks"]
        finite = np.isfinite(values[used, :2]).all(axis=1)
        if not finite.any():
            continue
        whole = np.ascontiguousarray(values[used, :2])
        length, picked = lengths(whole)[finite], used[finite]
        total = length.sum()
        if picked.size > _MOST_POINTS:
            thin = np.linspace(0, picked.size - 1, _MOST_POINTS).round().astype(np.int64)
            picked, length = picked[thin], length[thin]
            length = length * (total / length.sum()) if length.sum() > 0 else length
        yield Line(
            key=key,
            u_mm=float(u_mm[used[0]]),
            source=str(source[used[0]]),
            points_mm=np.ascontiguousarray(values[picked, :2]),
            std_mm=values[picked, 2],
            calibration_std_mm=shared[picked],
            length_mm=length,
            whole_mm=whole,
        )


def grouped(table: pd.DataFrame) -> dict[Key, NDArray[np.int64]]:
    """Rows of each frame and layer, in the table's order, keys in order."""
    frame, layer = (
        table["frame"].to_numpy(dtype=np.float64),
        table["layer"].to_numpy(dtype=np.float64).round(6),
    )
    order = np.lexsort((layer, frame))
    change = np.flatnonzero((np.diff(frame[order]) != 0) | (np.diff(layer[order]) != 0)) + 1
    parts: Sequence[NDArray[np.int64]] = np.split(order, change) if len(order) else []
    return {(int(frame[rows[0]]), float(layer[rows[0]])): rows for rows in parts}


def model_lines(table: pd.DataFrame) -> dict[Key, Floats]:
    """Lines (M, 2) of a model's layers (LAYER_COLUMNS), by frame and layer."""
    xy = table[["x_mm", "y_mm"]].to_numpy(dtype=np.float64)
    return {key: np.ascontiguousarray(xy[rows]) for key, rows in grouped(table).items()}


def lengths(whole_mm: Floats) -> Floats:
    """Length (M,) of line that each point stands for: half-way to its neighbours within its piece."""
    step = np.nan_to_num(np.hypot(*np.diff(whole_mm, axis=0).T))
    return np.asarray(0.5 * (np.append(step, 0.0) + np.append(0.0, step)))
