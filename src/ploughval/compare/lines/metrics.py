"""Metrics of tracer layers and free surface: distances of measured from predicted lines, both ways."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.compare.case import Case
from ploughval.compare.ensemble import Spread
from ploughval.compare.face import lean_of
from ploughval.compare.lines.distances import (
    COMMON,
    FACE_DEPTHS,
    LineDistance,
    PointStds,
    beside_face,
    compare_lines,
    distance_table,
    within,
)
from ploughval.compare.lines.lines import Key, measured_lines, model_lines
from ploughval.compare.lines.spread import Predicted, input_spread
from ploughval.compare.validation import NAN, Metric, distance, rms

if TYPE_CHECKING:
    from ploughval.model import History

Floats = NDArray[np.float64]


def layer_metrics(case: Case, measured: pd.DataFrame) -> tuple[list[Metric], pd.DataFrame | None]:
    """Compare measured with predicted tracer layers.

    Parameters
    ----------
    case : Case
        The model's side.
    measured : DataFrame
        LAYER_COLUMNS, with ``calibration_std_mm`` where that is known.

    Returns
    -------
    metrics : list of Metric
    table : DataFrame or None
        DISTANCE_COLUMNS, a row a frame and layer; None without a frame that the model reaches.
    """
    inside, travel = _reached(measured, float(case.history.force["u_mm"].iloc[-1]))
    if not travel:
        return [], None
    heights = tuple(float(h) for h in sorted(inside["layer"].dropna().unique()))

    def lines(one: "History", frames: Sequence[int]) -> Mapping[Key, Floats]:
        u = np.array([travel[frame] for frame in frames])
        return model_lines(one.layers(heights, u, np.array(frames, dtype=np.int64)))

    pool = _Pool(case, inside, travel, lines)
    return pool.metrics("layers", torn=True), pool.table


def surface_metrics(case: Case, measured: pd.DataFrame) -> list[Metric]:
    """Compare the measured (SURFACE_COLUMNS, ``std_mm`` where known) with the predicted free surface."""
    inside, travel = _reached(measured, float(case.history.force["u_mm"].iloc[-1]))
    if not travel:
        return []
    std = inside.get("std_mm", NAN)

    def lines(one: "History", frames: Sequence[int]) -> Mapping[Key, Floats]:
        end = float(one.force["u_mm"].iloc[-1])
        return {
            (frame, 0.0): np.asarray(one.surface(travel[frame]), dtype=np.float64)
            for frame in frames
            if travel[frame] <= end
        }

    return _Pool(case, inside.assign(layer=0.0, source="tracks", std_mm=std), travel, lines).metrics(
        "surface", torn=False
    )


def _reached(table: pd.DataFrame, end_mm: float) -> tuple[pd.DataFrame, dict[int, float]]:
    """Rows of a measured table that the model's travel covers, and the travel of its frames."""
    inside = table[(table["u_mm"] >= 0) & (table["u_mm"] <= end_mm)]
    stages = inside.drop_duplicates("frame").sort_values("frame", kind="stable")
    pairs = zip(stages["frame"].astype(int), stages["u_mm"].astype(float), strict=True)
    return inside, dict(pairs)


class _Pool:
    """All points of all lines of a test with their distances and uncertainties."""

    def __init__(
        self, case: Case, measured: pd.DataFrame, travel: Mapping[int, float], predicted: Predicted
    ) -> None:
        self.depth_mm, self.lean = case.depth_mm, lean_of(case.scene)
        self.numerical_mm = case.scene.model.tolerance * case.depth_mm
        self.frames = len(travel)
        model = predicted(case.history, sorted(travel))
        self.found: list[LineDistance] = compare_lines(list(measured_lines(measured)), model)
        inputs, self.mean_spread = self._inputs(case, predicted)
        self.stds = [self._stds(one, std) for one, std in zip(self.found, inputs, strict=True)]
        self.table = distance_table(self.found, self.stds.__getitem__, self.depth_mm, self.lean)

    def _inputs(self, case: Case, predicted: Predicted) -> tuple[list[Floats], Spread]:
        return input_spread(case, [one.line for one in self.found], predicted)

    def _stds(self, one: LineDistance, inputs: Floats) -> PointStds:
        line = one.line
        numerical = np.full(len(line.points_mm), self.numerical_mm)
        return PointStds(line.std_mm, line.calibration_std_mm, inputs, numerical)

    def metrics(self, name: str, *, torn: bool) -> list[Metric]:
        """Pooled metrics; with ``torn`` also of the zone beside the face and of what has no partner."""
        d = _joined([one.distance_mm for one in self.found])
        met = np.isfinite(d)
        if not met.any():
            return []
        u = _joined([std.validation for std in self.stds])
        share = within(d, u)[met]
        beyond = int((~met).sum())
        note = f"normal distance of {int(met.sum())} points in {self.frames} frames"
        note += f"; {beyond} beyond the model's lines left out" if beyond else ""
        if np.isfinite(share).any():
            note += f"; {100 * float(np.nanmean(share)):.0f} % within twice their own uncertainty"
        size = np.abs(d[met])
        found = [self._mean(name), self._rms(f"{name}_rms_mm", met, note)]
        both = float(np.fmax(np.percentile(size, 95), self._reverse()))
        for kind, value, said in (
            ("median", float(np.median(size)), note),
            ("p95", float(np.percentile(size, 95)), note),
            (
                "hausdorff95",
                both,
                "95 % of the points of either side lie nearer to the other's line; lost points count",
            ),
        ):
            found.append(_unjudged(f"{name}_{kind}_mm", value, said))
        return found + (self._zones(name, met) + self._lengths(name) if torn else [])

    def _mean(self, name: str) -> Metric:
        """Mean signed distance, model above measured; what is shared by all points does not average out."""
        table = self.table[self.table["points"] > 0]
        weight = table["points"].to_numpy(dtype=np.float64)
        std = table["std_mm"].to_numpy(dtype=np.float64)
        own = np.sqrt(1.0 - COMMON) * std / np.sqrt(table["effective"].to_numpy(float))
        # The frames of a layer share its points' errors; the layers have errors of their own.
        parts = [float(np.sum((weight * own)[rows])) for rows in _rows_of(table["layer"])]
        fresh = float(np.linalg.norm(parts)) / weight.sum()
        common = np.sqrt(COMMON) * float(np.average(std, weights=weight))
        calibration = float(np.average(table["calibration_std_mm"].to_numpy(float), weights=weight))
        effective = float(table["effective"].sum())
        return distance(
            f"{name}_mean_mm",
            -float(np.average(table["mean_mm"].to_numpy(float), weights=weight)),
            experiment_std=float(np.linalg.norm([fresh, common, calibration])),
            numerical_std=self.numerical_mm,
            input_std=self.mean_spread.std,
            dominant_input=self.mean_spread.dominant,
            note=f"along the normal, positive: the model's lines lie above; {effective:.0f} independent "
            f"points of {weight.sum():.0f}{self.mean_spread.remark}",
        )

    def _rms(self, metric: str, chosen: NDArray[np.bool_], note: str) -> Metric:
        d = _joined([one.distance_mm for one in self.found])[chosen]
        measured = [np.hypot(std.own, std.calibration) for std in self.stds]
        return distance(
            metric,
            rms(d),
            experiment_std=_whole_rms(_joined(measured)[chosen]),
            numerical_std=self.numerical_mm,
            input_std=_whole_rms(_joined([std.inputs for std in self.stds])[chosen]),
            dominant_input=self.mean_spread.dominant,
            note=note,
        )

    def _zones(self, name: str, met: NDArray[np.bool_]) -> list[Metric]:
        face = _joined([beside_face(one, self.depth_mm, self.lean) for one in self.found]).astype(bool)
        places = (
            ("face", met & face, f"within {FACE_DEPTHS:g} d of the blade's face"),
            ("away", met & ~face, f"further than {FACE_DEPTHS:g} d from the blade's face"),
        )
        return [
            self._rms(f"{name}_{zone}_rms_mm", chosen, f"{int(chosen.sum())} points {said}")
            for zone, chosen, said in places
            if chosen.any()
        ]

    def _lengths(self, name: str) -> list[Metric]:
        frames = max(int(self.table["frame"].nunique()), 1)
        return [
            _unjudged(f"{name}_{kind}_mm", float(self.table[f"{kind}_mm"].sum()) / frames, said)
            for kind, said in (
                ("extra", "length of measured line a frame past the model's torn ends"),
                ("missing", "length of the model's line a frame on which no measured point falls"),
            )
        ]

    def _reverse(self) -> float:
        reverse = _joined([one.reverse_mm for one in self.found])
        return float(np.percentile(reverse, 95)) if reverse.size else NAN


def _unjudged(metric: str, value: float, note: str) -> Metric:
    """A size for which no uncertainty says how large it may be."""
    return distance(metric, value, experiment_std=NAN, numerical_std=NAN, input_std=NAN, note=note)


def _whole_rms(values: Floats) -> float:
    """Root mean square; NaN where any value is unknown."""
    return rms(values) if np.isfinite(values).all() else NAN


def _rows_of(layer: pd.Series) -> list[NDArray[np.int64]]:
    values = layer.to_numpy(dtype=np.float64)
    return [np.flatnonzero(values == one) for one in np.unique(values)]


def _joined(parts: Sequence[NDArray[np.generic]]) -> Floats:
    return np.concatenate([np.asarray(part, dtype=np.float64) for part in parts]) if parts else np.empty(0)
