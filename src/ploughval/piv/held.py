"""Pictures of a series, filtered only where points are: references that are held, and the newest one."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ploughval.piv.guess import to_8bit
from ploughval.piv.interpolate import Planes, SlopeFilter, filtered, plain_planes, spline_coefficients
from ploughval.piv.prepare import whole_grey
from ploughval.piv.subsets import ALL_SEEN, Fit, Floats, Pair, Recipe, match

Index = NDArray[np.intp]

BORDER_PX = 24
"""Pixels around what is read: beyond them the filters have forgotten what they were not shown."""


@dataclass(frozen=True, slots=True)
class Box:
    """A part of a picture, px: x0, y0 included, x1, y1 not."""

    x0: int
    y0: int
    x1: int
    y1: int

    @classmethod
    def about(cls, places: Floats, margin: float, shape: tuple[int, ...]) -> "Box":
        """The box around places (N, 2) px with a margin, inside a picture of a shape (H, W)."""
        size = np.array([shape[1], shape[0]])
        known = places[np.isfinite(places).all(axis=1)]
        if len(known) == 0:
            known = np.zeros((1, 2))
        low = np.clip(np.floor(known.min(axis=0) - margin), 0, size - 16).astype(int)
        high = np.clip(np.ceil(known.max(axis=0) + margin) + 1, low + 16, size).astype(int)
        return cls(int(low[0]), int(low[1]), int(high[0]), int(high[1]))

    @property
    def corner(self) -> Floats:
        """Its first pixel (2,), px."""
        return np.array([self.x0, self.y0], float)

    @property
    def part(self) -> tuple[slice, slice]:
        """Rows and columns of the picture."""
        return slice(self.y0, self.y1), slice(self.x0, self.x1)

    def joined(self, other: "Box") -> "Box":
        """The least box that holds both."""
        return Box(
            min(self.x0, other.x0), min(self.y0, other.y0), max(self.x1, other.x1), max(self.y1, other.y1)
        )

    def holds(self, other: "Box") -> bool:
        """Whether another box lies inside."""
        return self.joined(other) == self


@dataclass(frozen=True, slots=True)
class Picture:
    """A photograph: as it was read, 8 bit copy and sand, all (H, W)."""

    image: NDArray[np.generic]
    grey: NDArray[np.uint8]
    sand: NDArray[np.uint8]

    @classmethod
    def taken(cls, image: NDArray[np.generic], sand: NDArray[np.bool_]) -> "Picture":
        """A photograph with the sand (H, W) bool that may be used in it."""
        whole, usable = whole_grey(image)
        mask = np.ascontiguousarray(sand, np.uint8) if usable is ALL_SEEN else sand * usable
        return cls(whole, to_8bit(whole), np.ascontiguousarray(mask, np.uint8))


class Current:
    """The newest picture: spline coefficients where points may have gone.

    Parameters
    ----------
    picture : Picture
    spline : 3 or 5
        Degree of the spline.
    """

    def __init__(self, picture: Picture, spline: int) -> None:
        self.picture, self._spline = picture, spline
        self._box: Box | None = None
        self._coefficients = np.zeros((0, 0), np.float32)

    def reach(self, places: Floats, margin: float) -> None:
        """Make sure that everything within a margin of places (N, 2) px can be read."""
        wanted = Box.about(places, margin, self.picture.image.shape)
        if self._box is not None and self._box.holds(wanted):
            return
        self._box = wanted if self._box is None else self._box.joined(wanted)
        self._coefficients = spline_coefficients(self.picture.image[self._box.part], self._spline)

    @property
    def corner(self) -> Floats:
        """First pixel (2,) of the part that can be read, px."""
        assert self._box is not None
        return self._box.corner

    @property
    def coefficients(self) -> NDArray[np.float32]:
        """Coefficients of that part."""
        return self._coefficients


@dataclass(frozen=True, slots=True)
class Reference:
    """Part of a picture that points are matched against, and where they stood in it (NaN: not known).

    Attributes
    ----------
    frame : int
    picture : Picture
    box : Box, the part that is filtered
    planes, sand : of that part
    position : (N, 2) float, px in the whole picture
    std : (N,) float, px
    slopes : filter of the slopes
    """

    frame: int
    picture: Picture
    box: Box
    planes: Planes
    sand: NDArray[np.uint8]
    position: Floats
    std: Floats
    slopes: SlopeFilter

    @classmethod
    def held(cls, frame: int, picture: Picture, position: Floats, std: Floats, recipe: Recipe) -> "Reference":
        """A picture filtered where points stand."""
        box = Box.about(position, recipe.subset + BORDER_PX, picture.image.shape)
        planes = filtered(plain_planes(picture.image[box.part], recipe.spline), recipe.slopes)
        sand = np.ascontiguousarray(picture.sand[box.part])
        return cls(frame, picture, box, planes, sand, position.copy(), std.copy(), recipe.slopes)

    def refiltered(self, slopes: SlopeFilter) -> "Reference":
        """The same with other slopes; ``self`` has plain ones."""
        return replace(self, planes=filtered(self.planes, slopes), slopes=slopes)


@dataclass(frozen=True, slots=True)
class Facing:
    """A reference and the newest picture, ready to be matched; places and motions are of whole pictures."""

    reference: Reference
    pair: Pair
    shift: Floats  # (2,) px, what is added to a motion between the parts

    @classmethod
    def of(
        cls, reference: Reference, current: Current, recipe: Recipe, workers: int, noise_variance: float
    ) -> "Facing":
        """Both parts, with the sand of the reference."""
        known = reference.planes, reference.sand, current.coefficients, ALL_SEEN
        pair = Pair(*known, recipe, workers, noise_variance)
        return cls(reference, pair, reference.box.corner - current.corner)

    def places(self, index: Index) -> Floats:
        """Points of an index in the part of the reference (I, 2), px."""
        return self.reference.position[index] - self.reference.box.corner

    def inward(self, fit: Fit) -> Fit:
        """A fit as the pair sees it, copied."""
        params = fit.params.copy()
        params[:, :, 0] += self.shift
        return Fit(params, fit.stats.copy(), fit.status.copy())

    def outward(self, fit: Fit) -> Fit:
        """A fit of the pair in whole pictures, copied."""
        params = fit.params.copy()
        params[:, :, 0] -= self.shift
        return Fit(params, fit.stats, fit.status)

    def match(self, index: Index, start: Floats) -> Fit:
        """Match the points of an index from parameters (I, 2, terms)."""
        params = start.copy()
        params[:, :, 0] += self.shift
        return self.outward(match(self.pair, self.places(index), params))
