"""Model against experiment over all tests: the mean error, with what does not average out kept whole."""

import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from ploughval.compare.several.pooling import Pooled, pool
from ploughval.compare.several.record import Record, Value
from ploughval.compare.several.repeats import metric_names

_TWO_SIDED = float(ndtri(0.975))


@dataclass(frozen=True, slots=True)
class MeanError:
    """Error E = model - experiment of one scaled metric over the tests that have it.

    Attributes
    ----------
    metric : str
    scale : str
        What the metric was divided by; its own unit for nothing.
    tests : tuple of int
    errors, validation_stds : tuple of float
        E of each test and its validation uncertainty, scaled.
    pooled : Pooled
        Over E, with the experiments' stated uncertainties.
    input_std : float
        Standard uncertainty of the mean from the model's side; common to the tests of a sand.
    low, high : float
        95 % interval of the mean error: scatter, the model's side, and the measurements' stated uncertainty
        whole, since no file says how much of it all tests share.
    mean_agrees : bool or None
        Whether zero lies within; None where it cannot be told, and for a distance.
    distance : bool
        Whether the metric is itself a difference (an rms): its mean is never zero.
    agree, judged : int
        Tests that agree by themselves, of those that can be judged.
    """

    metric: str
    scale: str
    tests: tuple[int, ...]
    errors: tuple[float, ...]
    validation_stds: tuple[float, ...]
    pooled: Pooled
    input_std: float
    low: float
    high: float
    mean_agrees: bool | None
    distance: bool
    agree: int
    judged: int


def mean_errors(places: Sequence[int], records: Sequence[Record]) -> list[MeanError]:
    """Mean error of every metric that two tests have an error of.

    The model's standard uncertainty (inputs and numerics) is taken as fully correlated between tests that
    state the same [soil], and as independent between different ones.

    Parameters
    ----------
    places : sequence of int
        Tests that count.
    records : sequence of Record
        All tests.

    Returns
    -------
    list of MeanError
        By metric.
    """
    found = []
    for name in metric_names([records[place] for place in places]):
        known = {}
        for place in places:
            scaled = records[place].scaled_metric(name, with_depth=False)
            if scaled is not None and np.isfinite(scaled.error):
                known[place] = scaled
        if len(known) > 1:
            found.append(_mean_error(name, known, records))
    return found


def _mean_error(name: str, known: dict[int, Value], records: Sequence[Record]) -> MeanError:
    values = list(known.values())
    pooled = pool([v.error for v in values], [v.experiment_std for v in values])
    common = _input_std([v.model_std for v in values], [_sand(records[place]) for place in known])
    shared = 0.0 if np.isnan(pooled.stated_std) else pooled.stated_std
    reach = float(np.hypot(pooled.half_width, _TWO_SIDED * np.hypot(common, shared)))
    judged = [v.agrees for v in values if v.agrees is not None]
    distance = all(np.isnan(v.experiment) for v in values)
    told = np.isfinite(reach) and judged and not distance
    return MeanError(
        name, values[0].unit, tuple(known), tuple(v.error for v in values),
        tuple(v.validation_std for v in values), pooled, common, pooled.pooled - reach, pooled.pooled + reach,
        abs(pooled.pooled) <= reach if told else None, distance, sum(judged), len(judged),
    )  # fmt: skip


def _input_std(stds: Sequence[float], sands: Sequence[Hashable]) -> float:
    """Standard uncertainty of a plain mean: sums within a sand, squares between sands.

    docs/several-tests.md, Eq. (4).
    """
    sums: dict[Hashable, float] = {}
    for std, sand in zip(stds, sands, strict=True):
        sums[sand] = sums.get(sand, 0.0) + std
    return math.hypot(*sums.values()) / len(stds)


def _sand(record: Record) -> str:
    return repr(record.settings.get("soil"))
