"""Standard deviation of a vector from image noise and texture (Cramer-Rao; cf. Wang et al. 2009).

docs/theory-correlation.md, Eq. (5).
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from ploughval.axes import Status
from ploughval.piv.interpolate import SlopeFilter, basis_polynomials, prefilter_taps, slope_noise
from ploughval.piv.subsets import Description, Fit, Pair, match, params_from, read_subsets
from ploughval.piv.validate import chance_zncc

Floats = NDArray[np.float64]
SAMPLE = 96
"""Points on which the noise of a pair is judged."""
READ = 64
"""Points of them whose residuals are read pixel by pixel."""
LEAST_ANSWER = 0.02
"""Least share of the slopes that is not noise: less is told as so much."""
STRIP, STRIPS = 24, 8
"""Height and number of the strips of a picture on which its noise is bounded."""
LENGTHS = 2.0
"""Residuals are taken to be correlated over so many lengths of the texture's correlation."""
MOST_LAGS = 12
NOISE_STEPS = (0.004, 0.3)
"""Noise variance over mean squared slope, px^2, at which another filter of the slopes has the least error."""
FILTERS = (SlopeFilter.NARROW, SlopeFilter.WIDE, SlopeFilter.SOFT)


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise of a pair as its residuals show it.

    Attributes
    ----------
    variance : float, grey levels^2, of one picture
    correlated : (2,) float, factor on the variance of a displacement (x, y) because residuals of neighbouring
        pixels are correlated: interpolated noise, and what the pixels could not resolve
    given : bool, whether the user gave the noise, so that residuals do not count
    """

    variance: float = 0.0
    correlated: tuple[float, float] = (1.0, 1.0)
    given: bool = False


@lru_cache(maxsize=16)
def residual_share(spline: int) -> float:
    """Residual variance over the noise variance of one picture, over all fractions of a pixel.

    Interpolation between pixels averages noise, so residuals show less of it than both pictures hold.
    """
    fractions = (np.arange(64) + 0.5) / 64
    weights = basis_polynomials(spline) @ fractions ** np.arange(spline + 1)[:, None]
    share = np.mean([np.sum(np.convolve(prefilter_taps(spline), w) ** 2) for w in weights.T])
    return float(1.0 + share**2)


def judge_noise(
    pair: Pair, points: Floats, start: Floats, given: float | None
) -> tuple[Noise, SlopeFilter] | None:
    """Noise of a pair from the residuals of a sample of points, and the filter of the slopes that suits it.

    None where hardly a point of the sample matched.

    ``pair`` has plain slopes; ``start`` (N, 2) px: first guesses; ``given``: noise of one picture in grey
    levels, None: unknown.
    """
    some = np.linspace(0, len(points) - 1, min(SAMPLE, len(points))).astype(int)
    fit = match(pair, points[some], params_from(start[some], pair.recipe))
    bound = noise_bound(pair.reference.value, pair.mask)
    good = np.flatnonzero(
        (fit.zncc > chance_zncc(fit, min(bound, 1e30)))
        & np.isin(fit.status, (Status.OK, Status.NOT_CONVERGED))
    )
    if good.size < max(3, 0.1 * some.size):
        return None
    calm = good[fit.residual[good] <= np.median(fit.residual[good])]
    shown = float(np.median(fit.residual[calm])) / residual_share(pair.recipe.spline)
    variance = min(shown, bound) if given is None else given**2
    # Plain slopes hold the noise as well.
    texture = np.median(fit.product[calm]) - 0.5 * variance * slope_noise(
        pair.recipe.spline, pair.recipe.slopes
    )
    step = int(np.searchsorted(NOISE_STEPS, variance / max(float(texture), 1e-12)))
    return Noise(variance, given=given is not None), FILTERS[step]


def unjudged(given: float | None) -> tuple[Noise, SlopeFilter]:
    """Noise and filter where no sample tells them."""
    return Noise(0.0 if given is None else given**2, given=given is not None), SlopeFilter.NARROW


def with_correlation(noise: Noise, pair: Pair, points: Floats, fit: Fit) -> Noise:
    """The noise with the correlation of residuals, read on some of the calmer half of the valid points."""
    good = np.flatnonzero((fit.status == Status.OK) & (fit.description == Description.PLAIN))
    if noise.given or good.size < 3:
        return noise
    calm = good[fit.residual[good] <= np.median(fit.residual[good])]
    calm = calm[np.linspace(0, calm.size - 1, min(READ, calm.size)).astype(int)]
    some = fit.take(calm)
    texture = np.maximum(some.variance - noise.variance, 0.0) / np.maximum(some.slope * some.answer, 1e-12)
    lags = int(np.clip(np.ceil(LENGTHS * np.sqrt(np.median(texture))), 1, MOST_LAGS))
    lags = min(lags, pair.recipe.subset // 6)
    subsets = read_subsets(pair, points[calm], fit.params[calm])
    return replace(noise, correlated=_correlation(subsets, lags, pair.recipe.terms))


def _correlation(subsets: NDArray[np.float32], lags: int, terms: int) -> tuple[float, float]:
    """Variance of the sum of slope times residual over that of white residuals, for x and y.

    The sum over lags of the products' covariance (Newey & West 1987, in the plane). The fit makes the
    products of a whole subset add up to nothing, and those of a window of w^2 pixels to less by the share
    ``terms`` w^2 / n of white residuals' (1 for the mean, 1 for each of the shape function's other terms).
    """
    residual, slopes = subsets[:, 0], subsets[:, 1:3]
    side = residual.shape[-1]
    square = np.mean(residual**2, axis=(1, 2)) * np.mean(slopes**2, axis=(2, 3)).T
    if lags < 1 or not (square.sum(axis=1) > 0).all():
        return 1.0, 1.0
    product = slopes * residual[:, None]
    core = slice(lags, side - lags)
    total = np.zeros(2)
    for width in (2 * lags + 1, 2 * lags - 1):  # the outermost lags count by half
        around = uniform_filter(product, size=(1, 1, width, width), mode="constant") * width**2
        both = np.mean((product * around)[:, :, core, core], axis=(0, 2, 3))
        total += both / max(1.0 - terms * width**2 / side**2, 0.5) / 2.0
    total /= np.mean(square, axis=1)
    kept = np.clip(total, 0.25, 16.0)
    return float(kept[0]), float(kept[1])


def noise_bound(image: NDArray[np.float32], usable: NDArray[np.uint8]) -> float:
    """Variance of the white noise of a picture (H, W), grey levels^2, at most: what its finest checks hold.

    Mean square of the product of two second differences over that of white noise (Immerkaer 1996), on usable
    pixels in strips of the picture; texture only adds to it. Infinite where no pixel is usable.
    """
    rows = np.flatnonzero(usable.any(axis=1))
    if rows.size == 0 or min(image.shape) < 3:
        return np.inf
    check = np.array([1.0, -2.0, 1.0], np.float32)
    square, count = 0.0, 0
    for top in np.unique(np.linspace(rows[0], max(rows[-1] + 1 - STRIP, rows[0]), STRIPS).astype(int)):
        strip = slice(top, top + STRIP)
        whole = cv2.erode(usable[strip], np.ones((3, 3), np.uint8)) != 0
        fine = cv2.sepFilter2D(image[strip], cv2.CV_32F, check, check)[whole]
        square, count = square + float(np.dot(fine, fine)), count + fine.size
    return square / count / 36.0 if count else np.inf


def predict_std(fit: Fit, noise: Noise) -> Floats:
    """Predicted standard deviation of displacements.

    Parameters
    ----------
    fit : Fit
        Subsets matched by a pair that knows its noise.
    noise : Noise
        Of the pair.

    Returns
    -------
    (N, 2) float, px
        std^2 = s^2 c [H^-1] / r^2 with s^2 the residual variance (twice the noise variance where it is
        given), c the correlation of residuals, H the Hessian of the subset, freed from gain and offset, and
        r what the residuals answer to over it, for each axis: the plain slopes, freed from noise. Along an
        edge nothing but noise has a slope, and r is nearly zero.
    """
    variance = np.full(fit.zncc.shape, 2.0 * noise.variance) if noise.given else fit.residual
    factor = np.ones(2) if noise.given else np.array(noise.correlated)
    answer = np.maximum(fit.answers, LEAST_ANSWER)
    return np.asarray(np.sqrt(variance[:, None] * factor * fit.spread) / answer)
