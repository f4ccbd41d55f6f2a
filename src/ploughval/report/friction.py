"""The chapter on the friction that the bands mobilise."""

import math

import numpy as np
import pandas as pd

from ploughval.compare.mobilised.inversion import slopes
from ploughval.compare.mobilised.sources import SOURCES
from ploughval.compare.softening.table import ALL
from ploughval.report.blocks import Cell, Chapter, Pen, Table, pair_cell, table_of, value_cell
from ploughval.report.figures import SofteningLine, mobilised_figure
from ploughval.report.text import number
from ploughval.results import Results

_WORDS = {
    "fresh": "noise of the force, and the way between photographs",
    "photographs": "level of the surface in each photograph",
    "force_zero": "zeros and friction of the force",
    "force_gain": "calibration of the force",
    "unit_weight": "unit weight",
    "depth": "level of the tip",
    "wall_friction": "friction on the blade",
    "scale": "scale of the photographs",
    "surface": "level of the surface",
    "outcrop_height": "height of the surface at the outcrop",
    "outcrop": "place of the outcrop",
}


def friction_chapter(results: Results, pen: Pen) -> Chapter | None:
    """Friction mobilised in the photographs and between them, and what is read from it.

    Parameters
    ----------
    results : Results
        Of one test; mobilised_curve.csv and softening.csv are read where they are there.
    pen : Pen
        Draws the figure.
    """
    mobilised = results.mobilised
    if mobilised is None or not mobilised["phi_deg"].notna().any():
        return None
    curve = results.table("mobilised_curve.csv")
    softening = results.table("softening.csv")
    low, high = float(mobilised["phi_deg"].min()), float(mobilised["phi_deg"].max())
    names = ("peak_friction_deg", "residual_friction_deg", "mobilization_length_mm")
    assumed = SofteningLine(*(_number(results.setting("soil", name)) for name in names))
    read = None
    if softening is not None and len(softening):
        last = softening.iloc[-1]
        read = SofteningLine(*(float(last[name]) for name in ("peak_deg", "residual_deg", "length_mm")))
    drawing = pen.draw(
        mobilised_figure(mobilised, curve, read=read, assumed=assumed),
        f"Mobilised friction against slip on the band, in the photographs from {number(low, 3)} to "
        f"{number(high, 3)} degrees. {_read_words(read)}",
        "The friction that the measured force, surface and band need for equilibrium, without running "
        "the model. Marks: at the photographs; lines: at every step of the force, with 95 % limits.",
        name="mobilised-friction",
        data=("mobilised.csv", "mobilised_curve.csv", "softening.csv"),
    )
    tables = [] if softening is None else [_softening_table(softening)]
    notes: tuple[str, ...] = ()
    if curve is not None and len(curve):
        tables.append(_budget(curve))
        inclines = (("soil", "wall_friction_deg"), ("blade", "inclination_deg"))
        notes = _notes(curve, sum(_number(results.setting(*keys) or 0.0) for keys in inclines))
    tables.append(table_of(mobilised, "Mobilised friction, every photograph", folded=True))
    return Chapter("friction", "Mobilised friction", drawings=[drawing], tables=tables, notes=notes)


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else math.nan


def _read_words(read: SofteningLine | None) -> str:
    if read is None or not read.known:
        return "Peak, residual and length are not all determined."
    return (
        f"It falls from {number(read.peak_deg, 3)} to {number(read.residual_deg, 3)} degrees over "
        f"{number(read.length_mm, 3)} mm."
    )


def _softening_table(softening: pd.DataFrame) -> Table:
    """Peak, residual and length by band with their 95 % limits."""
    rows = []
    for _, row in softening.iterrows():
        cells = [Cell("all bands together" if row["band"] == ALL else f"band {row['band']}")]
        for quantity, unit in (("peak", "deg"), ("residual", "deg"), ("length", "mm")):
            cells.append(pair_cell(float(row[f"{quantity}_{unit}"]), float(row[f"{quantity}_std_{unit}"])))
            limits = [float(row[f"{quantity}_{side}_{unit}"]) for side in ("low", "high")]
            cells.append(Cell(_limits(*limits)))
        said = [row["note"]] if row["note"] else []
        if row["law"] != "linear":
            said.append("an exponential fall describes the curve better")
        rows.append([*cells, Cell("; ".join(said))])
    head = (
        "Band", "Peak ± std, °", "95 %", "Residual ± std, °", "95 %", "Mobilization length ± std, mm", "95 %",
        "Note",
    )  # fmt: skip
    notes = (
        "The straight line from peak to residual is fitted to each curve; the limits hold what all rows "
        "share. A band in fresh sand starts at the peak; before that the old band is at its residual.",
    )
    return Table("Softening read from the curves", head, rows, kind="cards", footnotes=notes)


def _limits(low: float, high: float) -> str:
    if not (math.isfinite(low) or math.isfinite(high)):
        return ""
    if not math.isfinite(low):
        return f"at most {number(high, 4)}"
    return (
        f"at least {number(low, 4)}" if not math.isfinite(high) else f"{number(low, 4)} to {number(high, 4)}"
    )


def _notes(curve: pd.DataFrame, incline_deg: float) -> tuple[str, ...]:
    """What was taken as exact, and what friction on the blade would change."""
    exact = [_WORDS[name] for name in SOURCES if not curve[f"{name}_deg"].abs().max() > 0]
    said = [f"Taken as exact, no standard uncertainty being stated: {', '.join(exact)}."] if exact else []
    F = curve["force_N"].to_numpy(float) * math.cos(math.radians(incline_deg))
    by_wall = slopes(F, curve["weight_N"].to_numpy(float), incline_deg).wall
    low, high = (number(float(np.nanpercentile(-by_wall, share)), 2) for share in (5, 95))
    said.append(f"A degree more of friction on the blade would lower the curve by {low} to {high} degrees.")
    return tuple(said)


def _budget(curve: pd.DataFrame) -> Table:
    """What the friction is uncertain by, the median over rows, while a band softens and after."""
    slip = curve["slip_mm"].to_numpy(float)
    early, late = curve[(slip >= 0) & (slip <= 1.0)], curve[slip > 1.0]
    rows = []
    for name in ("fresh", "photographs", *SOURCES):
        values = [float(part[f"{name}_deg"].abs().median()) for part in (early, late)]
        if np.nanmax([*values, 0.0]) > 0:
            rows.append([Cell(_WORDS[name]), *(value_cell(value, 2) for value in values)])
    rows.sort(key=lambda cells: -(cells[2].value or cells[1].value or 0.0))
    totals = [value_cell(float(part["phi_std_deg"].median()), 2) for part in (early, late)]
    rows.append([Cell("all of them"), *totals])
    head = ("Source", "Slip up to 1 mm, °", "Slip beyond, °")
    return Table("Standard uncertainty of the friction by source, median over rows", head, rows, kind="cards")
