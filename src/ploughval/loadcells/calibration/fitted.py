"""Response of the two cells from known moments: the model chosen, and how well its constants are known."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import CalibrationError
from ploughval.loadcells.calibration.choice import Choice, choose_model
from ploughval.loadcells.calibration.fit import ModelFit, Session, fit_model
from ploughval.loadcells.calibration.runs import RunSpread, run_spread
from ploughval.loadcells.response import CellResponse, Powers

Floats = NDArray[np.float64]
_LEAST_WEIGHT = 1e-3  # of a model that takes part in the covariance
_STEP_MM = 1.0  # of the geometry, for derivatives: moments are linear in it


@dataclass(frozen=True, slots=True, eq=False)
class ResponseFit:
    """What known moments tell about the cells.

    Attributes
    ----------
    response : CellResponse
        Readings to moments.
    choice : Choice
        Model, residuals, scatter, and the other models.
    spread : RunSpread
        How the runs differ among themselves.
    attenuation : (2,) float
        At most so much, relatively, are each cell's constants too small because readings scatter as well.
    """

    response: CellResponse
    choice: Choice
    spread: RunSpread
    attenuation: Floats


def fit_response(
    readings: Floats,
    moments: Floats,
    *,
    run: NDArray[np.intp] | None = None,
    errors: Floats | None = None,
    by_spacing: Floats | None = None,
    by_lower_to_tip: Floats | None = None,
) -> ResponseFit:
    """Response of the two cells from readings at known moments.

    Parameters
    ----------
    readings, moments : (2, N) float, unit of the log and N m
        Of the (upper, lower) cell; all finite.
    run : (N,) int or None
        Runs counted from 0; None: a single run. Each has its own zeros, which are found.
    errors : (G, 2, N) float, N m, or None
        What one standard deviation of each weight and arm does to the moments.
    by_spacing, by_lower_to_tip : (2, N) float, N m per mm, or None
        Change of the moments with the geometry.

    Returns
    -------
    ResponseFit

    Raises
    ------
    CalibrationError
        Too few rows, or rows that contradict each other.
    """
    count = readings.shape[1]
    session = Session(
        np.asarray(readings, float),
        np.asarray(moments, float),
        np.zeros(count, dtype=np.intp) if run is None else np.asarray(run, dtype=np.intp),
        np.zeros((0, 2, count)) if errors is None else errors,
        np.array([written_step(cell) for cell in readings]),
    )
    choice = choose_model(session)
    if len(choice.fit.left_out) > 1:
        rows = ", ".join(map(str, sorted(choice.fit.left_out)))
        raise CalibrationError(f"rows {rows} of the calibration contradict the others; expected at most one")
    none = np.zeros_like(session.moments)
    changes = tuple(none if by is None else by for by in (by_spacing, by_lower_to_tip))
    return response_of(session, choice, (changes[0], changes[1]))


def written_step(readings: Floats) -> float:
    """The coarsest power of ten that all readings are multiples of; 0 where there is none.

    >>> written_step(np.array([1.25, 3.5])), written_step(np.array([100.0, 350.0]))
    (0.01, 10.0)
    """
    largest = float(np.abs(readings).max(initial=0.0))
    if largest == 0:
        return 0.0
    top = int(np.floor(np.log10(largest)))
    for power in range(top, top - 8, -1):
        scaled = readings * 10.0**-power
        if (np.abs(scaled - np.round(scaled)) <= 1e-9 * np.maximum(np.abs(scaled), 1.0)).all():
            return float(10.0**power)
    return 0.0


def response_of(session: Session, choice: Choice, by_geometry: tuple[Floats, Floats]) -> ResponseFit:
    """The chosen fit as a response, with what the runs' differences and the geometry add.

    Parameters
    ----------
    session, choice : Session, Choice
        As from choose_model.
    by_geometry : two (2, N) float, N m per mm
        Change of the moments with spacing and with lower_to_tip.
    """
    fit = choice.fit
    spread = run_spread(session, fit)
    powers, coefficients, cov = _averaged(choice)
    main = np.array([cov[k, k, k, k] for k in (0, 1)])
    extra = spread.relative_variance * (1 + 1 / session.runs)
    for k in (0, 1):
        cov[k, :, k, :] += extra[k] * np.outer(coefficients[k], coefficients[k])
    added = extra * np.array([coefficients[k, k] ** 2 for k in (0, 1)])
    total = main + added
    parts = (fit.scatter_share * main / total) ** 2 / fit.dof
    parts = parts + (added / total) ** 2 / max(session.runs - 1, 1)
    dof = float((1 / np.maximum(parts, 1e-12)).min())
    changes = []
    for by in by_geometry:
        change = np.zeros_like(coefficients)
        change[:, : fit.coefficients.shape[1]] = _derivative(session, fit, by)
        changes.append(change)
    response = CellResponse(powers, coefficients, cov, changes[0], changes[1], dof if dof < 1e9 else np.inf)
    return ResponseFit(response, choice, spread, _attenuation(session, fit))


def _averaged(choice: Choice) -> tuple[Powers, Floats, Floats]:
    """The chosen coefficients; their covariance over all models by weight (Burnham & Anderson 2002, 4.3).

    docs/theory-loadcell-calibration.md, Eq. (7).
    """
    weighed = [(weight, fit) for weight, fit in choice.weighed if weight > _LEAST_WEIGHT]
    powers = max((fit.model.powers for _, fit in weighed), key=len)
    size, own = len(powers), choice.fit.coefficients.shape[1]
    coefficients, cov = np.zeros((2, size)), np.zeros((2, size, 2, size))
    coefficients[:, :own] = choice.fit.coefficients
    share = sum(weight for weight, _ in weighed)
    for weight, fit in weighed:
        k = fit.coefficients.shape[1]
        away = np.zeros((2, size))
        away[:, :k] = fit.coefficients
        away -= coefficients
        cov[:, :k, :, :k] += weight / share * fit.cov
        cov += weight / share * np.multiply.outer(away, away)
    return powers, coefficients, cov


def _derivative(session: Session, fit: ModelFit, by: Floats) -> Floats:
    """Change of the coefficients (2, K) for a millimetre of the geometry, by central differences."""
    if not by.any():
        return np.zeros_like(fit.coefficients)
    ends = []
    for step in (_STEP_MM, -_STEP_MM):
        moved = fit_model(replace(session, moments=session.moments + step * by), fit.model, fit.left_out)
        if moved is None:
            raise CalibrationError(
                "the constants of the load cells are lost when the geometry changes by 1 mm"
            )
        ends.append(moved.coefficients)
    return np.asarray((ends[0] - ends[1]) / (2 * _STEP_MM))


def _attenuation(session: Session, fit: ModelFit) -> Floats:
    """Bound of the relative loss of constants if all scatter is in the readings (Fuller 1987, 1.1).

    docs/theory-loadcell-calibration.md, Eq. (5).
    """
    used = np.ones(session.run.size, dtype=bool)
    used[list(fit.left_out)] = False
    centred = session.moments.copy()
    for k in range(session.runs):
        rows = used & (session.run == k)
        if rows.any():
            centred[:, rows] -= centred[:, rows].mean(axis=1, keepdims=True)
    centred, count = centred[:, used], int(used.sum())
    power = (centred**2).sum(axis=1)
    if fit.model.crossed:
        power = np.full(2, float(np.linalg.eigvalsh(centred @ centred.T)[0]))
        return np.asarray(np.full(2, count * float((fit.scatter_Nm**2).max())) / power)
    return np.asarray(count * fit.scatter_Nm**2 / power)
