"""Fits the rim of one marker to the photograph, in those sectors in which it is seen."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.photos.markers.rim import (
    BLUR,
    CX,
    CY,
    INSIDE,
    LEAST_BLUR_PX,
    LIGHT_X,
    LIGHT_Y,
    LINE,
    OUTSIDE,
    RADIUS,
    SKEW,
    STRETCH,
    VEIL_X,
    VEIL_Y,
    Floats,
    Kind,
    Rim,
    contrast_at,
    rim_at,
)

Bools = NDArray[np.bool_]

LEAST_SEEN = 0.25
"""Share of the rim that has to be seen."""
ROUNDS = 6
"""Times that pixels and sectors are chosen anew, at most."""
READMITTED = 3
"""Times that a sector may be taken up again: then some are only left out, and the choice settles."""
STEPS = 12
"""Gauss-Newton steps in each of them, at most."""
SETTLED_PX = 1e-4
SECTOR_PX = 1.6
"""Length of rim in a sector."""
ASTRAY = 3.5
"""A sector whose piece of rim lies off by so many stds of what is usual shows something else."""
ASTRAY_PX = 0.08
"""Nothing less is worth leaving out."""
MISFIT = 0.15
"""So does one whose pixels miss the model by this share of the contrast, root mean square, besides noise."""
LEVEL = 0.12
"""And one that is paler or darker by this share on either side of the rim."""
GAIN = (0.6, 1.6)
"""And one whose contrast is less or more than these shares of the marker's."""
ROOM = 0.8
"""What is about a marker is taken to reach so far beyond its rim, in radii, at least 2 px."""
LIGHT = 0.01
"""Share by which light usually changes from one pixel to the next, one standard deviation."""
GLARE = 0.5
"""Where glare is looked for, it may change by this share of the contrast over a radius, one std."""
GLARE_TOLD = 3.5
"""It is believed where its slope is so many stds,"""
GLARE_SEEN = 0.7
"""and looked for where this share of the rim is seen: on less, it cannot be told from another centre."""
HUBER = 2.5
"""Pixels that are off by more stds count for less."""


@dataclass(frozen=True, slots=True)
class Shape:
    """What is known of a marker's shape before it is fitted.

    Attributes
    ----------
    radius_px, radius_std_px : float
    stretch : (2,) float
        As in :mod:`ploughval.photos.markers.rim`.
    stretch_std : float
    blur_px, blur_std_px : float
    """

    radius_px: float
    radius_std_px: float
    stretch: Floats
    stretch_std: float
    blur_px: float = 0.8
    blur_std_px: float = 1.0


@dataclass(frozen=True, slots=True)
class RimFit:
    """A fitted marker.

    Attributes
    ----------
    theta : (12,) or (13,) float
        Parameters of :mod:`ploughval.photos.markers.rim`.
    covariance : (2, 2) float
        Of the centre, px^2.
    seen : float
        Share of the rim that was used.
    misfit : float
        Root mean square of what the model leaves there, as a share of the contrast.
    patchiness : float
        The same without the white noise in it.
    glare : float
        Slope of glare across the marker, in standard deviations.
    """

    theta: Floats
    covariance: Floats
    seen: float
    misfit: float
    patchiness: float
    glare: float

    @property
    def contrast_grey(self) -> float:
        """Inside less outside."""
        return contrast_at(self.theta)


def fit_rim(
    image: NDArray[np.generic],
    theta: Floats,
    shape: Shape,
    kind: Kind,
    *,
    on_rays: Bools | None = None,
    glare: float = 0.0,
) -> RimFit | None:
    """Fit a marker from approximate parameters.

    Parameters
    ----------
    image : (H, W)
        Grey levels.
    theta : (12,) or (13,) float
        Where to start: the centre within about a third of the radius.
    shape : Shape
        What is known beforehand.
    kind : "dot" or "ring"
        Filled, or an outline.
    on_rays : (R,) bool, optional
        Directions, evenly from +x towards +y, in which the rim is thought to be seen; all where not given.
    glare : float
        How much glare may change over a radius, as a share of the contrast, one standard deviation.

    Returns
    -------
    RimFit or None
        None where too little of a rim is seen.
    """
    fit = _Fitting(image, theta.astype(float), shape, kind)
    fit.allow(glare)
    if on_rays is not None:
        fit.trust(on_rays)
    for _ in range(ROUNDS):
        before, seen = fit.theta, fit.seen
        if not fit.choose_pixels():
            return None
        fit.descend()
        if not fit.judge_sectors():
            return None
        moved = np.abs(fit.theta - before)[[CX, CY, RADIUS]].max()
        if moved < 0.01 and np.array_equal(seen, fit.seen):
            break
    return fit.result()


def freed_of_glare(image: NDArray[np.generic], fit: RimFit, shape: Shape, kind: Kind) -> RimFit:
    """A fit with glare that changes across the marker where it clearly does; else as it was.

    Glare adds to the light of dark and pale alike, and so is told from uneven light; but looking for it costs
    up to half as much error again.
    """
    if fit.seen < GLARE_SEEN:
        return fit
    other = fit_rim(image, fit.theta, shape, kind, glare=GLARE)
    if other is None or other.glare <= GLARE_TOLD or other.seen < GLARE_SEEN:
        return fit
    return other


class _Fitting:
    """State of one fit: parameters, pixels of the band about the rim, sectors that are seen."""

    def __init__(self, image: NDArray[np.generic], theta: Floats, shape: Shape, kind: Kind) -> None:
        self._image, self._shape, self._kind = image, shape, kind
        self.theta = theta
        self._count = int(np.clip(round(2 * math.pi * theta[RADIUS] / SECTOR_PX), 16, 48))
        self.seen: Bools = np.ones(self._count, bool)
        self._rounds, self._glare = 0, 0.0

    def allow(self, glare: float) -> None:
        """Let glare change across the marker, by so much of the contrast over a radius."""
        self._glare = glare

    def trust(self, on_rays: Bools) -> None:
        """Start with the sectors in most of whose directions the rim is thought to be seen."""
        sector = (np.arange(on_rays.size) + 0.5) / on_rays.size * self._count
        votes = np.bincount(sector.astype(int), weights=on_rays, minlength=self._count)
        rays = np.bincount(sector.astype(int), minlength=self._count)
        seen = votes >= 0.6 * rays
        if seen.mean() >= LEAST_SEEN:
            self.seen = seen

    def choose_pixels(self) -> bool:
        """Take the pixels near the rim as it is thought to be; False where none are left."""
        theta = self.theta
        line = theta[LINE] / 2 if self._kind == "ring" else 0.0
        band = 2.5 * theta[BLUR] + 1.2 + line
        beyond = min(band, line + max(ROOM * theta[RADIUS], 2.0))
        reach = theta[RADIUS] * (1 + np.abs(theta[[STRETCH, SKEW]]).max()) + band + 1
        height, width = self._image.shape
        left, right = max(math.floor(theta[CX] - reach), 0), min(math.ceil(theta[CX] + reach) + 1, width)
        top, bottom = max(math.floor(theta[CY] - reach), 0), min(math.ceil(theta[CY] + reach) + 1, height)
        if right - left < 4 or bottom - top < 4:
            return False
        y, x = np.mgrid[top:bottom, left:right].reshape(2, -1).astype(float)
        off = rim_at(x, y, theta, self._kind).off_px
        near = (off > -band) & (off < beyond)
        self._x, self._y = x[near], y[near]
        self._grey = self._image[top:bottom, left:right].reshape(-1)[near].astype(float)
        turn = np.arctan2(self._y - theta[CY], self._x - theta[CX]) / (2 * math.pi) % 1.0
        self._sector = np.minimum((turn * self._count).astype(int), self._count - 1)
        there = np.bincount(self._sector, minlength=self._count)
        self.seen = self.seen & (there >= 0.5 * np.median(there))
        return bool(self.seen.mean() >= LEAST_SEEN)

    def descend(self) -> None:
        """Least squares on the sectors that are seen: Gauss-Newton, halved steps, less for pixels far off."""
        use = self.seen[self._sector]
        x, y, grey = self._x[use], self._y[use], self._grey[use]
        theta, cost = self.theta, np.inf
        step: Floats = np.zeros(len(theta))
        noise = np.nan
        for _ in range(STEPS):
            tried = self._bounded(theta + step)
            rim = rim_at(x, y, tried, self._kind)
            rest = grey - rim.grey
            if not np.isfinite(noise):
                noise = max(1.4826 * float(np.median(np.abs(rest))), 0.3)
            far = np.maximum(np.abs(rest) / (HUBER * noise), 1.0)
            tried_cost = float(np.sum((rest / noise) ** 2 * (2 * far - 1) / far**2)) + self._surprise(tried)
            small = np.abs(tried - theta)[[CX, CY, RADIUS]].max() < SETTLED_PX
            if tried_cost > cost and not small:
                step = step / 2
                continue
            theta, cost = tried, tried_cost
            if small and step.any():
                break
            normal, right = self._normal(rim, 1 / far, rest, noise, theta)
            step = np.asarray(np.linalg.solve(normal, right), np.float64)
        self.theta = theta

    def _surprise(self, theta: Floats) -> float:
        """How far parameters are from what is known beforehand, as a sum of squares."""
        expected, std = self._prior(theta)
        return float(np.sum(((theta - expected) / std) ** 2))

    def _normal(
        self, rim: Rim, weight: Floats, rest: Floats, noise: float, theta: Floats
    ) -> tuple[Floats, Floats]:
        """Normal equations, with what is known of the shape beforehand."""
        weighted = rim.jacobian * (weight / noise**2)[:, None]
        normal, right = weighted.T @ rim.jacobian, weighted.T @ rest
        expected, std = self._prior(theta)
        normal[np.diag_indices_from(normal)] += 1 / std**2
        return normal, right + (expected - theta) / std**2

    def _prior(self, theta: Floats) -> tuple[Floats, Floats]:
        """Expected parameters and their stds; infinite where nothing is known."""
        shape, expected, std = self._shape, theta.copy(), np.full(len(theta), np.inf)
        std[[CX, CY]] = shape.radius_px  # about where they stand: keeps the equations regular, no more
        std[[OUTSIDE, INSIDE]] = 1e4
        expected[[RADIUS, STRETCH, SKEW]] = shape.radius_px, *shape.stretch
        std[[RADIUS, STRETCH, SKEW]] = shape.radius_std_px, shape.stretch_std, shape.stretch_std
        uneven = LIGHT * (shape.radius_px + 3.0)
        expected[[BLUR, LIGHT_X, LIGHT_Y]] = shape.blur_px, 0.0, 0.0
        std[[BLUR, LIGHT_X, LIGHT_Y]] = shape.blur_std_px, uneven, uneven
        expected[[VEIL_X, VEIL_Y]] = 0.0
        std[[VEIL_X, VEIL_Y]] = self._glare * abs(contrast_at(theta)) + 1e-3
        if self._kind == "ring":
            expected[LINE], std[LINE] = 0.25 * shape.radius_px, 0.25 * shape.radius_px
        return expected, std

    def _bounded(self, theta: Floats) -> Floats:
        """Parameters kept where the model means something."""
        theta = theta.copy()
        size = self._shape.radius_px
        theta[RADIUS] = np.clip(theta[RADIUS], 0.4 * size, 2.0 * size)
        theta[BLUR] = np.clip(theta[BLUR], LEAST_BLUR_PX, max(0.5 * size, 1.0))
        theta[[STRETCH, SKEW]] = np.clip(theta[[STRETCH, SKEW]], -0.4, 0.4)
        if self._kind == "ring":
            theta[LINE] = np.clip(theta[LINE], 0.5, size)
        return theta

    def judge_sectors(self) -> bool:
        """Which sectors show the rim; False where too few do."""
        rim = rim_at(self._x, self._y, self.theta, self._kind)
        rest, count = self._grey - rim.grey, self._count
        contrast = abs(contrast_at(self.theta))
        if contrast <= 0:
            return False
        pixels = np.maximum(self._sums(np.ones_like(rest)), 1)
        info = np.maximum(self._sums(rim.slope**2), 1e-12)
        off = self._sums(rim.slope * rest) / info
        left = self._sums((rest - off[self._sector] * rim.slope) ** 2)
        miss = np.sqrt(left / pixels)
        light = 1 + self._light()
        above = rim.grey - light * self.theta[OUTSIDE]
        gain = self._sums(above * (self._grey - light * self.theta[OUTSIDE])) / np.maximum(
            self._sums(above**2), 1e-12
        )
        usual = self.seen if self.seen.any() else np.ones(count, bool)
        noise = 1.4826 * float(np.median(np.abs(rest[usual[self._sector]])))
        own = noise / np.sqrt(info)
        scatter = 1.4826 * float(np.median(np.abs(off[usual])))
        limit = np.maximum(ASTRAY * np.maximum(own, scatter), ASTRAY_PX)
        good = (np.abs(off) <= limit) & (miss <= np.hypot(MISFIT * contrast, 1.5 * noise))
        for side in (rim.off_px > self.theta[BLUR], rim.off_px < -self.theta[BLUR]):
            share = np.maximum(self._sums(side.astype(float)), 0.5)
            level = np.abs(self._sums(np.where(side, rest, 0.0)) / share)
            good &= level <= np.maximum(LEVEL * contrast, ASTRAY * noise / np.sqrt(share))
        good &= (gain >= GAIN[0]) & (gain <= GAIN[1])
        good &= pixels >= 0.5 * np.median(pixels)
        good &= np.roll(good, 1) & np.roll(good, -1)  # what is beside something else is half that
        self.seen = good if self._rounds < READMITTED else good & self.seen
        self._rounds += 1
        return bool(self.seen.mean() >= LEAST_SEEN)

    def _light(self) -> Floats:
        theta = self.theta
        across, down = self._x - theta[CX], self._y - theta[CY]
        return np.asarray((theta[LIGHT_X] * across + theta[LIGHT_Y] * down) / theta[RADIUS])

    def _sums(self, values: Floats) -> Floats:
        """Sum over the pixels of each sector."""
        return np.asarray(np.bincount(self._sector, weights=values, minlength=self._count), np.float64)

    def result(self) -> RimFit:
        """The fit with the covariance of its centre: from the noise, more where the rim scatters by more."""
        use = self.seen[self._sector]
        rim = rim_at(self._x, self._y, self.theta, self._kind)
        rest = self._grey - rim.grey
        free = max(int(use.sum()) - len(self.theta), 1)
        noise = math.sqrt(max(float(np.sum(rest[use] ** 2)) / free, 1 / 12))
        part = Rim(rim.grey[use], rim.off_px[use], rim.slope[use], rim.jacobian[use])
        normal, _ = self._normal(part, np.ones(int(use.sum())), rest[use], noise, self.theta)
        inverse = np.asarray(np.linalg.inv(normal), np.float64)
        covariance = inverse[np.ix_([CX, CY], [CX, CY])]
        told = np.abs(self.theta[[VEIL_X, VEIL_Y]]) / np.sqrt(np.diag(inverse)[[VEIL_X, VEIL_Y]])
        info = np.maximum(self._sums(rim.slope**2), 1e-12)
        off = self._sums(rim.slope * rest) / info
        shown = int(self.seen.sum())
        spare = max(shown - 5, 1)
        excess = float(np.sum((off**2 * info)[self.seen])) / noise**2 / spare
        if excess < 1 + 2 * math.sqrt(2 / spare):  # as white noise has it
            excess = 1.0
        contrast = abs(contrast_at(self.theta))
        patchy = self._patchiness(rim.off_px[use], rest[use], self._sector[use])
        return RimFit(
            theta=self.theta,
            covariance=np.asarray(covariance * excess),
            seen=float(self.seen.mean()),
            misfit=noise / contrast,
            patchiness=patchy / contrast,
            glare=float(told.max()),
        )

    def _patchiness(self, off: Floats, rest: Floats, sector: NDArray[np.int64]) -> float:
        """Root mean square of what is left besides white noise, from means of patches beside the rim."""
        cell = 2 * sector + (off > 0)
        count = np.bincount(cell)
        there = np.flatnonzero(count)
        total = np.bincount(cell, weights=rest)[there]
        between = float(np.sum(total**2 / count[there]))
        white = (float(np.sum(rest**2)) - between) / max(len(rest) - len(there), 1)
        return math.sqrt(max((between - white * len(there)) / len(rest), 0.0))
