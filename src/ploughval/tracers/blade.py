"""The blade's face in each photograph: its body recognised, its face read at the half-level crossing."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from ploughval.changing import Changing
from ploughval.scene import Blade
from ploughval.tracers.light import Lighting, densest_half
from ploughval.tracers.view import Cut, Floats, View

_BLOCKS = 32  # rows are gathered in blocks: each reads the face for itself, their scatter gives the std
_MARGIN_PX = 2.0  # the face's blur, kept out of the body
_SIDE_PX = 6  # columns read on either side of the face
_TRIES_PX = (0.0, -2.0, 2.0, -4.0, 4.0)
_BLUR_PX = 2  # columns on either side of the face that may show some of both
_REACH_PX = 2.5  # the face stands no further from where the body's match puts it
_LEAST_CONTRAST = 4.0  # of the face against the noise of a block's mean
_GRAIN_PX = 0.07  # by which grains at the face shift it: the same in all blocks
_ALIKE = 0.3  # of the contrast: a block nearer to the body at rest than this shows the body
_LEAST_ALIKE = 0.5  # of the share of such blocks in earlier frames: with fewer something hides the blade
_LEAST_ALIKE_FAR = 0.8  # ... where the face stands far from where it was expected
_SLOW = 0.1  # of the width: std over which the light along the sand is smoothed for the blade
_EQUAL = 0.03  # of the contrast: matches as good as the best one
_EQUAL_SHARE, _EQUAL_PX = 0.5, 3.0  # of the body, px: one place's good matches reach no further
_STRONGER = 2.0  # times: a crossing beside the one that was looked for counts if it stands out so much more
_FAR_STEPS, _FAR_PX = 1.0, 3.0


@dataclass(frozen=True, slots=True)
class BladeSight:
    """Where the face stands in the view: column and its std, px; NaN where it was not found."""

    column: float
    std_px: float


class BladeFinder(Changing):
    """Finds the blade's face, frame after frame, from what the blade looks like at rest.

    Parameters
    ----------
    view : grid of the photographs
    blade : settings of the blade
    image : (h, w) uint8 or uint16, the first frame on the grid: the face stands at x = 0
    light : (w,) float, how bright each column is at rest, relative to the others; None: alike
    """

    CHANGES = ("_before", "_last", "_step", "_missed", "_alike")

    def __init__(self, view: View, blade: Blade, image: Cut, light: Floats | None = None) -> None:
        width = image.shape[1]
        self._light = np.ones(width)
        if light is not None:
            self._light = np.asarray(gaussian_filter1d(light, _SLOW * width, mode="nearest"))
        self._rows = max(int(view.row(0.0)) - 2, 4)
        self._rest = float(view.column(0.0))
        thickness = blade.thickness_mm / view.step_mm
        margin = min(_MARGIN_PX, thickness / 4)
        first = max(round(self._rest - thickness + margin), 0)
        last = max(round(self._rest - margin), first + 1)
        self._body = slice(first, last)
        profile = self._profile(image, None, 0, image.shape[1])
        even = profile / self._light
        self._template = even[:, self._body]
        self._level = np.median(self._template, axis=1)
        middle, high = np.percentile(np.abs(even - self._level[:, None]), [50, 90])
        self._cap = float(max(middle, high / 2))
        self._alike = 1.0
        seen = self._read_face(profile, self._rest)
        self._offset = seen.column - self._rest if np.isfinite(seen.column) else 0.0
        self._before, self._last, self._step, self._missed = self._rest, self._rest, np.nan, 0

    @property
    def first_offset_px(self) -> float:
        """How far from tip_px the face was seen in the first frame, px along the travel."""
        return self._offset

    @property
    def predicted(self) -> float:
        """Column at which the face is expected in the frame to come."""
        step = self._step if np.isfinite(self._step) else 0.0
        return self._last + step * (1 + self._missed)

    def find(self, image: Cut, lighting: Lighting | None = None) -> BladeSight:
        """The face in the next frame; columns count from the grid's left, x = 0 where it was at rest.

        ``lighting``: its light against the first frame's; None: the same.
        """
        first, stop = self._reach(image.shape[1])
        width = self._body.stop - self._body.start
        left = max(first - width - _SIDE_PX, 0)
        profile = self._profile(image, lighting, left, min(stop + 2 * width + 2 * _SIDE_PX, image.shape[1]))
        even = profile / self._light[left : left + profile.shape[1]]
        place, alike = self._recognise(even, first - left, stop - left)
        seen = self._read_face(profile, place + self._offset)
        column = seen.column + left - self._offset
        expected = abs(column - self.predicted) < _FAR_STEPS * abs(self._step) + _FAR_PX
        least = _LEAST_ALIKE if expected or np.isnan(self._step) else _LEAST_ALIKE_FAR
        if not np.isfinite(column) or alike < least * self._alike:
            self._missed += 1
            return BladeSight(np.nan, np.nan)
        self._alike += 0.25 * (alike - self._alike)
        self._step = (column - self._last) / (1 + self._missed)
        self._before, self._last, self._missed = self._last, column, 0
        return BladeSight(column, seen.std_px)

    def _profile(self, image: Cut, lighting: Lighting | None, left: int, right: int) -> Floats:
        """Means over blocks of rows above the tip, of columns left to right - 1: (blocks, columns)."""
        starts = np.unique(
            np.linspace(0, self._rows, min(_BLOCKS, self._rows // 2), endpoint=False).astype(int)
        )
        ends = np.append(starts[1:], self._rows)
        means = np.empty((len(starts), right - left))
        for k, (start, end) in enumerate(zip(starts, ends, strict=True)):
            block: NDArray[Any] = np.ascontiguousarray(image[start:end, left:right])
            means[k] = cv2.reduce(block, 0, cv2.REDUCE_SUM, dtype=cv2.CV_64F)[0] / (end - start)
        if lighting is not None and not lighting.same:
            means *= lighting.columns(left, right)
            means *= lighting.rows(0, self._rows)[(starts + ends) // 2][:, None]
        return means

    def _reach(self, width: int) -> tuple[int, int]:
        """First columns at which the body may begin: from a little behind its last place but one.

        Had the last place been wrong, the next picture puts it right.
        """
        body = self._body.stop - self._body.start
        first = self._body.start + round(min(self._last, self._before) - self._rest) - 2
        stop = width - body - 2
        if np.isfinite(self._step):
            reach = round(self.predicted - min(self._last, self._before) + 3 * abs(self._step))
            stop = min(stop, first + max(reach, 0) + 4 * body + 12)
        return min(max(first, 0), max(stop - 1, 0)), stop

    def _recognise(self, profile: Floats, first: int, stop: int) -> tuple[float, float]:
        """Column of the face to a pixel or two, by the body's best match, and share of blocks that match."""
        width = self._template.shape[1]
        windows = sliding_window_view(profile[:, first : stop + width - 1], width, axis=1)
        unlike = np.stack(  # block by block: together they would take a gigabyte of a large photograph
            [
                np.minimum(np.abs(window - body), self._cap).mean(axis=1)
                for window, body in zip(windows, self._template, strict=True)
            ]
        )
        score = unlike.mean(axis=0) / max(self._cap, 1e-9)
        best = int(np.argmin(score))
        # a blade as grey as what is behind it is matched by that too: of equals the foremost, before the sand
        foremost = int(np.flatnonzero(score <= score[best] + _EQUAL)[-1])
        if foremost - best > max(_EQUAL_SHARE * width, _EQUAL_PX):
            best = foremost
        alike = float(np.mean(unlike[:, best] < _ALIKE * self._cap))
        return float(self._rest + first + best - self._body.start), alike

    def _read_face(self, profile: Floats, column: float) -> BladeSight:
        """Half-level crossing near a column, block by block; their robust weighted mean.

        Of crossings a few columns apart the one that most blocks show most clearly counts.
        """
        body = self._body.stop - self._body.start
        tries = [_crossings(profile, column + off, body) for off in _TRIES_PX]
        best, strength = max(tries, key=lambda found: found[1])
        if tries[0][1] > strength / _STRONGER:
            best, strength = tries[0]
        return _crossings(profile, best.column, body)[0] if strength > 0 else best


def _crossings(profile: Floats, column: float, body_px: int) -> tuple[BladeSight, float]:
    """The face near a column, and how strongly the blocks that agree on it stand out; 0: no face."""
    nothing = BladeSight(np.nan, np.nan), 0.0
    middle = round(column)
    left, right = middle - _SIDE_PX, middle + _SIDE_PX
    if left < 0 or right >= profile.shape[1]:
        return nothing
    part = profile[:, left : right + 1]
    ahead = part[:, _SIDE_PX + 3 :]
    behind = profile[:, max(middle - max(body_px, 3), 0) : max(middle - 2, 1)]
    inside, outside = behind.mean(axis=1), ahead.mean(axis=1)
    contrast = outside - inside
    scatter = np.hypot(behind.std(axis=1), ahead.std(axis=1)) / np.sqrt(3)
    share = (part - inside[:, None]) / np.where(contrast == 0, np.inf, contrast)[:, None]
    place, tails = _balanced(share, _nearest_half(share, column - left))
    place += left
    noise = np.median(scatter)
    good = np.isfinite(place) & (np.abs(contrast) > _LEAST_CONTRAST * np.maximum(scatter, 0.3 * noise))
    if good.sum() < 2:
        return nothing
    place, weight = place[good], np.abs(contrast[good] / np.maximum(scatter[good], noise + 1e-9))
    centre, spread = densest_half(place)
    kept = np.abs(place - centre) <= 3 * spread + 0.1
    place, weight = place[kept], weight[kept]
    mean = float(np.average(place, weights=weight))
    std = float(np.sqrt(np.sum(weight**2 * (place - mean) ** 2)) / weight.sum())
    blurred = float(np.average(tails[good][kept], weights=weight))
    return BladeSight(mean, float(np.hypot(std, max(_GRAIN_PX, blurred)))), float(weight.sum())


def _balanced(share: Floats, place: Floats) -> tuple[Floats, Floats]:
    """Edge that leaves as much of the body ahead as is missing behind, over a few columns about a place.

    The half-level itself depends on where in its pixel the edge stands (Tabatabai and Mitchell 1984;
    docs/theory-geometry.md, Eq. (2)). Also how much of the edge's blur lies beyond those columns, px.
    """
    middle = np.rint(np.nan_to_num(place)).astype(int)
    around = np.clip(middle[:, None] + np.arange(-_BLUR_PX, _BLUR_PX + 1), 0, share.shape[1] - 1)
    body = 1 - np.clip(np.take_along_axis(share, around, axis=1), 0.0, 1.0)
    edge = np.where(np.isfinite(place), middle - _BLUR_PX - 0.5 + body.sum(axis=1), np.nan)
    return edge, 1 - body[:, 0] + body[:, -1]


def _nearest_half(share: Floats, place: float) -> Floats:
    """Per row, where the share rises through one half, nearest to a place; NaN if not near it."""
    low, high = share[:, :-1], share[:, 1:]
    rises = (low < 0.5) & (high >= 0.5)
    at = np.arange(low.shape[1]) + np.where(rises, (0.5 - low) / np.where(rises, high - low, 1.0), 0.0)
    distance = np.where(rises, np.abs(at - place), np.inf)
    best = np.argmin(distance, axis=1)
    rows = np.arange(len(share))
    return np.where(distance[rows, best] <= _REACH_PX, at[rows, best], np.nan)
