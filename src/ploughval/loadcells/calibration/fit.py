"""One model of the cells fitted to known moments: least squares with errors that rows have in common.

A scatter of its own for each cell is estimated from the residuals (restricted maximum likelihood; Fellner,
1986); errors of weights and arms are carried as parameters of known standard deviation
(docs/theory-loadcell-calibration.md, Eqs (3) and (4)).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.loadcells.calibration.models import Model

Floats = NDArray[np.float64]
_MOST_STEPS = 60
_SETTLED = 1e-5  # of a standard deviation, and of the scatter
_LEAST_SCATTER = 1e-9  # of the largest moment: below that is rounding


@dataclass(frozen=True, slots=True, eq=False)
class Session:
    """What was hung on the cells and what they read.

    Attributes
    ----------
    readings : (2, N) float
        Of the (upper, lower) cell, in the unit of the log.
    moments : (2, N) float, N m
        True moments at the cells.
    run : (N,) int
        Runs counted from 0; each has zeros of its own.
    errors : (G, 2, N) float, N m
        What one standard deviation of each weight and arm does to the moments.
    resolution : (2,) float
        Step of the readings, in the unit of the log.
    """

    readings: Floats
    moments: Floats
    run: NDArray[np.intp]
    errors: Floats
    resolution: Floats

    @property
    def runs(self) -> int:
        """Number of runs."""
        return int(self.run.max()) + 1

    def zeros_seen(self) -> Floats:
        """Readings (2, runs) at the least moments of each run: where the search for its zeros starts."""
        seen = np.empty((2, self.runs))
        size = np.abs(self.moments).max(axis=0)
        for k in range(self.runs):
            rows = np.flatnonzero(self.run == k)
            seen[:, k] = self.readings[:, rows[size[rows] == size[rows].min()]].mean(axis=1)
        return seen


@dataclass(frozen=True, slots=True, eq=False)
class ModelFit:
    """A model with its coefficients.

    Attributes
    ----------
    model : Model
    coefficients, cov : (2, K) float, (2, K, 2, K) float
        As in CellResponse.
    zeros : (2, R) float
        Zero readings of each run.
    left_out : tuple of int
        Rows that have no say.
    shifts, shift_std : (len(left_out), 2) float, N m
        By how much the rows left out are off, and how well that is known.
    residuals, hat : (2, N) float
        Known less fitted moments, N m, and what share of itself each row has in its own fit.
    scatter_Nm, dof : (2,) float
        Standard deviation of the residuals of each cell beyond what weights and arms explain, and the degrees
        of freedom behind it.
    scatter_share : (2,) float
        Part of the variance of each cell's main constant that comes from this scatter.
    deviance : float
        Minus twice the logarithm of the likelihood.
    parameters : int
        Coefficients, zeros, shifts and two scatters.
    """

    model: Model
    coefficients: Floats
    cov: Floats
    zeros: Floats
    left_out: tuple[int, ...]
    shifts: Floats
    shift_std: Floats
    residuals: Floats
    hat: Floats
    scatter_Nm: Floats
    dof: Floats
    scatter_share: Floats
    deviance: float
    parameters: int

    @property
    def aic(self) -> float:
        """Akaike's information criterion."""
        return self.deviance + 2 * self.parameters

    @property
    def aicc(self) -> float:
        """The same with the correction for few rows (Hurvich & Tsai 1989); inf where they are too few.

        docs/theory-loadcell-calibration.md, Eq. (6).
        """
        spare = self.residuals.size - self.parameters - 1
        if spare <= 0:
            return float("inf")
        return self.aic + 2 * self.parameters * (self.parameters + 1) / spare


@dataclass(frozen=True, slots=True)
class _Problem:
    """The session with readings scaled to 1, and the columns that do not change from step to step."""

    session: Session
    model: Model
    scale: Floats  # (2,) of the readings
    fixed: Floats  # (2N, shifts + G): shifts and errors
    shifts: int

    @property
    def active(self) -> list[tuple[int, int]]:
        """(moment, feature) of each coefficient."""
        return [(cell, j) for cell in (0, 1) for j in self.model.active[cell]]


def fit_model(session: Session, model: Model, left_out: tuple[int, ...] = ()) -> ModelFit | None:
    """Fit a model by least squares; None where the rows do not determine it.

    Parameters
    ----------
    session : Session
        Loads and readings, all finite.
    model : Model
        What the moments are built from.
    left_out : tuple of int
        Rows that get a moment of their own to be off by, so that they tell nothing.
    """
    problem, coefficients, zeros = _prepare(session, model, left_out)
    count = session.readings.shape[1]
    floor = _floor(session)
    scatter = np.maximum(floor, 1e-3 * np.abs(session.moments).max(axis=1))
    value, design = _linearised(problem, coefficients, zeros)
    for _ in range(_MOST_STEPS):
        solved = _solve(problem, design, session.moments - value, scatter)
        if solved is None:
            return None
        step, factor, hat = solved
        n_coefficients, n_zeros = len(problem.active), zeros.size
        for (cell, j), change in zip(problem.active, step, strict=False):
            coefficients[cell, j] += change
        zeros = zeros + step[n_coefficients : n_coefficients + n_zeros].reshape(zeros.shape)
        others = step[n_coefficients + n_zeros :]
        value, design = _linearised(problem, coefficients, zeros)
        left = session.moments - value - (problem.fixed @ others).reshape(2, -1)
        dof = count - hat.sum(axis=1)
        if (dof < 1e-6).any():
            return None
        fresh = np.maximum(np.sqrt((left**2).sum(axis=1) / dof), floor)
        settled = np.abs(fresh / scatter - 1).max() < _SETTLED
        scatter = fresh
        std = np.sqrt((factor**2).sum(axis=1))
        if settled and (np.abs(step[:n_coefficients]) <= _SETTLED * std[:n_coefficients] + 1e-13).all():
            break
    return _result(problem, left_out, (coefficients, zeros, others), (left, hat, scatter, factor))


def _prepare(session: Session, model: Model, left_out: tuple[int, ...]) -> tuple[_Problem, Floats, Floats]:
    """The problem with scaled readings, and where the search starts: straight lines through zeros seen."""
    count = session.readings.shape[1]
    zeros = session.zeros_seen()
    scale = np.abs(session.readings - zeros[:, session.run]).max(axis=1)
    scale = np.where(scale > 0, scale, 1.0)
    shifts = np.zeros((2, count, 2 * len(left_out)))
    for k, row in enumerate(left_out):
        shifts[0, row, 2 * k] = shifts[1, row, 2 * k + 1] = 1.0
    errors = -np.moveaxis(session.errors, 0, -1)
    fixed = np.concatenate([shifts, errors], axis=2).reshape(2 * count, -1)
    coefficients = np.zeros((2, len(model.powers)))
    weight = np.ones(count)
    weight[list(left_out)] = 0.0
    for cell in (0, 1):
        x = weight * (session.readings[cell] - zeros[cell, session.run]) / scale[cell]
        coefficients[cell, cell] = (x @ session.moments[cell]) / max(float(x @ x), np.finfo(float).tiny)
    return _Problem(session, model, scale, fixed, 2 * len(left_out)), coefficients, zeros / scale[:, None]


def _floor(session: Session) -> Floats:
    """The least scatter of each cell, N m: rounding of the numbers, and of the readings to their step."""
    span = np.ptp(session.readings, axis=1)
    largest = np.abs(session.moments).max(axis=1)
    relative = np.divide(session.resolution, span, out=np.zeros(2), where=span > 0) / np.sqrt(12.0)
    return np.asarray(largest * np.maximum(relative, _LEAST_SCATTER) + np.finfo(float).tiny)


def _linearised(problem: _Problem, coefficients: Floats, zeros: Floats) -> tuple[Floats, Floats]:
    """Fitted moments (2, N) and their derivative (2N, P) by all parameters."""
    session, powers = problem.session, problem.model.powers
    x = session.readings / problem.scale[:, None] - zeros[:, session.run]
    features = np.stack([x[0] ** i * x[1] ** j for i, j in powers])
    by_reading = np.stack(  # (2, K, N)
        [
            np.stack([i * x[0] ** max(i - 1, 0) * x[1] ** j for i, j in powers]),
            np.stack([j * x[1] ** max(j - 1, 0) * x[0] ** i for i, j in powers]),
        ]
    )
    slopes = np.einsum("ck,lkn->cln", coefficients, by_reading)  # moment, reading, row
    count, active = x.shape[1], problem.active
    design = np.zeros((2, count, len(active) + zeros.size))
    for p, (cell, j) in enumerate(active):
        design[cell, :, p] = features[j]
    rows = np.arange(count)
    for reading in (0, 1):
        places = len(active) + reading * session.runs + session.run
        for cell in (0, 1):
            design[cell, rows, places] = -slopes[cell, reading]
    full = np.concatenate([design.reshape(2 * count, -1), problem.fixed], axis=1)
    return coefficients @ features, full


def _solve(
    problem: _Problem, design: Floats, left: Floats, scatter: Floats
) -> tuple[Floats, Floats, Floats] | None:
    """Weighted least squares: step (P,), factor (P, 2N + G) with factor factor^T = cov, hat (2, N)."""
    count, known = left.shape[1], problem.session.errors.shape[0]
    weight = np.repeat(1.0 / scatter, count)
    size = design.shape[1]
    prior = np.zeros((known, size))
    prior[:, size - known :] = np.eye(known)
    stacked = np.concatenate([design * weight[:, None], prior])
    target = np.concatenate([left.reshape(-1) * weight, np.zeros(known)])
    with np.errstate(over="ignore"):
        length = np.sqrt((stacked**2).sum(axis=0))
    if not ((length > 0) & np.isfinite(length)).all():
        return None
    q, r = np.linalg.qr(stacked / length)
    pivots = np.abs(np.diag(r))
    if stacked.shape[0] < size or pivots.min() < 1e-10 * pivots.max():
        return None
    factor = np.linalg.solve(r, q.T) / length[:, None]
    hat = (q[: 2 * count] ** 2).sum(axis=1).reshape(2, -1)
    return factor @ target, factor, hat


def _result(
    problem: _Problem,
    left_out: tuple[int, ...],
    parameters: tuple[Floats, Floats, Floats],
    spread: tuple[Floats, Floats, Floats, Floats],
) -> ModelFit:
    coefficients, zeros, others = parameters
    left, hat, scatter, factor = spread
    session, active, count = problem.session, problem.active, left.shape[1]
    per_unit = np.array([problem.scale[0] ** -i * problem.scale[1] ** -j for i, j in problem.model.powers])
    variance, joint = factor**2, factor @ factor.T
    cov = np.zeros((2, per_unit.size, 2, per_unit.size))
    for p, (cell, j) in enumerate(active):
        for q, (other, k) in enumerate(active):
            cov[cell, j, other, k] = joint[p, q] * per_unit[j] * per_unit[k]
    mains = [active.index((0, 0)), active.index((1, 1))]
    share = variance[mains, : 2 * count].sum(axis=1) / variance[mains].sum(axis=1)
    start = len(active) + zeros.size
    shift_std = np.sqrt(np.diag(joint)[start : start + problem.shifts])
    return ModelFit(
        problem.model,
        coefficients * per_unit,
        cov,
        zeros * problem.scale[:, None],
        left_out,
        others[: problem.shifts].reshape(-1, 2),
        shift_std.reshape(-1, 2),
        left,
        hat,
        scatter,
        count - hat.sum(axis=1),
        share,
        _deviance(session, left, others[problem.shifts :], hat, scatter),
        start + problem.shifts + 2,
    )


def _deviance(session: Session, left: Floats, known: Floats, hat: Floats, scatter: Floats) -> float:
    """Minus twice the logarithm of the likelihood at its greatest over the two scatters."""
    count = left.shape[1]
    whitened = (session.errors / scatter[:, None]).reshape(known.size, 2 * count)
    inner = np.eye(known.size) + whitened @ whitened.T
    own = (whitened * np.linalg.solve(inner, whitened)).sum(axis=0)
    # Estimated with all degrees of freedom but those of the known errors, as the greatest likelihood has it.
    squares = scatter**2 * (count - hat.sum(axis=1)) / (count - own.reshape(2, -1).sum(axis=1))
    logdet = float(np.linalg.slogdet(inner)[1])
    misfit = float(((left**2).sum(axis=1) / squares).sum() + known @ known)
    return float(count * np.log(2 * np.pi * squares).sum()) + logdet + misfit
