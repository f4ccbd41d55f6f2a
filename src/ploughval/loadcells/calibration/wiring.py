"""Whole runs of a calibration that cannot be right: signs, units or cells that were exchanged."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.calibration.fit import Session, fit_model
from ploughval.loadcells.calibration.models import MODELS

Floats = NDArray[np.float64]
_CELLS = ("upper", "lower")
_OTHER_SCALE = 1.25  # runs of the same cell differ by less than this factor
_ALIKE = 0.1  # and those of an exchanged cell by less than this share
_SAME_FACTOR = 0.03
_KNOWN_FACTORS = {
    9.80665: "kilograms and newtons are mixed",
    1000.0: "units a thousand times apart are mixed (N and kN, m and mm, g and kg)",
    4.4482216: "pounds and newtons are mixed",
}
_SWAP_MISFIT = 0.003  # of the largest moment: what fits better than that is not exchanged
_SWAP_GAIN = 3.0  # times less must be the misfit with the cells exchanged


def run_slopes(session: Session) -> Floats:
    """Reading of each cell per N m in each run, (2, R); NaN where a run holds a single moment."""
    slopes = np.full((2, session.runs), np.nan)
    for run in range(session.runs):
        rows = session.run == run
        m = session.moments[:, rows] - session.moments[:, rows].mean(axis=1, keepdims=True)
        power = (m**2).sum(axis=1)
        told = power > 1e-12 * (session.moments**2).max(axis=1)
        slopes[told, run] = (session.readings[told][:, rows] * m[told]).sum(axis=1) / power[told]
    return slopes


def odd_runs(session: Session) -> list[tuple[int, str]]:
    """Runs whose readings per moment differ from those of most runs, and how, as (run, text).

    Of two runs the second is told apart from the first; which of them is wrong stays open.
    """
    slopes = run_slopes(session)
    if not np.isfinite(slopes).any(axis=1).all():
        return []
    usual = np.nanmedian(slopes, axis=1) if session.runs > 2 else slopes[:, 0]
    exchanged = run_slopes(replace(session, readings=session.readings[::-1])) / usual[:, None]
    found = []
    for run, ratio in enumerate((slopes / usual[:, None]).T):
        if not np.isfinite(ratio).all():
            continue
        turned = [name for name, r in zip(_CELLS, ratio, strict=True) if r < 0]
        if turned:
            found.append((run, f"the sign of the {' and '.join(turned)} cell is turned"))
        elif max(ratio.max(), 1 / ratio.min()) <= _OTHER_SCALE:
            continue
        elif np.abs(exchanged[:, run] - 1).max() < _ALIKE:
            found.append((run, "upper and lower cell are exchanged"))
        else:
            found.append((run, _scale_text(ratio)))
    return found


def _scale_text(ratio: Floats) -> str:
    """By which factor a run reads more or less than the others, and what makes such a factor."""
    text = " and ".join(f"{r:.3g} times as much in the {n} cell" for r, n in zip(ratio, _CELLS, strict=True))
    for factor, meaning in _KNOWN_FACTORS.items():
        if min(np.abs(ratio / factor - 1).max(), np.abs(ratio * factor - 1).max()) < _SAME_FACTOR:
            return f"it reads {text}: {meaning}"
    return f"it reads {text}"


def cells_exchanged(session: Session) -> bool:
    """Whether the upper column holds the lower cell: needs loads at several arms to tell."""
    straight = fit_model(session, MODELS[0])
    turned = replace(session, readings=session.readings[::-1], resolution=session.resolution[::-1])
    exchanged = fit_model(turned, MODELS[0])
    if straight is None or exchanged is None:
        return False
    largest = np.abs(session.moments).max(axis=1)
    worse = straight.scatter_Nm / largest
    better = exchanged.scatter_Nm / largest
    return bool(worse.min() > _SWAP_MISFIT and (worse > _SWAP_GAIN * better).all())
