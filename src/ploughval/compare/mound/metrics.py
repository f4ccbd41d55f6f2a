"""Metrics of the mound: at the end of the travel, in the mean over frames, and rms over them."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ploughval.compare.case import Case, judge_spread
from ploughval.compare.ensemble import Spread
from ploughval.compare.face import lean_of
from ploughval.compare.mound.history import (
    lines_of,
    measured_mounds,
    mound_rows,
    predicted_mounds,
    reading_of,
    rest_of,
)
from ploughval.compare.mound.shape import Floats, Mound
from ploughval.compare.quantity import Quantity
from ploughval.compare.validation import Metric, distance

if TYPE_CHECKING:
    from ploughval.model import History

_PARTS = {"crest": "mm", "face": "mm", "front": "mm", "flank": "deg", "slope": "deg", "area": "mm2"}
_WORDS = {
    "crest": "greatest height above the initial surface",
    "face": "height above the initial surface at the blade's face",
    "front": "from the face to where the surface has left its initial level by {threshold:.3g} mm",
    "flank": "mean slope from near the crest to near the front",
    "slope": "of the mound's front, its lowest step",
    "area": "between the surface and the initial one, a width",
}
_STAGES = 6  # frames at which the draws are read, the last among them
Mounds = Callable[["History", Sequence[int]], Mapping[int, Mound]]


def mound_metrics(case: Case, surface: pd.DataFrame) -> tuple[list[Metric], pd.DataFrame | None]:
    """Compare the mound of the measured with that of the predicted surface.

    Parameters
    ----------
    case : Case
        The model's side.
    surface : DataFrame
        SURFACE_COLUMNS; ``std_mm`` and ``calibration_std_mm`` where they are known.

    Returns
    -------
    metrics : list of Metric
        ``surface_<part>_end``, ``_mean`` and ``_rms`` of crest, face, front, flank, slope and area, over the
        frames in which both sides show that part.
    table : DataFrame or None
        MOUND_COLUMNS of both sides; None without a frame that the model reaches.
    """
    end = float(case.history.force["u_mm"].iloc[-1])
    inside = surface[surface["u_mm"] <= end]
    lines = lines_of(inside)
    if not lines:
        return [], None
    rest, seen = rest_of(lines, case.depth_mm)
    reading = reading_of(inside, rest, case.depth_mm, lean_of(case.scene))
    travel = {frame: u for frame, (u, _) in lines.items()}
    measured = measured_mounds(lines, rest, reading)
    model = predicted_mounds(case.history, travel, reading)
    table = pd.concat(
        [mound_rows("experiment", measured, travel), mound_rows("model", model, travel)], ignore_index=True
    )
    said = "" if seen else "; the initial surface was not seen and is taken as level at the stated depth"
    read: dict[tuple[int, int], Mound] = {}

    def mounds(one: "History", frames: Sequence[int]) -> Mapping[int, Mound]:
        wanted = {k: travel[k] for k in frames if (id(one), k) not in read}
        read.update({(id(one), k): mound for k, mound in predicted_mounds(one, wanted, reading).items()})
        return {k: read[id(one), k] for k in frames if (id(one), k) in read}

    metrics: list[Metric] = []
    for part in _PARTS:
        pairs = [(frame, getattr(measured[frame], part), getattr(one, part)) for frame, one in model.items()]
        pairs = [pair for pair in pairs if np.isfinite(pair[1].value) and np.isfinite(pair[2].value)]
        if pairs:
            note = _WORDS[part].format(threshold=reading.threshold_mm) + said
            metrics += _Part(case, part, pairs, note).metrics(mounds)
    return metrics, table


class _Part:
    """One part of the mound over the frames in which both sides show it."""

    def __init__(
        self, case: Case, part: str, pairs: Sequence[tuple[int, Quantity, Quantity]], note: str
    ) -> None:
        self.case, self.part, self.note = case, part, note
        self.frames = [frame for frame, _, _ in pairs]
        self.experiment: Floats = np.array([measured.value for _, measured, _ in pairs])
        # A terrace at the height of a reading may show in one surface and just not in the other: what such a
        # surface leaves of the reading is asked of both.
        self.own: Floats = np.array([max(measured.std, model.std) for _, measured, model in pairs])
        self.model: Floats = np.array([model.value for _, _, model in pairs])
        self.numerical: Floats = case.scene.model.tolerance * np.abs(self.model)

    def metrics(self, mounds: Mounds) -> list[Metric]:
        """End, mean and rms; the errors of a test's surfaces are taken as the same in all frames."""
        count, unit = len(self.frames), _PARTS[self.part]
        spreads = self._spreads(mounds)
        end = spreads[str(self.frames[-1])]
        where = f"in the last frame that shows it, {self.frames[-1]}"
        found = [
            judge_spread(
                f"surface_{self.part}_end_{unit}",
                (float(self.experiment[-1]), float(self.own[-1])),
                (float(self.model[-1]), float(self.numerical[-1])),
                end,
                f"{self.note}; {where}",
            )
        ]
        if count == 1:
            return found
        over = f"{self.note}; over {count} frames"
        staged = [spread.std for name, spread in spreads.items() if name != "mean"]
        return [
            *found,
            judge_spread(
                f"surface_{self.part}_mean_{unit}",
                (float(self.experiment.mean()), float(self.own.mean())),
                (float(self.model.mean()), float(self.numerical.mean())),
                spreads["mean"],
                over,
            ),
            distance(
                f"surface_{self.part}_rms_{unit}",
                _rms(self.model - self.experiment),
                experiment_std=_rms(self.own),
                numerical_std=_rms(self.numerical),
                input_std=_rms(np.array(staged)),
                dominant_input=spreads["mean"].dominant,
                note=f"{over}{spreads['mean'].remark}",
            ),
        ]

    def _spreads(self, mounds: Mounds) -> dict[str, Spread]:
        """What the inputs leave open at some frames, by the frame's number, and of their mean."""
        count = len(self.frames)
        picked = np.unique(np.linspace(0, count - 1, min(_STAGES, count)).round().astype(np.int64))
        stages = [self.frames[k] for k in picked]

        def values(one: "History") -> Mapping[str, float]:
            found = mounds(one, stages)
            read = {str(k): getattr(found[k], self.part).value for k in stages if k in found}
            known = np.array([value for value in read.values() if np.isfinite(value)])
            # A mean over other frames is another quantity: a draw has it where it shows all of them.
            enough = known.size == len(stages)
            return {**read, "mean": float(known.mean()) if enough else float("nan")}

        return self.case.ensemble.spread(values)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
