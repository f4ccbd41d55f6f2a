"""Dyed layers found in the picture itself: likeliest ridge along the layer, half-level edges across it."""

import cv2
import numpy as np
from scipy.ndimage import median_filter

from ploughval.scene import Tracers
from ploughval.tracers.appearance import Appearance
from ploughval.tracers.light import Lighting
from ploughval.tracers.view import Floats, Image, Levels, Mask, View

_STEP_PX = 2  # one point of a layer every so many columns
_STIFFNESS = 0.05  # cost of a pixel of rise between two points
_TEAR = 3.0  # cost of a jump, where a band has torn the layer
_STRAY = 1.0  # cost of leaving the place expected from the frame before, by one thickness
_MEDIAN = 7  # points of the running median along a layer
_BRIDGE_PX = 60  # gaps up to twice this long keep the line through their ends as what is expected next
_REACH_PX = 3  # rise between two points that is still no jump
_DEFAULT_THICKNESS_MM = 2.0
_STD_FLOOR_PX = 0.1


class DyeFollower:
    """Follows the dyed layers of a test from photograph to photograph.

    Parameters
    ----------
    view : grid of the photographs
    tracers : heights and look of the dyed layers
    image : (h, w) float32, the first frame on the grid
    sand : (h, w) bool, its sand
    """

    def __init__(self, view: View, tracers: Tracers, image: Levels, look: Appearance) -> None:
        sand = _sand(image.shape, look.top, float(view.column(0.0)))
        self._view = view
        self._thickness = (tracers.thickness_mm or _DEFAULT_THICKNESS_MM) / view.step_mm
        self._sign = -1.0 if tracers.dye == "dark" else 1.0
        self._columns = np.arange(0.0, view.shape[1], _STEP_PX)
        self._rows = {h: np.full(len(self._columns), view.row(h)) for h in tracers.dyed_layers_mm}
        self._levels = {h: self._learn(image, sand, h) for h in self._rows}
        self._face = float(view.column(0.0))

    def follow(
        self,
        image: Levels,
        lighting: Lighting,
        top: Floats,
        face: float,
        carried: dict[float, Floats] | None = None,
    ) -> dict[float, Floats]:
        """The dyed layers of the next frame.

        Parameters
        ----------
        image : (h, w) float32
            Frame on the grid.
        sand : (h, w) bool
            Its sand.
        face : float
            Column of the blade's face.

        Returns
        -------
        dict of layer height, mm -> (K, 3) float: x, y, std, mm; rows of NaN at gaps
        """
        sand = _sand(image.shape, top, face)
        travel = face - self._face if np.isfinite(face) else 0.0
        self._face = face if np.isfinite(face) else self._face
        blur = max(self._thickness / 8, 0.7)
        smooth = np.asarray(
            cv2.GaussianBlur(image.astype(np.float32), (0, 0), sigmaX=3.0, sigmaY=blur), np.float32
        )
        return {height: self._follow_one(height, smooth, sand, travel) for height in self._rows}

    def _learn(self, image: Levels, sand: Mask, height: float) -> tuple[float, float]:
        """Grey of the dyed layer and of the sand beside it, in the first frame."""
        row = np.arange(image.shape[0])[:, None]
        off = np.abs(row - self._view.row(height))
        band = self._thickness
        inside = sand & (off < 0.3 * band)
        beside = sand & (off > 0.5 * band + 2) & (off < 1.2 * band + 3)
        for other in self._rows:
            if other != height:
                beside &= np.abs(row - self._view.row(other)) > 0.5 * band + 2
        if not inside.any() or not beside.any():
            return np.nan, np.nan
        return float(np.median(image[inside])), float(np.median(image[beside]))

    def _follow_one(self, height: float, smooth: Image, sand: Mask, travel: float) -> Floats:
        dyed, plain = self._levels[height]
        if not (dyed - plain) * self._sign > 0:
            return np.full((1, 3), np.nan)
        low, high = self._expected(height, travel)
        first = int(np.clip(low.min() - 3 * self._thickness, 0, len(smooth) - 8))
        part = slice(first, max(int(high.max() + 3 * self._thickness), first + 8))
        share = np.clip((smooth[part, ::_STEP_PX] - plain) / (dyed - plain), -0.5, 1.2)
        share = np.where(sand[part, ::_STEP_PX], share, 0.0)
        centre = _ridge(share, self._thickness, low - first, high - first)
        row, found = _edges(share, centre, self._thickness)
        row += first
        found &= self._columns > self._face + 2
        found = _without_scraps(row, found, round(1.5 * self._thickness / _STEP_PX) + 2)
        row = _smoothed(row, found)
        self._rows[height] = _filled(self._columns, row, found, self._rows[height])
        return self._in_world(row, found)

    def _expected(self, height: float, travel: float) -> tuple[Floats, Floats]:
        """Rows between which a layer may stand: where it was, or moved on and up with the block."""
        before = self._rows[height]
        moved = np.interp(self._columns - travel, self._columns, before)
        slack = 0.25 * self._thickness + 1
        return np.minimum(before, moved - abs(travel)) - slack, np.maximum(before, moved) + slack

    def _in_world(self, row: Floats, found: Mask) -> Floats:
        """Found stretches as (K, 3) x, y, std, mm, one row of NaN between two stretches."""
        if not found.any():
            return np.full((1, 3), np.nan)
        std = _scatter(row, found)
        points = np.column_stack([self._view.x_mm(self._columns), self._view.y_mm(row)])
        line = np.column_stack([points, std * self._view.step_mm])
        line[~found] = np.nan
        torn = found[1:] & found[:-1] & _tears(row, found)
        line = np.insert(line, np.flatnonzero(torn) + 1, np.nan, axis=0)
        real = np.isfinite(line[:, 0])
        kept = real | np.append(False, real[:-1])
        line = line[kept]
        return np.asarray(line[:-1] if np.isnan(line[-1, 0]) else line)


def _sand(shape: tuple[int, int], top: Floats, face: float) -> Mask:
    row, column = np.arange(shape[0])[:, None], np.arange(shape[1])
    return np.asarray((row > top) & (column > face + 0.5))


def _ridge(share: Floats, thickness: float, low: Floats, high: Floats) -> Floats:
    """Row of the layer in each column: the likeliest path that may jump at a price.

    Parameters
    ----------
    share : (h, K) float
        How much of each pixel is dyed.
    thickness : float
        Of the layer, px.
    low, high : (K,) float
        Rows between which the layer is expected.
    """
    height = max(round(thickness), 1)
    cost = -cv2.blur(share, (1, height), borderType=cv2.BORDER_REPLICATE)
    row = np.arange(share.shape[0])[:, None]
    cost = cost + _STRAY * np.maximum(np.maximum(low - row, row - high), 0.0) / thickness
    price = _STIFFNESS * np.abs(np.arange(-_REACH_PX, _REACH_PX + 1))
    total = np.empty((cost.shape[1], cost.shape[0]))
    total[0] = cost[:, 0]
    for k in range(1, len(total)):
        padded = np.pad(total[k - 1], _REACH_PX, constant_values=np.inf)
        around = np.lib.stride_tricks.sliding_window_view(padded, 2 * _REACH_PX + 1)
        total[k] = cost[:, k] + np.minimum((around + price).min(axis=1), total[k - 1].min() + _TEAR)
    path = np.empty(len(total), dtype=int)
    path[-1] = np.argmin(total[-1])
    for k in range(len(total) - 2, -1, -1):
        rise = np.abs(row[:, 0] - path[k + 1])
        path[k] = np.argmin(total[k] + np.where(rise <= _REACH_PX, _STIFFNESS * rise, _TEAR))
    return path.astype(float)


def _edges(share: Floats, centre: Floats, thickness: float) -> tuple[Floats, Mask]:
    """Middle between a layer's two half-level edges in each column, and where both are clear."""
    reach = int(np.ceil(1.5 * thickness)) + 2
    across = np.arange(-reach, reach + 1)
    rows = centre.astype(int)[None, :] + across[:, None]
    inside = (rows >= 0) & (rows < len(share))
    profile = np.take_along_axis(share, np.clip(rows, 0, len(share) - 1), axis=0)
    profile = np.where(inside, profile, 0.0)
    near = np.where((np.abs(across) <= thickness / 2)[:, None], profile, -np.inf)
    peak = np.argmax(near, axis=0)
    dyed = profile > 0.5
    index = np.arange(len(across))[:, None]
    top = np.where(~dyed & (index < peak), index, -1).max(axis=0)
    bottom = np.where(~dyed & (index > peak), index, len(across)).min(axis=0)
    column = np.arange(share.shape[1])
    clear = dyed[peak, column] & (top >= 0) & (bottom < len(across))
    top, bottom = np.clip(top, 0, len(across) - 2), np.clip(bottom, 1, len(across) - 1)
    up = top + _part(profile[top, column], profile[top + 1, column])
    down = bottom - _part(profile[bottom, column], profile[bottom - 1, column])
    width = down - up
    clear &= (width > 0.4 * thickness) & (width < 2.0 * thickness)
    return centre + (up + down) / 2 - reach, clear


def _part(outside: Floats, inside: Floats) -> Floats:
    """Where between two pixels the level passes one half, 0 at the outer one."""
    rise = inside - outside
    return np.clip((0.5 - outside) / np.where(rise == 0, 1.0, rise), 0.0, 1.0)


def _tears(row: Floats, found: Mask) -> Mask:
    """Whether a layer is broken between each point and the next, (K - 1,) bool."""
    step = np.abs(np.diff(np.where(found, row, 0.0)))
    return np.asarray(~(found[1:] & found[:-1]) | (step > 2 * _REACH_PX))


def _without_scraps(row: Floats, found: Mask, least: int) -> Mask:
    """Found points without stretches of fewer than ``least`` of them: dark spots, not a layer."""
    stretch = np.concatenate([[0], np.cumsum(_tears(row, found))])
    count = np.bincount(stretch, weights=found)
    return np.asarray(found & (count[stretch] >= least))


def _smoothed(row: Floats, found: Mask) -> Floats:
    """Running median along each stretch of a layer: single grains do not count."""
    row = row.copy()
    stretch = np.concatenate([[0], np.cumsum(_tears(row, found))])
    for number in np.unique(stretch[found]):
        part = found & (stretch == number)
        row[part] = median_filter(row[part], _MEDIAN, mode="nearest")
    return row


def _filled(column: Floats, row: Floats, found: Mask, before: Floats) -> Floats:
    """Rows of a layer with its short gaps bridged; the frame before where nothing was found near."""
    if not found.any():
        return before
    bridged = np.interp(column, column[found], row[found])
    distance = np.abs(column[:, None] - column[found][None, :]).min(axis=1) if found.sum() < len(found) else 0
    return np.asarray(np.where(np.asarray(distance) > _BRIDGE_PX, before, bridged))


def _scatter(row: Floats, found: Mask) -> Floats:
    """Std of a layer's rows from their scatter about their neighbours, px."""
    bend = np.full(len(row), np.nan)
    whole = found[2:] & found[1:-1] & found[:-2]
    bend[1:-1][whole] = (row[1:-1] - (row[2:] + row[:-2]) / 2)[whole]
    typical = np.nanmedian(np.abs(bend)) * 1.4826 / np.sqrt(1.5) if whole.any() else 1.0
    return np.full(len(row), max(float(typical), _STD_FLOOR_PX))
