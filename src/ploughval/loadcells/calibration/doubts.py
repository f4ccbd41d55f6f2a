"""What speaks against a calibration: whole runs, single points, and what it leaves open."""

from dataclasses import replace

import numpy as np
import pandas as pd

from ploughval.errors import CalibrationError
from ploughval.loadcells.calibration.blunders import Rig, likely_cause
from ploughval.loadcells.calibration.choice import Choice, choose_model
from ploughval.loadcells.calibration.fit import Session
from ploughval.loadcells.calibration.fitted import ResponseFit
from ploughval.loadcells.calibration.models import CONDITION_LIMIT
from ploughval.loadcells.calibration.wiring import cells_exchanged, odd_runs
from ploughval.scene import LoadCells

_WORRYING = 0.02  # of full scale: scatter that asks for a look at the runs
_FELT = 0.2  # of a constant's standard uncertainty: a bias that is said
_CELLS = ("upper", "lower")


def _refuse_exchanged(session: Session) -> None:
    if cells_exchanged(session):
        raise CalibrationError(
            "the readings of the two cells are exchanged in the calibration: the column 'upper' follows "
            "the moments of the lower cell and the other way round. Exchange the columns upper and lower; "
            "where the log has the same wiring, exchange its two moments in [loadcells.columns] as well"
        )


def sound_choice(session: Session, used: pd.DataFrame) -> Choice:
    """The model chosen; whole runs that are odd are named before single points are.

    Raises
    ------
    CalibrationError
        Exchanged cells, or a run with another sign or scale than the others.
    """
    _refuse_exchanged(session)
    choice = choose_model(session)
    scatter = choice.fit.scatter_Nm / np.abs(session.moments).max(axis=1)
    if len(choice.fit.left_out) > 1 or scatter.max() > _WORRYING:
        odd = odd_runs(_without(session, choice.fit.left_out))
        if odd:
            raise CalibrationError(
                "; ".join(f"{_run_name(session, used, run)}: {text}" for run, text in odd)
                + ", against the other runs of the calibration. Correct the file, or leave the run out"
            )
    return choice


def _without(session: Session, rows: tuple[int, ...]) -> Session:
    """The session without rows that are odd by themselves."""
    kept = np.delete(np.arange(session.run.size), list(rows))
    return replace(
        session,
        readings=session.readings[:, kept],
        moments=session.moments[:, kept],
        run=session.run[kept],
        errors=session.errors[:, :, kept],
    )


def _run_name(session: Session, used: pd.DataFrame, run: int) -> str:
    first = used.iloc[int(np.flatnonzero(session.run == run)[0])]
    return f"{first['file']}, run {first['run']} (from line {first['line']})"


def wrong_points(session: Session, choice: Choice, used: pd.DataFrame, cells: LoadCells) -> list[str]:
    """The one wrong point in words, if there is one.

    Raises
    ------
    CalibrationError
        Two or more contradict the others.
    """
    fit = choice.fit
    rig = Rig(
        cells.spacing_mm,
        cells.lower_to_tip_mm,
        np.unique(used["load_N"].dropna().to_numpy(float)),
        np.unique(used["arm_mm"].dropna().to_numpy(float)),
    )
    texts = []
    for place, row in enumerate(fit.left_out):
        known, point = session.moments[:, row], used.iloc[row]
        expected = known - fit.shifts[place]
        texts.append(
            f"{point['file']}, row {point['row']} (line {point['line']}): moments of {known[0]:.4g} and "
            f"{known[1]:.4g} N m are stated, the others give {expected[0]:.4g} and {expected[1]:.4g} N m for "
            f"its readings. Likely cause: {likely_cause(session, fit, row, rig)}"
        )
    if len(texts) > 1:
        raise CalibrationError(
            f"{len(texts)} calibration points contradict the others; expected at most one. "
            + "; ".join(texts)
            + ". Correct or remove them"
        )
    return [f"{text}. Left out" for text in texts]


def doubts(session: Session, fitted: ResponseFit, used: pd.DataFrame, cells: LoadCells) -> list[str]:
    """What the calibration does not tell, or tells with less certainty than it seems."""
    choice, response = fitted.choice, fitted.response
    faults = []
    if not choice.condition <= CONDITION_LIMIT:
        which = "differ by little" if np.isfinite(choice.condition) else "are all the same"
        faults.append(f"the arms of the loads {which}: cross-talk between the cells cannot be told")
    falling = [n for k, n in enumerate(_CELLS) if choice.fit.coefficients[k, k] < 0]
    if falling:
        faults.append(
            f"the readings of the {' and '.join(falling)} cell fall as the moment rises: "
            "the constants have that sign, the log must be wired alike"
        )
    scatter = choice.fit.scatter_Nm / np.abs(session.moments).max(axis=1)
    if scatter.max() > _WORRYING:
        faults.append(f"the points scatter by {100 * scatter.max():.2g} % of full scale about the fit")
    for k, name in enumerate(_CELLS):
        relative = float(np.sqrt(response.cov[k, k, k, k])) / abs(response.coefficients[k, k])
        if fitted.attenuation[k] > _FELT * relative:
            faults.append(
                f"scatter of the readings may make the constant of the {name} cell "
                f"{100 * fitted.attenuation[k]:.2g} % too small, {100 * relative:.2g} % being its uncertainty"
            )
    if (fitted.spread.relative_variance > 0).any():
        shown = 100 * float(np.sqrt(fitted.spread.relative_variance.max()))
        faults.append(f"the runs' sensitivities differ by {shown:.2g} % (standard deviation): counted in")
    if not ((session.moments == 0).all(axis=0)).any():
        faults.append("no unloaded row: the zeros of the calibration are extrapolated")
    if used["from_mass"].any():
        faults.append(f"masses became loads with g = {cells.calibration.g_m_s2:g} m/s^2")
    if not (used["load_std_N"] > 0).any() and not used["moment_given"].all():
        faults.append("no load_std_N: the weights are taken as exact")
    return faults
