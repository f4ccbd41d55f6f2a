"""Chapter of the forces: force-settings.csv, force.csv."""

from pathlib import Path

import pandas as pd

from ploughval.report.blocks import Table, value_cell
from speed_error.points import ERROR, Level, Panel, Subject, family_points, read
from speed_error.words import against, best, shown

TIME_LABEL = "CPU, ms a record of 50 s"
BANDWIDTH, RUNS, RATE, COMPENSATION = "bandwidth, Hz", "empty runs", "rows a second", "friction taken off"
DEFAULT_WORDS = "no smoothing, friction taken off per cell, three empty runs"


def subject(folder: Path) -> Subject | None:
    """The chapter, or None where force-settings.csv is missing."""
    table = read(folder, "force-settings.csv")
    if table is None:
        return None
    panels = (
        _panel(table, True, "force_rms_percent"),
        _panel(table, True, "arm_rms_mm"),
        _panel(table, False, "force_rms_percent"),
        _panel(table, False, "arm_rms_mm"),
    )
    cases = read(folder, "force.csv")
    tables = [_table(table, "Every setting", _HEAD)]
    if cases is not None:
        tables.append(_table(cases.iloc[:, :11], "What limits the force, case by case", _CASE_HEAD))
    return Subject(
        "forces",
        "Forces",
        "Made records of rigs whose zeros, friction, gains and lengths are drawn from their stated "
        "uncertainties: a saw-tooth of 11 to 20 N over 40 mm at 1 mm/s, line of action 10 mm above the "
        "tip, cells 150 mm apart. The bounds are what noise and the scatter of friction leave when all "
        "else is known. The ring marks what is done when nothing is set; of rows a second and empty runs, "
        "which the laboratory chooses, the base of the study.",
        panels,
        _choice(table, panels),
        tuple(tables),
        tuple(name for name in ("force-settings.csv", "force.csv") if (folder / name).is_file()),
    )


def _panel(table: pd.DataFrame, noisy: bool, column: str) -> Panel:
    """Force or line of action, of records with noise or of those with friction."""
    rows = table[(table["family"] == BANDWIDTH) == noisy]
    force = column == "force_rms_percent"
    base = rows[rows["default"]].iloc[0]
    unit, aim = ("%", 1.0) if force else ("mm", 1.0)
    levels = [Level(ERROR, aim, f"{aim:g} {unit}: to reach in a whole test", "mark")]
    bound = float(base["bound_percent"])
    if force and bound == bound:
        name = "bound, not smoothed" if noisy else "bound, 3 empty runs"
        levels.append(Level(ERROR, bound, name, "bound"))
    what = "Force" if force else "Line of action"
    case = "noise of 0.4 % of the moments, 100 Hz" if noisy else "friction scatters by 5 %"
    return Panel(
        f"{'noise' if noisy else 'friction'}-{'force' if force else 'arm'}",
        f"{what}: {case}",
        f"rms error, {unit}",
        TIME_LABEL,
        family_points(rows, "cpu_ms", column),
        (),
        tuple(levels),
        DEFAULT_WORDS,
    )


def _choice(table: pd.DataFrame, panels: tuple[Panel, ...]) -> tuple[str, ...]:
    smoothing, arm, friction, friction_arm = panels
    bands, mine = smoothing.of(BANDWIDTH), smoothing.standard
    least = best(bands)
    said = [
        f"Without smoothing the force of a noisy record is off by {shown(mine.error)} % of its mean, of one "
        f"whose friction scatters by {shown(friction.standard.error)} %; a record takes "
        f"{shown(friction.standard.time)} to {shown(mine.time)} ms of CPU."
    ]
    if least.setting == mine.setting:
        said.append("Smoothing to a bandwidth gains nothing for this noise.")
    else:
        there = arm.of(BANDWIDTH)[least.setting]
        said.append(
            f"Noisy cells logged fast: a bandwidth of {least.setting} Hz leaves least ({shown(least.error)} "
            f"%, line of action {shown(there.error)} mm in place of "
            f"{shown(arm.of(BANDWIDTH)['none'].error)} mm)."
        )
        low = [p for p in bands.values() if p.setting != "none" and float(p.setting) < float(least.setting)]
        if low:
            worst = max(low, key=lambda p: p.error)
            said.append(
                f"Below it the drops of the force are rounded: {worst.setting} Hz leaves "
                f"{shown(worst.error)} %. Where no drop is to be read, the line of action gains from "
                f"{min(low, key=lambda p: arm.of(BANDWIDTH)[p.setting].error).setting} Hz."
            )
    return (*said, *_runs(table, friction), *_rest(friction, friction_arm))


def _runs(table: pd.DataFrame, friction: Panel) -> list[str]:
    runs = friction.of(RUNS)
    three, most = runs["3"], runs[max(runs, key=int)]
    held = table[table["family"] == RUNS].set_index("setting")["force_coverage_95_percent"]
    said = [f"Making {most.setting} empty runs in place of 3 {against(most, three)}."]
    poor = [name for name in held.index if float(held[name]) < 80.0]
    if poor:
        told = " and ".join(f"{name} (the 95 % intervals hold {shown(float(held[name]))} %)" for name in poor)
        said.append(f"How friction scatters is not told by {told} alone: make at least two empty runs.")
    return said


def _rest(friction: Panel, arm: Panel) -> list[str]:
    rates = friction.of(RATE)
    said = []
    if len(rates) > 1:
        slow, fast = rates[min(rates, key=float)], rates[max(rates, key=float)]
        said.append(
            f"Logging {fast.setting} rows a second in place of {slow.setting} {against(fast, slow)}"
            + ("; what friction leaves is not averaged away." if fast.error > 0.9 * slow.error else ".")
        )
    ways = arm.of(COMPENSATION)
    if {"per cell", "force only"} <= set(ways):
        one, other = ways["force only"], ways["per cell"]
        said.append(
            f"Friction taken off the force alone leaves {shown(one.error)} mm of the line of action, off "
            f"each cell {shown(other.error)} mm."
        )
    return said


_HEAD = [
    "Family", "Setting", "Default", "Rows", "Rigs", "Force, % of mean", "Bound, %", "Line of action, mm",
    "95 % intervals hold, %", "CPU, ms", "Clock, ms",
]  # fmt: skip
_CASE_HEAD = [
    "Case", "Rows", "Rigs", "Force, % of mean", "Bound, %", "Line of action, mm", "Bound, mm",
    "Force: 95 % hold, %", "Line: 95 % hold, %", "Std of that, %", "Clock, s",
]  # fmt: skip


def _table(table: pd.DataFrame, caption: str, head: list[str]) -> Table:
    rows = [[value_cell(value, 3) for value in row] for row in table.itertuples(index=False, name=None)]
    return Table(caption, head, rows, folded=True)
