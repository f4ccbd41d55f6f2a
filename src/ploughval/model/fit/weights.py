"""How much a record weighs against a model that misses it: the model's discrepancy, and rows that count."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ploughval.model.fit.objective import Objective

Floats = NDArray[np.float64]

ROWS_TOLD = 2.5  # standard deviations: rows are taken as independent while their correlation stays below
TOO_FAR = 2.0  # standard deviations, rms: teeth differ by more than was allowed for


@dataclass(frozen=True, slots=True, eq=False)
class Misfit:
    """How the rows of the best fit miss the record.

    Attributes
    ----------
    chi2 : float
        Mean square of the residuals over their stated variance, per degree of freedom.
    rows_together : float
        Rows that miss the record together: the integrated autocorrelation of the residuals.
    independent : float
        Rows that count: all of them over ``rows_together``.
    inflation : float
        Factor on the noise of a row that makes independent rows tell as much as these do.
    """

    chi2: float
    rows_together: float
    independent: float
    inflation: float


def misfit_of(residuals: Floats, unknowns: int) -> Misfit:
    """Misfit of standardised residuals in the order of travel (docs/theory-fit.md, Eq. (5))."""
    count = len(residuals)
    freedom = max(count - unknowns, 1)
    chi2 = float(np.sum(residuals**2)) / freedom
    together = _rows_together(residuals)
    first = float(np.sum(residuals[1:] * residuals[:-1]) / max(np.sum(residuals**2), 1e-300))
    alone = abs(first) < ROWS_TOLD / np.sqrt(count) and chi2 < 1.0 + ROWS_TOLD * np.sqrt(2.0 / freedom)
    if alone:
        return Misfit(chi2, 1.0, float(count), 1.0)
    independent = max(count / together, unknowns + 2.0)
    return Misfit(chi2, together, independent, float(np.sqrt(max(1.0, chi2 * count / independent))))


def _rows_together(residuals: Floats) -> float:
    """Integrated autocorrelation by Geyer's initial positive sequence (1992, section 3.3)."""
    count = len(residuals)
    size = 1 << (2 * count - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(residuals, size)) ** 2
    correlation = np.fft.irfft(spectrum, size)[:count]
    correlation /= max(correlation[0], 1e-300)
    pairs = correlation[0 : 2 * (count // 2) : 2] + correlation[1 : 2 * (count // 2) : 2]
    end = int(np.argmax(pairs <= 0.0)) if np.any(pairs <= 0.0) else len(pairs)
    return max(1.0, 2.0 * float(np.sum(pairs[:end])) - 1.0)


def loosened(objective: Objective, unknowns: Floats) -> Objective:
    """The objective with a discrepancy of the model as great as the best fit asks for.

    Where teeth are stretched by more than :data:`TOO_FAR` of what was allowed for (rms), the standard
    deviation in travel becomes what was seen; where the force misses the record by more than its noise and
    more than was allowed for, that in force does (docs/theory-fit.md, Eq. (4)). To be called once: a force
    that may bend more takes its level, which tells the friction angles, more for the model's fault each time.
    """
    apart, record = objective.discrepancy, objective.record
    stretch = _rms(_stretch(objective, unknowns))
    if apart.travel > 0.0 and stretch > TOO_FAR * apart.travel:
        apart = replace(apart, travel=stretch)
    missed = _rms(objective.curve(unknowns) - record.force_N) ** 2 - _rms(record.noise_std_N) ** 2
    share = float(np.sqrt(max(missed, 0.0))) / max(_rms(record.force_N), 1e-12)
    if apart.force > 0.0 and share > apart.force:
        apart = replace(apart, force=share)
    return objective if apart == objective.discrepancy else replace(objective, discrepancy=apart)


def _stretch(objective: Objective, unknowns: Floats) -> Floats:
    """Relative difference in length of the teeth that the record closes; none without them."""
    places = unknowns[objective.switches]
    modelled = objective.modelled(unknowns[: objective.soils])
    known = 0 if modelled is None else min(len(places), len(modelled.teeth.place_mm) - 1)
    if modelled is None or not known:
        return np.zeros(1)
    seen = np.diff(np.concatenate([[objective.record.start_mm], places[:known]]))
    return np.asarray(seen / np.diff(modelled.teeth.place_mm[: known + 1]) - 1.0)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
