"""Metrics of the friction that is read from the photographs and the force."""

import numpy as np
import pandas as pd

from ploughval.compare.case import Case
from ploughval.compare.softening.table import FrictionFindings
from ploughval.compare.validation import Metric, judge

_QUANTITIES = {
    "peak_deg": "peak_friction",
    "residual_deg": "residual_friction",
    "length_mm": "mobilization_length",
}


def friction_metrics(case: Case, mobilised: pd.DataFrame, found: FrictionFindings) -> list[Metric]:
    """Peak, residual and mobilization length read from the curves, against those that the model was given.

    Parameters
    ----------
    case : Case
        The model's side.
    mobilised : DataFrame
        MOBILISED_COLUMNS: friction in the photographs.
    found : FrictionFindings
        Curves between them, and what they tell.

    Returns
    -------
    list of Metric
        Those that the curves determine. The residual of frames long after the start of their band stands in
        for that of the curves where these tell none. A sand that was given one friction has no length.
    """
    soil, row = case.scene.soil, found.overall
    if soil is None:
        return []
    metrics = []
    for name, key in _QUANTITIES.items():
        quantity, unit = name.split("_")
        note = ""
        experiment = (np.nan, np.nan)
        if row is not None:
            experiment = (float(row[name]), float(row[f"{quantity}_std_{unit}"]))
            bands = "all bands" if row["band"] == "all" else f"band {row['band']}"
            note = f"softening line through {row['points']} points of {bands}"
        if not np.isfinite(experiment[0]) and quantity == "residual":
            experiment, note = _late(mobilised, soil.mobilization_length_mm)
        constant = soil.peak_friction_deg <= soil.residual_friction_deg
        if not np.isfinite(experiment[0]) or (constant and quantity == "length"):
            continue
        input_std = float(getattr(soil, f"{key}_std_{unit}"))
        metrics.append(
            judge(
                f"mobilised_{name}",
                experiment,
                (float(getattr(soil, f"{key}_{unit}")), 0.0),
                input_std=input_std,
                dominant_input=f"{key}_{unit}" if input_std else "",
                note=f"{note}; the model's is its input",
            )
        )
    return metrics


def unread_friction(case: Case) -> list[Metric]:
    """Metrics of a friction that is not read, before a blade that leans: NaN, and why.

    Parameters
    ----------
    case : Case
        The model's side.

    Returns
    -------
    list of Metric
        Those of :func:`friction_metrics`, without what was measured.
    """
    soil, lean = case.scene.soil, case.scene.blade.inclination_deg
    note = (
        f"not read: block and force of an upright blade are supposed, and this one leans by {lean:g} degrees"
    )
    metrics = []
    for name, key in _QUANTITIES.items():
        value = float(getattr(soil, f"{key}_{name.split('_')[1]}"))
        metrics.append(judge(f"mobilised_{name}", (np.nan, np.nan), (value, 0.0), note=note))
    return metrics


def _late(mobilised: pd.DataFrame, length_mm: float) -> tuple[tuple[float, float], str]:
    """Median friction, and its std, of frames with more slip than a length."""
    late = mobilised[(mobilised["status"] == "ok") & (mobilised["slip_mm"] > length_mm)]
    if not len(late):
        return (np.nan, np.nan), ""
    values = float(late["phi_deg"].median()), float(late["phi_std_deg"].median())
    return values, f"median of {len(late)} frames with more slip than the mobilization length"
