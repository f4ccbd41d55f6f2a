"""Movement of the camera between photographs, from sand that stays where it is."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.changing import Changing
from ploughval.piv.guess import to_8bit
from ploughval.piv.interpolate import TAIL, Planes, plain_planes, spline_coefficients
from ploughval.piv.movement import CameraMovement
from ploughval.piv.subsets import ALL_SEEN, Fit, Floats, Pair, Recipe, match

TILES = 40
"""Patches of still sand that are looked at."""
LEAST_TILES = 4
SIDES_PX = (11, 31)
"""Least and greatest side of a patch."""
SEARCH_PX = 48
"""Farthest that a knock is searched for."""
TEMPLATE_PX = 63
"""Side of the templates of that search."""
LEAST_ZNCC = 0.5
AGREE_PX = 0.15
"""Patches tell the movement that agree within this, or within three times their scatter."""
LEAST_SHARE = 0.4
"""Share of the patches that must agree."""
KNOCK_PX = 0.3
"""A movement of more from one photograph to the next is the camera's; slower ones may be the sand's own."""


@dataclass(frozen=True, slots=True)
class SandSeen:
    """Movement (2,) px of the patches since the first photograph, its std, turn and correlation."""

    moved_px: Floats
    std_px: float
    turn_deg: float
    zncc: float


_UNTOLD = SandSeen(np.full(2, np.nan), np.nan, np.nan, np.nan)


class CameraWatch(Changing):
    """Finds how the camera moved since the first photograph.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float
        The first photograph.
    still : (H, W) bool
        Where sand will stay at rest.
    """

    CHANGES = ("_last", "_knocked")

    def __init__(self, image: NDArray[np.generic], still: NDArray[np.bool_]) -> None:
        side, self._places = _patches(still)
        self._recipe = Recipe(side, 0, 5)
        self._first = to_8bit(image)
        self._planes = self._cut_planes(image)
        self._last, self._knocked = np.zeros(2), SandSeen(np.zeros(2), 0.0, 0.0, 1.0)

    @property
    def patches(self) -> int:
        """Number of patches of still sand; fewer than LEAST_TILES tell nothing."""
        return len(self._places)

    def see(self, image: NDArray[np.generic]) -> CameraMovement:
        """Movement of the camera in the next photograph (H, W)."""
        found = _UNTOLD
        if self.patches >= LEAST_TILES:
            found = self._measured(image, np.rint(self._last))
            if not np.isfinite(found.moved_px[0]):
                found = self._measured(image, self._searched(image))
        if np.isfinite(found.moved_px[0]):
            step = found.moved_px - self._last
            if np.hypot(*step) > KNOCK_PX:
                std = float(np.hypot(self._knocked.std_px, np.sqrt(2) * found.std_px))
                self._knocked = replace(self._knocked, moved_px=self._knocked.moved_px + step, std_px=std)
            self._last = found.moved_px
        shift, std = self._knocked.moved_px, self._knocked.std_px
        return CameraMovement(shift, std, found.moved_px - shift, found.turn_deg, found.zncc)

    def _cut_planes(self, image: NDArray[np.generic]) -> Planes:
        return plain_planes(self._mosaic(image, np.zeros(2)), self._recipe.spline)

    def _mosaic(self, image: NDArray[np.generic], shift: Floats) -> NDArray[np.float32]:
        """Patches with what the filters read about them, one below the other; mirrored at the border."""
        reach = self._recipe.half + TAIL
        steps = np.arange(-reach, reach + 1)
        tiles = np.zeros((max(len(self._places), 1), steps.size, steps.size), np.float32)
        for tile, (x, y) in zip(tiles, self._places + shift.astype(np.int64), strict=False):
            rows, columns = (_mirrored(c + steps, n) for c, n in zip((y, x), image.shape, strict=True))
            tile[:] = image[np.ix_(rows, columns)]
        return tiles.reshape(-1, steps.size)

    def _measured(self, image: NDArray[np.generic], guess: Floats) -> SandSeen:
        """The movement by matching every patch, from whole pixels."""
        mosaic = self._mosaic(image, guess)
        mask = np.ones(mosaic.shape, np.uint8)
        pair = Pair(self._planes, mask, spline_coefficients(mosaic, 5), ALL_SEEN, self._recipe)
        reach = self._recipe.half + TAIL
        centres = np.column_stack(
            [np.full(self.patches, reach), reach + (2 * reach + 1) * np.arange(self.patches)]
        )
        fit = match(pair, centres.astype(float), np.zeros((self.patches, 2, 1)), limit=self._recipe.half)
        return _agreed(self._places, fit, guess)

    def _searched(self, image: NDArray[np.generic]) -> Floats:
        """Whole pixels of a movement that is too far for the match, from templates; zero where none fits."""
        grey, moves = to_8bit(image), []
        half = TEMPLATE_PX // 2
        height, width = grey.shape
        for x, y in self._places[:: max(1, self.patches // 8)]:
            x, y = (int(np.clip(c, half, n - half - 1)) for c, n in ((x, width), (y, height)))
            template = self._first[y - half : y + half + 1, x - half : x + half + 1]
            top, left = max(y - half - SEARCH_PX, 0), max(x - half - SEARCH_PX, 0)
            area = grey[top : y + half + 1 + SEARCH_PX, left : x + half + 1 + SEARCH_PX]
            if area.shape < template.shape or template.std() == 0:
                continue
            score = cv2.matchTemplate(area, template, cv2.TM_CCOEFF_NORMED)
            _, best, _, where = cv2.minMaxLoc(score)
            if best > LEAST_ZNCC:
                moves.append([left + where[0] - (x - half), top + where[1] - (y - half)])
        return np.rint(np.median(moves, axis=0)) if moves else np.zeros(2)


def _patches(still: NDArray[np.bool_]) -> tuple[int, NDArray[np.int64]]:
    """Side of the patches that fit best into still sand, and their centres (K, 2) px, spread over it."""
    mask = np.ascontiguousarray(still, np.uint8)
    for side in range(SIDES_PX[1], SIDES_PX[0] - 1, -4):
        room = cv2.erode(mask, np.ones((side, side), np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=0)
        step = max(side // 2, 1)
        first = int(np.argmax([np.count_nonzero(room[k::step, ::step]) for k in range(step)]))
        rows, columns = np.nonzero(room[first::step, ::step])
        if rows.size < 2 * LEAST_TILES and side > SIDES_PX[0] + 3:
            continue
        order = np.argsort(columns, kind="stable")
        some = order[np.linspace(0, rows.size - 1, min(TILES, rows.size)).astype(int)]
        return side, np.column_stack([columns[some] * step, rows[some] * step + first]).astype(np.int64)
    return SIDES_PX[0], np.zeros((0, 2), np.int64)


def _mirrored(index: NDArray[np.int64], size: int) -> NDArray[np.int64]:
    """Indices beyond a border mirrored at its last pixel."""
    index = np.abs(index)
    return np.clip(np.where(index >= size, 2 * (size - 1) - index, index), 0, size - 1)


def _agreed(places: NDArray[np.int64], fit: Fit, guess: Floats) -> SandSeen:
    """Movement that most patches agree on: a shift and a small turn about their middle, least squares."""
    good = np.flatnonzero((fit.status == Status.OK) & (fit.zncc > LEAST_ZNCC))
    zncc = float(np.median(fit.zncc)) if len(fit.zncc) else np.nan
    if good.size < max(LEAST_TILES, LEAST_SHARE * len(places)):
        return replace(_UNTOLD, zncc=zncc)
    moved = fit.params[good, :, 0] + guess
    arm = places[good] - places[good].mean(axis=0)
    off = np.linalg.norm(moved - np.median(moved, axis=0), axis=1)
    kept = off <= max(AGREE_PX, 3 * 1.4826 * float(np.median(off)))
    for _ in range(3):
        model = _turned_shift(arm[kept], moved[kept])
        rest = moved - model[:2] - model[2] * np.column_stack([arm[:, 1], -arm[:, 0]])
        off = np.linalg.norm(rest, axis=1)
        kept = off <= max(AGREE_PX, 3 * 1.4826 * float(np.median(off[kept])))
    if kept.sum() < max(LEAST_TILES, LEAST_SHARE * len(places)):
        return replace(_UNTOLD, zncc=zncc)
    std = float(np.sqrt(np.mean(rest[kept] ** 2) / kept.sum()))
    return SandSeen(model[:2], std, float(np.degrees(model[2])), zncc)


def _turned_shift(arm: Floats, moved: Floats) -> Floats:
    """Shift (2) px and turn (rad, counter-clockwise as seen) of points about their middle, least squares.

    docs/theory-sequences.md, Eq. (3).
    """
    lever = np.column_stack([arm[:, 1], -arm[:, 0]])
    design = np.zeros((len(arm), 2, 3))
    design[:, 0, 0] = design[:, 1, 1] = 1.0
    design[:, :, 2] = lever
    return np.asarray(np.linalg.lstsq(design.reshape(-1, 3), moved.reshape(-1), rcond=None)[0])
