"""Control markers found in a photograph from approximate places: painted dots and drawn circles.

White, Take and Bolton (2003) read pixels of black dots on white by thresholds; here the whole rim is fitted
(:mod:`ploughval.photos.markers.rim`), which keeps to the part that is seen and says how well it is known.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ploughval.photos.markers.edges import first_circle
from ploughval.photos.markers.fit import RimFit, Shape, fit_rim, freed_of_glare
from ploughval.photos.markers.rim import BLUR, CX, CY, RADIUS, SKEW, STRETCH, Floats, Kind
from ploughval.photos.markers.search import Candidate, search

REACH = 2.0
"""How far from its approximate place a marker is searched for, in stated radii, unless said."""
SIZES = (0.65, 1.5)
"""Radii that are accepted, over the stated one."""
ROUNDNESS = 0.1
"""Expected stretch of a marker: half the difference of its axes over their mean, one standard deviation."""
ROUNDEST = 0.16
"""Most of it that is accepted: axes as 1.4 to 1, a view from 43 degrees aside."""
POOLED = 0.002
"""Markers of a picture have the stretch of each other to about this."""
LEAST_SEEN, SMALL_SEEN, SMALL_PX = 0.35, 0.8, 4.5
"""Share of the rim that must be seen of a marker of which the others tell nothing: at least the first, and
SMALL_PX over its radius, since grains show pieces of rims; never more than the second."""
WHOLE = 0.8
"""Share of the rim from which a marker tells its own shape."""
LEAST_ALIKE = 3
"""Whole markers that tell how all of a picture look."""
UNLIKE_CONTRAST, UNLIKE_SIZE = 2.5, 1.3
"""A thing that differs from them by more than these ratios is no marker."""
NOISY = 0.25
"""What the model may leave, as a share of the contrast, root mean square."""
PATCHY = 0.08
"""The same without the white noise in it: sand beside a rim, or sand that looks round, leaves more."""
RIVAL = 0.6
"""A second marker within reach counts if it is alike and has this share of the contrast and of a rim."""


@dataclass(frozen=True, slots=True, eq=False)
class MarkerFits:
    """Markers found in a photograph, N as asked for.

    Attributes
    ----------
    px : (N, 2) float
        Centres, right and down, px; NaN where not found.
    std_px : (N, 2) float
        Standard deviations of the coordinates.
    radius_px : (N,) float
        Mean of the axes; of a ring, that of the middle of its line.
    contrast_grey : (N,) float
        Grey level inside (on the line of a ring) less that outside.
    seen : (N,) float
        Share of the rim that was used.
    reasons : tuple of str
        Why a marker was not found; empty: found.
    fits : tuple of RimFit or None
        All parameters.
    """

    px: Floats
    std_px: Floats
    radius_px: Floats
    contrast_grey: Floats
    seen: Floats
    reasons: tuple[str, ...]
    fits: tuple[RimFit | None, ...]

    @property
    def found(self) -> NDArray[np.bool_]:
        """Which markers were found (N,)."""
        return np.array([not reason for reason in self.reasons], bool)


def find_markers(
    image: NDArray[np.generic],
    approximate_px: ArrayLike,
    radius_px: float,
    *,
    reach_px: float | None = None,
    kind: Kind = "dot",
) -> MarkerFits:
    """Find dots or circles near approximate places.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float
        Grey levels; dark or pale markers, on what contrasts with them.
    approximate_px : (N, 2) float
        Where they are, about.
    radius_px : float
        Their radius, about: from SIZES[0] to SIZES[1] of it is accepted.
    reach_px : float, optional
        How far from the approximate place a centre may be; REACH radii where not given.
    kind : "dot" or "ring"
        Filled, or an outline.

    Returns
    -------
    MarkerFits
        A marker that is not found costs only itself and has a reason.
    """
    places = np.asarray(approximate_px, float).reshape(-1, 2)
    reach = REACH * radius_px if reach_px is None else reach_px
    wide = Shape(radius_px, 0.5 * radius_px, np.zeros(2), ROUNDNESS)
    asked = _Asked(image, radius_px, reach, kind)
    found = [_find(asked, place, wide) for place in places]
    fits = [fit for fit, _ in found if fit is not None and fit.seen >= WHOLE]
    if len(fits) >= LEAST_ALIKE:
        shape, contrast = _common(fits, radius_px)
        for k, (fit, _) in enumerate(found):
            if fit is None or fit.seen < WHOLE:
                found[k] = _find(asked, places[k], shape, contrast)
        found = [_unlike(fit, why, shape, contrast) for fit, why in found]
    return gathered([fit for fit, _ in found], [why for _, why in found])


@dataclass(frozen=True, slots=True)
class _Asked:
    """What is searched for in one photograph."""

    image: NDArray[np.generic]
    radius: float
    reach: float
    kind: Kind


def gathered(fits: list[RimFit | None], reasons: list[str]) -> MarkerFits:
    """Single fits as one; a reason wherever there is no fit."""
    count = len(fits)
    px, std = np.full((count, 2), np.nan), np.full((count, 2), np.nan)
    radius, contrast, seen = (np.full(count, np.nan) for _ in range(3))
    for k, fit in enumerate(fits):
        if fit is not None:
            px[k] = fit.theta[[CX, CY]]
            std[k] = np.sqrt(np.diag(fit.covariance))
            radius[k], contrast[k], seen[k] = fit.theta[RADIUS], fit.contrast_grey, fit.seen
    return MarkerFits(px, std, radius, contrast, seen, tuple(reasons), tuple(fits))


def _find(
    asked: _Asked, place: Floats, shape: Shape, contrast: float | None = None
) -> tuple[RimFit | None, str]:
    """One marker, or why not; ``contrast``: that of the other markers, where it is known."""
    (height, width), radius, reach = asked.image.shape, asked.radius, asked.reach
    if not (0 <= place[0] <= width - 1 and 0 <= place[1] <= height - 1):
        return None, f"({place[0]:.0f}, {place[1]:.0f}) px lies outside the picture of {width} x {height} px"
    sign = contrast if asked.kind == "dot" else None
    candidates = search(asked.image, place, shape.radius_px, reach, contrast=sign)
    fits: list[RimFit] = []
    for candidate in candidates:
        fit = None if _known(candidate, fits, contrast) else _fitted(asked, candidate, shape)
        if fit is not None and _like_marker(fit) and (contrast is not None or _told_alone(fit)):
            fits.append(fit)
    near = [f for f in fits if np.hypot(*(f.theta[[CX, CY]] - place)) <= reach]
    sized = [f for f in near if SIZES[0] <= f.theta[RADIUS] / radius <= SIZES[1]]
    if not sized:
        return None, _why_none(near, radius, reach)
    best = max(sized, key=lambda f: _worth(f, radius))
    rivals = [f for f in sized if _rivals(f, best)]
    if rivals:
        (x0, y0), (x1, y1) = best.theta[[CX, CY]], rivals[0].theta[[CX, CY]]
        return None, (
            f"two markers within {reach:.0f} px, at ({x0:.1f}, {y0:.1f}) and ({x1:.1f}, {y1:.1f}) px; "
            "say the place more exactly, or a smaller reach_px"
        )
    return freed_of_glare(asked.image, best, shape, asked.kind), ""


def _known(candidate: Candidate, fits: list[RimFit], contrast: float | None) -> bool:
    """Whether something round is a marker that is fitted already: whole, or as the other markers are."""
    return any(
        np.hypot(*(fit.theta[[CX, CY]] - candidate.centre_px)) < 0.4 * fit.theta[RADIUS]
        and 0.7 < candidate.radius_px / fit.theta[RADIUS] < 1.4
        and (fit.seen >= WHOLE or contrast is not None)
        for fit in fits
    )


def _fitted(asked: _Asked, candidate: Candidate, shape: Shape) -> RimFit | None:
    """The fit that starts from something round."""
    image, kind = asked.image, asked.kind
    sign = math.copysign(1.0, candidate.votes)
    circle = first_circle(image, candidate.centre_px, candidate.radius_px, sign)
    centre, edge, on = circle.centre_px, circle.radius_px, circle.on_rays
    far, grey = _about(image, centre, 1.8 * shape.radius_px + 3)
    outside = _median(grey[(far > 1.15 * edge + 1) & (far < 1.6 * edge + 2)], 0.0)
    if kind == "dot":
        levels = outside, _median(grey[far < 0.75 * edge], outside - sign)
        theta = np.array([*centre, edge, *shape.stretch, shape.blur_px, *levels, 0.0, 0.0, 0.0, 0.0])
        return fit_rim(image, theta, shape, kind, on_rays=on)
    middle, line, level = _line(far, grey, outside, shape.radius_px)
    theta = np.array(
        [*centre, middle, *shape.stretch, shape.blur_px, outside, level, 0.0, 0.0, 0.0, 0.0, line]
    )
    return fit_rim(image, theta, shape, kind, on_rays=on)


def _line(far: Floats, grey: Floats, outside: float, radius: float) -> tuple[float, float, float]:
    """Radius, width and grey level of a drawn circle, from the median of the grey levels at each distance."""
    step = 0.5
    ring = (far / step).astype(int)
    profile = np.array([_median(grey[ring == k], outside) for k in range(int(ring.max()) + 1)])
    off = np.abs(profile - outside)
    first, last = round(SIZES[0] * radius / step), round(SIZES[1] * radius / step)
    peak = first + int(np.argmax(off[first : last + 1]))
    low = high = peak
    while low > 0 and off[low - 1] > off[peak] / 2:
        low -= 1
    while high < len(off) - 1 and off[high + 1] > off[peak] / 2:
        high += 1
    return (low + high + 1) * step / 2, (high - low + 1) * step, float(profile[peak])


def _about(image: NDArray[np.generic], centre: Floats, reach: float) -> tuple[Floats, Floats]:
    """Distances (P,) px from a place and grey levels (P,) of the pixels within reach of it."""
    height, width = image.shape
    rows = np.arange(max(math.ceil(centre[1] - reach), 0), min(math.floor(centre[1] + reach) + 1, height))
    columns = np.arange(max(math.ceil(centre[0] - reach), 0), min(math.floor(centre[0] + reach) + 1, width))
    far = np.hypot(columns[None, :] - centre[0], rows[:, None] - centre[1])
    near = far <= reach
    return far[near], image[np.ix_(rows, columns)][near].astype(float)


def _median(values: Floats, otherwise: float) -> float:
    return float(np.median(values)) if values.size else otherwise


def _like_marker(fit: RimFit) -> bool:
    round_enough = np.hypot(*fit.theta[[STRETCH, SKEW]]) < ROUNDEST
    clean = fit.misfit <= NOISY and fit.patchiness <= PATCHY
    return bool(clean and round_enough and np.isfinite(fit.covariance).all())


def _told_alone(fit: RimFit) -> bool:
    """Whether enough of a rim is seen to be sure of it without other markers."""
    return fit.seen >= max(LEAST_SEEN, min(SMALL_SEEN, SMALL_PX / float(fit.theta[RADIUS])))


def _worth(fit: RimFit, radius: float) -> float:
    """How good a fit is: contrast and share seen, less for a size other than the stated one."""
    size = math.log(float(fit.theta[RADIUS]) / radius)
    return abs(fit.contrast_grey) * fit.seen * math.exp(-0.5 * (size / 0.25) ** 2)


def _rivals(fit: RimFit, best: RimFit) -> bool:
    apart = float(np.hypot(*(fit.theta[[CX, CY]] - best.theta[[CX, CY]])))
    strong = (
        fit.contrast_grey / best.contrast_grey >= RIVAL and fit.seen >= RIVAL and fit.patchiness <= PATCHY / 2
    )
    alike = abs(math.log(float(fit.theta[RADIUS] / best.theta[RADIUS]))) < 0.25
    return strong and alike and apart > 0.5 * float(best.theta[RADIUS])


def _why_none(near: list[RimFit], radius: float, reach: float) -> str:
    if near:
        size = float(max(near, key=lambda f: f.seen).theta[RADIUS])
        return f"its radius is {size:.1f} px; expected about {radius:g} px"
    return f"nothing round of radius {radius:g} px within {reach:.0f} px; is it covered, or somewhere else?"


def _common(fits: list[RimFit], radius: float) -> tuple[Shape, float]:
    """Shape and contrast that the markers of a picture share."""
    theta = np.stack([f.theta for f in fits])
    middle = np.median(theta, axis=0)
    spread = 1.4826 * np.median(np.abs(theta - middle), axis=0)
    shape = Shape(
        float(middle[RADIUS]),
        max(float(spread[RADIUS]), 0.01 * radius),
        middle[[STRETCH, SKEW]],
        max(float(spread[[STRETCH, SKEW]].max()), POOLED),
        float(middle[BLUR]),
        max(float(spread[BLUR]), 0.1),
    )
    return shape, float(np.median([f.contrast_grey for f in fits]))


def _unlike(fit: RimFit | None, why: str, shape: Shape, contrast: float) -> tuple[RimFit | None, str]:
    """A marker unless it is clearly another thing than the others are."""
    if fit is None:
        return fit, why
    ratio, size = fit.contrast_grey / contrast, float(fit.theta[RADIUS]) / shape.radius_px
    if 1 / UNLIKE_CONTRAST < ratio < UNLIKE_CONTRAST and 1 / UNLIKE_SIZE < size < UNLIKE_SIZE:
        return fit, why
    return None, (
        f"what is there has a radius of {float(fit.theta[RADIUS]):.1f} px and a contrast of "
        f"{fit.contrast_grey:+.0f}; the other markers {shape.radius_px:.1f} px and {contrast:+.0f}"
    )
