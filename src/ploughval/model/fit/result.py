"""What a fit found, as numbers, tables and words."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.model.fit.information import Information
from ploughval.model.fit.objective import Discrepancy
from ploughval.model.fit.weights import Misfit

Floats = NDArray[np.float64]

CURVE_COLUMNS = ("u_mm", "force_N", "noise_std_N", "model_N")
PROFILE_COLUMNS = ("parameter", "value", "rise")
LANDSCAPE_COLUMNS = ("map", "x", "y", "rise")
SWITCH_COLUMNS = ("switch", "record_u_mm", "model_u_mm", "stretch")


@dataclass(frozen=True, slots=True)
class Shift:
    """A quantity known beforehand, and where the best fit puts it.

    Attributes
    ----------
    name : str
        Its name, with its unit.
    shift : float
        Of the best fit from what was told, in that unit.
    std : float
        Its standard uncertainty as told.
    """

    name: str
    shift: float
    std: float


@dataclass(frozen=True, slots=True, eq=False)
class SoilFit:
    """Soil parameters fitted to a force history.

    Attributes
    ----------
    parameters : tuple of str
        Names as in [soil], units in the names.
    values : (K,) float, units of the parameters
        Best values.
    std : (K,) float, units of the parameters
        Half the length of the 68 % interval; infinite where that is open.
    covariance : (K, K) float, products of the units
        From ``std`` and the correlation at the best fit; infinite on the diagonal where the std is.
    interval_68, interval_95 : (K, 2) float
        Limits by profile likelihood; infinite where the record does not bound the parameter within the range
        searched.
    told_by : tuple of str
        For each parameter the stretches of the record that it hangs on.
    information : Information
        The numbers behind that.
    shifts : tuple of Shift
        Offset, gain, start and what else was known with an uncertainty.
    switches : DataFrame
        SWITCH_COLUMNS: where record and model change their band, and the stretch of the tooth before.
    curve : DataFrame
        CURVE_COLUMNS: rows that were fitted and the registered model there.
    profiles : DataFrame
        PROFILE_COLUMNS: rise of the least cost over each parameter.
    landscape : DataFrame
        LANDSCAPE_COLUMNS: the cost over two parameters at a time, the others at their best; no rows where
        maps were not asked for.
    rises : dict of float to float
        Rise of the cost at the ends of the interval of each level.
    misfit : Misfit
        How rows miss the model.
    discrepancy : Discrepancy
        Of the model: what was allowed for, or more where the record asks for it.
    residual_rms_N : float
        Rms of measured minus modelled force, registered.
    points : int
        Rows of the record that were used.
    remarks : tuple of str
        What limits the result.
    posterior : dict of str to tuple of float, or None
        2.5, 16, 50, 84 and 97.5 % of each parameter by a sampler, where that was asked for.
    """

    parameters: tuple[str, ...]
    values: Floats
    std: Floats
    covariance: Floats
    interval_68: Floats
    interval_95: Floats
    told_by: tuple[str, ...]
    information: Information
    shifts: tuple[Shift, ...]
    switches: pd.DataFrame
    curve: pd.DataFrame
    profiles: pd.DataFrame
    landscape: pd.DataFrame
    rises: dict[float, float]
    misfit: Misfit
    discrepancy: Discrepancy
    residual_rms_N: float
    points: int
    remarks: tuple[str, ...]
    posterior: dict[str, tuple[float, ...]] | None = None

    @property
    def chi2_reduced(self) -> float:
        """Squared residuals over their stated variance, per degree of freedom."""
        return self.misfit.chi2

    @property
    def message(self) -> str:
        """The remarks in one line."""
        return "; ".join(self.remarks) or "all parameters are determined by this record"

    def __str__(self) -> str:
        lines = []
        for k, name in enumerate(self.parameters):
            limits = " to ".join(_limit(v) for v in self.interval_95[k])
            lines.append(f"{name}: {self.values[k]:.4g}, 95 % interval {limits}")
            if self.posterior is not None:
                low, _, middle, _, high = (f"{value:.4g}" for value in self.posterior[name])
                lines.append(f"  sampled: median {middle}, 95 % between {low} and {high}")
            lines.append(f"  told by {self.told_by[k]}")
        lines.append(f"residual: {self.residual_rms_N:.3g} N rms over {self.points} points")
        return "\n".join([*lines, self.message])

    def to_json(self) -> dict[str, object]:
        """Everything but the tables as plain numbers and text, for a JSON file; open limits are None."""
        return {
            "parameters": {
                name: {
                    "value": float(self.values[k]),
                    "std": _finite(self.std[k]),
                    "interval_68": [_finite(v) for v in self.interval_68[k]],
                    "interval_95": [_finite(v) for v in self.interval_95[k]],
                    "told_by": self.told_by[k],
                }
                for k, name in enumerate(self.parameters)
            },
            "covariance": [[_finite(c) for c in row] for row in self.covariance],
            "shifts": {s.name: {"shift": s.shift, "std": s.std} for s in self.shifts},
            "switches": self.switches.to_dict("records"),
            "discrepancy": {"travel": self.discrepancy.travel, "force": self.discrepancy.force},
            "information": self.information.to_json(),
            "rises": {f"{100 * level:.0f}": rise for level, rise in self.rises.items()},
            "residual_rms_N": self.residual_rms_N,
            "chi2_reduced": self.chi2_reduced,
            "points": self.points,
            "independent_points": self.misfit.independent,
            "noise_inflation": self.misfit.inflation,
            "message": self.message,
            "posterior": None if self.posterior is None else {n: list(v) for n, v in self.posterior.items()},
        }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _limit(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else "open"
