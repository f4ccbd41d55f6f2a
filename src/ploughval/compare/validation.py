"""Error against uncertainty (ASME V&V 20-2009, eqs 1-5-3 and 1-5-10), and the area metric of histories."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from ploughval.axes import unit_of
from ploughval.scene import Scene, Soil

if TYPE_CHECKING:
    from ploughval.model import History

Floats = NDArray[np.float64]
NAN = float("nan")
_COVERAGE = 2.0
_INPUTS = {
    "unit_weight_kN_m3": "unit_weight_std_kN_m3",
    "peak_friction_deg": "peak_friction_std_deg",
    "residual_friction_deg": "residual_friction_std_deg",
    "mobilization_length_mm": "mobilization_length_std_mm",
    "wall_friction_deg": "wall_friction_std_deg",
}


@dataclass(frozen=True, slots=True)
class Metric:
    """One number of the comparison; NaN (None for ``agrees``) where it could not be had, with a note.

    ``error`` is model - experiment, or a distance where only that exists; ``validation_std`` its standard
    uncertainty; ``agrees`` whether the error is within twice that.
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


def judge(
    name: str,
    experiment: tuple[float, float],
    model: tuple[float, float],
    *,
    input_std: float = 0.0,
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
    note : str
        Added to the metric.
    """
    model_std = float(np.hypot(model[1], input_std))
    error = model[0] - experiment[0]
    deviation = float(np.hypot(experiment[1], model_std))
    return Metric(
        name, unit_of(name), experiment[0], experiment[1], model[0], model_std, error, deviation,
        verdict(error, deviation), note,
    )  # fmt: skip


def distance(name: str, value: float, *, experiment_std: float, model_std: float, note: str = "") -> Metric:
    """A metric that is itself a difference of model and experiment, such as an rms."""
    deviation = float(np.hypot(experiment_std, model_std))
    return Metric(
        name, unit_of(name), NAN, experiment_std, NAN, model_std, value, deviation,
        verdict(value, deviation), note,
    )  # fmt: skip


def verdict(error: float, validation_std: float) -> bool | None:
    """Whether an error is within twice its standard uncertainty; None where either is unknown.

    >>> verdict(-2.0, 1.0), verdict(2.1, 1.0), verdict(0.0, float("nan"))
    (True, False, None)
    """
    if not (np.isfinite(error) and np.isfinite(validation_std)):
        return None
    return bool(abs(error) <= _COVERAGE * validation_std)


def area_metric(error: Floats, experiment_std: Floats, model_std: Floats) -> Floats:
    """Area between the two cumulative distributions, taken normal, at every point of a history.

    For normal distributions it is the mean of |error + (s_model - s_experiment) Z|, a folded normal; it is
    |error| where both uncertainties are the same (Ferson, Oberkampf & Ginzburg 2008, eq. 4).
    """
    spread = np.abs(model_std - experiment_std)
    size = np.abs(error)
    with np.errstate(divide="ignore", invalid="ignore"):
        z = size / (np.sqrt(2.0) * spread)
        folded = spread * np.sqrt(2.0 / np.pi) * np.exp(-(z**2)) + size * erf(z)
    return np.where(spread > 0, folded, size)


@dataclass(frozen=True, slots=True)
class Perturbed:
    """Runs with one soil parameter a standard uncertainty up and down; unchanged in place of a barred one."""

    parameter: str
    histories: "tuple[History, History]"
    span: float  # between the two runs, in standard uncertainties


def perturbed_runs(scene: Scene, history: "History", displacement_mm: float) -> tuple[Perturbed, ...]:
    """Run the model again for each soil parameter with a standard uncertainty, one at a time."""
    soil = scene.soil
    if soil is None:
        return ()
    from ploughval.model import simulate

    runs = []
    for name, std_name in _INPUTS.items():
        std = float(getattr(soil, std_name))
        if std <= 0:
            continue
        value = float(getattr(soil, name))
        allowed = [
            one for sign in (1, -1) if _possible(one := soil.model_copy(update={name: value + sign * std}))
        ]
        ends = [
            simulate(scene.model_copy(update={"soil": one}), displacement_mm=displacement_mm)
            for one in allowed
        ]
        if ends:
            span = float(len(ends))
            runs.append(Perturbed(name, (ends[0], ends[1] if len(ends) == 2 else history), span))
    return tuple(runs)


def _possible(soil: Soil) -> bool:
    return (
        0 < soil.residual_friction_deg <= soil.peak_friction_deg
        and soil.peak_friction_deg + soil.wall_friction_deg < 90
        and soil.unit_weight_kN_m3 > 0
        and soil.mobilization_length_mm >= 0
        and soil.wall_friction_deg >= 0
    )


def input_stds(values: Sequence[tuple[Mapping[str, float], Mapping[str, float], float]]) -> dict[str, float]:
    """Root of the summed squares of half the differences between runs up and down, for every name.

    A value that one of the runs does not have (NaN) leaves its uncertainty unknown (NaN).
    """
    names = {name for up, down, _ in values for name in (*up, *down)}

    def change(name: str, up: Mapping[str, float], down: Mapping[str, float], span: float) -> float:
        return (up.get(name, NAN) - down.get(name, NAN)) / span

    return {name: float(np.linalg.norm([change(name, *ends) for ends in values])) for name in names}
