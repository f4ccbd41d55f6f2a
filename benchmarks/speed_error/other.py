"""Chapters of what has no settings to choose: whole tests, reading photographs, markers."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from ploughval.report.blocks import Table, value_cell
from speed_error.points import read
from speed_error.words import shown


@dataclass(frozen=True, slots=True)
class Facts:
    """A chapter of tables."""

    key: str
    title: str
    lead: str
    notes: tuple[str, ...]
    tables: tuple[Table, ...]
    files: tuple[str, ...]


def chapters(folder: Path) -> list[Facts]:
    """Those whose tables are there."""
    return [
        found
        for found in (_whole(folder), _page(folder), _photographs(folder), _markers(folder))
        if found is not None
    ]


def _whole(folder: Path) -> Facts | None:
    made, big = read(folder, "whole.csv"), _big(folder)
    tables, notes = [], []
    if big is not None:
        name = big.columns[-1]
        value = big.set_index("quantity")[name]
        seconds, memory = float(value["whole command [s]"]), float(value["peak memory [GB]"])
        points = f"{value['points [1]']:.0f} points"
        notes.append(
            f"{name}, 12 megapixels, {points}: {shown(seconds)} s by the clock from the photographs to the "
            f"report, {shown(memory)} GB of memory."
        )
        tables.append(
            _table(big, "A test of a laboratory's size", ["Quantity", "To reach", name], folded=True)
        )
    if made is not None:
        names = list(made.columns[2:])
        notes.append(_missed(made))
        tables.append(
            _table(made, "Made tests, every quantity", ["Quantity", "To reach", *names], folded=True)
        )
    if not tables:
        return None
    files = tuple(name for name in ("whole.csv", "speed.csv") if (folder / name).is_file())
    lead = "Photographs, logs and settings in, report out: errors of every quantity against the exact truth."
    return Facts("whole", "Whole tests", lead, tuple(notes), tuple(tables), files)


def _big(folder: Path) -> pd.DataFrame | None:
    """The large test, here or beside the studies of sequences."""
    here = read(folder, "speed.csv")
    return here if here is not None else read(folder.parent / "sequences", "speed.csv")


def _missed(table: pd.DataFrame) -> str:
    """Bounded figures that were not reached, in words."""
    count, reached, missed = 0, 0, []
    for row in table.dropna(subset=["to reach"]).itertuples(index=False, name=None):
        low, high = _bounds(str(row[1]))
        wrong = [float(value) for value in row[2:] if not low <= float(value) <= high]
        count += len(row[2:])
        reached += len(row[2:]) - len(wrong)
        if wrong:
            missed.append(f"{row[0]} {', '.join(shown(value) for value in wrong)} ({row[1]})")
    if not missed:
        return f"All {count} bounded figures of the made tests are reached."
    return f"{reached} of {count} bounded figures of the made tests are reached; missed: {'; '.join(missed)}."


def _bounds(words: str) -> tuple[float, float]:
    if words.startswith("at most "):
        return float("-inf"), float(words.removeprefix("at most "))
    if words.startswith("at least "):
        return float(words.removeprefix("at least ")), float("inf")
    low, high = words.split(" to ")
    return float(low), float(high)


def _page(folder: Path) -> Facts | None:
    table = read(folder, "page.csv")
    if table is None:
        return None
    most = table.loc[table["page_cpu_s"].idxmax()]
    note = (
        f"The slowest page: {most['frames']:.0f} photographs of {most['width_px']:.0f} x "
        f"{most['height_px']:.0f} px ({most['kind']}) take {shown(float(most['page_cpu_s']))} s of CPU "
        f"and weigh "
        f"{shown(float(most['page_MB']))} MB; the heaviest weighs {shown(float(table['page_MB'].max()))} MB."
    )
    names = [
        "frames",
        "width_px",
        "height_px",
        "kind",
        "points",
        "read_cpu_s",
        "player_cpu_s",
        "page_cpu_s",
        "page_MB",
    ]
    head = [
        "Photographs",
        "Width, px",
        "Height, px",
        "Kind",
        "Points",
        "Reading, s",
        "Player, s",
        "Page, s",
        "Page, MB",
    ]
    lead = "The report page against the number of photographs, their size and their kind; CPU, all threads."
    return Facts(
        "page", "The report page", lead, (note,), (_table(table[names], "By case", head),), ("page.csv",)
    )


def _photographs(folder: Path) -> Facts | None:
    table = read(folder, "photos.csv")
    if table is None:
        return None
    still = table[~table["format"].str.contains("series|video|GIF")]
    fast, slow = (still.loc[pick(still["ms_per_megapixel"])] for pick in (pd.Series.idxmin, pd.Series.idxmax))
    exact = still[still["error_levels"] == 0]
    note = (
        f"Fastest is {fast['format']} ({shown(fast['ms_per_megapixel'])} ms a megapixel), slowest "
        f"{slow['format']} ({shown(slow['ms_per_megapixel'])}); {len(exact)} of {len(still)} formats are "
        f"read without any difference, the others within {shown(float(still['error_levels'].max()))} grey "
        "levels: the rounding of a grey from three colours."
    )
    head = [
        "Format", "Megapixels", "Megabytes", "Header, ms", "ms a megapixel", "Peak, MB a "
        "megapixel", "Error, grey levels",
    ]  # fmt: skip
    body = table[list(table.columns[:7])]
    lead = "Each format in a process of its own, 24 megapixels, the least of three times."
    return Facts(
        "photographs",
        "Reading photographs",
        lead,
        (note,),
        (_table(body, "By format", head, folded=True),),
        ("photos.csv",),
    )


def _markers(folder: Path) -> Facts | None:
    table = read(folder, "markers.csv")
    if table is None:
        return None
    whole = table[table["case"] == "whole"].copy()
    whole["ratio"] = whole["rmse_px"] / whole["bound_px"]
    note = (
        f"Whole markers: rms errors of {shown(float(whole['rmse_px'].min()))} to "
        f"{shown(float(whole['rmse_px'].max()))} px over radius, blur and noise, "
        f"{shown(float(whole['ratio'].median()))} times the bound in the median."
    )
    head = [
        "Case", "Kind", "Radius, px", "Blur, px", "Noise, grey", "Markers", "Found", "Rms, px", "Bias, "
        "px", "95 %, px",
        "Within one std", "Within two", "Bound, px",
    ]  # fmt: skip
    lead = "Markers on the window, found in photographs made with them."
    files = tuple(name for name in ("markers.csv",) if (folder / name).is_file())
    return Facts(
        "markers", "Markers", lead, (note,), (_table(table, "Every case", head, folded=True),), files
    )


def _table(table: pd.DataFrame, caption: str, head: Sequence[str], *, folded: bool = False) -> Table:
    rows = [
        [value_cell("" if isinstance(v, float) and v != v else v, 3) for v in row]
        for row in table.itertuples(index=False, name=None)
    ]
    return Table(caption, list(head), rows, folded=folded)
