"""Metrics of the shear bands: scalars, differences over all pairs, frequency, and what matches."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ploughval.compare.bands.frequency import Spacings, frequency_ratio, spacings
from ploughval.compare.bands.matching import band_quantities, match_bands
from ploughval.compare.bands.observed import Window, observe
from ploughval.compare.bands.pairs import Predicted, judged_pairs, pair_metrics, pair_table
from ploughval.compare.case import Case, join_scalars, judge_spread
from ploughval.compare.quantity import Quantity
from ploughval.compare.validation import Metric

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
        Tables with the frames' ``u_mm``: how far the photographs reach and how far apart they are; and,
        where a table has it, ``calibration_std_mm`` at ``x_mm``.

    Returns
    -------
    metrics : list of Metric
    pairs : DataFrame
        What matches what, with differences and their uncertainties; see ``pair_table``.
    """
    end_mm = float(case.history.force["u_mm"].iloc[-1])
    window = _window(measured, framed, end_mm)
    limit = _limit(window, end_mm)
    seen = observe(_calibrated(measured, framed), window)
    seen = seen[~(seen["u_start_mm"] >= limit)].reset_index(drop=True)
    note = f"bands that begin within {limit:.4g} mm of travel"

    tables: dict[int, pd.DataFrame] = {}

    def predicted(one: "History") -> pd.DataFrame:
        if id(one) not in tables:
            tables[id(one)] = described(one)
        return tables[id(one)]

    def described(one: "History") -> pd.DataFrame:
        last = float(one.force["u_mm"].iloc[-1])
        table = observe(one.bands, Window(0.0, last, np.empty(0)))
        inside = (table["u_start_mm"] < limit) & ~(table["u_end_mm"] <= window.first_mm)
        return table[inside].reset_index(drop=True)

    def values(one: "History") -> Mapping[str, Quantity]:
        return band_quantities(predicted(one))

    metrics = join_scalars(case, band_quantities(seen), values, note)
    metrics += _frequency(case, seen, predicted, window, note)
    pairs = match_bands(seen, predicted(case.history), case.depth_mm)
    pairs = judged_pairs(case, pairs, predicted)
    metrics += pair_metrics(case, pairs, predicted, window.interval_mm)
    return metrics + _counted(pairs, note), pair_table(pairs)


def _window(measured: pd.DataFrame, framed: Sequence[pd.DataFrame], end_mm: float) -> Window:
    """What the photographs cover: all their travels, or without photographs what the bands span."""
    travels = [table["u_mm"].to_numpy(dtype=np.float64) for table in framed if len(table)]
    looks = np.unique(np.concatenate(travels)) if travels else np.empty(0)
    looks = looks[np.isfinite(looks)]
    ends = measured["u_end_mm"].to_numpy(dtype=np.float64)
    reach = np.concatenate([looks, ends[np.isfinite(ends)]])
    first = float(looks[0]) if looks.size else 0.0
    return Window(first, float(reach.max()) if reach.size else end_mm, looks if looks.size else np.zeros(1))


def _limit(window: Window, end_mm: float) -> float:
    """Travel before which a band must begin: an interval later the record ends, and has hardly seen it.

    A band that is there from the first look on was seen, however few looks follow.
    """
    before_end = min(window.last_mm, end_mm) - float(np.nan_to_num(window.interval_mm))
    return max(before_end, window.first_mm + float(np.nan_to_num(window.slack_mm)))


def _calibrated(measured: pd.DataFrame, framed: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """The measured bands with what the calibration leaves open of their outcrops, where a table knows it."""
    outcrop = measured["outcrop_x_mm"].to_numpy(dtype=np.float64)
    for table in framed:
        known = table[["x_mm", "calibration_std_mm"]].dropna() if "calibration_std_mm" in table else table[:0]
        if len(known):
            known = known.sort_values("x_mm", kind="stable")
            return measured.assign(
                calibration_std_mm=np.interp(outcrop, known["x_mm"], known["calibration_std_mm"])
            )
    return measured


def _frequency(
    case: Case, seen: pd.DataFrame, predicted: Predicted, window: Window, note: str
) -> list[Metric]:
    """Model's frequency of fresh bands over the experiment's, with what so few bands leave open."""
    limit = _limit(window, float(case.history.force["u_mm"].iloc[-1]))
    earliest = window.first_mm if window.late else -np.inf

    def of(table: pd.DataFrame) -> Spacings:
        starts = table["u_start_mm"].to_numpy(dtype=np.float64)
        return spacings(starts[starts > earliest], limit)

    measured = of(seen)

    def values(one: "History") -> Mapping[str, Quantity]:
        return {"ratio": Quantity(frequency_ratio(measured, of(predicted(one))).value, 0.0)}

    found = frequency_ratio(measured, of(predicted(case.history)))
    if not np.isfinite(found.value):
        return []
    said = (
        f"model over experiment, fresh bands a travel, from {found.pairs} spacings seen whole on both sides; "
        f"95 % of what so few leave open: {found.low:.3g} to {found.high:.3g}; {note}"
    )
    ratio = case.numerical(Quantity(found.value, 0.0))
    spread = case.input_spread(values)["ratio"]
    return [judge_spread("band_frequency_ratio", (1.0, found.std), ratio, spread, said)]


def _counted(pairs: pd.DataFrame, note: str) -> list[Metric]:
    """How many bands match, and where those are that do not."""
    alone = [pairs[pairs[f"band_{side}"].isna()] for side in ("model", "experiment")]
    matched = float(len(pairs) - len(alone[0]) - len(alone[1]))
    places = [
        f"{side} {_places(table, side)}"
        for side, table in zip(("experiment", "model"), alone, strict=True)
        if len(table)
    ]
    unmatched = "bands without a partner" + (f", starting at u: {'; '.join(places)}" if places else "")
    pieces = pairs["joined_experiment"].fillna(1).to_numpy(dtype=np.float64)
    if (pieces > 1).any():
        note += f"; {int(pieces.sum() - pieces.size)} pieces were joined to the band that they go on with"
    return [
        Metric("bands_matched_count", "1", matched, model=matched, note=f"one to one; {note}"),
        Metric(
            "bands_unmatched_count",
            "1",
            float(len(alone[0])),
            model=float(len(alone[1])),
            note=unmatched,
        ),
    ]


def _places(table: pd.DataFrame, side: str) -> str:
    """Where bands start, mm; those that started before the first look come without a number."""
    return ", ".join(
        f"{start:.4g} mm" if np.isfinite(start) else "before the first photograph"
        for start in table[f"u_start_mm_{side}"]
    )
