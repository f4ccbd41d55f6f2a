"""Two force histories against each other: rms, peak-aligned rms, and the area metric, in units of P0."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.compare.ensemble import std_about
from ploughval.compare.force.curve import Curve
from ploughval.compare.force.peaks import aligned_u, common_grid
from ploughval.compare.lines.distances import rms
from ploughval.compare.validation import NAN, Metric, area_metric, distance

Floats = NDArray[np.float64]
_FIRST_PEAK_DEPTHS = 0.5


def history_metrics(
    measured: Curve,
    model: Curve,
    extremes: Mapping[str, pd.DataFrame],
    drawn: Sequence[Curve],
    *,
    P0_N: float,
    depth_mm: float,
) -> list[Metric]:
    """Differences of the two curves over their common travel.

    Parameters
    ----------
    measured : Curve
        The experiment's, up to the common travel.
    model : Curve
        The model's, up to the common travel.
    extremes : mapping of "experiment" and "model" to DataFrame
        PEAK_COLUMNS of both.
    drawn : sequence of Curve
        The model's with drawn inputs.
    P0_N : float
        Force that normalises both, so that their ratio is kept.
    depth_mm : float
        Depth of the tip.
    """
    grid = common_grid(measured, model, min(measured.end_mm, model.end_mm))
    F_exp, s_exp = measured.at(grid)
    F_mod, s_num = model.at(grid)
    s_input = std_about(F_mod, np.array([one.at(grid)[0] for one in drawn]).reshape(-1, grid.size))
    s_mod = np.hypot(s_num, s_input)
    error = F_mod - F_exp
    sides = [rms(std) / P0_N for std in (s_exp, s_num, s_input)]
    note = f"both over the model's P0, over {grid[-1]:.4g} mm of travel"
    area = float(np.nanmean(area_metric(error, s_exp, s_mod)))
    metrics = [
        distance(
            "force_rms_P0",
            rms(error) / P0_N,
            experiment_std=sides[0],
            numerical_std=sides[1],
            input_std=sides[2],
            note=note,
        ),
        distance("area_validation_P0", area / P0_N, experiment_std=NAN, numerical_std=NAN, note=note),
    ]
    places = [_switches(extremes[side], depth_mm) for side in ("experiment", "model")]
    if not min(map(len, places)):
        return metrics
    same = aligned_u(grid, *places)
    aligned = model.at(same)[0] - F_exp
    note = f"model's travel stretched so that {min(map(len, places))} switches coincide"
    value = rms(aligned) / P0_N
    return [
        *metrics,
        distance("force_rms_aligned_P0", value, experiment_std=NAN, numerical_std=NAN, note=note),
    ]


def _switches(extremes: pd.DataFrame, depth_mm: float) -> Floats:
    """Travel at the peaks after the initial one."""
    peaks = extremes[(extremes["kind"] == "peak") & (extremes["u_mm"] > _FIRST_PEAK_DEPTHS * depth_mm)]
    return peaks["u_mm"].to_numpy(dtype=np.float64)
