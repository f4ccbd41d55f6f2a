"""Repeatability of equal tests: every metric's scatter between them (ISO 5725-2)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ploughval.compare.several.excess import size_of
from ploughval.compare.several.groups import Group
from ploughval.compare.several.pooling import Pooled, pool, std_interval
from ploughval.compare.several.record import Record, Value


@dataclass(frozen=True, slots=True)
class Repeat:
    """One metric in the tests of one group.

    Attributes
    ----------
    group : str
    metric, unit : str
    tests : tuple of int
        Places of the tests that measured it.
    values, stds : tuple of float
        What they measured.
    pooled : Pooled
    """

    group: str
    metric: str
    unit: str
    tests: tuple[int, ...]
    values: tuple[float, ...]
    stds: tuple[float, ...]
    pooled: Pooled


@dataclass(frozen=True, slots=True)
class LevelsTogether:
    """Repeatability standard deviation of a scaled metric over several groups.

    Attributes
    ----------
    metric, scale : str
        Name of the metric, and what it was divided by.
    groups, dof : int
        How many groups, and degrees of freedom of all together.
    std, std_low, std_high : float
        Standard deviation between tests, scaled, and its 95 % interval.
    """

    metric: str
    scale: str
    groups: int
    dof: int
    std: float
    std_low: float
    std_high: float


def metric_names(records: Sequence[Record]) -> list[str]:
    """Names of all metrics, in the order in which tests bring them; what is told in mm and in d, once."""
    names = list(dict.fromkeys(name for record in records for name in record.values))
    return [name for name in names if not (name.endswith("_d") and f"{name[:-2]}_mm" in names)]


def measured_names(records: Sequence[Record]) -> list[str]:
    """Names of metrics that are a measurement: no ratio to it, no count of matches with the model."""
    names = metric_names(records)
    return [name for name in names if not name.endswith(("_ratio", "_matched_count", "_unmatched_count"))]


def repeats_of(group: Group, records: Sequence[Record]) -> list[Repeat]:
    """Scatter of each metric that two tests of a group measured at least.

    Parameters
    ----------
    group : Group
        Whose tests.
    records : sequence of Record
        All tests.

    Returns
    -------
    list of Repeat
        By metric, in the order of the first test.
    """
    found = []
    for name in measured_names([records[place] for place in group.members]):
        held = {place: records[place].values.get(name) for place in group.members}
        known = {place: v for place, v in held.items() if v is not None and np.isfinite(v.experiment)}
        if len(known) < 2:
            continue
        values, stds = _sides(list(known.values()))
        unit = next(iter(known.values())).unit
        found.append(Repeat(group.label, name, unit, tuple(known), values, stds, pool(values, stds)))
    return found


def levels_together(groups: Sequence[Group], records: Sequence[Record]) -> list[LevelsTogether]:
    """Repeatability of each scaled metric over all groups: the root of their weighted mean variance.

    Variances are weighted by their degrees of freedom, as ISO 5725-2 does over laboratories. Scaled metrics
    are pooled, since the scatter of a force grows with the depth.

    Parameters
    ----------
    groups : sequence of Group
        Groups; those with one test that measured a metric say nothing of its scatter.
    records : sequence of Record
        All tests.

    Returns
    -------
    list of LevelsTogether
        Metrics that two groups at least have scatter of.
    """
    found = []
    for name in measured_names(records):
        scaled = [[records[place].scaled_metric(name) for place in group.members] for group in groups]
        known = [[v for v in cell if v is not None and np.isfinite(v.experiment)] for cell in scaled]
        cells = [np.array([v.experiment for v in cell]) for cell in known if len(cell) > 1]
        if len(cells) < 2:
            continue
        size = size_of(np.concatenate(cells))
        squares = sum(float(np.var(cell / size)) * cell.size for cell in cells)
        dof = sum(cell.size - 1 for cell in cells)
        std = float(np.sqrt(squares / dof)) * size
        words = next(v.unit for cell in known for v in cell)
        found.append(LevelsTogether(name, words, len(cells), dof, std, *std_interval(std, dof)))
    return found


def _sides(values: Sequence[Value]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return tuple(v.experiment for v in values), tuple(v.experiment_std for v in values)
