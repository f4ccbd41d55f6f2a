"""Metrics of tracer layers and free surface: normal distances of measured points from predicted lines."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.compare.case import Case
from ploughval.compare.lines.distances import Distances, line_distances, rms, surface_as_layer
from ploughval.compare.validation import NAN, Metric, distance

if TYPE_CHECKING:
    from ploughval.model import History

Floats = NDArray[np.float64]
_STAGES = 5  # frames at which the inputs' effect on the lines is read


def _frames(table: pd.DataFrame, end_mm: float) -> tuple[pd.DataFrame, NDArray[np.int64], Floats]:
    """Rows of a measured table that the model's travel covers, its frames and their travel."""
    inside = table[(table["u_mm"] >= 0) & (table["u_mm"] <= end_mm)]
    stages = inside.drop_duplicates("frame").sort_values("frame", kind="stable")
    return inside, stages["frame"].to_numpy(dtype=np.int64), stages["u_mm"].to_numpy(dtype=np.float64)


def layer_metrics(case: Case, measured: pd.DataFrame) -> tuple[list[Metric], pd.DataFrame | None]:
    """Compare measured with predicted tracer layers.

    Parameters
    ----------
    case : Case
        The model's side.
    measured : DataFrame
        LAYER_COLUMNS.

    Returns
    -------
    metrics : list of Metric
    table : DataFrame or None
        DISTANCE_COLUMNS, a row a frame and layer; None without a frame that the model reaches.
    """
    history = case.history
    inside, frames, u = _frames(measured, float(history.force["u_mm"].iloc[-1]))
    if not len(frames):
        return [], None
    heights = tuple(float(h) for h in sorted(inside["layer"].dropna().unique()))
    found = line_distances(inside, history.layers(heights, u, frames))

    def lines(one: "History", picked: NDArray[np.int64]) -> pd.DataFrame:
        return pd.DataFrame(one.layers(heights, u[picked], frames[picked]))

    return _line_metrics(case, "layers", found, len(frames), lines), found.table


def surface_metrics(case: Case, measured: pd.DataFrame) -> list[Metric]:
    """Compare the measured (SURFACE_COLUMNS) with the predicted free surface."""
    inside, frames, u = _frames(measured, float(case.history.force["u_mm"].iloc[-1]))
    if not len(frames):
        return []
    inside = surface_as_layer(inside)

    def lines(one: "History", picked: NDArray[np.int64]) -> pd.DataFrame:
        parts = []
        end = float(one.force["u_mm"].iloc[-1])
        for k in picked[u[picked] <= end]:
            line = np.asarray(one.surface(float(u[k])), dtype=np.float64)
            parts.append(
                pd.DataFrame({"frame": frames[k], "u_mm": u[k], "x_mm": line[:, 0], "y_mm": line[:, 1]})
            )
        empty = pd.DataFrame(columns=["frame", "u_mm", "x_mm", "y_mm"], dtype=np.float64)
        return surface_as_layer(pd.concat(parts, ignore_index=True) if parts else empty)

    found = line_distances(inside, lines(case.history, np.arange(len(frames))))
    return _line_metrics(case, "surface", found, len(frames), lines)


def _line_metrics(
    case: Case,
    name: str,
    found: Distances,
    count: int,
    lines: Callable[["History", NDArray[np.int64]], pd.DataFrame],
) -> list[Metric]:
    """rms, median and 95 % of all points' distances, with what measurement and inputs explain of them."""
    d = found.distance_mm
    if d.size == 0:
        return []
    picked = np.unique(np.linspace(0, count - 1, min(_STAGES, count)).round().astype(np.int64))

    stated = lines(case.ensemble.centre, picked)
    drawn = [rms(line_distances(lines(one, picked), stated).distance_mm) for one in case.ensemble]
    beyond = int(found.table["beyond"].sum())
    note = f"normal distance of {d.size} points in {count} frames; {beyond} beyond the model's lines left out"
    values = (("rms", rms(d)), ("median", float(np.median(d))), ("p95", float(np.percentile(d, 95))))
    return [
        distance(
            f"{name}_{kind}_mm",
            value,
            experiment_std=rms(found.std_mm) if kind == "rms" else NAN,
            numerical_std=case.scene.model.tolerance * case.depth_mm if kind == "rms" else NAN,
            input_std=rms(np.array(drawn)) if drawn else 0.0,
            note=note,
        )
        for kind, value in values
    ]
