"""Metrics of the force: scalars of both histories, their switches, and the histories against each other."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import pandas as pd

from ploughval.compare.case import Case, join_scalars
from ploughval.compare.force.curve import Curve, model_curve
from ploughval.compare.force.envelope import envelope_table
from ploughval.compare.force.history import common_histories, history_metrics
from ploughval.compare.force.initial import begins_late
from ploughval.compare.force.pairs import match_switches, pair_metrics, pair_table
from ploughval.compare.force.peaks import least_prominence, weak_prominence
from ploughval.compare.force.reading import Reading, read_force
from ploughval.compare.force.scalars import force_quantities
from ploughval.compare.quantity import Quantity
from ploughval.compare.validation import Metric

if TYPE_CHECKING:
    from ploughval.model import History

_OF_INITIAL = ("first_peak", "first_trough", "_P0")


class ForceComparison(NamedTuple):
    """Metrics of the force, and the tables behind them.

    Attributes
    ----------
    metrics : list of Metric
    peaks : DataFrame
        source (experiment or model) and PEAK_COLUMNS.
    pairs : DataFrame of PAIR_COLUMNS
        Switches of both sides that match.
    envelope : DataFrame of ENVELOPE_COLUMNS
        The model's force with what its inputs leave open.
    """

    metrics: list[Metric]
    peaks: pd.DataFrame
    pairs: pd.DataFrame
    envelope: pd.DataFrame


def compare_force(case: Case, measured_curve: Curve) -> ForceComparison:
    """Compare the measured with the predicted force.

    Parameters
    ----------
    case : Case
        The model's side.
    measured_curve : Curve
        The experiment's force.

    Returns
    -------
    ForceComparison
    """
    history, depth = case.history, case.depth_mm
    P0 = float(history.P0_N * history.horizontal_share)
    limit = min(measured_curve.end_mm, float(history.force["u_mm"].iloc[-1]))
    common = measured_curve.until(limit)
    prominence = least_prominence(common, P0, case.scene.compare.prominence)
    weak = weak_prominence(common, P0)

    begin = float(common.u_mm[0]) if begins_late(common, depth) else 0.0
    note = f"over {limit - begin:.4g} mm of travel" + (f" from {begin:.4g} mm on" if begin else "")
    if begin >= limit:
        start = float(measured_curve.u_mm[0])
        note = f"no travel in common: the record begins at {start:.4g} mm, the model ends at {limit:.4g} mm"

    def read(curve: Curve) -> Reading:
        return read_force(curve.until(limit), prominence, depth, weak_N=weak, begin_mm=begin)

    def of_model(one: "History") -> Reading:
        return read(model_curve(one.force, one.force_std_N, one.horizontal_share))

    measured, model = read(measured_curve), of_model(history)
    drawn = [of_model(one) for one in case.ensemble]
    runs = [
        (history, model),
        (case.ensemble.centre, of_model(case.ensemble.centre)),
        *zip(case.ensemble, drawn, strict=True),
    ]
    known = {id(one): reading for one, reading in runs}

    def values(one: "History") -> Mapping[str, Quantity]:
        return force_quantities(known[id(one)], depth, limit_mm=limit)

    scalars = join_scalars(case, force_quantities(measured, depth, limit_mm=limit), values, note)
    pairs = match_switches(measured, model, drawn, depth_mm=depth, tolerance=case.scene.model.tolerance)
    histories = common_histories(measured.curve, model.curve, [one.curve for one in drawn])
    metrics = [
        *(_with_reason(metric, measured) for metric in scalars),
        *pair_metrics(pairs, case.ensemble),
        *history_metrics(histories, measured, model, drawn, pairs, P0),
    ]
    tables = [one.extremes.assign(source=side) for side, one in (("experiment", measured), ("model", model))]
    peaks = pd.concat(tables, ignore_index=True)
    peaks = peaks[["source", *(name for name in peaks.columns if name != "source")]]
    return ForceComparison(metrics, peaks, pair_table(pairs, measured, model), envelope_table(histories))


def _with_reason(metric: Metric, measured: Reading) -> Metric:
    """How the measured initial force was read, in the notes of the metrics that rest on it."""
    if measured.initial.note and any(part in metric.name for part in _OF_INITIAL):
        return replace(metric, note=f"{metric.note}; measured: {measured.initial.note}")
    return metric
