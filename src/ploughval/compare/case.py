"""The model's side of a comparison, and how its scalars are set against measured ones."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ploughval.compare.ensemble import NO_SPREAD, Ensemble, Spread
from ploughval.compare.quantity import MISSING, Quantity
from ploughval.compare.validation import Metric, judge
from ploughval.scene import Scene

if TYPE_CHECKING:
    from ploughval.model import History


@dataclass(frozen=True, slots=True)
class Case:
    """The model's side of a comparison: the run with the stated inputs, and runs with drawn ones."""

    scene: Scene
    history: "History"
    ensemble: Ensemble

    @property
    def depth_mm(self) -> float:
        """Depth of the tip, mm."""
        return self.scene.blade.depth_mm

    def input_spread(self, values: Callable[["History"], Mapping[str, Quantity]]) -> dict[str, Spread]:
        """What the inputs leave open of every value of a history, by name."""

        def plain(one: "History") -> dict[str, float]:
            return {name: quantity.value for name, quantity in values(one).items()}

        return self.ensemble.spread(plain)

    def input_std(self, values: Callable[["History"], Mapping[str, Quantity]]) -> dict[str, float]:
        """Standard uncertainty that the inputs leave in every value of a history, by name."""
        return {name: spread.std for name, spread in self.input_spread(values).items()}

    def numerical(self, value: Quantity) -> tuple[float, float]:
        """A model's value with its numerical uncertainty: its own, or the tolerance's share of it."""
        std = value.std if value.std > 0 else self.scene.model.tolerance * abs(value.value)
        return value.value, std


def join_scalars(
    case: Case,
    measured: Mapping[str, Quantity],
    values: Callable[["History"], Mapping[str, Quantity]],
    note: str,
) -> list[Metric]:
    """Measured scalars set against the model's of the same name; those that neither has are left out."""
    predicted, spreads = values(case.history), case.input_spread(values)
    metrics = []
    for name, experiment in measured.items():
        model = predicted.get(name, MISSING)
        missing = [
            side
            for side, value in (("experiment", experiment), ("model", model))
            if not np.isfinite(value.value)
        ]
        if len(missing) == 2:
            continue
        said = f"{note}; none in the {missing[0]}" if missing else note
        numerical = (model.value, 0.0) if name.endswith("_count") else case.numerical(model)
        metrics.append(judge_spread(name, experiment, numerical, spreads.get(name, NO_SPREAD), said))
    return metrics


def judge_spread(
    name: str, experiment: tuple[float, float], model: tuple[float, float], spread: Spread, note: str
) -> Metric:
    """Set a measured against a predicted value whose inputs were drawn.

    Parameters
    ----------
    name : str
        Ends in the unit.
    experiment : (value, standard uncertainty)
        NaN where not measured.
    model : (value, standard uncertainty of the numerics)
        NaN where not predicted.
    spread : Spread
        What the drawn inputs leave open.
    note : str
        Added to the metric, with what the draws lack.
    """
    return judge(
        name,
        experiment,
        model,
        input_std=spread.std,
        dominant_input=spread.dominant,
        note=f"{note}{spread.remark}",
    )
