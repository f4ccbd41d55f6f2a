"""The chapter of the load cells: how the force came about, and what its uncertainty is made of."""

import numpy as np
import pandas as pd

from ploughval.report.blocks import Cell, Chapter, Drawing, Pen, Table, table_of, value_cell
from ploughval.report.figures import (
    budget_figure,
    by_source,
    cell_calibration_alt,
    cell_calibration_figure,
)
from ploughval.report.text import MISSING, number, with_std
from ploughval.results import LoadCellEntry, Results

_HEADS = {
    "sensitivity_N": "Sensitivity of the force, N per unit",
    "share": "Share of the force's variance",
    "sensitivity_mm": "Sensitivity of the line of action, mm per unit",
    "arm_share": "Share of the variance of the line of action",
    "std": "Standard uncertainty",
}


def load_cells_chapter(results: Results, pen: Pen) -> Chapter | None:
    """Zeros, friction, start of motion, and the uncertainty budget of the force."""
    entry, budget = results.run.loadcells, results.budget
    drawings, tables = list[Drawing](), list[Table]()
    if entry is not None:
        tables.append(_how(entry, results.force_only))
    if budget is not None and not budget.empty:
        if budget[["share", "arm_share"]].notna().any(axis=None):
            drawings.append(_shares(budget, pen))
        tables.append(_budget(budget))
    if results.cell_calibration is not None and results.cell_quality is not None:
        drawings.append(_residuals(results.cell_calibration, results.cell_quality, pen))
        tables += _calibration(results)
    if not tables:
        return None
    return Chapter("budget", "Load cells and the uncertainty of the force", drawings=drawings, tables=tables)


def _how(entry: LoadCellEntry, force_only: bool) -> Table:
    """What was read at rest, taken off, and found in the record itself."""
    smoothed = "no" if entry.bandwidth_Hz is None else f"to {number(entry.bandwidth_Hz, 3)} Hz"
    rows = [
        [Cell("Zero of the upper, lower cell, N m"), Cell(_pairs(entry.zero_Nm, entry.zero_std_Nm))],
        [Cell("Noise of one sample, upper, lower cell, N m"), Cell(_pairs(entry.noise_std_Nm))],
        [Cell("Noise of one sample of the force, N"), value_cell(entry.noise_std_N, 3)],
        [Cell("Drift of the zeros that was taken off, N m"), Cell(_drift(entry))],
        [Cell("Friction that was taken off"), Cell(_friction(entry, force_only))],
        [Cell("Smoothed"), Cell(smoothed)],
        [Cell("Calibration"), Cell(_calibrated(entry))],
        [Cell("Motion starts at, s"), value_cell(entry.motion_starts_s)],
        [
            Cell("Contact with the sand after a travel of, mm"),
            Cell(with_std(entry.contact_u_mm, entry.contact_std_mm), entry.contact_u_mm),
        ],
    ]
    if (mean := entry.mean_load) is not None:
        rows += [
            [
                Cell("Mean force of the travel, one sample of it, N"),
                Cell(with_std(mean.force_N, mean.force_std_N)),
            ],
            [Cell("Line of action at that force, mm"), Cell(with_std(mean.arm_mm, mean.arm_std_mm))],
        ]
    return Table("How the force came about", ("Quantity", "Value"), rows)


def _friction(entry: LoadCellEntry, force_only: bool) -> str:
    """How large, from where, how it was chosen, and from what it was taken off."""
    friction = entry.friction
    if friction is None:
        return "none: no empty-box run was used"
    size = "" if friction.mean_N is None else f"{number(friction.mean_N, 3)} N on average; "
    runs = "1 run" if friction.runs == 1 else f"{friction.runs} runs"
    place = (
        "; off the force alone: the line of action is that of sand and friction together"
        if force_only
        else ""
    )
    return f"{size}{friction.taken_off} ({runs}){place}"


def _calibrated(entry: LoadCellEntry) -> str:
    if entry.condition is None:
        return entry.calibration
    return f"{entry.calibration}; condition number of the loads {number(entry.condition, 3)}"


def _residuals(points: pd.DataFrame, quality: pd.DataFrame, pen: Pen) -> Drawing:
    points = points.assign(used=points["used"] == "True")
    return pen.draw(
        cell_calibration_figure(points, quality),
        cell_calibration_alt(points, quality),
        "Calibration of the cells: known moments less those that the readings give. Triangles point up "
        "while loads were put on, down while they were taken off; dashed: two standard errors; grey: below "
        "the limit of use.",
        name="cell-calibration",
        data=("cell_calibration.csv", "cell_quality.csv"),
    )


def _calibration(results: Results) -> list[Table]:
    """How good the cells are, what was chosen from, and every calibration point."""
    named = (
        (results.cell_quality, "How good the cells are"),
        (results.cell_models, "Models of the calibration; the least AICc is taken"),
        (results.cell_calibration, "Calibration points"),
    )
    return [table_of(table, caption, folded=True) for table, caption in named if table is not None]


def _drift(entry: LoadCellEntry) -> str:
    return _pairs(entry.drift_Nm) if any(entry.drift_Nm) else "none"


def _pairs(values: tuple[float | None, ...], stds: tuple[float | None, ...] = ()) -> str:
    if not values:
        return MISSING
    if not stds:
        return ", ".join(number(value, 3) for value in values)
    return ", ".join(with_std(value, std) for value, std in zip(values, stds, strict=False))


def _shares(budget: pd.DataFrame, pen: Pen) -> Drawing:
    shares = by_source(budget)
    said = (
        " A share is negative where a source offsets another."
        if np.nanmin(shares[["share", "arm_share"]]) < 0
        else ""
    )
    largest = []
    for column, what in (("share", "force"), ("arm_share", "line of action")):
        if shares[column].notna().any():
            row = int(np.nanargmax(shares[column]))
            largest.append(f"{what}: {shares['source'].iloc[row]}, {shares[column].iloc[row]:.0%}")
    return pen.draw(
        budget_figure(budget),
        f"Shares of the variance of force and line of action; largest for the {'; for the '.join(largest)}.",
        "What the standard uncertainty of one sample is made of at the mean load, for the force and for its "
        f"line of action.{said}{_exact(budget)}",
        name="force-budget",
        data=("budget.csv",),
    )


def _exact(budget: pd.DataFrame) -> str:
    """Sources of which no standard uncertainty is stated: they have no share, whatever they are."""
    exact = by_source(budget.assign(share=budget["std"], arm_share=np.nan))
    names = [str(name).replace("_", " ") for name in exact.loc[exact["share"] == 0, "source"]]
    return f" Taken as exact: {', '.join(names)}." if names else ""


def _budget(budget: pd.DataFrame) -> Table:
    head = [_HEADS.get(name, name.replace("_", " ").capitalize()) for name in budget.columns]
    rows = [
        [_budget_cell(name, value) for name, value in zip(budget.columns, row, strict=True)]
        for row in budget.itertuples(index=False, name=None)
    ]
    together = (
        "What the errors of the two cells have in common is split evenly: shares add up to 100 %, and one "
        "of them may be negative."
    )
    return Table("Budget", head, rows, kind="cards", footnotes=(together,))


def _budget_cell(column: str, value: object) -> Cell:
    if column == "source":
        return Cell(str(value).replace("_", " "))
    if column in ("share", "arm_share") and isinstance(value, float) and np.isfinite(value):
        return Cell(f"{100 * value:z.1f} %".replace("-", "−"), value)
    return value_cell(value)
