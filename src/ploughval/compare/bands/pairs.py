"""Differences of matched bands: each with its uncertainties, and over all pairs."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ploughval.compare.bands.matching import numbered
from ploughval.compare.bands.observed import QUANTITIES, Floats
from ploughval.compare.case import Case, judge_spread
from ploughval.compare.ensemble import NO_SPREAD
from ploughval.compare.quantity import Quantity
from ploughval.compare.validation import Metric, distance

if TYPE_CHECKING:
    from ploughval.model import History

Predicted = Callable[["History"], pd.DataFrame]
_NAMES = {
    "u_start_mm": "start", "u_end_mm": "end", "life_mm": "life", "beta_deg": "beta",
    "outcrop_x_mm": "outcrop", "ahead_mm": "ahead", "slip_mm": "slip", "start_spacing_mm": "start_spacing",
    "outcrop_spacing_mm": "outcrop_spacing",
}  # fmt: skip
_ENDINGS = ("experiment", "model", "difference", "validation_std")
PAIR_COLUMNS = (
    "band_experiment", "band_model", "complete_experiment", "complete_model", "joined_experiment",
    *(f"{name}_{ending}" for name in QUANTITIES for ending in _ENDINGS),
)  # fmt: skip
_CHAINED = {  # lengths between places, each the end of one and the start of the next
    "start_spacing_mm": "u_start_mm", "life_mm": "u_start_mm", "outcrop_spacing_mm": "outcrop_x_mm",
}  # fmt: skip
_SAME_MM = 1e-6
_PLACES = ("outcrop_x_mm", "ahead_mm")  # what the calibration's error moves as a whole


def judged_pairs(case: Case, pairs: pd.DataFrame, predicted: Predicted) -> pd.DataFrame:
    """Add to each pair the differences, and what measurement, inputs and numerics leave open of them.

    Parameters
    ----------
    case : Case
        The model's side.
    pairs : DataFrame
        As ``match_bands`` gives it.
    predicted : callable
        The bands of a model run, as ``observe`` gives them.

    Returns
    -------
    DataFrame
        Also, for each of the QUANTITIES, ``_difference`` (model minus experiment), ``_input_std``,
        ``_numerical_std`` and ``_validation_std``; NaN where a side does not have it.
    """
    number = _numbers(pairs, predicted(case.history))
    spreads = case.ensemble.spread(lambda one: numbered(predicted(one)))
    added: dict[str, Floats] = {}
    for name in QUANTITIES:
        model = pairs[f"{name}_model"].to_numpy(dtype=np.float64)
        difference = model - pairs[f"{name}_experiment"].to_numpy(dtype=np.float64)
        inputs = [spreads.get(f"{name}/{k}", NO_SPREAD).std if k >= 0 else np.nan for k in number]
        numerical = _numerical(case, name, pairs)
        parts = (_experiment_std(name, pairs), np.array(inputs, dtype=np.float64), numerical)
        known = np.isfinite(difference)
        added[f"{name}_difference"] = difference
        added[f"{name}_input_std"] = np.where(known, parts[1], np.nan)
        added[f"{name}_numerical_std"] = np.where(known, numerical, np.nan)
        added[f"{name}_validation_std"] = np.where(known, np.sqrt(sum(part**2 for part in parts)), np.nan)
    return pairs.assign(**added)


def pair_table(pairs: pd.DataFrame) -> pd.DataFrame:
    """What of the pairs is written: PAIR_COLUMNS.

    Parameters
    ----------
    pairs : DataFrame
        As ``judged_pairs`` gives it.

    Returns
    -------
    DataFrame
        Bands and whether their ends were seen, and of each of the QUANTITIES both sides, the difference and
        its standard uncertainty.
    """
    return pairs[list(PAIR_COLUMNS)]


def pair_metrics(case: Case, pairs: pd.DataFrame, predicted: Predicted, interval_mm: float) -> list[Metric]:
    """Mean and rms difference of every quantity over the pairs that have it on both sides.

    Parameters
    ----------
    case : Case
        The model's side.
    pairs : DataFrame
        As ``judged_pairs`` gives it.
    predicted : callable
        The bands of a model run, as ``observe`` gives them.
    interval_mm : float
        Travel between photographs: a band that starts within it of the first motion starts by definition.

    Returns
    -------
    list of Metric
        ``band_..._mean`` (mean of both sides over the pairs) and, for two pairs or more, ``band_..._rms``.
    """
    number = _numbers(pairs, predicted(case.history))
    chosen = {name: _chosen(name, pairs, interval_mm) for name in QUANTITIES}

    def means(one: "History") -> Mapping[str, float]:
        table = predicted(one)
        found = {}
        for name, rows in chosen.items():
            places = [number[k] for k in rows]
            have = bool(places) and max(places) < len(table)
            found[name] = float(table[name].to_numpy(float)[places].mean()) if have else float("nan")
        return found

    spreads = case.ensemble.spread(means)
    metrics = []
    for name, rows in chosen.items():
        if not rows:
            continue
        part = pairs.iloc[rows]
        count, unit = len(rows), name.rsplit("_", 1)[1]
        experiment = Quantity(float(part[f"{name}_experiment"].mean()), _mean_std(name, part))
        model = float(part[f"{name}_model"].mean()), float(part[f"{name}_numerical_std"].mean())
        note = f"mean of {count} matched bands" if count > 1 else "the one matched band that has it"
        metrics.append(
            judge_spread(f"band_{_NAMES[name]}_mean_{unit}", experiment, model, spreads[name], note)
        )
        if count > 1:
            metrics.append(_rms_metric(name, part, f"band_{_NAMES[name]}_rms_{unit}", spreads[name].remark))
    return metrics


def _rms_metric(name: str, part: pd.DataFrame, metric: str, remark: str) -> Metric:
    stds = (_experiment_std(name, part), part[f"{name}_numerical_std"], part[f"{name}_input_std"])
    experiment, numerical, inputs = (float(np.sqrt(np.mean(np.asarray(std) ** 2))) for std in stds)
    return distance(
        metric,
        float(np.sqrt((part[f"{name}_difference"] ** 2).mean())),
        experiment_std=experiment,
        numerical_std=numerical,
        input_std=inputs,
        note=f"differences of {len(part)} matched bands, model minus experiment{remark}",
    )


def _chosen(name: str, pairs: pd.DataFrame, interval_mm: float) -> list[int]:
    """Rows of the pairs whose difference says something of a quantity."""
    known = pairs[f"{name}_difference"].notna().to_numpy()
    if name == "u_start_mm":
        known = (
            known
            & (
                pairs[["u_start_mm_experiment", "u_start_mm_model"]].abs().max(axis=1) > interval_mm
            ).to_numpy()
        )
    return [int(k) for k in np.flatnonzero(known)]


def _numbers(pairs: pd.DataFrame, model: pd.DataFrame) -> list[int]:
    """Place of each pair's predicted band among the model's; -1 for none."""
    place = {float(band): k for k, band in enumerate(model["band"])}
    return [place.get(float(band), -1) for band in pairs["band_model"]]


def _numerical(case: Case, name: str, pairs: pd.DataFrame) -> Floats:
    """The model's own numerical uncertainty, or the tolerance's share of the value."""
    own = np.nan_to_num(pairs[f"{name}_std_model"].to_numpy(dtype=np.float64))
    return np.asarray(
        np.maximum(own, case.scene.model.tolerance * pairs[f"{name}_model"].abs().to_numpy(float))
    )


def _experiment_std(name: str, pairs: pd.DataFrame) -> Floats:
    own = pairs[f"{name}_std_experiment"].to_numpy(dtype=np.float64)
    return np.asarray(np.hypot(own, _shared_std(name, pairs)))


def _shared_std(name: str, pairs: pd.DataFrame) -> Floats:
    """The calibration's part, alike for all bands of a test: its error moves all places as one."""
    if name not in _PLACES:
        return np.zeros(len(pairs))
    return np.asarray(np.nan_to_num(pairs["calibration_std_mm_experiment"].to_numpy(dtype=np.float64)))


def _mean_std(name: str, part: pd.DataFrame) -> float:
    """Of the mean over pairs: own parts average out, the shared one does not.

    docs/theory-comparison-lines.md, Eq. (3).

    Where one length ends at the place at which the next begins, that place's error is in both with opposite
    sign, and cancels.
    """
    own = part[f"{name}_std_experiment"].to_numpy(dtype=np.float64)
    variance = float(np.sum(own**2))
    if name in _CHAINED:
        place, std = (
            part[f"{_CHAINED[name]}{end}"].to_numpy(float) for end in ("_experiment", "_std_experiment")
        )
        ends = place + part[f"{name}_experiment"].to_numpy(dtype=np.float64)
        met = np.abs(ends[:-1] - place[1:]) < _SAME_MM
        variance -= 2.0 * float(np.sum(std[1:][met] ** 2))
    fresh = float(np.sqrt(max(variance, 0.0))) / len(part)
    return float(np.hypot(fresh, _shared_std(name, part).mean()))
