"""The force at given moments, such as those of photographs, with the doubt about the moment carried."""

import numpy as np
import pandas as pd
from numpy.polynomial.hermite_e import hermegauss
from numpy.typing import NDArray

from ploughval.axes import FORCE_AT_COLUMNS, ForceStatus

Floats = NDArray[np.float64]
_GAP_STEPS = 5.0
_NODES = 9
_VALUES = ("u_mm", "force_N", "force_std_N", "arm_mm", "arm_std_mm")


def force_at(record: pd.DataFrame, time_s: Floats, time_std_s: Floats | float = 0.0) -> pd.DataFrame:
    """Force and line of action at given times of the log's clock.

    Parameters
    ----------
    record : DataFrame
        FORCE_COLUMNS, ordered by time.
    time_s : (M,) float, s
        Times on the log's clock; NaN where unknown.
    time_std_s : (M,) float or float, s
        Standard uncertainty of these times: of the offset between the clocks and of the stamps.

    Returns
    -------
    DataFrame
        FORCE_AT_COLUMNS, one row a time. Values are interpolated between the neighbouring usable rows. The
        standard uncertainty holds the root mean square of what the value changes within a normal doubt of the
        time (JCGM 101:2008, 7; by quadrature), so that a drop of the force nearby counts. ``status`` says why
        a value could not be had.
    """
    wanted = np.asarray(time_s, float)
    doubt = np.broadcast_to(np.asarray(time_std_s, float), wanted.shape)
    clock = record["time_s"].to_numpy(float)
    columns = {name: record[name].to_numpy(float) for name in _VALUES}
    step = float(np.median(np.diff(clock))) if clock.size > 1 else 0.0
    found = {name: _between(wanted, clock, columns[name], step) for name in ("u_mm", "force_N", "arm_mm")}
    for value, std in (("force_N", "force_std_N"), ("arm_mm", "arm_std_mm")):
        moved = _change(wanted, doubt, clock, columns[value])
        own = _between(wanted, clock, columns[std], step)
        found[std] = np.where(np.isfinite(found[value]), np.hypot(own, moved), np.nan)
    said = _status(wanted, clock, record["status"].astype(str).to_numpy(), found)
    table = {"frame": np.arange(wanted.size), "time_s": wanted, "time_std_s": doubt, **found, "status": said}
    return pd.DataFrame(table)[list(FORCE_AT_COLUMNS)]


def _status(
    wanted: Floats, clock: Floats, status: NDArray[np.object_], found: dict[str, Floats]
) -> list[str]:
    """Why a value could not be had: the reason of the nearest row, if that has one."""
    right = np.clip(np.searchsorted(clock, wanted), 1, max(clock.size - 1, 1))
    right = np.minimum(right, clock.size - 1)
    left = np.maximum(right - 1, 0)
    nearest = np.where(np.abs(wanted - clock[left]) <= np.abs(clock[right] - wanted), left, right)
    force, arm = np.isfinite(found["force_N"]), np.isfinite(found["arm_mm"])
    inside = (wanted >= clock[0]) & (wanted <= clock[-1])
    said = []
    for k, row in enumerate(nearest):
        reason = status[row]
        lost = reason not in (ForceStatus.OK, ForceStatus.NO_ARM)
        if not inside[k]:
            said.append(ForceStatus.OUTSIDE_LOG.value)
        elif force[k]:
            said.append(ForceStatus.OK.value if arm[k] else ForceStatus.NO_ARM.value)
        else:
            said.append(reason if lost else ForceStatus.GAP.value)
    return said


def _between(wanted: Floats, clock: Floats, values: Floats, step: float) -> Floats:
    """Linear interpolation between usable rows; NaN outside them and within gaps of more than 5 steps."""
    good = np.isfinite(values)
    result = np.full(wanted.shape, np.nan)
    if not good.any():
        return result
    t, v = clock[good], values[good]
    right = np.searchsorted(t, wanted)
    inside = (wanted >= t[0]) & (wanted <= t[-1])
    before, after = np.clip(right - 1, 0, t.size - 1), np.clip(right, 0, t.size - 1)
    close = t[after] - t[before] <= _GAP_STEPS * step
    use = inside & (close | (t[after] == wanted))
    result[use] = np.interp(wanted[use], t, v)
    return result


def _change(wanted: Floats, doubt: Floats, clock: Floats, values: Floats) -> Floats:
    """Root mean square of the change of the values over a normal doubt of the time; 0 without doubt."""
    good = np.isfinite(values)
    known = np.isfinite(wanted) & (doubt > 0)
    change = np.zeros(wanted.shape)
    if not (good.any() and known.any()):
        return change
    t, v = clock[good], values[good]
    nodes, weights = hermegauss(_NODES)
    at, spread = wanted[known], doubt[known]
    here = np.interp(at, t, v)
    square, moved = np.zeros(at.shape), np.zeros(at.shape)
    for node, weight in zip(nodes, weights / weights.sum(), strict=True):
        there = np.clip(at + node * spread, t[0], t[-1])
        square += weight * (np.interp(there, t, v) - here) ** 2
        moved += weight * (there - np.clip(at, t[0], t[-1])) ** 2
    # beyond the record's ends the value is taken to change as it does within
    share = np.divide(moved, spread**2, out=np.ones(at.shape), where=moved > 0)
    change[known] = np.sqrt(square / share)
    return change
