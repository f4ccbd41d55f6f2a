"""From the scene's load-cell log and empty-box runs to force, line of action and their uncertainties."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.axes import FORCE_COLUMNS, ForceStatus
from ploughval.errors import ConfigError, DataError, Fault, PloughvalError
from ploughval.loadcells.bending import horizontal_force, line_of_action
from ploughval.loadcells.budget import Sources, arm_std, budget_table, force_std
from ploughval.loadcells.checks import STATUSES, status_column
from ploughval.loadcells.friction import EmptyRun, Friction, empty_run, mean_friction
from ploughval.loadcells.log import Log, read_log
from ploughval.loadcells.motion import Motion, find_motion
from ploughval.loadcells.zero import Zero, zero_of
from ploughval.scene import LoadCells, Scene

Floats = NDArray[np.float64]
_ARM_LIMIT = 5.0  # forces below this many standard uncertainties have no line of action


@dataclass(frozen=True, slots=True)
class ForceResult:
    """The force record of one test.

    Attributes
    ----------
    record : DataFrame
        FORCE_COLUMNS, one row a row of the log; ``status`` holds values of ForceStatus.
    budget : DataFrame
        source, value, std, unit, sensitivity_N, share: one sample of the force at the mean load.
    faults : tuple of str
        Everything found wrong in the logs and what was done about it.
    compensated : bool
        Whether friction was taken off.
    zero_Nm, zero_std_Nm, noise_std_Nm : (2,) float
        Offsets of the (upper, lower) cell, their standard uncertainty, and the noise of one sample.
    noise_std_N : float
        Noise of one sample of the force: the part of force_std_N that is fresh in every row.
    """

    record: pd.DataFrame
    budget: pd.DataFrame
    faults: tuple[str, ...]
    compensated: bool
    zero_Nm: Floats
    zero_std_Nm: Floats
    noise_std_Nm: Floats
    noise_std_N: float


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
    """
    cells = scene.loadcells
    if cells is None:
        raise ConfigError(scene.source, [Fault("loadcells", "nothing", "a table", "Add [loadcells].")])
    gain = _gain(scene.source, cells)
    log = read_log(scene.path(cells.log), cells.columns)
    faults = list(log.faults)
    time, u, raw = _arrays(log, gain)
    motion = find_motion(u)
    zero, level = _rest(cells, time, u, raw, motion, faults)
    friction = _friction(scene, cells, gain, zero, faults)
    if motion is not None and motion.travel_mm < 0:
        faults.append(
            f"the displacement falls by {-motion.travel_mm:.4g} mm; expected a rise: check its sign"
        )
    moving = np.arange(time.size) >= (time.size if motion is None else motion.onset)
    test = _Test(time, u - level, raw - zero.mean[:, None], moving, zero, friction)
    return _result(cells, gain, test, log, faults)


@dataclass(frozen=True, slots=True)
class _Test:
    """One test's log with zeros taken off; moments (2, N) in N m, not yet compensated."""

    time_s: Floats
    u_mm: Floats
    cells_Nm: Floats
    moving: NDArray[np.bool_]
    zero: Zero
    friction: Friction | None


def _gain(source: Path, cells: LoadCells) -> Floats:
    gain = np.array([cells.calibration.upper_Nm_per_unit, cells.calibration.lower_Nm_per_unit])
    if (gain == 0).any():
        place = "loadcells.calibration." + ("upper_Nm_per_unit", "lower_Nm_per_unit")[int(gain[0] != 0)]
        raise ConfigError(source, [Fault(place, "0", "a number other than 0")])
    return gain


def _arrays(log: Log, gain: Floats) -> tuple[Floats, Floats, Floats]:
    """Times (N,), displacement (N,) mm and the two moments (2, N) in N m."""
    data = log.data
    moments = np.stack([data["moment_upper"].to_numpy(), data["moment_lower"].to_numpy()])
    return data["time_s"].to_numpy(), data["displacement_mm"].to_numpy(), moments * gain[:, None]


def _rest(
    cells: LoadCells, time: Floats, u: Floats, raw: Floats, motion: Motion | None, faults: list[str]
) -> tuple[Zero, float]:
    """Zeros and displacement at rest, from rest_s or from the rows before motion."""
    if cells.rest_s is not None:
        rows = (time >= cells.rest_s[0]) & (time <= cells.rest_s[1])
        named = f"rest_s = [{cells.rest_s[0]:g}, {cells.rest_s[1]:g}]"
    else:
        rows = np.arange(time.size) < (time.size if motion is None else motion.rest_end)
        named = "the rest before motion"
    if cells.rest_s is not None and motion is not None and rows[motion.onset :].any():
        faults.append(
            f"the blade moves within {named} (from {time[motion.onset]:.4g} s): zeros taken before that"
        )
        rows[motion.onset :] = False
    zero = zero_of(time[rows], raw[:, rows])
    if zero is None and cells.rest_s is not None:
        raise DataError(
            f"loadcells.rest_s = {list(cells.rest_s)} holds fewer than 3 rows at rest; the log runs from "
            f"{time[0]:g} to {time[-1]:g} s. Correct rest_s, or leave it out to have it found",
            path=cells.log,
        )
    if zero is None:
        faults.append("no rest before motion: zero offsets taken as 0, without uncertainty")
        noise = _difference_cov(raw)
        zero = Zero(np.zeros(2), noise, np.zeros((2, 2)), np.zeros(2), np.zeros(2), 0)
    elif zero.drifts:
        faults.append(
            f"upper cell drifts by {zero.drift[0]:.3g} N m, lower by {zero.drift[1]:.3g} N m "
            f"over {named}: zeros are the mean there"
        )
    still = u[rows & np.isfinite(u)]
    level = (
        float(still.mean()) if still.size else float(u[np.isfinite(u)][0]) if np.isfinite(u).any() else 0.0
    )
    if motion is None:
        faults.append("the displacement shows no motion: no friction taken off")
    return zero, level


def _difference_cov(raw: Floats) -> Floats:
    """Covariance of white noise on smooth curves, from second differences."""
    second = np.diff(raw, 2, axis=1)
    second = second[:, np.isfinite(second).all(axis=0)]
    if second.shape[1] < 2:
        return np.zeros((2, 2))
    return np.asarray(np.cov(second) / 6.0)


def _friction(scene: Scene, cells: LoadCells, gain: Floats, zero: Zero, faults: list[str]) -> Friction | None:
    """Friction from all empty-box runs that can be read; None without any."""
    log = scene.path(cells.log)
    paths = sorted({path for pattern in cells.empty for path in scene.matches(pattern)} - {log})
    runs: list[EmptyRun] = []
    for path in paths:
        try:
            empty = read_log(path, cells.columns)
        except PloughvalError as error:
            faults.append(f"empty-box run left out: {error}")
            continue
        faults.extend(f"{path.name}: {fault}" for fault in empty.faults)
        run = empty_run(*_arrays(empty, gain), zero)
        if run is None:
            faults.append(f"{path.name}: no motion found: left out of the friction")
            continue
        if not run.own_zero:
            faults.append(f"{path.name}: no rest before motion: the test's zeros are used")
        runs.append(run)
    if not runs:
        faults.append("no empty-box runs: the force is not compensated for friction")
        return None
    if len(runs) == 1:
        faults.append(
            "a single empty-box run: friction's spread between runs is unknown, that along it is used"
        )
    return mean_friction(runs)


def _result(cells: LoadCells, gain: Floats, test: _Test, log: Log, faults: list[str]) -> ForceResult:
    sources = _sources(cells, gain, test.zero, test.friction)
    moving, friction, zero = test.moving, test.friction, test.zero
    raw_N = horizontal_force(test.cells_Nm[0], test.cells_Nm[1], cells.spacing_mm)
    compensated_Nm = test.cells_Nm
    friction_N = np.full(moving.size, np.nan)
    if friction is not None:
        compensated_Nm = test.cells_Nm - np.where(moving, friction.mean[:, None], 0.0)
        one = horizontal_force(friction.mean[:1], friction.mean[1:], cells.spacing_mm)
        friction_N = np.where(moving, one, 0.0)
    force_N = horizontal_force(compensated_Nm[0], compensated_Nm[1], cells.spacing_mm)
    std_N = force_std(compensated_Nm, force_N, moving, sources)
    # With friction off the force alone, as in the paper, the line of action is that of sand and friction.
    per_cell = cells.compensation == "per_cell"
    arm_cells, arm_force = (compensated_Nm, force_N) if per_cell else (test.cells_Nm, raw_N)
    arm_mm = line_of_action(arm_cells[1], arm_force, cells.lower_to_tip_mm)
    arm_mm_std = arm_std(arm_cells, arm_force, moving & per_cell, sources)
    codes = log.data["status"].cat.codes.to_numpy().astype(np.int8)
    small = ~(np.abs(arm_force) >= _ARM_LIMIT * std_N)
    arm_mm[small] = np.nan
    arm_mm_std[small] = np.nan
    std_N[~np.isfinite(force_N)] = np.nan
    codes[small & (codes == STATUSES.index(ForceStatus.OK))] = STATUSES.index(ForceStatus.NO_ARM)
    columns = (
        test.time_s,
        test.u_mm,
        force_N,
        std_N,
        arm_mm,
        arm_mm_std,
        raw_N,
        friction_N,
        status_column(codes),
    )
    loaded = moving & np.isfinite(force_N)
    mean_cells = compensated_Nm[:, loaded].mean(axis=1) if loaded.any() else np.zeros(2)
    if mean_cells[0] < mean_cells[1]:
        faults.append(
            "the mean force is negative: check the signs of the moments and which cell is the upper"
        )
    budget = budget_table(
        sources,
        mean_cells_Nm=mean_cells,
        zero_Nm=zero.mean,
        friction_Nm=None if friction is None else friction.mean,
        gain=gain,
        lower_to_tip_mm=cells.lower_to_tip_mm,
    )
    gradient = np.array([1000.0, -1000.0]) / cells.spacing_mm
    return ForceResult(
        pd.DataFrame(dict(zip(FORCE_COLUMNS, columns, strict=True))),
        budget,
        tuple(faults),
        friction is not None,
        zero.mean,
        np.sqrt(np.diag(zero.mean_cov)),
        np.sqrt(np.diag(zero.noise_cov)),
        float(np.sqrt(gradient @ zero.noise_cov @ gradient)),
    )


def _sources(cells: LoadCells, gain: Floats, zero: Zero, friction: Friction | None) -> Sources:
    none = np.zeros((2, 2))
    stds = np.array([cells.calibration.upper_Nm_per_unit_std, cells.calibration.lower_Nm_per_unit_std])
    return Sources(
        zero.noise_cov,
        zero.mean_cov,
        none if friction is None else friction.cov,
        np.inf if friction is None else friction.dof,
        none if friction is None else friction.variation_cov,
        np.abs(stds / gain),
        cells.spacing_mm,
        cells.spacing_std_mm,
        cells.lower_to_tip_std_mm,
    )
