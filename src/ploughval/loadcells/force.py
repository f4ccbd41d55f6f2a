"""From the scene's load-cell log and empty-box runs to force, line of action and their uncertainties."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.axes import FORCE_COLUMNS, ForceStatus
from ploughval.errors import ConfigError, Fault
from ploughval.loadcells.bending import CellGeometry, horizontal_force
from ploughval.loadcells.budget import Term
from ploughval.loadcells.calibration import CellCalibrationResult, calibrate_cells
from ploughval.loadcells.contact import Contact, find_contact
from ploughval.loadcells.empty_runs import SPEED_DIFFERS, friction_from, read_empty
from ploughval.loadcells.friction import Friction
from ploughval.loadcells.logs import log_paths, read_cell_log
from ploughval.loadcells.logs.checks import STATUSES, status_column
from ploughval.loadcells.pauses import rise_standing
from ploughval.loadcells.record import (
    ForceArrays,
    MeanLoad,
    Rig,
    force_from_readings,
    mean_budget,
    mean_load,
    mean_sample,
)
from ploughval.loadcells.response import CellResponse
from ploughval.loadcells.rest import zero_at_rest, zeros_over
from ploughval.loadcells.run_log import RunLog, arrays_of, filled
from ploughval.loadcells.smoothing import Smoothed, smooth, unsmoothed
from ploughval.loadcells.wiring import wiring_of
from ploughval.loadcells.zero import Zero
from ploughval.scene import LoadCells, Scene

Floats = NDArray[np.float64]
_BACK = 0.02  # of its travel that the blade has gone back: friction may have turned
_LATE_DEPTHS = 0.02  # contact this long after the onset of motion is said


@dataclass(frozen=True, slots=True, eq=False)
class ForceResult:
    """The force record of one test.

    Attributes
    ----------
    record : DataFrame
        FORCE_COLUMNS, one row a row of the log; ``status`` holds values of ForceStatus.
    budget : DataFrame
        BUDGET_COLUMNS: one sample of force and line of action at the mean load.
    mean_load : MeanLoad
        What the budget adds up to.
    faults : tuple of str
        Everything found wrong in the logs and what was done about it.
    calibration : CellCalibrationResult
        What readings mean, and how well that is known.
    friction : Friction or None
        What was taken off for friction; None without empty runs.
    zero_Nm, zero_std_Nm, noise_std_Nm : (2,) float
        Offsets of the (upper, lower) cell at rest, their standard uncertainty, and the noise of one sample.
    drift_Nm : (2,) float
        Drift of the zeros over the record that was taken off.
    noise_std_N : float
        Noise of one sample of the force: the part of force_std_N that is fresh in every row.
    onset_s : float
        Time at which the blade starts to move; NaN where it does not.
    contact : Contact or None
        When the force leaves its noise.
    bandwidth_Hz : float or None
        Bandwidth that the readings were smoothed to; None: not smoothed.
    lost : tuple of str
        What was asked for and could not be had: empty-box runs.
    """

    record: pd.DataFrame
    budget: pd.DataFrame
    mean_load: MeanLoad
    faults: tuple[str, ...]
    calibration: CellCalibrationResult
    friction: Friction | None
    zero_Nm: Floats
    zero_std_Nm: Floats
    noise_std_Nm: Floats
    drift_Nm: Floats
    noise_std_N: float
    onset_s: float
    contact: Contact | None
    bandwidth_Hz: float | None
    lost: tuple[str, ...] = ()

    @property
    def compensated(self) -> bool:
        """Whether friction was taken off."""
        return self.friction is not None

    @property
    def friction_mean_N(self) -> float:
        """Mean over the travel of the friction that was taken off, N; NaN without empty runs."""
        taken = self.record.loc[self.record["time_s"] >= self.onset_s, "friction_N"]
        return float(taken[taken != 0].mean())


def measure_force(scene: Scene) -> ForceResult:
    """Force on the blade and its line of action from the log and the empty-box runs of a test.

    Parameters
    ----------
    scene : Scene
        With a [loadcells] table.

    Returns
    -------
    ForceResult
        Forces in N for the blade's width, lines of action in mm above the tip. ``force_raw_N`` is before
        friction, ``friction_N`` what was taken off (0 before motion, NaN without empty runs).

    Raises
    ------
    ConfigError
        No [loadcells] table, or a calibration constant of zero.
    DataError
        The log cannot be read or holds no usable row.
    CalibrationError
        Calibration files that fix nothing or contradict themselves.
    """
    cells = scene.loadcells
    if cells is None:
        raise ConfigError(scene.source, [Fault("loadcells", "nothing", "a table", "Add [loadcells].")])
    calibration = calibrate_cells(scene)
    response = calibration.response
    geometry = CellGeometry(
        cells.spacing_mm, cells.lower_to_tip_mm, cells.spacing_std_mm, cells.lower_to_tip_std_mm
    )
    table = read_cell_log(log_paths(scene, cells), cells)
    faults = [*table.notes, *table.faults, *calibration.faults]
    log = arrays_of(table, ", ".join(cells.log_patterns))
    if cells.rest_end_s is not None:
        log = replace(log, unloaded_s=cells.rest_end_s[0])
    lost: list[str] = []
    empty = read_empty(scene, cells, faults, lost)
    wiring = wiring_of(log, empty, response, geometry, scene.blade.depth_mm, faults)
    log, empty = wiring.rewired(log), [wiring.rewired(run) for run in empty]
    zero, level_mm = zero_at_rest(cells, log, response, faults)
    friction = friction_from(empty, log, zero, response, faults)
    line = zeros_over(cells, log, zero, response, faults)
    smoothed, more = unsmoothed(log.readings), _once_stopped(friction, log, response, faults)
    more += _scatter(calibration, log)
    moving = log.moving.astype(np.float64)
    if cells.bandwidth_Hz is not None:
        smoothed = smooth(log.time_s, log.readings, cells.bandwidth_Hz)
        moving = smooth(log.time_s, np.stack([moving, moving]), cells.bandwidth_Hz).readings[0]
        more += _shaved(smoothed, log, zero, geometry, response, faults)
    rig = Rig(geometry, response, zero.noise_cov * smoothed.noise_share)
    found = force_from_readings(
        smoothed.readings,
        rig,
        line,
        moving=moving,
        friction=friction,
        friction_at=filled(log.u_mm - level_mm),
        more=more,
        per_cell=cells.compensation == "per_cell",
    )
    _say_speed(scene, log, faults)
    _say_motion(log, found, cells.empty, faults)
    _say_standing(log, found, faults)
    test = replace(log, u_mm=log.u_mm - level_mm)
    contact = _contact(scene, test, found, rig, faults)
    return _gathered(
        test,
        table.data["status"],
        found,
        _Told(calibration, zero, line.total, rig, contact, friction, cells, faults, lost),
    )


def _once_stopped(
    friction: Friction | None, log: RunLog, response: CellResponse, faults: list[str]
) -> tuple[Term, ...]:
    """Friction in pauses and after the travel: from all to none of it, or to its opposite on the way back.

    That of the travel is taken off: the mean square of what is too much is 1/3 or 4/3 of its square.
    """
    if friction is None or log.motion is None:
        return ()
    pauses = log.standing
    stopped = log.moving & (~log.advancing | pauses)
    if not stopped.any():
        return ()
    if pauses.any():
        faults.append(
            f"the blade stands still within its travel in {pauses.sum()} rows, first at "
            f"{log.time_s[np.argmax(pauses)]:.4g} s: friction is taken off there as in motion, and "
            "force_std_N holds that it may be anything from all to none"
        )
    level = (response.coefficients @ friction.mean)[:, 0]
    end = log.u_mm[: log.motion.stop]
    back = np.abs(log.u_mm - end[np.isfinite(end)][-1]) > _BACK * abs(log.motion.travel_mm)
    weight = np.where(back & ~log.advancing, 4 / 3, 1 / 3) * stopped
    return (Term("friction of a blade that stands", np.outer(level, level), weight, np.zeros(2)),)


def _scatter(calibration: CellCalibrationResult, log: RunLog) -> tuple[Term, ...]:
    """Hysteresis, and what else a single reading under load may be off the calibration's line."""
    if not calibration.scatter_Nm.any():
        return ()
    cov = np.diag(calibration.scatter_Nm**2)
    return (Term("scatter about the calibration", cov, log.moving.astype(float), np.zeros(2)),)


def _shaved(
    smoothed: Smoothed,
    log: RunLog,
    zero: Zero,
    geometry: CellGeometry,
    response: CellResponse,
    faults: list[str],
) -> tuple[Term, ...]:
    """What smoothing takes off the peaks: said, and a source of uncertainty."""
    cov = smoothed.lost_cov(log.advancing, zero.noise_cov)
    slope = response.slopes(np.zeros(2))
    moments = slope @ (smoothed.readings - zero.mean[:, None])
    force = np.where(log.advancing, horizontal_force(moments[0], moments[1], geometry.spacing_mm), np.nan)
    if np.isfinite(force).any():
        top = int(np.nanargmax(force))
        upper, lower = slope @ smoothed.lost[:, top]
        lost = (upper - lower) * geometry.per_Nm
        told = abs(lost) > 2 * smoothed.lost_std(
            geometry.per_Nm * np.array([1.0, -1.0]) @ slope, zero.noise_cov
        )
        loss = f"about {lost:.3g} N" if told else "no more than its noise"
        faults.append(
            f"smoothing leaves {100 * smoothed.noise_share**0.5:.3g} % of the noise and takes {loss} off the "
            f"highest peak of {force[top]:.4g} N"
        )
    weight = smoothed.lost_weight(log.advancing, zero.noise_cov)
    return (Term("smoothing", slope @ cov @ slope.T, weight, np.zeros(2)),)


def _say_speed(scene: Scene, log: RunLog, faults: list[str]) -> None:
    """A speed other than the scene's: most often a unit of times or displacements that no header names."""
    stated, speed = scene.blade.speed_mm_s, abs(log.speed_mm_s)
    if stated is not None and abs(speed - stated) > SPEED_DIFFERS * stated:
        faults.append(
            f"the blade moves at {speed:.4g} mm/s in the log, blade.speed_mm_s = {stated:.4g}: check the "
            "units of time and displacement (a header or [loadcells.columns] can name them), or correct "
            "speed_mm_s"
        )


def _say_standing(log: RunLog, found: ForceArrays, faults: list[str]) -> None:
    """A force that rises while the displacement stands: the transducer and not the blade came to rest."""
    if log.motion is None:
        return
    end = log.u_mm[: log.motion.stop]
    kept = np.abs(log.u_mm - end[np.isfinite(end)][-1]) <= _BACK * abs(log.motion.travel_mm)
    still = log.standing | (log.moving & ~log.advancing & kept)
    rise = rise_standing(found.force_N, still)
    if rise is not None:
        faults.append(
            f"from {log.time_s[rise[0]]:.4g} s on the displacement stands still at "
            f"{log.u_mm[rise[0]]:.4g} mm but the force rises by {rise[1]:.3g} N, which no blade at rest "
            "does: check the displacement transducer; places from there on may be wrong"
        )


def _say_motion(log: RunLog, found: ForceArrays, empty: Sequence[str], faults: list[str]) -> None:
    """A displacement that falls; friction that was not taken off, and how large it can be at most."""
    if log.motion is not None and log.motion.travel_mm < 0:
        faults.append(
            f"the displacement falls by {-log.motion.travel_mm:.4g} mm; expected a rise: check its sign"
        )
    if np.isfinite(found.friction_N).any():
        return
    runs = "no empty-box runs" if not empty else "none of the empty-box runs can be used"
    said = f"{runs}: the force is not compensated for friction"
    if log.motion is not None:
        steady = found.raw_N[log.motion.steady_start : log.motion.steady_end]
        steady = steady[np.isfinite(steady)]
        if steady.size:
            most = max(float(np.percentile(steady, 1.0)), 0.0)
            said += (
                f". Friction is at most {most:.3g} N, the least force of the steady travel; "
                "force_std_N does not hold it"
            )
    faults.append(said)


def _contact(scene: Scene, test: RunLog, found: ForceArrays, rig: Rig, faults: list[str]) -> Contact | None:
    """When the force leaves its noise; said where the blade had travelled before."""
    if test.motion is None:
        return None
    noise = _noise_N(rig)
    std = found.force_std_N[test.moving]
    std = std[np.isfinite(std)]
    contact = find_contact(
        test.time_s,
        test.u_mm,
        found.force_N,
        onset=test.motion.onset,
        noise_N=noise,
        level_std_N=float(np.sqrt(max(std[0] ** 2 - noise**2, 0.0))) if std.size else 0.0,
    )
    if contact is None:
        faults.append("the force never leaves its noise: no contact with the sand was found")
    elif contact.u_mm - 2 * contact.std_mm > _LATE_DEPTHS * scene.blade.depth_mm:
        faults.append(
            f"the blade meets the sand {contact.u_mm:.3g} mm after it starts to move (standard uncertainty "
            f"{contact.std_mm:.2g} mm): u_mm counts from the start"
        )
    return contact


def _noise_N(rig: Rig) -> float:
    """Noise of one sample of the force, N."""
    slope = rig.response.slopes(np.zeros(2))
    gradient = rig.geometry.per_Nm * np.array([1.0, -1.0]) @ slope
    return float(np.sqrt(gradient @ rig.noise_cov @ gradient))


@dataclass(frozen=True, slots=True, eq=False)
class _Told:
    """What goes into the result besides the arrays."""

    calibration: CellCalibrationResult
    zero: Zero
    drift: Floats
    rig: Rig
    contact: Contact | None
    friction: Friction | None
    cells: LoadCells
    faults: list[str]
    lost: list[str]


def _gathered(test: RunLog, status: pd.Series, found: ForceArrays, told: _Told) -> ForceResult:
    codes = status.cat.codes.to_numpy().astype(np.int8)
    codes[found.small & (codes == STATUSES.index(ForceStatus.OK))] = STATUSES.index(ForceStatus.NO_ARM)
    columns = (
        test.time_s,
        test.u_mm,
        found.force_N,
        found.force_std_N,
        found.arm_mm,
        found.arm_std_mm,
        found.raw_N,
        found.friction_N,
        status_column(codes),
    )
    loaded = test.advancing & ~test.standing & np.isfinite(found.force_N)
    mean = mean_sample(found, loaded)
    slope = told.rig.response.slopes(np.zeros(2))
    return ForceResult(
        record=pd.DataFrame(dict(zip(FORCE_COLUMNS, columns, strict=True)), copy=False),
        budget=mean_budget(mean),
        mean_load=mean_load(mean),
        faults=tuple(told.faults),
        calibration=told.calibration,
        friction=told.friction,
        zero_Nm=slope @ told.zero.mean,
        zero_std_Nm=np.sqrt(np.diag(slope @ told.zero.mean_cov @ slope.T)),
        noise_std_Nm=np.sqrt(np.diag(slope @ told.rig.noise_cov @ slope.T)),
        drift_Nm=slope @ told.drift,
        noise_std_N=_noise_N(told.rig),
        onset_s=float("nan") if test.motion is None else float(test.time_s[test.motion.onset]),
        contact=told.contact,
        bandwidth_Hz=told.cells.bandwidth_Hz,
        lost=tuple(told.lost),
    )
