"""The free surface: the likeliest border between air and sand, then its half-level crossing."""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import map_coordinates, median_filter

from ploughval.tracers.masks import Likelihood
from ploughval.tracers.view import Floats, Image

STEP_PX = 2  # one point of the surface every so many columns
_STIFFNESS = 0.5  # nats a pixel of rise from one point to the next
_HALF_WIDTH_PX = 4  # columns averaged for one profile across the surface
_NEAR_PX, _FAR_PX = 3, 9  # where the levels of air and sand are read, above and below
_STEEPEST = 1.5  # slope of the surface that is still followed
_SKIN_PX = 4  # the uppermost sand, which must look like the uppermost sand at rest
_SMOOTH = 17  # points in the line that a surface point is read from
_STD_FLOOR_PX = 0.05


@dataclass(frozen=True, slots=True)
class SurfaceTrace:
    """The surface in the view: (M,) columns, rows and std, px; ahead of the face, left to right."""

    column: Floats
    row: Floats
    std_px: Floats


def trace_surface(image: Image, fit: Likelihood, face: float) -> SurfaceTrace:
    """The free surface ahead of the face, to a part of a pixel.

    Parameters
    ----------
    image : (h, w) float32
        Frame on the grid.
    fit : Likelihood
        How well each pixel fits air, skin and sand.
    face : float
        Column of the blade's face.

    Returns
    -------
    SurfaceTrace
        Without points where the surface leaves the view or where the sand ends.
    """
    first = max(int(np.ceil(face)) + 2, 0)
    count = (fit.air.shape[1] - first) // STEP_PX
    if count < _SMOOTH:
        return SurfaceTrace(*np.empty((3, 0)))
    column = first + STEP_PX * np.arange(count) + (STEP_PX - 1) / 2
    part = slice(first, first + STEP_PX * count)
    row = likeliest_path(border_cost(fit, part)) - 0.5
    row, std = _refine(image, column, row)
    seen = (row > 1.5) & (row < fit.air.shape[0] - 1.5)
    return SurfaceTrace(column[seen], row[seen], std[seen])


def border_cost(fit: Likelihood, part: slice) -> Floats:
    """Cost of the border standing above each row, (rows + 1, points): air above, skin below it, then sand."""
    air, skin, sand = (_heaped(v[:, part]) for v in (fit.air, fit.skin, fit.sand))
    below = np.minimum(np.arange(len(air)) + _SKIN_PX, len(air) - 1)
    return np.asarray(-(air + skin[below] - skin + sand[-1] - sand[below]))


def likeliest_path(cost: Floats) -> Floats:
    """Row of least total cost in each column: rises cost in proportion, up to the steepest slope.

    Dynamic programming (Viterbi 1967).

    Parameters
    ----------
    cost : (rows, columns) float
        Cost of each row in each column.

    Returns
    -------
    (columns,) float, whole rows
    """
    rows = np.arange(cost.shape[0])
    reach = int(np.ceil(_STEEPEST * STEP_PX))
    price = _STIFFNESS * np.abs(np.arange(-reach, reach + 1))
    total = np.empty((cost.shape[1], cost.shape[0]))
    total[0] = cost[:, 0]
    for k in range(1, cost.shape[1]):
        around = sliding_window_view(np.pad(total[k - 1], reach, constant_values=np.inf), 2 * reach + 1)
        total[k] = cost[:, k] + (around + price).min(axis=1)
    path = np.empty(cost.shape[1], dtype=int)
    path[-1] = np.argmin(total[-1])
    for k in range(cost.shape[1] - 2, -1, -1):
        rise = np.abs(rows - path[k + 1])
        path[k] = np.argmin(np.where(rise <= reach, total[k] + _STIFFNESS * rise, np.inf))
    return path.astype(float)


def _heaped(value: Image) -> Floats:
    """Sums over all rows above, of means over each point's columns, (rows + 1, points)."""
    mean = value.reshape(len(value), -1, STEP_PX).mean(axis=2, dtype=float)
    return np.concatenate([np.zeros((1, mean.shape[1])), np.cumsum(mean, axis=0)])


def _refine(image: Image, column: Floats, row: Floats) -> tuple[Floats, Floats]:
    """Rows where the grey passes half-way between air and sand, smoothed along the surface, and their std."""
    crossing = row
    for _ in range(2):
        smooth = _line_fit(median_filter(crossing, 5, mode="nearest"))[0]
        found = _half_level(image, column, smooth)
        lost = ~np.isfinite(found)
        crossing = np.where(lost, row, smooth + np.nan_to_num(found))
    value, scatter = _line_fit(crossing)
    lonely = np.abs(crossing - value) > 3 * np.maximum(scatter, 0.3)
    value, scatter = _line_fit(np.where(lonely, value, crossing))
    # Grains and the averaging along the surface leave about three independent values in a window:
    # its mean is then about as uncertain as its scatter, and the scatter itself badly known.
    std = np.maximum(np.maximum(scatter, np.median(scatter)), _STD_FLOOR_PX)
    return value, np.where(lost, np.maximum(std, 1.0), std)


def _half_level(image: Image, column: Floats, row: Floats) -> Floats:
    """Offset of the half-level crossing from each row, px; NaN without contrast or crossing."""
    across = np.arange(-_FAR_PX, _FAR_PX + 1)
    along = np.arange(-_HALF_WIDTH_PX, _HALF_WIDTH_PX + 1)
    slope = np.gradient(row, column)
    cols = np.broadcast_to(
        column[:, None, None] + along[None, :, None], (len(column), len(along), len(across))
    )
    rows = (row[:, None] + slope[:, None] * along)[:, :, None] + across
    profile = map_coordinates(image, [rows, cols], order=1, mode="nearest").mean(axis=1)
    above, below = profile[:, : _FAR_PX - _NEAR_PX + 1], profile[:, _FAR_PX + _NEAR_PX :]
    contrast = below.mean(axis=1) - above.mean(axis=1)
    noise = np.hypot(above.std(axis=1), below.std(axis=1)) + 1e-9
    share = (profile - above.mean(axis=1)[:, None]) / np.where(contrast == 0, np.inf, contrast)[:, None]
    low, high = share[:, :-1], share[:, 1:]
    rises = (low < 0.5) & (high >= 0.5)
    at = across[:-1] + np.where(rises, (0.5 - low) / np.where(rises, high - low, 1.0), 0.0)
    distance = np.where(rises, np.abs(at), np.inf)
    best = np.argmin(distance, axis=1)
    index = np.arange(len(at))
    good = (distance[index, best] <= _NEAR_PX + 2) & (np.abs(contrast) > noise)
    return np.where(good, at[index, best], np.nan)


def _line_fit(value: Floats) -> tuple[Floats, Floats]:
    """Straight line through each point's neighbours: value at the point, and scatter about it.

    Of three windows, about the point and to either side of it, the one with the least scatter counts
    (Nagao and Matsuyama 1979): a kink, where a band comes out, is not rounded off.
    """
    half = _SMOOTH // 2
    window = sliding_window_view(np.pad(value, _SMOOTH - 1, mode="reflect", reflect_type="odd"), _SMOOTH)
    place = np.arange(_SMOOTH) - half
    mean = window.mean(axis=1)
    slope = window @ place / np.sum(place**2)
    residual = window - mean[:, None] - slope[:, None] * place
    scatter = np.sqrt(np.sum(residual**2, axis=1) / (_SMOOTH - 2))
    count = len(value)
    shifts = np.array([0, -half, half])
    index = np.arange(count) + half + shifts[:, None]
    at = mean[index] - slope[index] * shifts[:, None]
    preferred = scatter[index] * np.array([1.0, 1.5, 1.5])[:, None]
    best = np.argmin(preferred, axis=0)
    return at[best, np.arange(count)], scatter[index][best, np.arange(count)]
