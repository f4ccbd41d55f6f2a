"""Chapter of the comparison: compare.csv, alignment.csv."""

import math
from pathlib import Path

import pandas as pd

from ploughval.report.blocks import Table, value_cell
from ploughval.scene import Compare
from speed_error.points import Panel, Point, Subject, read
from speed_error.words import against, shown

DEFAULT = Compare().draws
OURS, TAIL, PLAIN = "draws: rms", "draws: 95 %", "plain random draws (theory)"


def subject(folder: Path) -> Subject | None:
    """The chapter, or None where compare.csv is missing."""
    table, alignment = read(folder, "compare.csv"), read(folder, "alignment.csv")
    if table is None:
        return None
    panel = _panel(table)
    tables = [
        _table(table, "Draws of the inputs", ["Draws", "Rms error, %", "95 %, %", "CPU, s", "Clock, s"])
    ]
    if alignment is not None:
        head = [
            "Case",
            "In height",
            "As it is",
            "At landmarks",
            "Warped, 0.1 d",
            "Warped, 0.25 d",
            "Warped, 0.5 d",
        ]
        tables.append(_table(alignment, "Rms difference left by alignment of known errors, in P₀", head))
    return Subject(
        "comparison",
        "Comparison",
        "What the stated uncertainties of the soil and the blade leave of a prediction is found by "
        "running the model with drawn inputs. The error is that of the standard uncertainty of eight "
        "metrics of a force history of 90 mm, against 2 048 draws, over twelve seeds; the time that of a "
        "whole comparison of the force.",
        (panel,),
        _choice(table, panel, alignment),
        tuple(tables),
        tuple(name for name in ("compare.csv", "alignment.csv") if (folder / name).is_file()),
    )


def _panel(table: pd.DataFrame) -> Panel:
    points = []
    for family, column in ((OURS, "rms_error_percent"), (TAIL, "p95_error_percent")):
        for row in table.itertuples():
            default = family == OURS and row.draws == DEFAULT
            points.append(
                Point(
                    family,
                    f"{row.draws}",
                    float(row.force_comparison_s),
                    float(getattr(row, column)),
                    default,
                )
            )
    for row in table.itertuples():
        # standard error of a standard deviation of n normal numbers: its share is 1 / sqrt(2 (n - 1))
        share = 100.0 / math.sqrt(2.0 * (row.draws - 1))
        points.append(Point(PLAIN, "", float(row.force_comparison_s), share))
    return Panel(
        "draws",
        "Input uncertainty against the number of draws",
        "error of a standard uncertainty, %",
        "CPU, s a comparison",
        tuple(points),
        default=f"{DEFAULT} draws",
        apart=frozenset({TAIL, PLAIN}),
    )


def _choice(table: pd.DataFrame, panel: Panel, alignment: pd.DataFrame | None) -> tuple[str, ...]:
    mine, ours = panel.standard, panel.of(OURS)
    tail = panel.of(TAIL)[mine.setting]
    plain = 100.0 / math.sqrt(2.0 * (DEFAULT - 1))
    said = [
        f"The default of {mine.setting} draws knows a standard uncertainty to {shown(mine.error)} % (95 % "
        f"of them to {shown(tail.error)} %) in {shown(mine.time)} s; plain random draws would know it to "
        f"{shown(plain)} %."
    ]
    least, most = min(ours, key=int), max(ours, key=int)
    if int(least) < DEFAULT:
        said.append(
            f"For a look: taking {least} draws in place of {mine.setting} {against(ours[least], mine)}."
        )
    if int(most) > DEFAULT:
        said.append(
            f"Where a verdict hangs on the uncertainty, or it is to be printed to two digits: taking {most} "
            f"draws {against(ours[most], mine)}."
        )
    if alignment is not None:
        noise = alignment.set_index("case").loc["noise of 0.05 P0"]
        warped = float(noise["warped_0.1_d"])
        sense = (
            "takes noise for agreement" if warped < 0.97 * float(noise["in_height"]) else "leaves noise alone"
        )
        said.append(
            f"Alignment at landmarks leaves {shown(float(noise['landmarks']))} of "
            f"{shown(float(noise['in_height']))} P₀ of pure noise; time warping within 0.1 d leaves "
            f"{shown(warped)}, so it {sense}."
        )
    return tuple(said)


def _table(table: pd.DataFrame, caption: str, head: list[str]) -> Table:
    rows = [[value_cell(value, 4) for value in row] for row in table.itertuples(index=False, name=None)]
    return Table(caption, head[: len(table.columns)], rows)
