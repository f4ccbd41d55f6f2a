"""Standard deviation of a vector from image noise and texture (Cramer-Rao; cf. Wang, Sutton et al. 2009)."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import spline_filter1d

from ploughval.axes import Status
from ploughval.piv.interpolate import basis_polynomials, node_taps
from ploughval.piv.subsets import Fit, Pair, Recipe, match, params_from

Floats = NDArray[np.float64]
_STEPS = 64
SAMPLE = 100
NOISE_STEPS = (0.004, 0.3)
"""Noise variance over mean squared slope, px^2, at which the smoothing changes."""
SMOOTHING = (1.0, 0.7, 1.2)


@lru_cache(maxsize=4)
def interpolated_noise(spline: int) -> Floats:
    """Variance of interpolated unit white noise at the fractions 0, 1/64 ... 1 of a pixel, along one axis.

    Interpolation between pixels averages noise, so residuals show less of it than both pictures hold.
    """
    impulse = np.zeros(129)
    impulse[64] = 1.0
    prefilter = spline_filter1d(impulse, order=spline, mode="mirror")
    table = basis_polynomials(spline)
    fractions = np.arange(_STEPS + 1) / _STEPS
    weights = table @ fractions ** np.arange(spline + 1)[:, None]
    return np.array([np.sum(np.convolve(prefilter, w) ** 2) for w in weights.T])


def residual_noise(params: Floats, recipe: Recipe) -> Floats:
    """Residual variance over the noise variance of one picture, (N,), for subsets with given parameters."""
    axis = np.linspace(-1.0, 1.0, 7)
    xi, eta = (a.ravel() for a in np.meshgrid(axis, axis))
    moved = params @ recipe.monomials(xi, eta)  # (N, 2, 49) px; the pixels themselves stand on integers
    gain = np.interp(moved % 1.0, np.arange(_STEPS + 1) / _STEPS, interpolated_noise(recipe.spline))
    return np.asarray(1.0 + np.mean(gain[:, 0] * gain[:, 1], axis=1))


def predict_std(fit: Fit, recipe: Recipe, noise: float | None) -> Floats:
    """Predicted standard deviation of displacements.

    Parameters
    ----------
    fit : Fit
        Matched subsets.
    recipe : Recipe
        How they were matched.
    noise : float, grey levels
        Noise of one photograph; None: from each subset's own residuals.

    Returns
    -------
    (N, 2) float, px
        Both pictures carry the noise: std^2 = 2 noise^2 [H^-1] with H the Hessian of the subset,
        freed from gain and offset.
    """
    variance = fit.stats[:, 1] / residual_noise(fit.params, recipe) if noise is None else noise**2
    variance = np.broadcast_to(np.asarray(variance, float), fit.zncc.shape)
    slope = np.maximum(fit.stats[:, 7], 1e-300)
    # Noise of the reference is in both slopes and must not count as texture.
    product = fit.stats[:, 8] * slope - variance * slope_noise(recipe)
    gain = slope / np.maximum(product, 0.1 * slope)
    return np.asarray(np.sqrt(2.0 * variance[:, None] * fit.stats[:, 2:4]) * gain[:, None])


def suited_recipe(pair: Pair, points: Floats, start: Floats) -> Recipe:
    """Recipe whose smoothing of the slopes suits the noise of a pair, judged on a sample of points.

    Little noise: more smoothing lowers the bias of what the pixels alias. Much noise: more smoothing keeps
    the noise out of the slopes.
    """
    some = np.linspace(0, len(points) - 1, min(SAMPLE, len(points))).astype(int)
    fit = match(pair, points[some], params_from(start[some], pair.recipe))
    seen = fit.stats[(fit.status == Status.OK) & (fit.stats[:, 7] > 0)]
    if len(seen) < 0.1 * some.size or len(seen) == 0:
        return pair.recipe
    noise = np.percentile(seen[:, 1], 25) / 1.8 / np.median(seen[:, 7] * seen[:, 8])
    smooth_px = SMOOTHING[int(np.searchsorted(NOISE_STEPS, noise))]
    return replace(pair.recipe, smooth_px=smooth_px)


@lru_cache(maxsize=16)
def slope_noise(recipe: Recipe) -> float:
    """Mean product of smoothed and plain slope in unit white noise."""
    impulse = np.zeros(129)
    impulse[64] = 1.0
    prefilter = spline_filter1d(impulse, order=recipe.spline, mode="mirror")
    value, smooth, slope, plain = (
        np.convolve(prefilter, taps) for taps in node_taps(recipe.spline, recipe.smooth_px)
    )
    return float(np.sum(slope * plain) * np.sum(smooth * value))
