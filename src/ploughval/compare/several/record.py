"""One of several tests: settings, metrics, and what frees these of depth, width and unit weight."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

NAN = float("nan")

# Powers of (force, length) in the units that metrics have; those without stay as they are.
_PLAIN = ("1", "degree", "%", "P0", "d", "1/d")
_DIMENSIONS = {
    "N": (1, 0),
    "mm": (0, 1),
    "mm^2": (0, 2),
    "1/mm": (0, -1),
    "N/mm": (1, -1),
    "mJ": (1, 1),
}
_WORDS = {
    (1, 0): "γd²B/2",
    (0, 1): "d",
    (0, 2): "d²",
    (0, -1): "1/d",
    (1, -1): "γdB/2",
    (1, 1): "γd³B/2",
}


@dataclass(frozen=True, slots=True)
class Value:
    """A metric of one test, as in metrics.json; NaN for what could not be had.

    Attributes
    ----------
    unit : str
        Of all values.
    experiment, experiment_std : float
        Measured value and its standard uncertainty.
    model, model_std : float
        Predicted value and its standard uncertainty.
    error, validation_std : float
        model - experiment and its standard uncertainty.
    agrees : bool or None
        Whether the error is within twice that.
    """

    unit: str
    experiment: float = NAN
    experiment_std: float = NAN
    model: float = NAN
    model_std: float = NAN
    error: float = NAN
    validation_std: float = NAN
    agrees: bool | None = None


class Scale(NamedTuple):
    """What a metric is divided by, its words (the metric's own unit for 1), and the power of depth in it."""

    size: float
    words: str
    power: int


@dataclass(frozen=True, slots=True)
class Record:
    """What is known of one test.

    Attributes
    ----------
    name : str
    settings : mapping
        Tables of test.toml as in run.json.
    values : mapping of str to Value
        Metrics by name.
    force : DataFrame of FORCE_COLUMNS or None
        Measured history.
    P0_N : float, N
        What peaks of the force are judged by; NaN unknown.
    inputs : mapping of str to str
        Digests of the files that were measured from, without settings.
    """

    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    values: Mapping[str, Value] = field(default_factory=dict)
    force: pd.DataFrame | None = None
    P0_N: float = NAN
    inputs: Mapping[str, str] = field(default_factory=dict)

    def setting(self, table: str, key: str) -> Any:
        """A value of test.toml, or None."""
        values = self.settings.get(table)
        return values.get(key) if isinstance(values, Mapping) else None

    def number(self, table: str, key: str) -> float:
        """A number of test.toml; NaN where there is none."""
        value = self.setting(table, key)
        good = isinstance(value, int | float) and not isinstance(value, bool)
        return float(value) if good else NAN

    @property
    def depth_mm(self) -> float:
        """Depth of the blade, mm."""
        return self.number("blade", "depth_mm")

    def scale(self, unit: str) -> Scale | None:
        """Divisor that frees a metric of depth, width and unit weight; None where it cannot be had.

        Forces are divided by unit weight x depth^2 x width / 2, lengths by the depth, the rest by 1.

        Parameters
        ----------
        unit : str
            Unit of the metric.
        """
        if unit in _PLAIN:
            return Scale(1.0, "" if unit == "1" else unit, 0)
        powers = _DIMENSIONS.get(unit)
        if powers is None:
            return None
        size = self.depth_mm ** powers[1] if powers[1] else 1.0
        if powers[0]:
            weight = self.number("soil", "unit_weight_kN_m3") * 1e-6  # kN/m3 = 1e-6 N/mm3
            size *= weight * self.depth_mm**2 * self.number("blade", "width_mm") / 2
        return Scale(size, _WORDS[powers], 2 * powers[0] + powers[1]) if np.isfinite(size) else None

    def scaled_metric(self, name: str, *, with_depth: bool = True) -> Value | None:
        """A metric by its name, scaled; None where the test does not have it or it cannot be scaled."""
        value = self.values.get(name)
        return None if value is None else self.scaled(value, with_depth=with_depth)

    def scaled(self, value: Value, *, with_depth: bool = True) -> Value | None:
        """A metric divided by its scale.

        Parameters
        ----------
        value : Value
            The metric.
        with_depth : bool
            Whether the depth's own uncertainty is added to the measured side, which then stands for the
            stated depth. Not where an error is looked at: there the model's inputs hold it already.

        Returns
        -------
        Value or None
            None where the test does not state what the metric is scaled by.
        """
        scale = self.scale(value.unit)
        if scale is None:
            return None
        sides = ("experiment", "experiment_std", "model", "model_std", "error", "validation_std")
        found = {side: getattr(value, side) / scale.size for side in sides}
        depth_std = self.number("blade", "depth_std_mm")
        if with_depth and scale.power and np.isfinite(depth_std) and np.isfinite(value.experiment):
            own = scale.power * depth_std / self.depth_mm * found["experiment"]
            found["experiment_std"] = float(np.hypot(found["experiment_std"], own))
        return Value(scale.words, **found, agrees=value.agrees)
