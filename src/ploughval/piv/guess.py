"""First guesses: dense inverse search flow (Kroeger et al. 2016), neighbours, template search."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.subsets import Fit, Floats, Pair, centres_of, match, params_from
from ploughval.piv.validate import gather, judge_correlation, neighbours_of

MARGIN = 128
"""Flow is computed this far around the points, px."""
LARGE = 1_500_000
"""Pictures of more pixels are halved for the flow."""
HOPEFUL = (Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.OUTLIER)
ROUNDS = 12
SEARCHED = 24
"""Points that are searched by template in one round."""


@dataclass(frozen=True, slots=True)
class Greys:
    """8 bit copies of two pictures, for guesses only."""

    reference: NDArray[np.uint8]
    current: NDArray[np.uint8]


def to_8bit(image: NDArray[np.generic], like: NDArray[np.generic] | None = None) -> NDArray[np.uint8]:
    """8 bit copy, stretched over the bulk of the grey levels (of ``like``, where given)."""
    if image.dtype == np.uint8:
        return np.asarray(image, np.uint8)
    sample = np.asarray(image if like is None else like)[::7, ::7].astype(np.float64)
    low, high = np.nanpercentile(sample, (0.5, 99.5))
    gain = 255.0 / max(float(high - low), 1e-12)
    scaled = (np.asarray(image, np.float32) - np.float32(low)) * np.float32(gain)
    return _as_bytes(np.clip(np.nan_to_num(scaled), 0, 255).astype(np.uint8))


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
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        search = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)  # type: ignore[attr-defined]
        return np.asarray(search.calc(a, b, None), np.float32)
    finally:
        cv2.setNumThreads(threads)


def search_template(
    greys: Greys, point: Floats, prior: Floats, side: int, radius: int
) -> tuple[Floats, float]:
    """Integer displacement of one subset by correlation in a window about a prior, and its coefficient.

    Returns NaN and 0 where the subset or the window leaves the picture.
    """
    height, width = greys.reference.shape
    half = side // 2
    cx, cy = centres_of(point[None])[0]
    nothing = np.full(2, np.nan), 0.0
    if cx < half or cy < half or cx >= width - half or cy >= height - half:
        return nothing
    template = greys.reference[cy - half : cy + half + 1, cx - half : cx + half + 1]
    x0, y0 = (np.array([cx, cy]) + np.round(prior).astype(int) - half - radius).tolist()
    x1, y1 = min(x0 + side + 2 * radius, width), min(y0 + side + 2 * radius, height)
    x0, y0 = max(x0, 0), max(y0, 0)
    if x1 - x0 < side or y1 - y0 < side or np.ptp(template) == 0:
        return nothing
    scores = cv2.matchTemplate(greys.current[y0:y1, x0:x1], template, cv2.TM_CCOEFF_NORMED)
    _, best, _, (bx, by) = cv2.minMaxLoc(scores)
    return np.array([x0 + bx + half - cx, y0 + by + half - cy], float), float(best)


def guess_by_neighbours(fit: Fit, points: Floats, failed: NDArray[np.intp]) -> Floats:
    """Median displacement (F, 2) of the nearest valid points, NaN where nothing is valid."""
    valid = np.flatnonzero(fit.status == Status.OK)
    if valid.size == 0:
        return np.full((failed.size, 2), np.nan)
    both = np.concatenate([points[valid], points[failed]])
    count = min(12, len(both) - 1)
    near = neighbours_of(both, count)[valid.size :]
    moved = np.concatenate([fit.params[valid, :, 0], np.full((failed.size, 2), np.nan)])
    around = gather(moved, near)
    out = np.full((failed.size, 2), np.nan)
    some = np.isfinite(around[:, :, 0]).any(axis=1)
    out[some] = np.nanmedian(around[some], axis=1)
    return out


def retry(
    pair: Pair, fit: Fit, points: Floats, index: NDArray[np.intp], moved: Floats, zncc_min: float
) -> int:
    """Match points again from other displacements; keeps what becomes valid, returns how many did."""
    index, moved = index[np.isfinite(moved).all(axis=1)], moved[np.isfinite(moved).all(axis=1)]
    if index.size == 0:
        return 0
    new = match(pair, points[index], params_from(moved, pair.recipe))
    merged = Fit(fit.params.copy(), fit.stats.copy(), fit.status.copy())
    merged.put(index, new)
    judge_correlation(merged, zncc_min)
    better = index[merged.status[index] == Status.OK]
    fit.put(better, merged.take(better))
    gone = index[merged.status[index] == Status.EDGE]
    fit.status[gone] = Status.EDGE
    return int(better.size)


def failed_points(fit: Fit) -> NDArray[np.intp]:
    """Points that another guess may help."""
    return np.flatnonzero(np.isin(fit.status, HOPEFUL))


def spread_by_neighbours(pair: Pair, fit: Fit, points: Floats, zncc_min: float, rounds: int = 8) -> None:
    """Second tries from the neighbours' motion, as long as they succeed."""
    for _ in range(rounds):
        failed = failed_points(fit)
        if failed.size == 0:
            return
        if retry(pair, fit, points, failed, guess_by_neighbours(fit, points, failed), zncc_min) == 0:
            return


def search_failed(pair: Pair, greys: Greys, fit: Fit, points: Floats, zncc_min: float) -> None:
    """Template search for some of the failed points, in windows that grow; their neighbours follow."""
    side = pair.recipe.subset
    widest = min(128, min(greys.reference.shape) // 3)
    radius = 16
    for _ in range(ROUNDS):
        failed = failed_points(fit)
        if failed.size == 0 or radius > widest:
            return
        some = failed[np.linspace(0, failed.size - 1, min(SEARCHED, failed.size)).astype(int)]
        prior = np.nan_to_num(guess_by_neighbours(fit, points, some))
        found = [search_template(greys, p, q, side, radius) for p, q in zip(points[some], prior, strict=True)]
        moved = np.array([m for m, _ in found])
        if retry(pair, fit, points, some, moved, zncc_min) > 0:
            spread_by_neighbours(pair, fit, points, zncc_min)
        else:
            radius *= 2
