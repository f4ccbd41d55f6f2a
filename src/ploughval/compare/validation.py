"""Error against uncertainty (ASME V&V 20-2009, eqs 1-5-3 and 1-5-10).

docs/theory-comparison.md, Eq. (1); docs/theory-comparison-lines.md, Eq. (1).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import unit_of

Floats = NDArray[np.float64]
NAN = float("nan")
_COVERAGE = 2.0


@dataclass(frozen=True, slots=True)
class Metric:
    """One number of the comparison; NaN (None for ``agrees``) where it could not be had, with a note.

    Attributes
    ----------
    name, unit : str
        What it is, and its unit: that of all its values.
    experiment, experiment_std : float
        Measured value and its standard uncertainty.
    model, model_std : float
        Predicted value, and what inputs and numerics leave open of it together.
    error : float
        model - experiment, or a distance where only that exists.
    validation_std : float
        Standard uncertainty of the error.
    agrees : bool or None
        Whether the error is within twice that.
    note : str
        Why a value is missing, or what it means.
    input_std, numerical_std : float
        The two parts of ``model_std``.
    dominant_input : str
        The input that most of ``input_std`` squared comes from.
    """

    name: str
    unit: str
    experiment: float = NAN
    experiment_std: float = NAN
    model: float = NAN
    model_std: float = NAN
    error: float = NAN
    validation_std: float = NAN
    agrees: bool | None = None
    note: str = ""
    input_std: float = NAN
    numerical_std: float = NAN
    dominant_input: str = ""


def judge(
    name: str,
    experiment: tuple[float, float],
    model: tuple[float, float],
    *,
    input_std: float = 0.0,
    dominant_input: str = "",
    note: str = "",
) -> Metric:
    """Set a measured against a predicted value.

    Parameters
    ----------
    name : str
        Ends in the unit.
    experiment : (value, standard uncertainty)
        NaN where not measured.
    model : (value, standard uncertainty of the numerics)
        NaN where not predicted.
    input_std : float
        Standard uncertainty that the model's inputs leave, in the metric's unit.
    dominant_input : str
        The input that most of it comes from.
    note : str
        Added to the metric.
    """
    model_std = float(np.hypot(model[1], input_std))
    error = model[0] - experiment[0]
    deviation = float(np.hypot(experiment[1], model_std))
    return Metric(
        name, unit_of(name), experiment[0], experiment[1], model[0], model_std, error, deviation,
        verdict(error, deviation), note, input_std, model[1], dominant_input,
    )  # fmt: skip


def distance(
    name: str,
    value: float,
    *,
    experiment_std: float,
    numerical_std: float,
    input_std: float = 0.0,
    dominant_input: str = "",
    note: str = "",
) -> Metric:
    """A metric that is itself a difference of model and experiment, such as an rms.

    Parameters
    ----------
    name : str
        Ends in the unit.
    value : float
        The difference.
    experiment_std, numerical_std, input_std : float
        What measurement, numerics and inputs leave open of it; NaN where that is unknown.
    dominant_input : str
        The input that most of ``input_std`` comes from.
    note : str
        Added to the metric.
    """
    model_std = float(np.hypot(numerical_std, input_std))
    deviation = float(np.hypot(experiment_std, model_std))
    return Metric(
        name, unit_of(name), NAN, experiment_std, NAN, model_std, value, deviation,
        verdict(value, deviation), note, input_std, numerical_std, dominant_input,
    )  # fmt: skip


def rms(values: Floats) -> float:
    """Root mean square of the finite values; NaN without any."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def verdict(error: float, validation_std: float) -> bool | None:
    """Whether an error is within twice its standard uncertainty; None where either is unknown.

    >>> verdict(-2.0, 1.0), verdict(2.1, 1.0), verdict(0.0, float("nan"))
    (True, False, None)
    """
    if not (np.isfinite(error) and np.isfinite(validation_std)):
        return None
    return bool(abs(error) <= _COVERAGE * validation_std)
