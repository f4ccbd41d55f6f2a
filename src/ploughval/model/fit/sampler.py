"""Samples of the posterior by an ensemble of walkers (Goodman and Weare, 2010); extra ``bayes``."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import MissingExtraError
from ploughval.model.fit.intervals import WIDTH
from ploughval.model.fit.objective import IMPOSSIBLE, Objective
from ploughval.model.fit.variables import in_units
from ploughval.watch import Progress, unheard

Floats = NDArray[np.float64]

WALKERS = 32
STEPS = 400  # of each walker
WARM_UP = 0.3  # of the steps, left out
PERCENT = (2.5, 16.0, 50.0, 84.0, 97.5)
SEED = 20120917  # of the walkers: same record, same samples
TOLERANCE = 1e-3


def sampler() -> Any:
    """The package that samples.

    Raises
    ------
    MissingExtraError
        emcee is not installed.
    """
    try:
        import emcee
    except ImportError as error:
        raise MissingExtraError("emcee", "bayes", "Sampling a fit") from error
    return emcee


def sample(
    objective: Objective, best: Floats, *, steps: int, progress: Progress = unheard
) -> dict[str, tuple[float, ...]]:
    """Percentiles of the posterior of each fitted parameter, flat over the range searched.

    Parameters
    ----------
    objective : Objective
        Half its cost is minus the logarithm of the posterior.
    best : (V,) float
        Where the walkers start around, spread as the derivatives there say.
    steps : int
        Of each walker.
    progress : callable
        Hears of (stage, done, total).

    Returns
    -------
    dict of str to tuple of float
        :data:`PERCENT` of each fitted parameter, in its unit.

    Raises
    ------
    MissingExtraError
        emcee is not installed.
    """
    emcee = sampler()
    coarse = objective.at(tolerance=TOLERANCE)
    low, high = coarse.bounds(best)
    walkers = max(WALKERS, 2 * len(best) + 2)
    start = _spread(coarse, best, walkers)

    def log_posterior(unknowns: Floats) -> float:
        if np.any(unknowns < low) or np.any(unknowns > high) or _no_soil(coarse, unknowns):
            return -np.inf
        left = coarse.residuals(unknowns)
        return -np.inf if np.any(np.abs(left) >= IMPOSSIBLE) else -0.5 * float(np.sum(left**2))

    chain = emcee.EnsembleSampler(walkers, len(best), log_posterior)
    chain.random_state = np.random.RandomState(SEED).get_state()
    progress("samples", 0, steps)
    for done, _ in enumerate(chain.sample(start, iterations=steps), start=1):
        progress("samples", done, steps)
    kept = chain.get_chain(discard=int(WARM_UP * steps), flat=True)
    names = coarse.space.fitted
    return {
        name: tuple(in_units(name, v) for v in np.percentile(kept[:, k], PERCENT))
        for k, name in enumerate(names)
    }


def _spread(objective: Objective, best: Floats, walkers: int) -> Floats:
    """First places of the walkers: normal about the best fit, with the covariance of its derivatives."""
    low, high = objective.bounds(best)
    span = high - low
    values, vectors = np.linalg.eigh(_information(objective, best, span))
    # what the record does not tell at all starts over a tenth of the range
    roots = 1.0 / np.sqrt(np.maximum(values, 100.0))
    normal = np.random.default_rng(SEED).standard_normal((walkers, len(best)))
    return np.asarray(np.clip(best + span * (normal * roots @ vectors.T), low + 1e-9, high - 1e-9))


def _information(objective: Objective, best: Floats, span: Floats) -> Floats:
    slopes = objective.jacobian(best, WIDTH) * span
    return np.asarray(slopes.T @ slopes)


def _no_soil(objective: Objective, unknowns: Floats) -> bool:
    """Whether the residual angle is above the peak."""
    names = objective.space.fitted
    pair = [f"{name}_friction_deg" for name in ("peak", "residual")]
    if not set(pair) <= set(names):
        return False
    return bool(unknowns[names.index(pair[1])] > unknowns[names.index(pair[0])])
