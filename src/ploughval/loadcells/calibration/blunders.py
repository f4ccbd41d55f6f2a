"""What probably went wrong with a calibration point that contradicts all others."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.calibration.fit import ModelFit, Session
from ploughval.loadcells.response import CellResponse

Floats = NDArray[np.float64]
_WITHIN = 4.0  # standard deviations that an explanation may leave
_WHOLE = 0.1  # of a weight: how far from a whole number of them


@dataclass(frozen=True, slots=True)
class Rig:
    """Geometry of the cells, and the loads and arms that were used, in N and mm."""

    spacing_mm: float
    lower_to_tip_mm: float
    loads_N: Floats
    arms_mm: Floats


def likely_cause(session: Session, fit: ModelFit, row: int, rig: Rig) -> str:
    """The mistake that explains a row left out of a fit, in words.

    Parameters
    ----------
    session, fit : Session, ModelFit
        A fit with ``row`` among its ``left_out``.
    row : int
        The row.
    rig : Rig
        What moments are turned back into loads and arms with.
    """
    place = fit.left_out.index(row)
    off, std = fit.shifts[place], np.maximum(fit.shift_std[place], fit.scatter_Nm)
    stated = session.moments[:, row]
    fitted = stated - off  # what the readings mean by all other rows
    zero = fit.zeros[:, session.run[row]]
    none = np.zeros_like(fit.coefficients)
    response = CellResponse(fit.model.powers, fit.coefficients, fit.cov, none, none)
    exchanged = response.moments((session.readings[::-1, row] - zero)[:, None])[:, 0]

    def explains(moments: Floats) -> bool:
        return bool((np.abs(moments - stated) < _WITHIN * std).all())

    if explains(-fitted):
        return "the sign of the load or of both readings is turned"
    if explains(exchanged):
        return "the readings of the two cells are exchanged"
    for k, name in enumerate(("upper", "lower")):
        other = 1 - k
        if abs(off[other]) < _WITHIN * std[other]:
            if abs(fitted[k] + stated[k]) < _WITHIN * std[k]:
                return f"the sign of the {name} reading is turned"
            slope = response.slopes(session.readings[:, row] - zero)[k, k]
            wanted = session.readings[k, row] + off[k] / slope
            return f"the {name} reading alone is off: {wanted:.6g} was expected"
    return _load_or_arm(fitted, stated, std, rig)


def _load_or_arm(fitted: Floats, stated: Floats, std: Floats, rig: Rig) -> str:
    """A wrong weight keeps the ratio of the moments, a wrong arm their difference."""
    load = float(stated[0] - stated[1]) * 1000 / rig.spacing_mm
    misfits = []
    if load != 0:
        lever = stated / load
        weight = float((fitted * lever / std**2).sum() / (lever**2 / std**2).sum())
        misfits.append(
            (float(np.abs((fitted - weight * lever) / std).max()), _weight_text(weight, load, rig))
        )
        arm_change = float(((stated - fitted) / std**2).sum() / (1 / std**2).sum()) / load * 1000
        left = fitted - stated + load * arm_change / 1000
        arm = rig.lower_to_tip_mm - 1000 * stated[1] / load + arm_change
        misfits.append((float(np.abs(left / std).max()), _arm_text(arm, arm_change, rig)))
    elif float(np.abs(fitted[0] - fitted[1])) > 0:
        weight = float(fitted[0] - fitted[1]) * 1000 / rig.spacing_mm
        return f"a load of about {weight:.4g} N still hung on the blade, or the zero was not awaited"
    best = min(misfits, default=(np.inf, ""))
    return best[1] if best[0] < _WITHIN else "no single wrong load, arm or reading explains it"


def _weight_text(weight: float, load: float, rig: Rig) -> str:
    text = f"the load was {weight:.4g} N, not {load:.4g} N"
    steps = np.diff(np.unique(np.abs(rig.loads_N)))
    if steps.size and steps.min() > 0:
        count = (weight - load) / float(steps.min())
        if round(count) != 0 and abs(count - round(count)) < _WHOLE * max(1.0, abs(round(count))):
            number = abs(round(count))
            plates = "one weight" if number == 1 else f"{number} weights"
            text += f" ({plates} of {steps.min():.4g} N {'more' if count * load > 0 else 'less'})"
    return text


def _arm_text(arm: float, change: float, rig: Rig) -> str:
    text = f"the load hung at {arm:.4g} mm above the tip, {abs(change):.3g} mm from the arm that is stated"
    near = rig.arms_mm[np.abs(rig.arms_mm - arm) < _WHOLE * max(abs(change), 1.0)]
    return f"{text} ({near[0]:g} mm is an arm that was used)" if near.size else text
