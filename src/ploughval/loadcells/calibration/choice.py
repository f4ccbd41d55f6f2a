"""Which model the loads support, and which rows contradict all others (Rosner 1983)."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ploughval.errors import CalibrationError
from ploughval.loadcells.calibration.fit import ModelFit, Session, fit_model
from ploughval.loadcells.calibration.models import MODELS, Model, condition_number, levels

CHOICE_COLUMNS = ("model", "parameters", "rms_upper_Nm", "rms_lower_Nm", "left_out", "aicc", "why_not")
_MOST_WRONG = 3  # rows that are looked for; one may be left out
_MANY = 20  # degrees of freedom
_SIGNIFICANCE = 1e-4  # of a wrong row, all rows and both cells together
_LEAST_WRONG = 0.002  # of the largest moment: less than that is scatter, not a mistake


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """The model chosen and those it was chosen from.

    Attributes
    ----------
    fit : ModelFit
        The chosen one; ``fit.left_out`` are the rows that contradict the others.
    table : DataFrame
        CHOICE_COLUMNS, one row a model; ``why_not`` is empty where it could have been chosen.
    condition : float
        Condition number of the loads (models.condition_number).
    weighed : tuple of (float, ModelFit)
        Every model that could have been chosen, with its Akaike weight.
    """

    fit: ModelFit
    table: pd.DataFrame
    condition: float
    weighed: tuple[tuple[float, ModelFit], ...]


def choose_model(session: Session) -> Choice:
    """The model of least AICc among those that the loads carry.

    Raises
    ------
    CalibrationError
        No model has fewer parameters than there are rows.
    """
    count = session.readings.shape[1]
    _check_spread(session)
    condition = condition_number(session.moments)
    rows, scored = [], list[tuple[float, ModelFit]]()
    for model in MODELS:
        why_not = model.why_not(session.moments, session.runs, condition)
        fit = None if why_not else _without_wrong_rows(session, model)
        if fit is None:
            why_not = why_not or "the readings do not determine it"
            rows.append((model.name, np.nan, np.nan, np.nan, 0, np.nan, why_not))
            continue
        # Each row left out was the best of many: that search is paid for beside its two shifts.
        score = fit.aicc + 2 * len(fit.left_out) * np.log(count)
        why_not = "" if np.isfinite(score) else "too few rows to compare it"
        rms = np.sqrt((fit.residuals**2).mean(axis=1))
        rows.append((model.name, fit.parameters, rms[0], rms[1], len(fit.left_out), score, why_not))
        scored.append((score, fit))
    if not scored:
        raise CalibrationError(
            f"{count} rows in {session.runs} runs do not fix the constants of the load cells "
            f"({rows[0][-1]}); expected at least three different loads a run, zero among them"
        )
    _, best = min(scored, key=lambda pair: pair[0])
    table = pd.DataFrame(rows, columns=list(CHOICE_COLUMNS))
    return Choice(best, table, condition, _weighed([fit for s, fit in scored if np.isfinite(s)] or [best]))


def _weighed(fits: list[ModelFit]) -> tuple[tuple[float, ModelFit], ...]:
    """Akaike weights, without the correction for few rows: it would call what few rows leave open settled."""
    count = fits[0].residuals.shape[1]
    criterion = np.array([fit.aic + 2 * len(fit.left_out) * np.log(count) for fit in fits])
    weights = np.exp(-0.5 * (criterion - criterion.min()))
    return tuple(zip((weights / weights.sum()).tolist(), fits, strict=True))


def _check_spread(session: Session) -> None:
    for cell, moments, readings in zip(("upper", "lower"), session.moments, session.readings, strict=True):
        if levels(moments) < 2:
            raise CalibrationError(
                f"all moments at the {cell} cell are {moments[0]:.4g} N m; expected at least three loads"
            )
        if np.ptp(readings) == 0:
            raise CalibrationError(
                f"the {cell} cell reads {readings[0]:.6g} whatever the load; expected readings that "
                "follow it. Look at its wiring and its column"
            )


def _without_wrong_rows(session: Session, model: Model) -> ModelFit | None:
    """The model fitted without the rows that no scatter explains, at most three."""
    fit = fit_model(session, model)
    believed = fit
    while fit is not None and len(fit.left_out) < _MOST_WRONG and fit.dof.min() > 3:
        row, chance = _most_suspect(session, fit)
        if chance > 1 and fit.dof.min() > _MANY:
            break  # three alike among so many would stand out
        fit = fit_model(session, model, (*fit.left_out, row))
        if fit is not None and chance < _SIGNIFICANCE:
            believed = fit  # Rosner: all up to the last significant one, lest two wrong rows hide each other
    return believed


def _most_suspect(session: Session, fit: ModelFit) -> tuple[int, float]:
    """The row with the greatest deleted residual, and the chance of one as great among all."""
    from scipy.special import stdtr

    free = np.maximum(1.0 - fit.hat, 1e-9)
    dof = fit.dof[:, None]
    square = fit.residuals**2 / (fit.scatter_Nm[:, None] ** 2 * free)
    square = np.where(fit.hat < 1 - 1e-6, np.minimum(square, dof * (1 - 1e-12)), 0.0)
    deleted = np.sqrt(square * (dof - 1) / (dof - square))
    cell, row = np.unravel_index(int(np.argmax(deleted)), deleted.shape)
    chance = 2 * float(stdtr(fit.dof[cell] - 1, -deleted[cell, row])) * deleted.size
    largest = float(np.abs(session.moments[cell]).max())
    if abs(fit.residuals[cell, row] / free[cell, row]) < _LEAST_WRONG * largest:
        chance = 1.0
    return int(row), chance
