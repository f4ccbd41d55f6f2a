"""What the model's uncertain inputs leave open of its lines, at every measured point."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.case import Case
from ploughval.compare.ensemble import NO_SPREAD, Spread, std_about
from ploughval.compare.lines.lines import Key, Line
from ploughval.compare.lines.nearest import nearest_on_line

if TYPE_CHECKING:
    from ploughval.model import History

Floats = NDArray[np.float64]
Predicted = Callable[["History", Sequence[int]], Mapping[Key, Floats]]
_STAGES = 6  # frames at which the draws are carried; between them their spread is interpolated


def input_spread(case: Case, lines: Sequence[Line], predicted: Predicted) -> tuple[list[Floats], Spread]:
    """Spread of the predicted lines along their normals.

    Parameters
    ----------
    case : Case
        With the runs of drawn inputs.
    lines : sequence of Line
        What was measured: where the spread is wanted.
    predicted : callable
        The lines of a run at given frames.

    Returns
    -------
    stds : list of (N,) float, mm
        Of each line's points; 0 without drawn runs.
    mean : Spread
        Of the mean distance.
    """
    if not len(case.ensemble):
        return [np.zeros(len(line.points_mm)) for line in lines], NO_SPREAD
    frames = sorted({line.key[0] for line in lines})
    picked = np.unique(np.linspace(0, len(frames) - 1, min(_STAGES, len(frames))).round().astype(np.int64))
    stages = [frames[k] for k in picked]
    staged = [line for line in lines if line.key[0] in set(stages)]
    kept: dict[int, Floats] = {}

    def values(one: "History") -> Mapping[str, float]:
        model = predicted(one, stages)
        found = np.concatenate([_signed(line, model) for line in staged])
        kept[id(one)] = found
        known = found[np.isfinite(found)]
        return {"mean": float(known.mean()) if known.size else float("nan")}

    mean = case.ensemble.spread(values)["mean"]
    drawn = np.stack([kept[id(one)] for one in case.ensemble])
    std = std_about(kept[id(case.ensemble.centre)], drawn)
    ends = np.cumsum([len(line.points_mm) for line in staged])[:-1]
    at_stage = {line.key: part for line, part in zip(staged, np.split(std, ends), strict=True)}
    return [_between(line, staged, at_stage) for line in lines], mean


def _signed(line: Line, model: Mapping[Key, Floats]) -> Floats:
    if line.key not in model:
        return np.full(len(line.points_mm), np.nan)
    found = nearest_on_line(line.points_mm, model[line.key])
    return np.where(found.beyond, np.nan, found.distance_mm)


def _between(line: Line, staged: Sequence[Line], at_stage: Mapping[Key, Floats]) -> Floats:
    """Spread at the points of a line: of its own stage, or between those of the stages about it.

    At the same distance ahead of the blade: the sand that moves does so with it.
    """
    if line.key in at_stage:
        return at_stage[line.key]
    same = [one for one in staged if one.key[1] == line.key[1]]
    before = [one for one in same if one.key[0] < line.key[0]][-1:]
    after = [one for one in same if one.key[0] > line.key[0]][:1]
    about = before + after
    if not about:
        return np.full(len(line.points_mm), np.nan)
    parts = [_ahead(one, at_stage[one.key], line) for one in about]
    if len(about) == 1:
        return parts[0]
    weight = (line.u_mm - about[0].u_mm) / max(about[1].u_mm - about[0].u_mm, 1e-12)
    return np.asarray((1.0 - weight) * parts[0] + weight * parts[1])


def _ahead(stage: Line, std: Floats, line: Line) -> Floats:
    x = stage.points_mm[:, 0] - stage.u_mm
    known = np.flatnonzero(np.isfinite(std))
    if not known.size:
        return np.full(len(line.points_mm), np.nan)
    order = known[np.argsort(x[known], kind="stable")]
    return np.asarray(np.interp(line.points_mm[:, 0] - line.u_mm, x[order], std[order]))
