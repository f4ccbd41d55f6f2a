"""The model's side of a comparison, and how its scalars are set against measured ones."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ploughval.compare.force.peaks import MISSING, Quantity
from ploughval.compare.validation import Metric, Perturbed, input_stds, judge
from ploughval.scene import Scene

if TYPE_CHECKING:
    from ploughval.model import History


@dataclass(frozen=True, slots=True)
class Case:
    """The model's side of a comparison: the run, and the runs with changed soil."""

    scene: Scene
    history: "History"
    runs: tuple[Perturbed, ...]

    @property
    def depth_mm(self) -> float:
        """Depth of the tip, mm."""
        return self.scene.blade.depth_mm

    def inputs(self, values: Callable[["History"], Mapping[str, Quantity]]) -> Mapping[str, float]:
        """Standard uncertainty that the soil's leaves in every value of a history."""

        def plain(one: "History") -> dict[str, float]:
            return {name: quantity.value for name, quantity in values(one).items()}

        ends = [(plain(run.histories[0]), plain(run.histories[1]), run.span) for run in self.runs]
        return input_stds(ends)

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
    predicted, inputs = values(case.history), case.inputs(values)
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
        if not case.runs:
            said += "; no uncertainty of the soil is stated"
        numerical = (model.value, 0.0) if name.endswith("_count") else case.numerical(model)
        metrics.append(judge(name, experiment, numerical, input_std=inputs.get(name, 0.0), note=said))
    return metrics
