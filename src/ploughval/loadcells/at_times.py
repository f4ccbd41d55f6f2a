"""The force at given moments, such as those of photographs, with the doubt about the moment carried."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.axes import FORCE_AT_COLUMNS, ForceStatus

Floats = NDArray[np.float64]
_GAP_STEPS = 5.0
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
        FORCE_AT_COLUMNS, one row a time. Values are interpolated between the neighbouring usable rows; the
        standard uncertainty holds half the change of the value within one standard uncertainty of the time
        before and after, so that a drop of the force nearby is not smoothed away. ``status`` is that of the
        nearest row where no value can be had.
    """
    wanted = np.asarray(time_s, float)
    doubt = np.broadcast_to(np.asarray(time_std_s, float), wanted.shape)
    clock = record["time_s"].to_numpy(float)
    status = record["status"].astype(str).to_numpy()
    columns = {name: record[name].to_numpy(float) for name in _VALUES}
    found = {name: np.full(wanted.shape, np.nan) for name in _VALUES}
    step = float(np.median(np.diff(clock))) if clock.size > 1 else 0.0
    for name in ("u_mm", "force_N", "arm_mm"):
        found[name] = _between(wanted, clock, columns[name], step)
    for value, std in (("force_N", "force_std_N"), ("arm_mm", "arm_std_mm")):
        moved = _change(wanted, doubt, clock, columns[value])
        known = np.isfinite(found[value])
        found[std][known] = np.hypot(_between(wanted, clock, columns[std], step), moved)[known]
    nearest = np.clip(np.searchsorted(clock, wanted - 0.5 * step), 0, clock.size - 1)
    said = np.where(np.isfinite(wanted), status[nearest], ForceStatus.OUTSIDE_LOG.value)
    outside = ~((wanted >= clock[0] - step) & (wanted <= clock[-1] + step))
    said = np.where(outside, ForceStatus.OUTSIDE_LOG.value, said)
    said = np.where(np.isfinite(found["force_N"]) & np.isfinite(found["arm_mm"]), ForceStatus.OK.value, said)
    table = {"frame": np.arange(wanted.size), "time_s": wanted, "time_std_s": doubt, **found, "status": said}
    return pd.DataFrame(table)[list(FORCE_AT_COLUMNS)]


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
    """Half the difference of the values one standard uncertainty later and earlier; 0 without doubt."""
    good = np.isfinite(values)
    known = np.isfinite(wanted) & (doubt > 0)
    change = np.zeros(wanted.shape)
    if good.any() and known.any():
        late = np.interp(wanted[known] + doubt[known], clock[good], values[good])
        early = np.interp(wanted[known] - doubt[known], clock[good], values[good])
        change[known] = 0.5 * np.abs(late - early)
    return change
