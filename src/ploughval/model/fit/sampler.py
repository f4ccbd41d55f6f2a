"""Samples of the posterior by an ensemble of walkers (Goodman and Weare, 2010); extra ``bayes``."""

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import MissingExtraError
from ploughval.model.fit.objective import IMPOSSIBLE, Objective
from ploughval.model.fit.variables import in_units

Floats = NDArray[np.float64]

WALKERS = 32
STEPS = 400  # of each walker
WARM_UP = 0.3  # of the steps, left out
PERCENT = (2.5, 16.0, 50.0, 84.0, 97.5)
SEED = 20120917  # of the walkers: same record, same samples
TOLERANCE = 1e-3


def sample(objective: Objective, best: Floats, std: Floats, *, steps: int) -> dict[str, tuple[float, ...]]:
    """Percentiles of the posterior of each fitted parameter, flat over the range searched.

    Parameters
    ----------
    objective : Objective
        Half its cost is minus the logarithm of the posterior.
    best : (V,) float
        Where the walkers start around.
    std : (K,) float
        Standard uncertainties of the fitted parameters, for the first spread of the walkers.
    steps : int
        Of each walker.

    Returns
    -------
    dict of str to tuple of float
        :data:`PERCENT` of each fitted parameter, in its unit.

    Raises
    ------
    MissingExtraError
        emcee is not installed.
    """
    try:
        import emcee
    except ImportError as error:
        raise MissingExtraError("emcee", "bayes", "samples of the fit") from error
    coarse = objective.at(tolerance=TOLERANCE)
    low, high = coarse.bounds(best)
    rng = np.random.default_rng(SEED)
    spread = np.full(len(best), 0.5)
    spread[: len(std)] = np.where(np.isfinite(std), std, 0.1 * (high - low)[: len(std)])
    spread[coarse.switches] = 2e-3 * coarse.space.scene.blade.depth_mm
    walkers = max(WALKERS, 2 * len(best) + 2)
    start = np.clip(best + spread * rng.standard_normal((walkers, len(best))), low + 1e-9, high - 1e-9)

    def log_posterior(unknowns: Floats) -> float:
        if np.any(unknowns < low) or np.any(unknowns > high) or _no_soil(coarse, unknowns):
            return -np.inf
        left = coarse.residuals(unknowns)
        return -np.inf if np.any(np.abs(left) >= IMPOSSIBLE) else -0.5 * float(np.sum(left**2))

    chain = emcee.EnsembleSampler(walkers, len(best), log_posterior)
    chain.random_state = np.random.RandomState(SEED).get_state()
    chain.run_mcmc(start, steps, progress=False)
    kept = chain.get_chain(discard=int(WARM_UP * steps), flat=True)
    names = coarse.space.fitted
    return {
        name: tuple(in_units(name, v) for v in np.percentile(kept[:, k], PERCENT))
        for k, name in enumerate(names)
    }


def _no_soil(objective: Objective, unknowns: Floats) -> bool:
    """Whether the residual angle is above the peak."""
    names = objective.space.fitted
    pair = [f"{name}_friction_deg" for name in ("peak", "residual")]
    if not set(pair) <= set(names):
        return False
    return bool(unknowns[names.index(pair[1])] > unknowns[names.index(pair[0])])
