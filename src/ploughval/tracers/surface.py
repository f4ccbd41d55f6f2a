"""The free surface: the likeliest border between air and sand, then its half-level crossing."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter, minimum_filter1d

from ploughval.changing import Changing
from ploughval.tracers.appearance import Appearance, Band
from ploughval.tracers.light import Lighting
from ploughval.tracers.straight import straightened
from ploughval.tracers.surface_kernel import Ints, border_costs, likeliest_path, profiles, surroundings
from ploughval.tracers.view import Cut, Floats, Image, Mask

STEP_PX = 2  # one point of the surface every so many columns
_STIFFNESS = 0.5  # nats a pixel of rise from one point to the next
_HALF_WIDTH_PX = 4  # columns averaged for one profile across the surface
_NEAR_PX, _FAR_PX = 3, 9  # where the levels of air and sand are read, above and below
_STEEPEST = 1.5  # slope of the surface that is still followed
_SKIN_PX = 4  # the uppermost sand, which must look like the uppermost sand at rest
_LEAST_POINTS = 17
_GRAIN_PX = 0.12  # by which half a level differs from where the sand ends: the same along a whole stretch

_RISE, _FALL = 1.4, 1.0  # of the blade's travel, by which the surface may rise or fall between photographs
_SLACK_SHARE, _SLACK_PX = 0.04, 8.0  # ... and of the depth, in any case
_WINDOW = (8, 4, 20)  # half width, nearest and farthest row of what is read above and below a point, px
_FLAT = 0.35  # of the sand's own texture: smoother is no sand
_ROUGHER = 1.5  # times the texture of air: sand that is not cannot be told by it
_STRANGE = 4.0  # times the density of a pixel that looks like nothing known
_AGREE = 15  # points over which such findings are averaged
_FAR_RIM = 40  # points beside a hidden stretch that must not stand further than one travel can bring them
_RIM, _SCRAP = 14, 12  # points beside a hidden stretch, and in a row between two, that are not believed
_BLIND, _BLIND_STD_PX = 12, 3.0  # points in a row without contrast between air and sand; std there, px
_STILL_SHARE, _STILL_PX = 0.03, 3.0  # of the depth, px: a surface that differs less from rest is still
_BESIDE, _DISAGREE_PX = 7, 4.0  # points beside a stretch without contrast, and how far they may differ
_WIDER = 1.5  # times: the strip of a column that was not seen, every photograph
_LEAVES, _BELOW, _ABOVE, _BEYOND = 1, 2, 3, 4
_CAUSES = (
    "",
    "it leaves the picture",
    "what lies below does not look like sand",
    "what lies above does not look like air",
    "it would have moved further than the blade can move it",
)
_NO_ROOM = "no room is left between the blade and the end of the picture"


@dataclass(frozen=True, slots=True)
class SurfaceTrace:
    """The surface in the view: (M,) columns, rows and std, px; ahead of the face, left to right.

    ``hidden``: (K, 2) first and last columns of the stretches that are not seen, ``causes`` why.
    ``top``: (w,) row of the surface in every column, from the last photograph in which it was seen there.
    ``cut_off``: it has moved up to the end of the picture, beyond which more may move.
    """

    column: Floats
    row: Floats
    std_px: Floats
    hidden: Floats
    causes: tuple[str, ...]
    top: Floats
    cut_off: bool = False


@dataclass(frozen=True, slots=True)
class Usual:
    """Texture of the sand below the surface at rest, least and usual, and of the air above it."""

    least: float
    texture: float
    noise: float

    def flat(self, texture: float) -> float:
        """Texture of what is too smooth for sand, in a picture whose usual texture is given.

        Out of focus it is less everywhere. 0 where sand at rest has no more of it than air.
        """
        sharp = min(texture / self.texture, 1.0) if self.texture > 0 else 0.0
        if sharp * self.least < _ROUGHER * self.noise:
            return 0.0
        return float(np.hypot(self.noise, _FLAT * np.sqrt((sharp * self.least) ** 2 - self.noise**2)))


class SurfaceFinder(Changing):
    """Finds the free surface, frame after frame, near where it stood and as far as the blade can move it.

    Parameters
    ----------
    appearance : what sand and air look like at rest
    depth_px : of the blade's tip under the surface at rest
    """

    CHANGES = ("_top", "_missed", "_usual")

    def __init__(self, appearance: Appearance, depth_px: float) -> None:
        self._look = appearance
        self._slack = max(_SLACK_SHARE * depth_px, _SLACK_PX)
        self._still = max(_STILL_SHARE * depth_px, _STILL_PX)
        self._top = appearance.top.astype(float).copy()
        self._missed = np.zeros(len(self._top))
        self._tables = _tables(appearance)
        self._usual: Usual | None = None

    def find(self, image: Cut, lighting: Lighting, face: float, travel: float) -> SurfaceTrace:
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
        if count < _LEAST_POINTS:
            none = np.empty(0)
            return SurfaceTrace(none, none, none, np.empty((0, 2)), (_NO_ROOM,), self._top)
        low, high = self._reach(first, count, travel, self._missed)
        start, rows = self._strips(low, high)
        upper = max(int(start.min()) - _WINDOW[2], 0)
        lower = min(int(start.max()) + rows + _SKIN_PX + _WINDOW[2], image.shape[0])
        band = self._look.band(image, lighting, upper, lower)
        path = self._path(band, first, start - upper, rows)
        column = first + STEP_PX * np.arange(count) + (STEP_PX - 1) / 2
        row, std = _refine(band.grey, column, path - 0.5)
        doubt = self._doubts(band, column, row, path - start + upper, rows)
        row += upper
        once = self._reach(first, count, travel, np.zeros_like(self._missed))
        doubt[_strays(row, doubt > 0, *once) & (doubt == 0)] = _BEYOND
        doubt[(row <= 1.5) | (row >= self._look.rows - 1.5)] = _LEAVES
        seen = _without_scraps(doubt == 0)
        self._remember(column, row, seen)
        hidden, causes = _stretches(column, ~seen, doubt)
        end = int(column[-1])
        cut_off = abs(self._top[end] - self._look.top[end]) > self._still
        return SurfaceTrace(column[seen], row[seen], std[seen], hidden, causes, self._top.copy(), cut_off)

    def _reach(self, first: int, count: int, travel: float, missed: Floats) -> tuple[Floats, Floats]:
        """Rows between which each point may stand, columns having been missed so many times."""
        gone = max(travel, 0.0) if np.isfinite(travel) else 0.0
        size = 2 * int(np.ceil(gone)) + 2 * STEP_PX + 1
        more = _WIDER ** np.minimum(missed, 16)
        low = minimum_filter1d(self._top, size, mode="nearest") - (_RISE * gone + self._slack) * more
        high = maximum_filter1d(self._top, size, mode="nearest") + (_FALL * gone + self._slack) * more
        part = slice(first, first + STEP_PX * count, STEP_PX)
        return low[part], high[part]

    def _strips(self, low: Floats, high: Floats) -> tuple[Ints, int]:
        """Uppermost row in which each point is looked for, and in how many rows."""
        limit = self._look.rows
        low = np.clip(np.floor(low), 0, limit - 4)
        high = np.clip(np.ceil(high), low + 4, limit)
        rows = int((high - low).max())
        return np.clip(low, 0, max(limit - rows, 0)).astype(np.int64), rows

    def _path(self, band: Band, first: int, start: Ints, rows: int) -> Floats:
        """Row of the border in each strip, whole rows of the band."""
        cost = np.empty((len(start), rows + 1))
        place = np.array([first, STEP_PX, _SKIN_PX, self._look.rows - band.first_row])
        known = self._look.known_rows - band.first_row
        limit = min(int(place[3]), len(band.level))
        place[3] = limit
        border_costs((band.grey, band.level, band.change), known, self._tables, place, start, cost)
        reach = int(np.ceil(_STEEPEST * STEP_PX))
        return likeliest_path(cost, start, reach, _STIFFNESS).astype(float)

    def _doubts(self, band: Band, column: Floats, row: Floats, place: Floats, rows: int) -> Ints:
        """Why each point is not believed, an index into _CAUSES; 0: it is."""
        known = self._look.known_rows - band.first_row
        around = surroundings((band.grey, band.level, band.change), known, self._tables, column, row, _WINDOW)
        around = np.where(np.isnan(around), np.inf, around)  # beyond the view nothing is doubted
        sand, texture, air, noise = median_filter(around, (_AGREE, 1), mode="nearest").T
        if self._usual is None:
            self._usual = Usual(_share(texture, 0.05), _share(texture, 0.5), _share(noise, 0.5))
        flat = self._usual.flat(_share(texture, 0.5))
        doubt = np.zeros(len(row), np.int64)
        pressed = (place <= 1) | (place >= rows - 1)
        pressed = median_filter(pressed, _AGREE, mode="nearest")
        doubt[pressed] = _BEYOND
        doubt[air < _STRANGE * self._look.unknown_air] = _ABOVE
        doubt[(sand < _STRANGE * self._look.unknown_sand) | (texture < flat)] = _BELOW
        return doubt

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


def _strays(row: Floats, hidden: Mask, low: Floats, high: Floats) -> Mask:
    """Points beside hidden ones that stand where only the widened strip of a missed column lets them."""
    beside = maximum_filter1d(hidden.astype(np.uint8), 2 * _FAR_RIM + 1, mode="nearest") > 0
    return np.asarray(beside & ((row < low) | (row > high)))


def _share(value: Floats, share: float) -> float:
    """Quantile of the finite values; 0 without any."""
    finite = value[np.isfinite(value)]
    return float(np.quantile(finite, share)) if len(finite) else 0.0


def _without_scraps(seen: Mask) -> Mask:
    """Seen points without those at the rims of hidden stretches, and without short stretches between two.

    The border leaves the surface before the window below it is wholly covered.
    """
    rimmed = np.asarray(minimum_filter1d(seen.astype(np.uint8), 2 * _RIM + 1, mode="nearest") > 0)
    edge = np.flatnonzero(np.diff(np.concatenate([[False], rimmed, [False]]).astype(int)))
    for first, last in zip(edge[::2], edge[1::2], strict=True):
        if last - first < _SCRAP and not (first == 0 and last == len(seen)):
            rimmed[first:last] = False
    return rimmed


def _stretches(column: Floats, hidden: Mask, doubt: Ints) -> tuple[Floats, tuple[str, ...]]:
    """First and last columns of successive points that are hidden, (K, 2), and the commonest causes."""
    edge = np.flatnonzero(np.diff(np.concatenate([[False], hidden, [False]]).astype(int)))
    causes = []
    for first, last in zip(edge[::2], edge[1::2], strict=True):
        count = np.bincount(doubt[first:last], minlength=len(_CAUSES))
        causes.append(_CAUSES[1 + int(np.argmax(count[1:]))])
    return np.column_stack([column[edge[::2]], column[edge[1::2] - 1]]), tuple(causes)


def _refine(grey: Image, column: Floats, row: Floats) -> tuple[Floats, Floats]:
    """Rows where the grey passes half-way between air and sand, read from straight pieces; their std."""
    crossing = row
    for _ in range(2):
        smooth = straightened(median_filter(crossing, 5, mode="nearest"))[0]
        found = _half_level(grey, column, smooth)
        lost = ~np.isfinite(found)
        if lost.all():
            return row, np.full(len(row), _BLIND_STD_PX)
        crossing = row + _offsets(smooth + found - row, lost)
    value, _, scatter = straightened(crossing)
    lonely = np.abs(crossing - value) > 3 * np.maximum(scatter, 0.3)
    value, std, _ = straightened(np.where(lonely, value, crossing))
    std = np.hypot(std, _GRAIN_PX)
    blind = minimum_filter1d(median_filter(lost.astype(np.uint8), _AGREE, mode="nearest"), _BLIND)
    blind = maximum_filter1d(blind, _BLIND) > 0
    return value, np.maximum(std, np.where(blind, _BLIND_STD_PX, np.where(lost, 1.0, 0.0)))


def _offsets(off: Floats, lost: Mask) -> Floats:
    """Offsets of crossings from the likeliest border; without one those on both sides, if they agree."""
    index = np.arange(len(off))
    filled = np.interp(index, index[~lost], off[~lost])
    edge = np.flatnonzero(np.diff(np.concatenate([[False], lost, [False]]).astype(int)))
    for first, last in zip(edge[::2], edge[1::2], strict=True):
        before, after = off[max(first - _BESIDE, 0) : first], off[last : last + _BESIDE]
        sides = [float(np.nanmedian(v)) for v in (before, after) if np.isfinite(v).any()]
        if max(sides, default=0.0) - min(sides, default=0.0) > _DISAGREE_PX:
            filled[first:last] = 0.0
    return filled


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
