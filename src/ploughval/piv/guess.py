"""First guesses: dense inverse search flow (Kroeger et al. 2016), and the motion of neighbours."""

from dataclasses import dataclass
from threading import Lock
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ploughval.axes import Status
from ploughval.piv.subsets import Fit, Floats, Pair, match, moved_at
from ploughval.piv.validate import gather, judge_correlation, neighbours_of

MARGIN = 128
"""Flow is computed this far around the points, px."""
LARGE = 1_500_000
"""Pictures of more pixels are halved for the flow."""
HOPEFUL = (Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.OUTLIER)
_ONE_THREAD = Lock()
"""OpenCV's number of threads is one for the whole process."""
NEAR = 6
"""Valid neighbours whose motion is carried on to a point."""


@dataclass(frozen=True, slots=True)
class Greys:
    """Copies of two pictures for guesses only: 8 bit, or float32 where they were shrunk."""

    reference: NDArray[Any]
    current: NDArray[Any]


def to_8bit(image: NDArray[np.generic], like: NDArray[np.generic] | None = None) -> NDArray[np.uint8]:
    """8 bit copy, stretched over the bulk of the grey levels (of ``like``, where given)."""
    if image.dtype == np.uint8:
        return np.asarray(image, np.uint8)
    sample = np.asarray(image if like is None else like)[::7, ::7].astype(np.float64)
    low, high = np.nanpercentile(sample, (0.5, 99.5))
    gain = 255.0 / max(float(high - low), 1e-12)
    if image.dtype == np.uint16:  # a table of all levels is six times as fast
        return _as_bytes(np.take(_scaled(np.arange(1 << 16), float(low), gain), np.asarray(image, np.uint16)))
    return _as_bytes(_scaled(image, float(low), gain))


def _scaled(image: NDArray[np.generic], low: float, gain: float) -> NDArray[np.uint8]:
    scaled = (np.asarray(image, np.float32) - np.float32(low)) * np.float32(gain)
    return np.asarray(np.clip(np.nan_to_num(scaled), 0, 255), np.uint8)


def _as_bytes(image: NDArray[np.generic]) -> NDArray[np.uint8]:
    return np.ascontiguousarray(image, np.uint8)


def flow_at(greys: Greys, points: Floats) -> Floats:
    """Displacement (N, 2) px at points from dense flow; zero where the pictures are too small for it."""
    height, width = greys.reference.shape
    low = np.clip(np.floor(points.min(axis=0)) - MARGIN, 0, [width - 1, height - 1]).astype(int)
    high = np.clip(np.ceil(points.max(axis=0)) + MARGIN + 1, 1, [width, height]).astype(int)
    window = (slice(low[1], high[1]), slice(low[0], high[0]))
    a, b = _as_bytes(greys.reference[window]), _as_bytes(greys.current[window])
    factor = 2 if a.size > LARGE else 1
    if factor == 2:
        size = (a.shape[1] // 2, a.shape[0] // 2)
        a, b = (_as_bytes(cv2.resize(im, size, interpolation=cv2.INTER_AREA)) for im in (a, b))
    if min(a.shape) < 32:
        return np.zeros((len(points), 2))
    flow = _dense_flow(a, b)
    place = np.round((points - low) / factor).astype(int)
    place = np.clip(place, 0, [flow.shape[1] - 1, flow.shape[0] - 1])
    return np.asarray(flow[place[:, 1], place[:, 0]] * factor, np.float64)


def _dense_flow(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Flow (h, w, 2) in one thread.

    OpenCV cuts the picture in as many stripes as it has threads and searches each on its own, so that the
    flow may depend on their number.
    """
    with _ONE_THREAD:
        threads = cv2.getNumThreads()
        cv2.setNumThreads(1)
        try:
            search = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_FAST)  # type: ignore[attr-defined]
            return np.asarray(search.calc(a, b, None), np.float32)
        finally:
            cv2.setNumThreads(threads)


def carried_on(
    known: Floats, params: Floats, points: Floats, half_px: float, reach_px: float = np.inf
) -> Floats:
    """Parameters (F, 2, terms) at points from the affine motion of their nearest known neighbours.

    The median over at most NEAR neighbours within reach of what each would give the point, with the median of
    their gradients; NaN where there is none. ``half_px``: half a subset, what gradients refer to.
    """
    out = np.full((len(points), *params.shape[1:]), np.nan)
    if len(known) == 0 or len(points) == 0:
        return out
    count = min(NEAR, len(known))
    distance, near = cKDTree(known).query(points, k=count, distance_upper_bound=reach_px)
    distance, near = distance.reshape(len(points), count), near.reshape(len(points), count)
    some = np.flatnonzero(np.isfinite(distance[:, 0]))
    around = gather(params, near[some])  # (F, K, 2, terms)
    offset = (points[some, None] - gather(known, near[some])) / half_px
    around[:, :, :, 0] = moved_at(around, offset)
    out[some] = np.nanmedian(around, axis=1)
    return out


def median_of_nearest(known: Floats, values: Floats, points: Floats, count: int = 12) -> Floats:
    """Median (F, 2) of the values (K, 2) at the known ones among the nearest of all places.

    NaN where none of these is known: deep among points that failed nothing tells how they moved.
    """
    out = np.full((len(points), 2), np.nan)
    if len(known) < 3 or len(points) == 0:
        return out
    both = np.concatenate([known, points])
    around = gather(
        np.concatenate([values, out]), neighbours_of(both, min(count, len(both) - 1))[len(known) :]
    )
    some = np.isfinite(around[:, :, 0]).any(axis=1)
    out[some] = np.nanmedian(around[some], axis=1)
    return out


def retry(
    pair: Pair,
    fit: Fit,
    points: Floats,
    index: NDArray[np.intp],
    start: Floats,
    zncc_min: float,
    *,
    beside: bool = False,
) -> int:
    """Match points again from other parameters; keeps what becomes valid, returns how many did.

    ``beside``: the parameters come from points beside them, so that a subset that leaves the picture has.
    """
    known = np.isfinite(start).all(axis=(1, 2))
    index, start = index[known], start[known]
    if index.size == 0:
        return 0
    new = match(pair, points[index], start)
    merged = Fit(fit.params.copy(), fit.stats.copy(), fit.status.copy())
    merged.put(index, new)
    judge_correlation(merged, zncc_min, pair.noise_variance)
    better = index[merged.status[index] == Status.OK]
    fit.put(better, merged.take(better))
    if beside:
        fit.status[index[merged.status[index] == Status.EDGE]] = Status.EDGE
    return int(better.size)


def failed_points(fit: Fit) -> NDArray[np.intp]:
    """Points that another guess may help."""
    return np.flatnonzero(np.isin(fit.status, HOPEFUL))


def spread_by_neighbours(pair: Pair, fit: Fit, points: Floats, zncc_min: float, rounds: int = 40) -> None:
    """Second tries from the motion of valid neighbours, outwards, as long as they succeed."""
    for turn in range(rounds):
        failed = failed_points(fit)
        valid = np.flatnonzero(fit.status == Status.OK)
        if failed.size == 0 or valid.size == 0:
            return
        # First everyone, from however far; then only those that have found points beside them.
        reach = 2.5 * spacing_of(points) if turn else np.inf
        start = carried_on(points[valid], fit.params[valid], points[failed], pair.recipe.half, reach)
        if retry(pair, fit, points, failed, start, zncc_min, beside=turn > 0) == 0:
            return


def spacing_of(points: Floats) -> float:
    """Usual distance of points, px: the median to the nearest other one."""
    if len(points) < 2:
        return 1.0
    some = points[:: max(1, len(points) // 256)]
    return float(max(np.median(cKDTree(points).query(some, k=2)[0][:, 1]), 1.0))
