"""Switches of both force histories, matched one to one, and what they differ by."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.compare.case import judge_spread
from ploughval.compare.ensemble import Ensemble, std_about
from ploughval.compare.force.reading import Reading
from ploughval.compare.validation import NAN, Metric, distance, verdict

Floats = NDArray[np.float64]
GATE_DEPTHS = 1.0  # partners lie no further apart
_VALUES = ("u_mm", "force_N", "drop_N", "spacing_mm")
_PARTS = ("experiment", "experiment_std", "model", "error", "validation_std", "agrees")
PAIR_COLUMNS = (
    "switch_experiment", "switch_model", *(f"{name}_{part}" for name in _VALUES for part in _PARTS),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Pairs:
    """Matched switches: numbers of either side, and place, height, drop and spacing of both.

    ``measured``, ``predicted`` and the standard uncertainties are (P, 4) in the order of u_mm, force_N,
    drop_N, spacing_mm (travel from the pair before); ``drawn`` is (N, P, 4). NaN where a side lacks a value.
    ``shared_std`` is the part of ``measured_std`` that is the same error in all pairs.
    """

    numbers: tuple[tuple[int, int], ...]
    alone: tuple[int, int]
    measured: Floats
    measured_std: Floats
    shared_std: Floats
    predicted: Floats
    numerical_std: Floats
    drawn: Floats

    @property
    def places_mm(self) -> tuple[Floats, Floats]:
        """Travel at the matched switches, measured and predicted."""
        return self.measured[:, 0], self.predicted[:, 0]

    def mean_std(self, k: int, known: NDArray[np.bool_]) -> float:
        """Standard uncertainty of the mean of the k-th measured value over some pairs.

        docs/theory-comparison.md, Eq. (6).
        """
        rows = np.flatnonzero(known)
        if _VALUES[k] == "spacing_mm":  # the places between the ends cancel
            return float(np.hypot(*self.measured_std[[rows[0] - 1, rows[-1]], 0])) / rows.size
        shared = self.shared_std[rows, k]
        fresh = np.sqrt(np.maximum(self.measured_std[rows, k] ** 2 - shared**2, 0.0))
        return float(np.hypot(np.linalg.norm(fresh) / rows.size, shared.mean()))


def match_places(first_mm: Floats, second_mm: Floats, gate_mm: float) -> tuple[tuple[int, int], ...]:
    """Pair places in order, as many as lie within a gate, so that the squares of the distances are least.

    >>> match_places(np.array([38.0, 98.0]), np.array([25.0, 60.0, 90.0]), 30.0)
    ((0, 0), (1, 2))
    """
    from scipy.optimize import linear_sum_assignment

    apart = np.abs(np.subtract.outer(first_mm, second_mm)) / gate_mm
    rows, columns = linear_sum_assignment(np.where(apart <= 1, apart**2, 1.0 + apart.size))
    return tuple((int(i), int(j)) for i, j in zip(rows, columns, strict=True) if apart[i, j] <= 1)


def match_switches(
    measured: Reading, model: Reading, drawn: Sequence[Reading], *, depth_mm: float, tolerance: float
) -> Pairs:
    """Match the switches of both sides.

    Parameters
    ----------
    measured, model : Reading
        Both sides.
    drawn : sequence of Reading
        The model's with drawn inputs: its switches count as those of ``model`` do.
    depth_mm : float
        Depth of the tip.
    tolerance : float
        Relative numerical error of the model.
    """
    sides = [one.switches["u_mm"].to_numpy(dtype=np.float64) for one in (measured, model)]
    numbers = match_places(sides[0], sides[1], GATE_DEPTHS * depth_mm)
    mine, theirs = ([pair[k] for pair in numbers] for k in (0, 1))
    values, stds = _values(measured, mine)
    predicted, _ = _values(model, theirs)
    runs = np.array([_values(one, theirs)[0] for one in drawn]).reshape(
        len(drawn), len(numbers), len(_VALUES)
    )
    alone = (len(sides[0]) - len(numbers), len(sides[1]) - len(numbers))
    numerical = tolerance * np.abs(predicted)
    return Pairs(numbers, alone, values, stds, _shared(measured, values), predicted, numerical, runs)


def _shared(measured: Reading, values: Floats) -> Floats:
    """The part of the uncertainty of measured values (P, 4) that offset and gain make, the same in all."""
    shared = measured.curve.shared
    stds = np.zeros(values.shape)
    stds[:, 1] = [np.sqrt(shared.variance(force)) for force in values[:, 1]]
    stds[:, 2] = shared.gain * values[:, 2]  # in a drop the offset cancels
    return stds


def _values(reading: Reading, numbers: Sequence[int]) -> tuple[Floats, Floats]:
    """Place, height, drop and spacing of some switches, (P, 4), and their standard uncertainties."""
    names = ["u_mm", "force_N", "drop_N", "u_std_mm", "force_std_N", "drop_std_N"]
    known = reading.switches[names].to_numpy(dtype=np.float64)
    rows = np.full((len(numbers), 6), NAN)
    there = [k for k, number in enumerate(numbers) if number < len(known)]
    rows[there] = known[[numbers[k] for k in there]]
    spacing = np.diff(rows[:, 0], prepend=NAN)
    spacing_std = np.hypot(rows[:, 3], np.append(NAN, rows[:-1, 3])[: len(rows)])
    return np.column_stack([rows[:, :3], spacing]), np.column_stack([rows[:, 3:], spacing_std])


def pair_metrics(pairs: Pairs, ensemble: Ensemble) -> list[Metric]:
    """Numbers matched and alone; where two or more match, mean and rms of what they differ by.

    Parameters
    ----------
    pairs : Pairs
        Matched switches.
    ensemble : Ensemble
        The runs that ``pairs`` holds the drawn switches of.
    """
    note = f"peaks after the initial one, matched in order within {GATE_DEPTHS:g} d"
    matched = float(len(pairs.numbers))
    alone = [float(count) for count in pairs.alone]
    metrics = [
        Metric("switches_matched_count", "1", matched, model=matched, note=note),
        Metric("switches_unmatched_count", "1", alone[0], model=alone[1], note=f"without a partner; {note}"),
    ]
    if len(pairs.numbers) < 2:
        return metrics
    for k, name in enumerate(_VALUES):
        known = np.isfinite(pairs.measured[:, k] + pairs.predicted[:, k])
        if known.any():
            metrics += _mean_and_rms(pairs, ensemble, name, known, f"of {_counted(name, known)}; {note}")
    return metrics


def _counted(name: str, known: NDArray[np.bool_]) -> str:
    count = int(known.sum())
    what = "gap between matched switches" if name.startswith("spacing") else "matched switch"
    plural = what.replace("gap", "gaps") if name.startswith("spacing") else f"{what}es"
    return f"{count} {what if count == 1 else plural}"


def _mean_and_rms(
    pairs: Pairs, ensemble: Ensemble, name: str, known: NDArray[np.bool_], note: str
) -> list[Metric]:
    """Mean of one value on either side, and rms of the differences; the rms of one would say nothing more."""
    k = _VALUES.index(name)
    what, unit = name.rsplit("_", 1)
    measured, predicted = pairs.measured[known, k], pairs.predicted[known, k]
    std, numerical = pairs.measured_std[known, k], pairs.numerical_std[known, k]
    centre = float(predicted.mean())
    spread = ensemble.spread_of(centre, pairs.drawn[:, known, k].mean(axis=1))
    found = [
        judge_spread(
            f"switch_{what}_mean_{unit}",
            (float(measured.mean()), pairs.mean_std(k, known)),
            (centre, float(numerical.mean())),
            spread,
            f"mean {note}",
        )
    ]
    if std.size > 1:
        found.append(
            distance(
                f"switch_{what}_rms_{unit}",
                _rms(predicted - measured),
                experiment_std=_rms(std),
                numerical_std=_rms(numerical),
                input_std=_rms(_input_std(pairs)[known, k]),
                dominant_input=spread.dominant,
                note=f"rms of the differences {note}{spread.remark}",
            )
        )
    return found


def pair_table(pairs: Pairs, measured: Reading, model: Reading) -> pd.DataFrame:
    """Matched switches side by side, and those of either side that are alone.

    Returns
    -------
    DataFrame of PAIR_COLUMNS
        A row a pair or lonely switch, in order of travel; numbers count from 1.
    """
    inputs = _input_std(pairs)
    validation = np.sqrt(pairs.measured_std**2 + pairs.numerical_std**2 + inputs**2)
    error = pairs.predicted - pairs.measured
    agrees = np.frompyfunc(lambda e, std: verdict(float(e), float(std)), 2, 1)(error, validation)
    parts = (pairs.measured, pairs.measured_std, pairs.predicted, error, validation, agrees)
    table = pd.DataFrame(
        np.array(pairs.numbers, dtype=float).reshape(-1, 2) + 1, columns=list(PAIR_COLUMNS[:2])
    )
    for k, name in enumerate(_VALUES):
        table = table.assign(
            **{f"{name}_{part}": values[:, k] for part, values in zip(_PARTS, parts, strict=True)}
        )
    rows = [table]
    for place, (side, reading) in enumerate((("experiment", measured), ("model", model))):
        partners = {pair[place] for pair in pairs.numbers}
        alone = [k for k in range(len(reading.switches)) if k not in partners]
        own = dict(zip((side, f"{side}_std"), _values(reading, alone), strict=True))
        known = {
            f"{name}_{part}": values[:, k]
            for part, values in own.items()
            for k, name in enumerate(_VALUES[:3])
        }
        rows.append(pd.DataFrame({f"switch_{side}": np.array(alone, dtype=float) + 1, **known}))
    table = pd.concat([part for part in rows if len(part)] or rows[:1], ignore_index=True)
    table = table.reindex(columns=list(PAIR_COLUMNS))
    begin = table["u_mm_experiment"].fillna(table["u_mm_model"]).to_numpy(dtype=np.float64)
    return table.iloc[np.argsort(begin, kind="stable")].reset_index(drop=True)


def _input_std(pairs: Pairs) -> Floats:
    """What the inputs leave open of every predicted value, (P, 4)."""
    count = pairs.predicted.size
    flat = std_about(pairs.predicted.ravel(), pairs.drawn.reshape(len(pairs.drawn), count))
    return np.where(np.isfinite(pairs.predicted), flat.reshape(pairs.predicted.shape), NAN)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
