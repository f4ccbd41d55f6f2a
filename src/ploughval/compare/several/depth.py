"""Effect of depth: scaled metrics against depth, and powers of depth, measured and predicted."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.several.groups import Group
from ploughval.compare.several.record import Record, Value
from ploughval.compare.several.repeats import measured_names
from ploughval.compare.several.straight import Line, fit_line

Floats = NDArray[np.float64]
Verdict = Literal["none", "predicted", "unpredicted", "unknown"]


@dataclass(frozen=True, slots=True)
class Trend:
    """One metric against depth over the tests of a series that differ in depth alone.

    Attributes
    ----------
    series : str
        Labels of its groups.
    metric : str
    scale : str
        What the metric was divided by; its own unit for nothing.
    unit : str
        Unit of the metric itself.
    tests : tuple of int
        Places of the tests that measured it.
    depth_mm, values, stds, models : (n,) float, mm and unit over scale
        Scaled metric of these tests; models NaN where nothing was predicted.
    measured, predicted : Line or None
        Straight lines over the logarithm of depth; the predicted one goes through the same tests with
        equal weights.
    beyond : Line or None
        Line through measurement minus prediction.
    power : Line or None
        Logarithm of the measured metric over that of depth, width and unit weight taken out: its slope
        is the power.
    predicted_power : float
        The same of the model; NaN where it cannot be had.
    scale_power : int
        Power that holds where the scaled metric does not depend on depth.
    verdict : {"none", "predicted", "unpredicted", "unknown"}
        Whether the scaled metric changes with depth at 95 %; if so, whether the model explains it.
    """

    series: str
    metric: str
    scale: str
    unit: str
    tests: tuple[int, ...]
    depth_mm: Floats
    values: Floats
    stds: Floats
    models: Floats
    measured: Line | None
    predicted: Line | None
    beyond: Line | None
    power: Line | None
    predicted_power: float
    scale_power: int
    verdict: Verdict


def depth_trends(series: Sequence[Group], records: Sequence[Record]) -> list[Trend]:
    """Trends of every metric over depth.

    Parameters
    ----------
    series : sequence of Group
        Groups that differ in depth alone.
    records : sequence of Record
        All tests.

    Returns
    -------
    list of Trend
        Metrics measured at two depths at least, of a unit that can be scaled.
    """
    places = sorted(place for group in series for place in group.members)
    label = ", ".join(group.label for group in series)
    found = []
    for name in measured_names([records[place] for place in places]):
        scaled = {place: records[place].scaled_metric(name) for place in places}
        known = {place: v for place, v in scaled.items() if v is not None and np.isfinite(v.experiment)}
        if len({round(records[place].depth_mm, 6) for place in known}) > 1:
            found.append(_trend(label, name, known, records))
    return found


def _trend(label: str, name: str, known: dict[int, Value], records: Sequence[Record]) -> Trend:
    places = tuple(known)
    depth = np.array([records[place].depth_mm for place in places])
    values, stds, models = (
        np.array([getattr(value, side) for value in known.values()], dtype=np.float64)
        for side in ("experiment", "experiment_std", "model")
    )
    original = records[places[0]].values[name]
    scale = records[places[0]].scale(original.unit)
    assert scale is not None  # only scaled values come here
    both = np.isfinite(models)
    at = np.log(depth)
    measured = fit_line(at, values, stds)
    predicted = fit_line(at[both], models[both], None) if both.any() else None
    beyond = fit_line(at[both], (values - models)[both], stds[both]) if both.any() else None
    return Trend(
        label, name, scale.words, original.unit, places, depth, values, stds, models,
        measured, predicted, beyond, _power(depth, values, stds, scale.power),
        _predicted_power(depth, models, scale.power), scale.power, _verdict(measured, beyond),
    )  # fmt: skip


def _power(depth: Floats, values: Floats, stds: Floats, scale_power: int) -> Line | None:
    """Logarithm of value times d^scale_power over that of d."""
    if not np.all(values > 0):
        return None
    with np.errstate(over="ignore"):  # beyond all numbers is not stated
        relative = stds / values
    return fit_line(np.log(depth), np.log(values) + scale_power * np.log(depth), relative)


def _predicted_power(depth: Floats, models: Floats, scale_power: int) -> float:
    known = np.isfinite(models) & (models > 0)
    line = fit_line(np.log(depth[known]), np.log(models[known]), None) if known.any() else None
    return float("nan") if line is None else line.slope + scale_power


def _verdict(measured: Line | None, beyond: Line | None) -> Verdict:
    if measured is None or not measured.slope_low < measured.slope_high:  # NaN, or values all alike
        return "unknown"
    if measured.slope_low <= 0 <= measured.slope_high:
        return "none"
    if beyond is None or not np.isfinite(beyond.slope_low):
        return "unpredicted"
    return "predicted" if beyond.slope_low <= 0 <= beyond.slope_high else "unpredicted"
