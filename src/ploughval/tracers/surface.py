"""The free surface: the likeliest border between air and sand, then its half-level crossing."""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import maximum_filter1d, median_filter, minimum_filter1d

from ploughval.tracers.appearance import Appearance, Band
from ploughval.tracers.light import Lighting
from ploughval.tracers.surface_kernel import Ints, border_costs, likeliest_path, profiles, surroundings
from ploughval.tracers.view import Floats, Image, Levels, Mask

STEP_PX = 2  # one point of the surface every so many columns
_STIFFNESS = 0.5  # nats a pixel of rise from one point to the next
_HALF_WIDTH_PX = 4  # columns averaged for one profile across the surface
_NEAR_PX, _FAR_PX = 3, 9  # where the levels of air and sand are read, above and below
_STEEPEST = 1.5  # slope of the surface that is still followed
_SKIN_PX = 4  # the uppermost sand, which must look like the uppermost sand at rest
_SMOOTH = 17  # points in the line that a surface point is read from
_STD_FLOOR_PX = 0.05

_RISE, _FALL = 1.4, 1.0  # of the blade's travel, by which the surface may rise or fall between photographs
_SLACK_SHARE, _SLACK_PX = 0.04, 8.0  # ... and of the depth, in any case
_WINDOW = (8, 4, 20)  # half width, nearest and farthest row of what is read above and below a point, px
_FLAT = 0.4  # of the sand's usual standard deviation: smoother is no sand
_STRANGE_GREY = 0.35  # of the range of the sand's greys at rest, beyond it
_NO_AIR = 4.0  # times the density of a pixel that looks like nothing known
_AGREE = 15  # points over which such findings are averaged
_LEAST_SEEN = 0.05  # of the points: fewer are no surface


@dataclass(frozen=True, slots=True)
class SurfaceTrace:
    """The surface in the view: (M,) columns, rows and std, px; ahead of the face, left to right.

    ``hidden``: (K, 2) first and last columns of the stretches that are not seen. ``top``: (w,) row of
    the surface in every column, from the last photograph in which it was seen there.
    """

    column: Floats
    row: Floats
    std_px: Floats
    hidden: Floats
    top: Floats


class SurfaceFinder:
    """Finds the free surface, frame after frame, near where it stood and as far as the blade can move it.

    Parameters
    ----------
    appearance : what sand and air look like at rest
    depth_px : of the blade's tip under the surface at rest
    """

    def __init__(self, appearance: Appearance, depth_px: float) -> None:
        self._look = appearance
        self._slack = max(_SLACK_SHARE * depth_px, _SLACK_PX)
        self._top = appearance.top.astype(float).copy()
        self._missed = np.zeros(len(self._top))
        self._tables = _tables(appearance)
        self._usual: tuple[float, float, float] | None = None

    def find(self, image: Levels, lighting: Lighting, face: float, travel: float) -> SurfaceTrace:
        """The free surface ahead of the face, to a part of a pixel.

        Parameters
        ----------
        image : (h, w) uint8 or uint16
            Frame on the grid.
        lighting : Lighting
            Its light against the first frame's.
        face : float
            Column of the blade's face.
        travel : float
            Columns the face has gone since the frame before.
        """
        width = image.shape[1]
        first = max(int(np.ceil(face)) + 2, 0)
        count = (width - first) // STEP_PX
        if count < _SMOOTH:
            none = np.empty(0)
            return SurfaceTrace(none, none, none, np.array([[first, width - 1.0]]), self._top)
        start, rows = self._strips(first, count, travel)
        upper = max(int(start.min()) - _WINDOW[2], 0)
        lower = min(int(start.max()) + rows + _SKIN_PX + _WINDOW[2], image.shape[0])
        band = self._look.band(image, lighting, upper, lower)
        path = self._path(band, first, start - upper, rows)
        column = first + STEP_PX * np.arange(count) + (STEP_PX - 1) / 2
        row, std = _refine(band.grey, column, path - 0.5)
        seen = self._plausible(band, column, row, path - start + upper, rows)
        row += upper
        seen &= (row > 1.5) & (row < self._look.rows - 1.5)
        if seen.mean() < _LEAST_SEEN:
            seen[:] = False
        self._remember(column, row, seen)
        return SurfaceTrace(column[seen], row[seen], std[seen], _stretches(column, ~seen), self._top.copy())

    def _strips(self, first: int, count: int, travel: float) -> tuple[Ints, int]:
        """Uppermost row in which each point may stand, and how many rows it may take."""
        gone = max(travel, 0.0) if np.isfinite(travel) else 0.0
        size = 2 * int(np.ceil(gone)) + 2 * STEP_PX + 1
        more = 2.0 ** np.minimum(self._missed, 12)
        low = minimum_filter1d(self._top, size, mode="nearest") - (_RISE * gone + self._slack) * more
        high = maximum_filter1d(self._top, size, mode="nearest") + (_FALL * gone + self._slack) * more
        part = slice(first, first + STEP_PX * count, STEP_PX)
        limit = self._look.rows
        low = np.clip(np.floor(low[part]), 0, limit - 4)
        high = np.clip(np.ceil(high[part]), low + 4, limit)
        rows = int((high - low).max())
        return np.clip(low, 0, max(limit - rows, 0)).astype(np.int64), rows

    def _path(self, band: Band, first: int, start: Ints, rows: int) -> Floats:
        """Row of the border in each strip, whole rows of the band."""
        cost = np.empty((len(start), rows + 1))
        place = np.array([first, STEP_PX, _SKIN_PX, self._look.rows - band.first_row])
        known = self._look.known_rows - band.first_row
        limit = min(int(place[3]), len(band.level))
        place[3] = limit
        border_costs(band.level, band.change, known, self._tables, place, start, cost)
        reach = int(np.ceil(_STEEPEST * STEP_PX))
        return likeliest_path(cost, start, reach, _STIFFNESS).astype(float)

    def _plausible(self, band: Band, column: Floats, row: Floats, place: Floats, rows: int) -> Mask:
        """Whether sand lies below each point and air above it, and it does not press against its strip."""
        known = self._look.known_rows - band.first_row
        around = surroundings((band.grey, band.level, band.change), known, self._tables, column, row, _WINDOW)
        around = median_filter(around, (_AGREE, 1), mode="nearest")
        mean, std, air = around.T
        if self._usual is None:
            low, high = np.nanpercentile(mean, [1, 99])
            spread = _STRANGE_GREY * float(self._look.sand_range)
            self._usual = (low - spread, high + spread, float(np.nanmedian(std)))
        low, high, usual = self._usual
        usual = min(usual, float(np.nanmedian(std))) if np.isfinite(std).any() else usual
        sand = ~((mean < low) | (mean > high) | (std < _FLAT * usual))
        clear = ~(air < _NO_AIR * self._look.unknown_air)
        pressed = (place <= 1) | (place >= rows - 1)
        pressed = median_filter(pressed, _AGREE, mode="nearest")
        return np.asarray(sand & clear & ~pressed)

    def _remember(self, column: Floats, row: Floats, seen: Mask) -> None:
        """Keep the surface where it was seen; elsewhere keep what was known, and look wider next time."""
        first, last = int(column[0]), int(np.ceil(column[-1])) + 1
        shown = np.zeros(len(self._top), bool)
        shown[first:last] = np.repeat(seen, STEP_PX)[: last - first]
        if shown.any():
            inside = np.flatnonzero(shown)
            self._top[inside] = np.interp(inside, column[seen], row[seen])
        self._missed[first:last] += 1
        self._missed[shown] = 0


def _tables(appearance: Appearance) -> Image:
    """The tables of an appearance in one array, as the kernels take them."""
    t = appearance.tables
    return np.concatenate([np.stack([t.air, t.skin, t.sand]), t.same.reshape(-1, len(t.air))])


def _stretches(column: Floats, hidden: Mask) -> Floats:
    """First and last columns of successive points that are hidden, (K, 2)."""
    edge = np.flatnonzero(np.diff(np.concatenate([[False], hidden, [False]]).astype(int)))
    return np.column_stack([column[edge[::2]], column[edge[1::2] - 1]])


def _refine(grey: Image, column: Floats, row: Floats) -> tuple[Floats, Floats]:
    """Rows where the grey passes half-way between air and sand, smoothed along the surface, and their std."""
    crossing = row
    for _ in range(2):
        smooth = _line_fit(median_filter(crossing, 5, mode="nearest"))[0]
        found = _half_level(grey, column, smooth)
        lost = ~np.isfinite(found)
        crossing = np.where(lost, row, smooth + np.nan_to_num(found))
    value, scatter = _line_fit(crossing)
    lonely = np.abs(crossing - value) > 3 * np.maximum(scatter, 0.3)
    value, scatter = _line_fit(np.where(lonely, value, crossing))
    # Grains and the averaging along the surface leave about three independent values in a window:
    # its mean is then about as uncertain as its scatter, and the scatter itself badly known.
    std = np.maximum(np.maximum(scatter, np.median(scatter)), _STD_FLOOR_PX)
    return value, np.where(lost, np.maximum(std, 1.0), std)


def _half_level(grey: Image, column: Floats, row: Floats) -> Floats:
    """Offset of the half-level crossing from each row, px; NaN without contrast or crossing."""
    across = np.arange(-_FAR_PX, _FAR_PX + 1)
    slope = np.asarray(np.gradient(row, column))
    profile = profiles(grey, column, row, slope, _HALF_WIDTH_PX, _FAR_PX)
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
