"""Distances between measured tracer layers (or the free surface) and the model's lines, both ways."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.compare.lines.effective import effective_number
from ploughval.compare.lines.lines import Key, Line, lengths
from ploughval.compare.lines.nearest import arcs, nearest_on_line
from ploughval.compare.validation import rms

Floats = NDArray[np.float64]
DISTANCE_COLUMNS = (
    "frame", "u_mm", "layer", "source", "points", "beyond", "effective", "mean_mm", "mean_std_mm", "rms_mm",
    "median_mm", "p95_mm", "std_mm", "calibration_std_mm", "input_std_mm", "validation_std_mm", "within",
    "face_points", "face_rms_mm", "reverse_p95_mm", "hausdorff95_mm", "extra_mm", "missing_mm",
)  # fmt: skip
FACE_DEPTHS = 0.25  # so far ahead of the face sand may be sheared along it
COMMON = 0.5  # of a point's variance, that all points share: correlation errs alike in a rigid block
_COVERAGE = 2.0
_SEEN_SPACINGS = 1.5  # a place of the model's line is seen where a measured point falls so near to it


@dataclass(frozen=True, slots=True, eq=False)
class LineDistance:
    """A measured line against the model's.

    Attributes
    ----------
    line : Line
        What was measured.
    distance_mm : (N,) float
        Of its points along the model's normal, positive where the measured point lies above; NaN beyond the
        model's outermost ends.
    reverse_mm : (R,) float
        Of the model's points from the measured line, without sign.
    extra_mm, missing_mm : float
        Length of measured line past the model's torn ends; and of the model's line on which no measured
        point falls: the sand lies elsewhere, or its points were lost.
    """

    line: Line
    distance_mm: Floats
    reverse_mm: Floats
    extra_mm: float
    missing_mm: float


def compare_line(line: Line, model_mm: Floats) -> LineDistance:
    """Set a measured line against the model's.

    Parameters
    ----------
    line : Line
        What was measured.
    model_mm : (M, 2) float
        The model's line in order, rows of NaN where it is torn.

    Returns
    -------
    LineDistance
        Lengths past a torn end count where a point lies further past it than the points are apart.
    """
    there = nearest_on_line(line.points_mm, model_mm)
    finite = np.isfinite(model_mm).all(axis=1)
    spacing = max(_spacing(line.whole_mm), _spacing(model_mm))
    back = nearest_on_line(model_mm[finite], line.whole_mm)
    unseen = ~back.beyond & (_apart(arcs(model_mm), there.arc_mm) > _SEEN_SPACINGS * spacing)
    return LineDistance(
        line,
        np.where(there.beyond, np.nan, there.distance_mm),
        np.abs(back.distance_mm[~back.beyond]),
        float(line.length_mm[there.past_tear_mm > spacing].sum()),
        float(lengths(model_mm)[finite][unseen].sum()),
    )


def _apart(places: Floats, others: Floats) -> Floats:
    """Distance of each place along a line from the nearest of others."""
    ordered = np.sort(others[np.isfinite(others)])
    if not ordered.size:
        return np.full(places.shape, np.inf)
    after = np.clip(np.searchsorted(ordered, places), 1, max(ordered.size - 1, 1))
    right = ordered[np.minimum(after, ordered.size - 1)]
    return np.asarray(np.minimum(np.abs(places - ordered[after - 1]), np.abs(right - places)))


def compare_lines(lines: Sequence[Line], model: Mapping[Key, Floats]) -> list[LineDistance]:
    """Set measured lines against the model's of the same frame and layer; those without one are left out."""
    return [compare_line(line, model[line.key]) for line in lines if line.key in model]


@dataclass(frozen=True, slots=True, eq=False)
class PointStds:
    """Standard uncertainties of the points of one line, (N,) mm each: what makes a difference credible."""

    own: Floats
    calibration: Floats
    inputs: Floats
    numerical: Floats

    @property
    def validation(self) -> Floats:
        """Of the difference at each point (docs/theory-comparison-lines.md, Eq. (5))."""
        return np.asarray(
            np.sqrt(self.own**2 + self.calibration**2 + self.inputs**2 + self.numerical**2), dtype=np.float64
        )


def distance_table(
    found: Sequence[LineDistance], stds: Callable[[int], PointStds], depth_mm: float, lean: float = 0.0
) -> pd.DataFrame:
    """Summary of the distances, a row a frame and layer.

    Parameters
    ----------
    found : sequence of LineDistance
        In the order of the rows.
    stds : callable
        Uncertainties of the points of a line, by its number.
    depth_mm : float
        Depth of the tip: it scales the zone beside the face.
    lean : float
        Tangent of the face's inclination.

    Returns
    -------
    DataFrame
        DISTANCE_COLUMNS. ``points`` with a distance, ``beyond`` without; ``effective`` independent points;
        ``mean_mm`` signed (positive: measured above predicted) with its standard uncertainty; rms, median and
        95 % of the size; root mean squares of the parts of a point's uncertainty; ``within``: share of the
        points within two of it; ``face_...``: within FACE_DEPTHS of the face; ``reverse_p95_mm``: 95 % of
        the model's points lie nearer to the measured line; ``hausdorff95_mm``: the larger of both ways.
    """
    rows = []
    for k, one in enumerate(found):
        met = np.isfinite(one.distance_mm)
        d, parts, line = one.distance_mm[met], stds(k), one.line
        deviation = parts.validation[met]
        count = effective_number(d)
        shared = [rms(part[met]) for part in (parts.calibration, parts.inputs, parts.numerical)]
        own = rms(parts.own[met])
        face = beside_face(one, depth_mm, lean)[met]
        p95, reverse = _percentile(d, 95), _percentile(one.reverse_mm, 95)
        rows.append(
            (
                line.key[0], line.u_mm, line.key[1], line.source, d.size, int((~met).sum()), count,
                _mean(d), float(np.sqrt(mean_variance(own, count) + np.sum(np.square(shared)))), rms(d),
                _percentile(d, 50), p95, own, shared[0], shared[1], rms(deviation),
                _mean(within(d, deviation)), int(face.sum()), rms(d[face]), reverse,
                float(np.fmax(p95, reverse)), one.extra_mm, one.missing_mm,
            )
        )  # fmt: skip
    return pd.DataFrame(rows, columns=list(DISTANCE_COLUMNS))


def mean_variance(own_mm: float, count: float) -> float:
    """Variance of the mean of so many independent points of one line, with what they have in common."""
    return own_mm**2 * (COMMON + (1.0 - COMMON) / max(count, 1.0))


def beside_face(one: LineDistance, depth_mm: float, lean: float = 0.0) -> NDArray[np.bool_]:
    """Which points lie in the zone beside the blade, (N,), whose face may lean (tangent)."""
    x, y = one.line.points_mm.T
    return np.asarray(x - one.line.u_mm - lean * y <= FACE_DEPTHS * depth_mm)


def within(distance_mm: Floats, deviation_mm: Floats) -> Floats:
    """1 where a distance is within twice its standard uncertainty, 0 where not, NaN where that is unknown."""
    inside = np.abs(distance_mm) <= _COVERAGE * deviation_mm
    return np.where(np.isfinite(distance_mm) & np.isfinite(deviation_mm), inside, np.nan)


def _mean(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else float("nan")


def _percentile(values: Floats, share: float) -> float:
    """Of the size of the values; NaN without any."""
    return float(np.percentile(np.abs(values), share)) if values.size else float("nan")


def _spacing(line_mm: Floats) -> float:
    step = np.hypot(*np.diff(line_mm, axis=0).T)
    step = step[np.isfinite(step)]
    return float(np.median(step)) if step.size else 0.0
