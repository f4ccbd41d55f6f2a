"""Calibration of the two cells: from files of known loads, or constants given in test.toml."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.errors import CalibrationError, ConfigError, DataError, Fault
from ploughval.loadcells.calibration.choice import CHOICE_COLUMNS, Choice
from ploughval.loadcells.calibration.doubts import doubts, sound_choice, wrong_points
from ploughval.loadcells.calibration.fit import Session
from ploughval.loadcells.calibration.fitted import response_of, written_step
from ploughval.loadcells.calibration.quality import QUALITY_COLUMNS, quality_table
from ploughval.loadcells.calibration.staircase import read_staircase
from ploughval.loadcells.calibration.table import (
    POINT_COLUMNS,
    read_table,
    run_numbers,
    with_moments,
    with_runs,
)
from ploughval.loadcells.response import CellResponse
from ploughval.scene import CellCalibration, LoadCells, Scene

Floats = NDArray[np.float64]
RESULT_COLUMNS = (*POINT_COLUMNS, "residual_upper_Nm", "residual_lower_Nm", "used", "reason")
_CELLS = ("upper", "lower")


@dataclass(frozen=True, slots=True, eq=False)
class CellCalibrationResult:
    """What readings of the cells mean, and what is known about that.

    Attributes
    ----------
    response : CellResponse
        Readings less their zero to moments, with covariance.
    points : DataFrame
        RESULT_COLUMNS, one row a calibration point: readings in the unit of the log, known moments, residuals
        (known less fitted, also of points left out), ``used``, and the ``reason`` where it is not. Empty
        where constants were given, like the tables that follow.
    choice : DataFrame
        The models and their AICc (choice.CHOICE_COLUMNS).
    model : str
        The chosen one.
    quality : DataFrame
        quality.QUALITY_COLUMNS.
    condition : float
        Condition number of the loads; NaN for constants.
    scatter_Nm : (2,) float
        Standard deviation of a single point of each cell about the fit: noise, hysteresis and lack of fit.
    faults : tuple of str
        What is wrong or has been taken for granted.
    """

    response: CellResponse
    points: pd.DataFrame
    choice: pd.DataFrame
    model: str
    quality: pd.DataFrame
    condition: float
    scatter_Nm: Floats
    faults: tuple[str, ...]


def calibrate_cells(scene: Scene) -> CellCalibrationResult:
    """Response of the cells of a test.

    Parameters
    ----------
    scene : Scene
        With a [loadcells] table.

    Returns
    -------
    CellCalibrationResult

    Raises
    ------
    ConfigError
        No [loadcells], a constant of zero, or no calibration file that matches.
    DataError
        A calibration file that cannot be read.
    CalibrationError
        Points that fix nothing, two or more that contradict the others, a run with turned sign or other unit,
        exchanged cells.
    """
    cells = scene.loadcells
    if cells is None:
        raise ConfigError(scene.source, [Fault("loadcells", "nothing", "a table", "Add [loadcells].")])
    if not cells.calibration.files and not cells.calibration.staircases:
        return _constants(scene, cells.calibration)
    points = _read_points(scene, cells)
    finite = points[["moment_upper_Nm", "moment_lower_Nm", "upper", "lower"]].notna().all(axis=1)
    if not finite.any():
        raise CalibrationError("no calibration row holds a load, an arm and both readings")
    used = points[finite].reset_index(drop=True)
    session = _session(used)
    choice = sound_choice(session, used)
    faults = wrong_points(session, choice, used, cells)
    fitted = response_of(session, choice, _by_geometry(used))
    quality = quality_table(
        session,
        fitted,
        used["direction"].to_numpy(str),
        spacing_mm=cells.spacing_mm,
        lower_to_tip_mm=cells.lower_to_tip_mm,
    )
    faults += doubts(session, fitted, used, cells)
    return CellCalibrationResult(
        fitted.response,
        _with_residuals(points, finite.to_numpy(), session, choice, faults),
        choice.table,
        choice.fit.model.name,
        quality,
        choice.condition,
        choice.fit.scatter_Nm,
        tuple(faults),
    )


def _constants(scene: Scene, given: CellCalibration) -> CellCalibrationResult:
    gain = np.array([given.upper_Nm_per_unit, given.lower_Nm_per_unit])
    wrong = [f"loadcells.calibration.{n}_Nm_per_unit" for n, g in zip(_CELLS, gain, strict=True) if g == 0]
    if wrong:
        raise ConfigError(scene.source, [Fault(place, "0", "a number other than 0") for place in wrong])
    std = np.array([given.upper_Nm_per_unit_std, given.lower_Nm_per_unit_std])
    points, choice, quality = (
        pd.DataFrame(columns=list(names)) for names in (RESULT_COLUMNS, CHOICE_COLUMNS, QUALITY_COLUMNS)
    )
    response = CellResponse.constant(gain, std)
    return CellCalibrationResult(
        response, points, choice, "constants given", quality, float("nan"), np.zeros(2), ()
    )


def _read_points(scene: Scene, cells: LoadCells) -> pd.DataFrame:
    """All calibration points with moments, runs and directions."""
    given = cells.calibration
    paths = list(dict.fromkeys(path for pattern in given.files for path in scene.matches(pattern)))
    if given.files and not paths:
        fault = Fault("loadcells.calibration.files", ", ".join(given.files), "a file that matches")
        raise ConfigError(scene.source, [fault])
    tables = [
        read_table(path, path.relative_to(scene.folder).as_posix(), g_m_s2=given.g_m_s2) for path in paths
    ]
    tables += [read_staircase(scene.path(s.log), s, cells.columns) for s in given.staircases]
    points = pd.concat([t for t in tables if len(t)], ignore_index=True) if any(map(len, tables)) else None
    if points is None:
        raise DataError("no row of numbers", path=paths[0] if paths else given.staircases[0].log)
    made = with_moments(points, spacing_mm=cells.spacing_mm, lower_to_tip_mm=cells.lower_to_tip_mm)
    return with_runs(made)


def _session(used: pd.DataFrame) -> Session:
    readings = used[["upper", "lower"]].to_numpy(float).T
    moments = used[["moment_upper_Nm", "moment_lower_Nm"]].to_numpy(float).T
    steps = np.array([written_step(cell) for cell in readings])
    return Session(readings, moments, run_numbers(used), _known_errors(used, moments), steps)


def _known_errors(used: pd.DataFrame, moments: Floats) -> Floats:
    """What one standard deviation of each weight and of each arm does: the same load has the same error."""
    load, arm = used["load_N"].to_numpy(float), used["arm_mm"].to_numpy(float)
    made = ~used["moment_given"].to_numpy(bool) & (load != 0)
    lever = np.divide(moments, load, out=np.zeros_like(moments), where=made)
    patterns = []
    for values, std, effect in (
        (load, used["load_std_N"].to_numpy(float), lever),
        (arm, used["arm_std_mm"].to_numpy(float), np.broadcast_to(-load / 1000, moments.shape)),
    ):
        known = made & (std > 0)
        for value in np.unique(values[known]):
            patterns.append(np.where(known & (values == value), effect * std, 0.0))
    return np.stack(patterns) if patterns else np.zeros((0, *moments.shape))


def _by_geometry(used: pd.DataFrame) -> tuple[Floats, Floats]:
    """Change of the moments, N m, for a millimetre of spacing and of lower_to_tip."""
    load = np.where(used["moment_given"], 0.0, used["load_N"].to_numpy(float)) / 1000
    return np.stack([load, np.zeros_like(load)]), np.stack([load, load])


def _with_residuals(
    points: pd.DataFrame, finite: NDArray[np.bool_], session: Session, choice: Choice, faults: list[str]
) -> pd.DataFrame:
    """All points with residuals and what became of them."""
    fit = choice.fit
    residuals = fit.residuals.copy()
    reasons = np.full(session.run.size, "", dtype=object)
    for place, row in enumerate(fit.left_out):
        residuals[:, row] = fit.shifts[place]
        reasons[row] = "contradicts the others"
    columns: dict[str, NDArray[np.generic]] = {}
    for k, name in enumerate(("residual_upper_Nm", "residual_lower_Nm")):
        values = np.full(len(points), np.nan)
        values[finite] = residuals[k]
        columns[name] = values
    reason = np.full(len(points), "load, arm or reading missing", dtype=object)
    reason[finite] = reasons
    if not finite.all():
        rows = points[~finite]
        shown = ", ".join(f"{f} line {n}" for f, n in zip(rows["file"], rows["line"], strict=True))
        faults.append(f"load, arm or reading missing in {shown}: not used")
    return points.assign(**columns, used=reason == "", reason=reason)[list(RESULT_COLUMNS)]
