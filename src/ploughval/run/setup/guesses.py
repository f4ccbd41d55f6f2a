"""What the photographs themselves tell of a test: direction, blade, tip, depth, layers, borders."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Direction
from ploughval.run.setup.guess_blade import BladeGuess, find_blade
from ploughval.run.setup.guess_frames import Frames, read_some
from ploughval.run.setup.guess_levels import Bands, find_layers, sharpened, surface_level, tip_level

Floats = NDArray[np.float64]

_NEAR_WIDTHS, _NEAR_SHARE = 2.0, 0.15  # of blade and picture: where the surface is read for the depth
_SURFACE_ROWS = 2  # rows above the surface that are left out of the air
_LEAST_AIR_ROWS = 8
_LEAST_PHOTOGRAPHS = 3


@dataclass(frozen=True, slots=True, eq=False)
class BladeFound:
    """The blade in the first photograph, in px of it, and its way.

    Attributes
    ----------
    direction : Direction
    face_px, thickness_px : float
        Column of its face, and its width.
    frames : (K,) int
        Photographs that were looked at, by their place in the series.
    travel_px : (K,) float
        How far the face has gone along the direction; NaN where it was not seen.
    sure : bool
        Whether nothing else could be meant.
    """

    direction: Direction
    face_px: float
    thickness_px: float
    frames: NDArray[np.intp]
    travel_px: Floats
    sure: bool

    @property
    def way_px(self) -> float:
        """Farthest that it was seen to go."""
        return float(np.nanmax(self.travel_px))


@dataclass(frozen=True, slots=True)
class Guesses:
    """What was found; None where it was not. Rows and columns in px of the photographs.

    Attributes
    ----------
    surface_px : float
        Row of the surface of the sand at rest, ahead of the blade where it was found.
    tip_px : (float, float)
        Blade face at the level of its tip.
    tip_sure : bool
        Whether both surface and tip stand out.
    layers : Bands
        Heights above the tip and thickness in px.
    view_px : (x0, y0, x1, y1)
        What lies inside the borders of the photographs; None: they have none.
    """

    blade: BladeFound | None = None
    surface_px: float | None = None
    tip_px: tuple[float, float] | None = None
    tip_sure: bool = False
    layers: Bands | None = None
    view_px: tuple[int, int, int, int] | None = None

    @property
    def depth_px(self) -> float | None:
        """From the surface at rest down to the tip."""
        if self.tip_px is None or self.surface_px is None:
            return None
        return self.tip_px[1] - self.surface_px

    def renumbered(self, places: Sequence[int]) -> "Guesses":
        """The same with the frames counted otherwise: number k is places[k]."""
        if self.blade is None:
            return self
        frames = np.array(places, np.intp)[self.blade.frames]
        return replace(self, blade=replace(self.blade, frames=frames))


NOTHING = Guesses()


def guess(files: Sequence[tuple[Path, int]], bits: int) -> Guesses:
    """Guess the geometry of a test from a few of its photographs.

    Parameters
    ----------
    files : sequence of (Path, int)
        File and picture in it, in the order of the series.
    bits : int
        Of a sample.
    """
    frames = read_some(files, bits)
    if frames is None:
        return NOTHING
    first = frames.images[0]
    view = frames.view_px if frames.bordered else None
    surface = surface_level(first, np.ones(first.shape[1], bool))
    if surface is None:
        return Guesses(view_px=view)
    air_rows = int(surface.row) - _SURFACE_ROWS
    body = find_blade(frames.images, air_rows) if air_rows >= _LEAST_AIR_ROWS else None
    if body is None:
        return Guesses(surface_px=frames.row_px(surface.row), view_px=view)
    near = _ahead(
        body, first.shape[1], _NEAR_WIDTHS * abs(body.face - body.back) + _NEAR_SHARE * first.shape[1]
    )
    at_blade = frames.row_px(sharpened(first[:, near], round(surface.row))) if near.sum() > 1 else None
    blade = _blade(frames, body, surface.sure)
    tip = tip_level(frames.images, (body.face, body.back), body.travel, surface.row)
    if tip is None or frames.numbers[0] != 0:  # a later photograph does not show the blade at rest
        return Guesses(blade, at_blade, view_px=view)
    layers = find_layers(first, _ahead(body, first.shape[1]), surface.row, tip.row)
    scaled = None if layers is None else layers.scaled(frames.shrink)
    place = (frames.column_px(body.face), frames.row_px(tip.row))
    return Guesses(blade, at_blade, place, surface.sure and tip.sure, scaled, view)


def _ahead(body: BladeGuess, width: int, reach: float = np.inf) -> NDArray[np.bool_]:
    """Columns (w,) ahead of the blade, from a width of it on."""
    far = (np.arange(width) - body.face) * (1 if body.rightwards else -1)
    return np.asarray((far > abs(body.face - body.back)) & (far < reach))


def _blade(frames: Frames, body: BladeGuess, surface_sure: bool) -> BladeFound:
    direction = Direction.RIGHT if body.rightwards else Direction.LEFT
    return BladeFound(
        direction,
        frames.column_px(body.face),
        abs(body.face - body.back) * frames.shrink,
        frames.numbers,
        body.travel * direction.sign * frames.shrink,
        body.sure and surface_sure and len(frames.numbers) >= _LEAST_PHOTOGRAPHS,
    )
