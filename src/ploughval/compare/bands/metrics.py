"""Metrics of the shear bands: scalars of both sides, frequency, and how many match."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ploughval.compare.bands.matching import band_quantities, match_bands
from ploughval.compare.case import Case, join_scalars
from ploughval.compare.force.peaks import Quantity
from ploughval.compare.validation import NAN, Metric, judge

if TYPE_CHECKING:
    from ploughval.model import History


def band_metrics(
    case: Case, measured: pd.DataFrame, framed: Sequence[pd.DataFrame]
) -> tuple[list[Metric], pd.DataFrame]:
    """Compare measured with predicted bands.

    Parameters
    ----------
    case : Case
        The model's side.
    measured : DataFrame
        BAND_COLUMNS.
    framed : sequence of DataFrame
        Tables with the frames' ``u_mm``: how far the photographs reach and how far apart they are.

    Returns
    -------
    metrics : list of Metric
    pairs : DataFrame
        What matches what; see ``match_bands``.
    """
    travels = [float(table["u_mm"].max()) for table in framed if len(table)]
    end = max([float(measured["u_end_mm"].max())] if len(measured) else [], default=NAN)
    end = np.nanmax([end, *travels]) if travels or np.isfinite(end) else NAN
    limit = float(np.nanmin([end, float(case.history.force["u_mm"].iloc[-1])]))
    start_std = _frame_interval(framed) / np.sqrt(12.0)
    note = f"bands that begin within {limit:.4g} mm of travel"

    def values(one: "History") -> Mapping[str, Quantity]:
        return band_quantities(one.bands, limit, 0.0)

    both = dict(band_quantities(measured, limit, start_std))
    frequency = both.pop("band_frequency")
    metrics = join_scalars(case, both, values, note)
    predicted, spreads = values(case.history)["band_frequency"], case.input_spread(values)
    if np.isfinite(frequency.value) and np.isfinite(predicted.value):
        scale = 1 / frequency.value
        metrics.append(
            judge(
                "band_frequency_ratio",
                (1.0, frequency.std * scale),
                case.numerical(Quantity(predicted.value * scale, 0.0)),
                input_std=spreads["band_frequency"].std * scale,
                dominant_input=spreads["band_frequency"].dominant,
                note=f"model over experiment, new bands a travel; {note}",
            )
        )
    within = case.history.bands[case.history.bands["u_start_mm"] < limit]
    pairs = match_bands(measured, within, case.depth_mm)
    alone = [int(pairs[f"band_{side}"].isna().sum()) for side in ("model", "experiment")]
    matched = len(pairs) - sum(alone)
    metrics.append(
        Metric("bands_matched_count", "1", float(matched), model=float(matched), note=f"one to one; {note}")
    )
    metrics.append(
        Metric(
            "bands_unmatched_count",
            "1",
            float(alone[0]),
            model=float(alone[1]),
            note="bands without a partner",
        )
    )
    return metrics, pairs


def _frame_interval(framed: Sequence[pd.DataFrame]) -> float:
    """Travel between frames, mm: a band's start is known no better than that."""
    for table in framed:
        steps = np.diff(np.unique(table["u_mm"].dropna().to_numpy(dtype=np.float64)))
        if steps.size:
            return float(np.median(steps))
    return NAN
