"""Chapter of the fit of soil parameters: fit-settings.csv, fit.csv."""

import math
from pathlib import Path

import pandas as pd

from ploughval.report.blocks import Table, value_cell
from speed_error.points import ERROR, TIME, Level, Panel, Subject, family_points, read
from speed_error.words import against, dominance, shown

TIME_LABEL = "CPU, s a fit"
DEFAULT_WORDS = (
    "a record of 300 rows, 6 local searches from a cover of 2 048 samples, model off by 3 % and 1 %"
)
ROWS, STARTS, COVER, ALLOWED, OBJECTIVE = (
    "rows of the record", "local searches", "samples of the cover", "model allowed to be off",
    "objective, simplex",
)  # fmt: skip


def subject(folder: Path) -> Subject | None:
    """The chapter, or None where fit-settings.csv is missing."""
    table = read(folder, "fit-settings.csv")
    if table is None:
        return None
    panels = (
        _panel(table, "angles", "angles_deg", "Peak and residual friction angle", "error, rms, degrees"),
        _panel(table, "length", "length_pct", "Mobilization length", "error, rms, %"),
    )
    cases = read(folder, "fit.csv")
    tables = [_table(table, "Every setting", _HEAD, folded=True)]
    if cases is not None:
        tables.append(_table(cases, "Single records that the model describes", _CASE_HEAD, folded=True))
    records = int(table["seeds"].iloc[0])
    spread = 100.0 / math.sqrt(2.0 * records)  # of a root mean square of so many normal errors
    return Subject(
        "fit",
        "Fit of soil parameters",
        f"Errors are root mean squares over {records} made records that the model does not quite describe: "
        "teeth stretched by 3 %, force bent by 1 %, offset of 2 %, gain of 1 %, noise of 1 %; three "
        f"parameters, intervals included. Errors of so few records are known to {spread:.0f} % of "
        "themselves, ratios between settings of the same records better. Objectives are compared by a "
        "plain simplex search without intervals; 'registered' is the one that the fit makes least.",
        panels,
        _choice(table, panels),
        tuple(tables),
        tuple(name for name in ("fit-settings.csv", "fit.csv") if (folder / name).is_file()),
    )


def _panel(table: pd.DataFrame, key: str, column: str, title: str, label: str) -> Panel:
    points = family_points(table, "cpu_s", column)
    marked = tuple(
        type(p)(p.family, p.setting, p.time, p.error, p.default and p.family != OBJECTIVE) for p in points
    )
    levels = [Level(TIME, 20.0, "to reach: 20 s")]
    if column == "angles_deg":
        stated = float(table.loc[table["default"], "stated_deg"].dropna().iloc[0])
        levels.append(Level(ERROR, stated, "stated standard uncertainty", "bound"))
    return Panel(
        key, title, label, TIME_LABEL, marked, (), tuple(levels), DEFAULT_WORDS, frozenset({OBJECTIVE})
    )


def _choice(table: pd.DataFrame, panels: tuple[Panel, ...]) -> tuple[str, ...]:
    angles, length = panels
    mine = angles.standard
    held = table[table["default"] & (table["family"] == ROWS)]["hold_pct"].iloc[0]
    said = [
        f"The default ({DEFAULT_WORDS}) finds the angles to {shown(mine.error)} degrees and the length to "
        f"{shown(length.standard.error)} % in {shown(mine.time)} s; {shown(float(held))} % of the 95 % "
        "intervals hold the truth.",
        dominance(angles, "Angles"),
        *_rows(angles, length),
    ]
    one = angles.of(STARTS).get("1")
    if one is not None:
        said.append(
            f"One local search in place of {mine_of(angles, STARTS)} {against(one, mine)} on these records."
        )
    small = angles.of(COVER).get("64")
    if small is not None:
        said.append(f"A cover of 64 samples in place of {mine_of(angles, COVER)} {against(small, mine)}.")
    none = angles.of(ALLOWED).get("no")
    if none is not None:
        hold = table[(table["family"] == ALLOWED) & (table["setting"] == "no")]["hold_pct"].iloc[0]
        said.append(
            f"Taking the model for right {against(none, mine)}; {shown(float(hold))} % of the 95 % "
            "intervals hold."
        )
    return (*said, *_objectives(angles))


def mine_of(panel: Panel, family: str) -> str:
    """The default's setting in a family."""
    return next(p.setting for p in panel.points if p.family == family and p.default)


def _rows(angles: Panel, length: Panel) -> list[str]:
    said = []
    few, many = angles.of(ROWS).get("100"), angles.of(ROWS).get("1000")
    if few is not None:
        short = length.of(ROWS)["100"].error / length.standard.error
        said.append(
            f"A record thinned to 100 rows {against(few, angles.standard)}; the error of the length is "
            f"{shown(short)} times as large."
        )
    if many is not None:
        said.append(f"Keeping 1 000 rows in place of 300 {_of(against(many, angles.standard))}.")
    return said


def _of(words: str) -> str:
    return words.replace("the error", "the error of the angles")


def _objectives(angles: Panel) -> list[str]:
    found = angles.of(OBJECTIVE)
    if "registered" not in found or "squares" not in found:
        return []
    ours, plain = found["registered"], found["squares"]
    least = min(found.values(), key=lambda p: p.error)
    return [
        f"Objectives, by the same simplex search: registering the rows {against(ours, plain)} against plain "
        f"squares; least has {least.setting} ({shown(least.error)} degrees), most "
        f"{max(found.values(), key=lambda p: p.error).setting}."
    ]


_HEAD = [
    "Family", "Setting", "Default", "Records", "Angles, °", "Length, %", "Stated, °", "95 % intervals "
    "hold, %",
    "CPU, s", "Clock, s",
]  # fmt: skip
_CASE_HEAD = [
    "Case", "Rows", "Parameter", "True", "Found", "From (95 %)", "To (95 %)", "Holds", "CPU, s", "Clock, s",
    "20 s of CPU",
]  # fmt: skip


def _table(table: pd.DataFrame, caption: str, head: list[str], *, folded: bool = False) -> Table:
    rows = [[value_cell(value, 3) for value in row] for row in table.itertuples(index=False, name=None)]
    return Table(caption, head, rows, folded=folded)
