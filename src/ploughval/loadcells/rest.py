"""Zeros of a test from its rest before motion, and from a second rest where one is given."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.loadcells.drift import ZeroLine, zero_line
from ploughval.loadcells.resolution import least_step, with_resolution
from ploughval.loadcells.response import CellResponse
from ploughval.loadcells.run_log import RunLog
from ploughval.loadcells.zero import Zero, unknown_zero, zero_of
from ploughval.scene import LoadCells

Floats = NDArray[np.float64]


def zero_at_rest(
    cells: LoadCells, log: RunLog, response: CellResponse, faults: list[str]
) -> tuple[Zero, float]:
    """Zeros in the log's unit, and the displacement, mm, at rest: from rest_s or from the rows before motion.

    Raises
    ------
    DataError
        rest_s holds fewer than three usable rows.
    """
    rows, named = _rest_rows(cells, log, faults)
    zero = _zero(log, rows)
    if zero is None and cells.rest_s is not None:
        raise _too_few(cells.rest_s, "rest_s", log)
    if zero is None and cells.rest_end_s is not None:
        faults.append("no rest before motion: zero offsets taken from rest_end_s alone, without drift")
        zero = replace(_second_rest(cells.rest_end_s, log), drift=np.zeros(2))
    elif zero is None:
        faults.append("no rest before motion: zero offsets taken as 0, without uncertainty")
        zero = unknown_zero(log.readings)
    elif zero.drifts and cells.rest_end_s is None:
        drift = response.slopes(zero.mean * 0) @ zero.drift
        faults.append(
            f"upper cell drifts by {drift[0]:.3g} N m, lower by {drift[1]:.3g} N m over {named}: taken to go "
            "on at that rate, with the uncertainty of a drift that may have stopped since"
        )
    if log.motion is None:
        faults.append("the displacement shows no motion: no friction taken off")
    still = log.u_mm[rows & np.isfinite(log.u_mm)]
    known = still if still.size else log.u_mm[np.isfinite(log.u_mm)][:1]
    return zero, float(known.mean()) if known.size else 0.0


def zeros_over(
    cells: LoadCells, log: RunLog, zero: Zero, response: CellResponse, faults: list[str]
) -> ZeroLine:
    """Zeros over the whole record, in the log's unit.

    Raises
    ------
    DataError
        rest_end_s holds fewer than three usable rows, or begins before the blade has made its way.
    """
    window = cells.rest_end_s
    if window is None or zero.end_s >= window[0]:
        return zero_line(log.time_s, zero)
    line = zero_line(log.time_s, zero, _second_rest(window, log))
    drift = response.slopes(zero.mean * 0) @ line.total
    faults.append(
        f"from rest to rest the upper cell drifts by {drift[0]:.3g} N m, the lower by {drift[1]:.3g} N m: "
        "taken off along a straight line"
    )
    return line


def _second_rest(window: tuple[float, float], log: RunLog) -> Zero:
    """Zeros of the cells unloaded again."""
    travelled = -np.inf if log.motion is None else float(log.time_s[log.motion.steady_end - 1])
    if window[0] <= travelled:
        raise DataError(
            f"loadcells.rest_end_s = {list(window)} begins before the blade has made its way, at "
            f"{travelled:.4g} s; expected a window in which the cells are unloaded again. Correct it, or "
            "leave it out",
            path=log.name,
        )
    rows = (log.time_s >= window[0]) & (log.time_s <= window[1])
    zero = _zero(log, rows)
    if zero is None:
        raise _too_few(window, "rest_end_s", log)
    return zero


def _zero(log: RunLog, rows: NDArray[np.bool_]) -> Zero | None:
    """Zeros of these rows (N,), with what the steps of the log hide."""
    zero = zero_of(log.time_s[rows], log.readings[:, rows])
    return None if zero is None else with_resolution(zero, least_step(log.readings))


def _rest_rows(cells: LoadCells, log: RunLog, faults: list[str]) -> tuple[NDArray[np.bool_], str]:
    """Rows of the rest before motion, and what to call it."""
    if cells.rest_s is None:
        return log.resting, "the rest before motion"
    rows = (log.time_s >= cells.rest_s[0]) & (log.time_s <= cells.rest_s[1])
    named = f"rest_s = [{cells.rest_s[0]:g}, {cells.rest_s[1]:g}]"
    if log.motion is not None and (rows & log.moving).any():
        start = log.time_s[log.motion.onset]
        faults.append(f"the blade moves within {named} (from {start:.4g} s): zeros taken before that")
        rows &= ~log.moving
    return rows, named


def _too_few(window: tuple[float, float], key: str, log: RunLog) -> DataError:
    return DataError(
        f"loadcells.{key} = {list(window)} holds fewer than 3 rows at rest; the log runs from "
        f"{log.time_s[0]:g} to {log.time_s[-1]:g} s. Correct {key}, or leave it out",
        path=log.name,
    )
