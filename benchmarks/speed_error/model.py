"""Chapter of the model: model-settings.csv, model.csv, model-figures.csv."""

from pathlib import Path

import pandas as pd

from model_study.costs import OTHER_METHODS_S
from ploughval.report.blocks import Table, value_cell
from ploughval.scene import ModelTable
from speed_error.points import ERROR, TIME, Level, Panel, Subject, family_points, read
from speed_error.words import against, dominance, shown

TIME_LABEL = "CPU, ms for a travel of 3 d"
QUANTITIES = (
    ("switch", "switch_error_pct", "Place of the first switch", "error, %", 0.2),
    ("force", "force_rms_pct", "Force away from the switch", "error, rms, %", 0.1),
)
DEFAULT_WORDS = f"tolerance {ModelTable().tolerance:g}"
LABORATORY_PCT = 1.0  # of a measured force, at best
SMALL = ": far below what a laboratory's force is known to."
NODES, ADDED, MARCH = "search over nodes, d apart", "nodes added, d apart", "increment, d"


def subject(folder: Path) -> Subject | None:
    """The chapter, or None where model-settings.csv is missing."""
    table = read(folder, "model-settings.csv")
    if table is None:
        return None
    panels = tuple(_panel(table, *quantity) for quantity in QUANTITIES)
    figures, sands = read(folder, "model-figures.csv"), read(folder, "model.csv")
    tables = [_table(table, "Every setting, sand of 50/32 degrees", _HEAD, folded=True)]
    if figures is not None:
        tables.append(_table(figures, "Figures to reach", ["What", "Measured", "At most", ""]))
    if sands is not None:
        tables.append(_table(sands, "Five sands by tolerance", _SANDS_HEAD, folded=True))
    files = ("model-settings.csv", "model.csv", "model-figures.csv")
    return Subject(
        "model",
        "Model",
        "Errors against the limit of vanishing increments (tolerance 10⁻⁵). A tolerance is simulate(): "
        "two marches, surfaces and stated error; an increment is one march, as scans use it. The search "
        "over nodes is the paper's: bands to nodes alone, fixed increments. Dashed lines are the times of "
        "other methods for u = 50 mm at d = 30 mm, measured once on one core of such a machine; what "
        "error they have here is not known.",
        panels,
        _choice(panels),
        tuple(tables),
        tuple(name for name in files if (folder / name).is_file()),
    )


def _panel(table: pd.DataFrame, key: str, column: str, title: str, label: str, target: float) -> Panel:
    points = family_points(table, "cpu_ms", column)
    levels = [Level(ERROR, target, f"to reach: {target:g} %"), Level(TIME, 2.0, "to reach: 2 ms")]
    levels += [Level(TIME, 1e3 * seconds, name, "mark") for name, seconds in OTHER_METHODS_S.items()]
    seen = False
    marked = []
    for point in points:  # one ring: the default tolerance
        mine = point.default and point.family == "tolerance" and not seen
        seen = seen or mine
        marked.append(type(point)(point.family, point.setting, point.time, point.error, mine))
    return Panel(
        key, title, label, TIME_LABEL, tuple(marked), (), tuple(levels), DEFAULT_WORDS, frozenset({MARCH})
    )


def _choice(panels: tuple[Panel, ...]) -> tuple[str, ...]:
    switch, force = panels
    mine = switch.standard
    said = [
        f"The default ({DEFAULT_WORDS}) places the first switch to {shown(mine.error)} % and the force to "
        f"{shown(force.standard.error)} % in {shown(mine.time)} ms"
        + (SMALL if max(mine.error, force.standard.error) < LABORATORY_PCT / 5 else "."),
        dominance(switch, "Place of the switch"),
    ]
    coarse = switch.of("tolerance").get("0.01")
    march, fine = switch.of(MARCH), switch.of("tolerance").get("0.0001")
    if coarse is not None:
        said.append(f"Scans of many soils: a tolerance of 0.01 {against(coarse, mine)}.")
    if "0.005" in march:
        said.append(
            f"Force alone: force_history() at the same increment {against(march['0.005'], mine)}; what is "
            "left out are surfaces, layers and the stated error."
        )
    if fine is not None:
        said.append(f"Reference solutions: a tolerance of 0.0001 {against(fine, mine)}.")
    return (*said, *_nodes(switch))


def _nodes(switch: Panel) -> list[str]:
    mine, said = switch.standard, []
    added = switch.of(ADDED)
    if added:
        finest = added[min(added, key=float)]
        said.append(
            f"More nodes in the initial surface are of no use: {finest.setting} d apart "
            f"{against(finest, mine)}."
            if finest.error > 0.97 * mine.error
            else f"Nodes {finest.setting} d apart in the initial surface {against(finest, mine)}."
        )
    plain = switch.of(NODES)
    if plain:
        least = min(plain.values(), key=lambda point: point.error)
        said.append(
            f"The search over nodes comes to {shown(least.error)} % at best, in {shown(least.time)} ms "
            f"({shown(least.error / mine.error)} times the error of the default, "
            f"{shown(least.time / mine.time)} times its time): a switch is seen only at the end of an "
            "increment."
        )
    return said


_HEAD = ["Family", "Setting", "Default", "Switch, %", "Peak, %", "Force, rms, %", "CPU, ms", "Clock, ms"]
_SANDS_HEAD = [
    "Sand", "Tolerance", "Increment, d", "Increments", "force_history(), ms", "simulate(), ms", "Switches",
    "Switch, %", "Peak, %", "Force, rms, %", "Stated, %",
]  # fmt: skip


def _table(table: pd.DataFrame, caption: str, head: list[str], *, folded: bool = False) -> Table:
    rows = [
        [value_cell("" if isinstance(v, float) and v != v else v, 3) for v in row]
        for row in table.itertuples(index=False, name=None)
    ]
    return Table(caption, head, rows, folded=folded)
