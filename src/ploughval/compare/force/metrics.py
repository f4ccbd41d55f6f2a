"""Metrics of the force: scalars of both histories, and the histories against each other."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import pandas as pd

from ploughval.compare.case import Case, join_scalars
from ploughval.compare.force.curve import Curve, model_curve
from ploughval.compare.force.history import history_metrics
from ploughval.compare.force.peaks import Quantity, find_extremes, least_prominence
from ploughval.compare.force.scalars import REBOUND_DEPTHS, force_quantities
from ploughval.compare.validation import Metric

if TYPE_CHECKING:
    from ploughval.model import History


def force_metrics(case: Case, measured: Curve) -> tuple[list[Metric], pd.DataFrame]:
    """Compare the measured with the predicted force.

    Parameters
    ----------
    case : Case
        The model's side.
    measured : Curve
        The experiment's force.

    Returns
    -------
    metrics : list of Metric
    peaks : DataFrame
        source (experiment or model) and PEAK_COLUMNS.
    """
    history, depth = case.history, case.depth_mm
    P0 = float(history.P0_N * history.horizontal_share)

    def curve_of(one: "History") -> Curve:
        return model_curve(one.force, one.force_std_N, one.horizontal_share)

    model = curve_of(history)
    limit = min(measured.end_mm, model.end_mm)
    measured, model = measured.until(limit), model.until(limit)
    prominence = least_prominence(measured, P0, case.scene.compare.prominence)

    def extremes_of(curve: Curve) -> pd.DataFrame:
        return find_extremes(curve, prominence, rebound_mm=REBOUND_DEPTHS * depth)

    def values(one: "History") -> Mapping[str, Quantity]:
        curve = curve_of(one).until(limit)
        return force_quantities(curve, extremes_of(curve), depth, limit_mm=limit)

    extremes = {"experiment": extremes_of(measured), "model": extremes_of(model)}
    metrics = join_scalars(
        case,
        force_quantities(measured, extremes["experiment"], depth),
        values,
        f"over {limit:.4g} mm of travel",
    )
    curves = [curve_of(one) for one in case.ensemble]
    metrics += history_metrics(measured, model, extremes, curves, P0_N=P0, depth_mm=depth)
    tables = [table.assign(source=side) for side, table in extremes.items()]
    peaks = pd.concat(tables, ignore_index=True)
    return metrics, peaks[["source", *(name for name in peaks.columns if name != "source")]]
