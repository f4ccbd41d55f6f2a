"""How far measured layers lie from predicted ones: coloured at the stages shown, and over the whole test."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.compare.lines.distances import DISTANCE_COLUMNS
from ploughval.compare.lines.lines import Key, grouped, measured_lines, model_lines
from ploughval.compare.lines.nearest import nearest_on_line
from ploughval.report.blocks import Cell, Drawing, Pen, Table, value_cell
from ploughval.report.figures.differences import ColouredLine, Differences, coarsened, distance_map_figure
from ploughval.report.text import number
from ploughval.results import Results

Floats = NDArray[np.float64]
_TOP = 95.0  # per cent of the credible distances that the colours cover


def read_distances(results: Results) -> pd.DataFrame | None:
    """layer_distances.csv, or None."""
    return results.table("layer_distances.csv")


def differences_at(results: Results, frames: Sequence[int]) -> dict[int, Differences]:
    """Measured layers of some frames with their distances from the predicted ones, on one scale.

    Parameters
    ----------
    results : Results
        With measured and predicted layers.
    frames : sequence of int
        The stages shown.

    Returns
    -------
    dict of int to Differences
        By frame; empty where a side is missing.
    """
    if results.layers is None or results.model_layers is None:
        return {}
    table = read_distances(results)
    deviation: dict[Key, float] = {}
    if table is not None:
        std = table["validation_std_mm"].to_numpy(dtype=np.float64)
        deviation = {key: float(std[rows[0]]) for key, rows in grouped(table).items()}
    shown = results.layers[results.layers["frame"].isin(frames)]
    model = model_lines(results.model_layers[results.model_layers["frame"].isin(frames)])
    found: dict[int, list[ColouredLine]] = {}
    for line in measured_lines(shown):
        if line.key in model:
            coloured = _coloured(
                coarsened(line.whole_mm), model[line.key], deviation.get(line.key, float("nan"))
            )
            found.setdefault(line.key[0], []).append(coloured)
    sizes = [np.abs(one.distance_mm[one.credible]) for lines in found.values() for one in lines]
    sizes = [size for size in sizes if size.size]
    known = [value for value in deviation.values() if np.isfinite(value)]
    top = float(np.percentile(np.concatenate(sizes), _TOP)) if sizes else 2.0 * max(known, default=0.5)
    return {frame: Differences(lines, _round_up(top)) for frame, lines in found.items()}


def _coloured(points: Floats, model: Floats, deviation: float) -> ColouredLine:
    """A line's points with their distances; without a known uncertainty every distance counts."""
    distance = np.full(len(points), np.nan)
    there = np.isfinite(points).all(axis=1)
    nearest = nearest_on_line(points[there], model)
    distance[there] = np.where(nearest.beyond, np.nan, nearest.distance_mm)
    least = 2.0 * deviation if np.isfinite(deviation) else 0.0
    return ColouredLine(points, distance, np.nan_to_num(np.abs(distance)) > least)


def _round_up(value: float) -> float:
    """The next of a few numbers times a power of ten whose halves are short.

    >>> _round_up(0.031), _round_up(2.7), _round_up(7.0)
    (0.04, 3.0, 8.0)
    """
    power = 10.0 ** np.floor(np.log10(max(value, 1e-6)))
    return float(
        round(
            next(step for step in (1, 1.5, 2, 3, 4, 6, 8, 10) if value <= step * power * (1 + 1e-9)) * power,
            9,
        )
    )


_HEAD = (
    "Layer, mm", "Frames", "Mean (above +), mm", "Rms, mm", "95 %, mm", "2 u of a point, mm",
    "Within 2 u, %", "Beside the face, rms, mm", "Extra, mm a frame", "Missing, mm a frame",
)  # fmt: skip


def distance_parts(results: Results, pen: Pen) -> tuple[list[Drawing], list[Table]]:
    """The map of distances over layers and travel, and a table of the layers; nothing without distances."""
    table = read_distances(results)
    if table is None or not table["rms_mm"].notna().any():
        return [], []
    known = table[table["rms_mm"].notna()]
    worst = known.iloc[int(known["rms_mm"].to_numpy().argmax())]
    words = (
        f"Largest: {number(float(worst['rms_mm']), 3)} mm in layer {worst['layer']:g} at "
        f"u = {worst['u_mm']:.1f} mm."
    )
    drawing = pen.draw(
        distance_map_figure(known),
        f"Rms distance between measured and predicted layers by layer and travel. {words}",
        f"Rms normal distance of measured from predicted layers. {words} Crosses: more than twice the "
        "uncertainty of a point.",
        name="layer-distances",
        data=("layer_distances.csv",),
    )
    rows = [_layer_row(float(str(height)), part) for height, part in known.groupby("layer", sort=True)]
    note = (
        "Extra: measured line past the predicted torn ends. Missing: predicted line on which no measured "
        "point falls; sand whose points were lost counts."
    )
    caption = "Distances by layer, measured from predicted"
    return [drawing], [Table(caption, _HEAD, rows, kind="cards", footnotes=(note,))]


def _layer_row(height: float, part: pd.DataFrame) -> list[Cell]:
    column = {name: part[name].to_numpy(dtype=np.float64) for name in DISTANCE_COLUMNS if name != "source"}
    count, face = column["points"], column["face_points"]
    values = (
        height,
        float(len(part)),
        _pooled(column["mean_mm"], count),
        float(np.sqrt(_pooled(column["rms_mm"] ** 2, count))),
        _pooled(column["p95_mm"], count),
        2.0 * float(np.sqrt(_pooled(column["validation_std_mm"] ** 2, count))),
        100.0 * _pooled(column["within"], count),
        float(np.sqrt(_pooled(column["face_rms_mm"] ** 2, face))),
        float(column["extra_mm"].mean()),
        float(column["missing_mm"].mean()),
    )
    return [value_cell(value, 3) for value in values]


def _pooled(values: Floats, weights: Floats) -> float:
    """Weighted mean of the known values; NaN without any."""
    good = np.isfinite(values) & (weights > 0)
    return float(np.average(values[good], weights=weights[good])) if good.any() else float("nan")
