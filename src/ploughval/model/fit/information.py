"""Which part of a record tells which parameter: how much wider an interval is without it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.model.fit.objective import Modelled, Objective
from ploughval.model.fit.registration import laid_on

Floats = NDArray[np.float64]

STRETCHES = ("first peak", "first fall", "first rise", "places of the switches", "later falls", "later rises")
PEAK_SHARE = 0.15  # of the travel of a softening that still counts as its peak
LEAST_TOLD = 0.5  # of the variance: a stretch without which less is lost is not named


@dataclass(frozen=True, slots=True, eq=False)
class Information:
    """What each stretch of a record tells.

    Attributes
    ----------
    parameters : tuple of str
        Those fitted.
    std : (K,) float
        Standard uncertainties at the best fit, on the searched scale; infinite where nothing is told.
    correlation : (K, K) float
        NaN where a std is infinite.
    widening : (S, K) float
        Std of each parameter without a stretch, over that with all; one row for each of :data:`STRETCHES`.
    share : (S, K) float
        Part of the information on a parameter that a stretch holds, were all others known.
    """

    parameters: tuple[str, ...]
    std: Floats
    correlation: Floats
    widening: Floats
    share: Floats

    def told_by(self, parameter: str) -> str:
        """The stretches that a parameter hangs on, in words."""
        k = self.parameters.index(parameter)
        if not np.isfinite(self.std[k]):
            return "nothing in this record"
        widening = self.widening[:, k]
        named = [
            f"{STRETCHES[s]} ({_times(widening[s])} without)"
            for s in np.argsort(-widening, kind="stable")
            if 1.0 - widening[s] ** -2.0 >= LEAST_TOLD
        ]
        return ", ".join(named) if named else "the whole record, no stretch more than others"

    def to_json(self) -> dict[str, dict[str, dict[str, float]]]:
        """Share and widening of each stretch and parameter, as plain numbers."""
        return {
            stretch: {
                name: {"share": float(self.share[s, k]), "widening": float(self.widening[s, k])}
                for k, name in enumerate(self.parameters)
            }
            for s, stretch in enumerate(STRETCHES)
        }


def _times(factor: float) -> str:
    return "undetermined" if not np.isfinite(factor) or factor > 1e3 else f"{factor:.2g} times as wide"


def information(objective: Objective, unknowns: Floats, width: float) -> Information:
    """Fisher's information of a record, by stretches (docs/theory-fit.md, Eq. (7)).

    Parameters
    ----------
    objective : Objective
        With the noise that the intervals take.
    unknowns : (V,) float
        The best fit.
    width : float, degrees
        Of the differences.
    """
    slopes = objective.jacobian(unknowns, width)
    fitted = len(objective.space.fitted)
    std, correlation = _spread(slopes, fitted)
    kinds = _stretches(objective, unknowns)
    widening = np.ones((len(STRETCHES), fitted))
    square = slopes[:, :fitted] ** 2
    whole = np.maximum(square.sum(axis=0), 1e-300)
    share = np.array([square[kinds == k].sum(axis=0) / whole for k in range(len(STRETCHES))])
    for k in range(len(STRETCHES)):
        if np.any(kinds == k):
            without = _spread(slopes[kinds != k], fitted)[0]
            widening[k] = np.where(np.isfinite(std), without / np.where(np.isfinite(std), std, 1.0), np.nan)
    return Information(objective.space.fitted, std, correlation, widening, share)


def _spread(slopes: Floats, fitted: int) -> tuple[Floats, Floats]:
    """Standard uncertainties and correlation of the fitted unknowns; infinite where a slope is missing."""
    size = np.linalg.norm(slopes, axis=0)
    seen = size > 1e-6
    std = np.full(len(size), np.inf)
    correlation = np.full((len(size), len(size)), np.nan)
    scaled = slopes[:, seen] / size[seen]
    values, vectors = np.linalg.eigh(scaled.T @ scaled)
    kept = values > 1e-12
    # an unknown with a part in a direction that no row sees is not told at all
    blind = np.linalg.norm(vectors[:, ~kept], axis=1) > 1e-3
    covariance = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    root = np.sqrt(np.diag(covariance))
    std[seen] = np.where(blind, np.inf, root / size[seen])
    known = np.outer(~blind, ~blind)
    safe = np.where(root > 0.0, root, 1.0)
    correlation[np.ix_(seen, seen)] = np.where(known, covariance / np.outer(safe, safe), np.nan)
    return std[:fitted], correlation[:fitted, :fitted]


def _stretches(objective: Objective, unknowns: Floats) -> NDArray[np.int64]:
    """Index into STRETCHES of every residual; -1 for what is known beforehand."""
    record, places = objective.record, unknowns[objective.switches]
    kinds = np.full(objective.count(len(places)), -1)
    modelled = objective.modelled(unknowns[: objective.soils])
    if modelled is None:
        return kinds
    travel = laid_on(record.u_mm, record.start_mm, places, record.end_mm, modelled.teeth)
    kinds[: len(travel)] = _of_rows(travel, modelled)
    kinds[len(travel) : len(travel) + len(places) + 1] = STRETCHES.index("places of the switches")
    return kinds


def _of_rows(travel_mm: Floats, modelled: Modelled) -> NDArray[np.int64]:
    """The stretch of each row, from where it lies on the model's teeth."""
    teeth = modelled.teeth
    tooth = np.clip(np.searchsorted(teeth.place_mm, travel_mm, side="right") - 1, 0, None)
    since = travel_mm - teeth.place_mm[tooth]
    soft = teeth.soft_mm[tooth]
    falls, first = since <= soft, tooth == 0
    kind = np.where(falls, STRETCHES.index("later falls"), STRETCHES.index("later rises"))
    kind[first & ~falls] = STRETCHES.index("first rise")
    kind[first & falls] = STRETCHES.index("first fall")
    kind[first & (since <= PEAK_SHARE * soft)] = STRETCHES.index("first peak")
    return kind
