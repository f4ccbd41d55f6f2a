"""Fixed markers found again in every photograph: the movement of the camera, without asking the sand."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ploughval.changing import Changing
from ploughval.photos.markers.find import NOISY, PATCHY, UNLIKE_CONTRAST, MarkerFits, find_markers
from ploughval.photos.markers.fit import RimFit, Shape, fit_rim, freed_of_glare
from ploughval.photos.markers.motion import LEAST, Similarity, fit_similarity
from ploughval.photos.markers.rim import BLUR, CX, CY, RADIUS, SKEW, STRETCH, Floats, Kind
from ploughval.piv.movement import UNMOVED, CameraMovement

SIZE_STD, STRETCH_STD, BLUR_STD_PX = 0.01, 0.005, 0.3
"""How far a marker's size (relative), stretch and blur may change from its looks in the first photograph."""
AGREE_PX = 0.2
"""Two markers that are left must agree within this."""
FAR = 0.5
"""A fit that ends farther from where it was expected, in radii, is of something else."""


class MarkerWatch(Changing):
    """Follows fixed markers from the first photograph on.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float
        The first photograph.
    approximate_px : (N, 2) float
        Where the markers are in it, about.
    radius_px, reach_px, kind
        As in :func:`ploughval.photos.markers.find.find_markers`.
    names : sequence of str, optional
        What messages call each marker.

    Attributes
    ----------
    first : MarkerFits
        The markers in the first photograph.
    """

    CHANGES = ("_fits", "_last", "_last_sand")

    def __init__(
        self,
        image: NDArray[np.generic],
        approximate_px: ArrayLike,
        radius_px: float,
        *,
        reach_px: float | None = None,
        kind: Kind = "dot",
        names: Sequence[str] | None = None,
    ) -> None:
        self._radius, self._reach, self._kind = radius_px, reach_px, kind
        count = len(np.asarray(approximate_px).reshape(-1, 2))
        self.names = [f"fixed marker {k}" for k in range(count)] if names is None else list(names)
        self.first: MarkerFits = find_markers(image, approximate_px, radius_px, reach_px=reach_px, kind=kind)
        self._fits: list[RimFit | None] = list(self.first.fits)
        self._last, self._last_sand = UNMOVED, np.zeros(2)
        self._pivot = np.nanmean(self.first.px, axis=0) if self.first.found.any() else np.zeros(2)

    @property
    def tells(self) -> bool:
        """Whether there are markers enough in the first photograph."""
        return int(self.first.found.sum()) >= LEAST

    def see(self, image: NDArray[np.generic], sand: CameraMovement = UNMOVED) -> CameraMovement:
        """Movement of the camera in the next photograph.

        Parameters
        ----------
        image : (H, W)
            The photograph.
        sand : CameraMovement
            What sand that stays says of it: where to look, and what goes on where no marker is seen.
        """
        moved = np.nan_to_num(sand.shift_px + sand.drift_px)
        step, self._last_sand = moved - self._last_sand, moved
        expected = self._last.now(self.first.px) + step
        fits = [self._again(image, k, place) for k, place in enumerate(expected)]
        if sum(f is not None for f in fits) < max(LEAST, self.first.found.sum() / 2):
            fits = self._searched(image, expected, fits)
        now, std = np.full_like(expected, np.nan), np.full(len(fits), np.nan)
        for k, fit in enumerate(fits):
            if fit is not None:
                now[k] = fit.theta[[CX, CY]]
                both = fit.covariance.trace() / 2 + np.mean(self.first.std_px[k] ** 2)
                std[k] = np.sqrt(both)
        told = fit_similarity(self.first.px, now, std)
        missing = self._missing(fits, told)
        if told is None:
            movement = self._bridged(now, std, step, missing)
        else:
            self._keep(fits, told.used)
            movement = self._movement(told, missing)
        self._last = movement
        return replace(movement, zncc=sand.zncc)

    def _again(self, image: NDArray[np.generic], k: int, place: Floats) -> RimFit | None:
        """One marker from where it is expected, with its looks of the first photograph."""
        first, last = self.first.fits[k], self._fits[k]
        if first is None or last is None or not np.isfinite(place).all():
            return None
        theta = last.theta.copy()
        theta[[CX, CY]] = place
        shape = Shape(
            float(first.theta[RADIUS]),
            SIZE_STD * float(first.theta[RADIUS]),
            first.theta[[STRETCH, SKEW]],
            STRETCH_STD,
            float(last.theta[BLUR]),
            BLUR_STD_PX,
        )
        height, width = image.shape
        if not (0 <= place[0] < width and 0 <= place[1] < height):
            return None
        fit = fit_rim(image, theta, shape, self._kind)
        if fit is None or not self._same(fit, first, place):
            return None
        return freed_of_glare(image, fit, shape, self._kind)

    def _same(self, fit: RimFit, first: RimFit, place: Floats) -> bool:
        """Whether a fit is of the same marker."""
        ratio = fit.contrast_grey / first.contrast_grey
        near = np.hypot(*(fit.theta[[CX, CY]] - place)) <= FAR * first.theta[RADIUS]
        clean = fit.misfit <= max(NOISY, 2 * first.misfit) and fit.patchiness <= PATCHY
        return bool(near and clean and 1 / UNLIKE_CONTRAST < ratio < UNLIKE_CONTRAST)

    def _searched(
        self, image: NDArray[np.generic], expected: Floats, fits: list[RimFit | None]
    ) -> list[RimFit | None]:
        """Fits from a search about where the markers are expected, where that finds more."""
        known = np.flatnonzero(self.first.found)
        found = find_markers(image, expected[known], self._radius, reach_px=self._reach, kind=self._kind)
        fresh: list[RimFit | None] = [None] * len(fits)
        for k, place, there in zip(known, found.px, found.found, strict=True):
            fresh[k] = self._again(image, int(k), place) if there else None
        more = sum(f is not None for f in fresh) > sum(f is not None for f in fits)
        return fresh if more else fits

    def _keep(self, fits: list[RimFit | None], used: NDArray[np.bool_]) -> None:
        self._fits = [
            fit if fit is not None and use else last
            for fit, last, use in zip(fits, self._fits, used, strict=True)
        ]

    def _movement(self, told: Similarity, missing: tuple[str, ...]) -> CameraMovement:
        """The movement about the middle of all markers: one pivot for the whole series."""
        arm = self._pivot - told.pivot_px
        shift = told.shift_px + (told.linear - np.eye(2)) @ arm
        std = float(np.hypot(told.shift_std_px, told.turn_std * np.hypot(*arm)))
        turn = float(np.degrees(np.arctan2(told.linear[0, 1], told.linear[0, 0])))
        return CameraMovement(
            shift, std, np.zeros(2), turn, np.nan, told.linear, self._pivot, told.turn_std,
            int(told.used.sum()), missing,
        )  # fmt: skip

    def _bridged(self, now: Floats, std: Floats, step: Floats, missing: tuple[str, ...]) -> CameraMovement:
        """Too few markers agree: what is left of them tells a shift; without any, sand goes on from there."""
        last, seen = self._last, np.isfinite(now).all(axis=1)
        stepped = replace(last, shift_px=last.shift_px + step, markers=0, missing=missing)
        if not 0 < seen.sum() < LEAST:
            return stepped
        off = (now - last.now(self.first.px))[seen]
        if len(off) == 2 and np.hypot(*(off[0] - off[1])) > AGREE_PX:
            return stepped
        own = float(np.sqrt(np.mean(std[seen] ** 2) / len(off)))
        shift, spread = last.shift_px + off.mean(axis=0), float(np.hypot(last.std_px, own))
        return replace(stepped, shift_px=shift, std_px=spread, markers=len(off))

    def _missing(self, fits: list[RimFit | None], told: Similarity | None) -> tuple[str, ...]:
        texts = []
        for k, (first, fit) in enumerate(zip(self.first.fits, fits, strict=True)):
            if first is None:
                continue
            x, y = self.first.px[k]
            name = f"{self.names[k]} at ({x:.0f}, {y:.0f}) px"
            if fit is None:
                texts.append(f"{name} is not seen")
            elif told is not None and not told.used[k]:
                texts.append(f"{name} has moved against the others")
        return tuple(texts)
