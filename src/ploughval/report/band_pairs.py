"""Which measured band goes with which predicted one, how far they differ, and how often fresh ones come."""

import math

import pandas as pd

from ploughval.report.blocks import Cell, Drawing, Pen, Table, travel_cell, value_cell
from ploughval.report.figures.band_pairs import band_pairs_figure
from ploughval.report.text import MISSING, with_std
from ploughval.results import Results

_SHOWN = (
    ("u_start_mm", "Start, mm"), ("life_mm", "Life, mm"), ("beta_deg", "β, °"),
    ("outcrop_x_mm", "Outcrop x, mm"), ("ahead_mm", "Outcrop ahead, mm"), ("slip_mm", "Slip, mm"),
)  # fmt: skip
_HEAD = (
    "Measured",
    "Predicted",
    "Starting at u, mm",
    *(f"E ± u_val: {title}" for _, title in _SHOWN),
    "Note",
)


def pair_parts(results: Results, pen: Pen) -> tuple[list[Drawing], list[Table], list[str]]:
    """A figure of the differences, the table of all bands, and a sentence on their frequency."""
    pairs = results.table("band_pairs.csv")
    notes = _frequency(results)
    if pairs is None or pairs.empty:
        return [], [], notes
    matched = pairs.dropna(subset=["band_experiment", "band_model"])
    drawings = []
    if len(matched):
        drawings.append(
            pen.draw(
                band_pairs_figure(pairs),
                f"Differences of {len(matched)} matched bands in start, life, inclination and outcrop, model "
                "minus experiment, with twice their uncertainty.",
                "Matched bands, model minus experiment, with 2 u_val. Diamonds: further off than that. A "
                "life that the record cuts has no point.",
                name="band-pairs",
                data=("band_pairs.csv",),
            )
        )
    rows = [_row(pair) for _, pair in pairs.iterrows()]
    note = (
        "Matched one to one: as many as possible, within 1 d of start and 3 d of outcrop, then with the "
        "least sum of squared differences over their variances."
    )
    table = Table("Measured and predicted bands side by side", _HEAD, rows, kind="cards", footnotes=(note,))
    return drawings, [table], notes


def _row(pair: pd.Series) -> list[Cell]:
    sides = [float(pair[f"band_{side}"]) for side in ("experiment", "model")]
    start = float(pair["u_start_mm_experiment"])
    start = start if math.isfinite(start) else float(pair["u_start_mm_model"])
    cells = [*(value_cell(side) for side in sides), travel_cell(start)]
    for name, _ in _SHOWN:
        error = float(pair[f"{name}_difference"])
        text = with_std(error, float(pair[f"{name}_validation_std"])) if math.isfinite(error) else MISSING
        cells.append(Cell(text, error if math.isfinite(error) else None))
    return [*cells, Cell(_note(pair, sides))]


def _note(pair: pd.Series, sides: list[float]) -> str:
    """What a reader must know of a pair: no partner, ends that were not seen, pieces that were joined."""
    if not all(math.isfinite(side) for side in sides):
        return "measured alone" if math.isfinite(sides[0]) else "predicted alone"
    said = []
    if pair["complete_experiment"] == 0 or pair["complete_model"] == 0:
        said.append("end not seen")
    if pair["joined_experiment"] > 1:
        said.append(f"{int(pair['joined_experiment'])} pieces")
    return ", ".join(said)


def _frequency(results: Results) -> list[str]:
    """What the ratio of frequencies says, or nothing."""
    metric = results.metric("band_frequency_ratio")
    if metric is None or metric.model is None:
        return []
    bounds = metric.note.split("leave open: ")[-1].split(";")[0]
    return [
        f"Fresh bands come {metric.model:.2f} times as often in the model as in the experiment "
        f"(95 %: {bounds}). Few bands leave much open, however well each is known."
    ]
