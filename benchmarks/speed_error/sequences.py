"""Chapter of tracked sequences: sequences.csv, and whole commands by setting where they were measured."""

from pathlib import Path

import pandas as pd

from ploughval.report.blocks import Table, value_cell
from speed_error.points import ERROR, Level, Panel, Point, Subject, read
from speed_error.words import BUSY, against, dominance, quiet, shown

TIME_LABEL = "CPU, s for the whole travel"
QUANTITIES = (
    ("tracks", "p95_px", "Points that moved: 95 % of the errors are below", "error, px", 0.25),
    ("lost", "not_tracked_pct", "Moved sand that is not tracked", "share, %", None),
)
DEFAULT_WORDS = "31 px, 15 px apart, affine, quintic, every photograph, reference renewed where needed"
APART = frozenset({"spacing", "photographs"})  # fewer points, fewer photographs: less is told
REFERENCE, FIRST, LAST = "reference", "always the first", "always the last"


def subject(folder: Path) -> Subject | None:
    """The chapter, or None where sequences.csv is missing."""
    table = read(folder, "sequences.csv")
    if table is None:
        return None
    panels = tuple(_panel(table, *quantity) for quantity in QUANTITIES)
    tables = [_table(table, "Every setting", _HEAD, folded=True)]
    whole = read(folder.parent / "sequences", "settings.csv")
    if whole is not None:
        tables.append(
            _table(whole, "The whole command on 24 photographs, two workers", _WHOLE_HEAD, folded=True)
        )
    return Subject(
        "sequences",
        "Tracked sequences",
        "A made test of 25 photographs of 724 x 287 px, 0.25 mm a pixel, a travel of 55 mm. Errors are "
        "distances from the exact place of the same sand in all photographs, of points that had moved by "
        "more than a pixel. Not tracked is moved sand that still stands and whose point was given up or "
        "refused. Only the tracking is timed, in one thread.",
        panels,
        _choice(table, panels),
        tuple(tables),
        ("sequences.csv",),
    )


def _panel(table: pd.DataFrame, key: str, column: str, title: str, label: str, target: float | None) -> Panel:
    points = []
    for row in table[table["family"] != "threads"].itertuples():
        seconds = 1e-3 * float(row.cpu_ms) * float(row.photographs)
        points.append(Point(row.family, _short(row), seconds, float(getattr(row, column)), bool(row.default)))
    levels = () if target is None else (Level(ERROR, target, f"to reach: {target:g} px"),)
    return Panel(key, title, label, TIME_LABEL, tuple(points), (), levels, DEFAULT_WORDS, APART)


def _short(row: object) -> str:
    """A setting as it stands beside its point."""
    name = str(row.setting)  # type: ignore[attr-defined]
    family = str(row.family)  # type: ignore[attr-defined]
    if family == "photographs":
        return (
            "every one" if name == "1" else {"2": "every 2nd", "3": "every 3rd"}.get(name, f"every {name}th")
        )
    return name


def _choice(table: pd.DataFrame, panels: tuple[Panel, ...]) -> tuple[str, ...]:
    tracks, lost = panels
    mine = tracks.standard
    said = [
        f"The default ({DEFAULT_WORDS}) keeps 95 % of the errors below {shown(mine.error)} px and loses "
        f"{shown(lost.standard.error)} % of the moved sand, in {shown(mine.time)} s of CPU.",
        dominance(tracks, "Error"),
    ]
    said += _spacing(tracks)
    for name in ("21", "41"):
        one, gone = tracks.of("subset").get(name), lost.of("subset").get(name)
        if one is not None and gone is not None:
            said.append(
                f"A subset of {name} px {against(one, mine)}, and loses {shown(gone.error)} % of the moved "
                "sand."
            )
    said += _strides(tracks, lost) + _rules(table, tracks, lost) + _threads(table)
    return tuple(said)


def _spacing(tracks: Panel) -> list[str]:
    wide = tracks.of("spacing").get("30")
    if wide is None:
        return []
    return [f"A distance of 30 px between points in place of 15 px {_what(against(wide, tracks.standard))}."]


def _what(words: str) -> str:
    return words.replace("the error", "the error of a point")


def _strides(tracks: Panel, lost: Panel) -> list[str]:
    half = tracks.of("photographs").get("every 2nd")
    kept = lost.of("photographs").get("every 2nd")
    if half is None or kept is None:
        return []
    return [
        f"Every second photograph alone {against(half, tracks.standard)}, and {shown(kept.error)} % in "
        f"place of {shown(lost.standard.error)} % of the moved sand is lost."
    ]


def _rules(table: pd.DataFrame, tracks: Panel, lost: Panel) -> list[str]:
    said, wrong = [], table[table["family"] == REFERENCE].set_index("setting")["wrong_pct"]
    mine = float(table.loc[table["default"], "wrong_pct"].iloc[0])
    for name in (FIRST, LAST):
        one, gone = tracks.of(REFERENCE).get(name), lost.of(REFERENCE).get(name)
        if one is None or gone is None:
            continue
        said.append(
            f"{name[0].upper()}{name[1:]} photograph as the reference {against(one, tracks.standard)} and "
            f"loses {shown(gone.error)} % of the moved sand (default {shown(lost.standard.error)} %); of "
            f"what it tracks {shown(float(wrong[name]))} % is off by more than a pixel (default "
            f"{shown(mine)} %)."
        )
    return said


def _threads(table: pd.DataFrame) -> list[str]:
    rows = table[table["family"] == "threads"].set_index("setting")
    if not {"1", "2"} <= set(rows.index):
        return []
    one, two = ((float(rows.loc[name, "cpu_ms"]), float(rows.loc[name, "wall_ms"])) for name in ("1", "2"))
    if not quiet(one, two):
        return [BUSY]
    return [
        f"Two threads take {shown(two[1])} ms a photograph, {shown(one[1] / two[1])} times as fast as one."
    ]


_HEAD = [
    "Family", "Setting", "Default", "Points", "Photographs", "CPU, ms each", "Clock, ms each", "Median, px",
    "95 %, px", "Wrong by over 1 px, %", "Not tracked, %", "Within one std",
]  # fmt: skip
_WHOLE_HEAD = [
    "Subset, px", "Apart, px", "Photographs, s", "Whole, s", "Points", "Tracks, median, px", "Tracks, 95 "
    "%, px",
    "Tracked, %", "Layers, 95 %, px", "Layers found, %", "Bands missed", "Bands invented", "Start, intervals",
    "Outcrop, mm", "Inclination, °",
]  # fmt: skip


def _table(table: pd.DataFrame, caption: str, head: list[str], *, folded: bool = False) -> Table:
    rows = [[value_cell(value, 3) for value in row] for row in table.itertuples(index=False, name=None)]
    return Table(caption, head, rows, folded=folded)
