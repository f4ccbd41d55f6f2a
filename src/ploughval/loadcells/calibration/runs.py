"""How the runs of a calibration differ: spread of their sensitivities."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.calibration.fit import ModelFit, Session

Floats = NDArray[np.float64]
_LEVEL = 0.05  # differences that chance brings about more often are none


@dataclass(frozen=True, slots=True, eq=False)
class RunSpread:
    """Differences between the runs' sensitivities, relative to the common one.

    Attributes
    ----------
    deviation : (2, R) float
        Of each cell in each run; NaN where a run does not tell.
    std : (2,) float
        Their standard deviation; NaN with a single run.
    relative_variance : (2,) float
        Variance between runs beyond what scatter within them explains; 0 where chance does (F test, 5 %).
    """

    deviation: Floats
    std: Floats
    relative_variance: Floats


def run_spread(session: Session, fit: ModelFit) -> RunSpread:
    """Sensitivity of each run against the common fit, by the slope of its residuals over the moments."""
    from scipy.special import fdtrc

    runs = session.runs
    deviation, weight = np.full((2, runs), np.nan), np.zeros((2, runs))
    used = np.ones(session.run.size, dtype=bool)
    used[list(fit.left_out)] = False
    for k in range(runs):
        rows = used & (session.run == k)
        if rows.sum() < 2:
            continue
        centred = session.moments[:, rows] - session.moments[:, rows].mean(axis=1, keepdims=True)
        power = (centred**2).sum(axis=1)
        good = power > 1e-6 * (session.moments**2).max(axis=1)
        deviation[good, k] = (fit.residuals[good][:, rows] * centred[good]).sum(axis=1) / power[good]
        weight[:, k] = np.where(good, power, 0.0)
    std, extra = np.full(2, np.nan), np.zeros(2)
    for cell in (0, 1):
        told = np.isfinite(deviation[cell])
        between = int(told.sum()) - 1
        if between < 1:
            continue
        b, w = deviation[cell, told], weight[cell, told]
        std[cell] = float(b.std(ddof=1))
        middle = float((w * b).sum() / w.sum())
        explained = float((w * (b - middle) ** 2).sum())
        inner = fit.dof[cell] - between
        total = fit.scatter_Nm[cell] ** 2 * fit.dof[cell]
        if inner < 1 or total <= explained:
            continue
        within = (total - explained) / inner
        if float(fdtrc(between, inner, explained / between / within)) < _LEVEL:
            extra[cell] = max(std[cell] ** 2 - float((within / w).mean()), 0.0)
    return RunSpread(deviation, std, extra)
