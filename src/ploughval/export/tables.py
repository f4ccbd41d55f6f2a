"""A folder of CSV files, a table each; what their columns mean stands beside them, for programs too."""

import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr

from ploughval.export.contents import Contents, Part
from ploughval.export.placing import replace_folder
from ploughval.results import MADE, Column, tracks_table, with_units
from ploughval.run.kept.written import json_text, put_csv

ENDINGS = frozenset({".csv", ".json"})
_LISTED = ["table", "column", "unit", "meaning"]
_ROWS_AT_ONCE = 100_000
COLUMNS, PACKAGE = "columns.csv", "datapackage.json"


def write_tables(contents: Contents, out: Path) -> list[Path]:
    """Write csv/: the tables, columns.csv and datapackage.json.

    Parameters
    ----------
    contents : Contents
        What is exported.
    out : Path
        Folder in which ``csv`` is made anew.

    Returns
    -------
    list of Path
        columns.csv (table, column, unit, meaning), datapackage.json (the same as a Frictionless Data Package,
        with the settings), and the tables: tracks in long form, those of the model as model_*.csv.

    Raises
    ------
    DataError
        When the disk refuses, or ``csv`` holds files that no export writes.
    """
    rows: list[tuple[Part, Iterable[pd.DataFrame]]] = [(part, [part.table]) for part in contents.parts]
    if contents.tracks is not None:
        told, first = MADE["tracks.csv"], tracks_table(contents.tracks, slice(1))
        rows.append((Part(told, with_units(first, told)), _by_photograph(contents.tracks)))
    parts = [part for part, _ in rows]
    names = [COLUMNS, PACKAGE, *(f"{part.told.key}.csv" for part in parts)]

    def write(folder: Path) -> None:
        for part, tables in rows:
            put_csv(folder / f"{part.told.key}.csv", tables, list(_units(part)))
        put_csv(folder / COLUMNS, [columns_table(parts)], _LISTED)
        (folder / PACKAGE).write_bytes(json_text(data_package(contents, parts)).encode())

    target = out / "csv"
    replace_folder(target, write, ENDINGS)
    return [target / name for name in names]


def _by_photograph(tracks: xr.Dataset) -> Iterator[pd.DataFrame]:
    """The table of tracks in parts of some photographs, so that it never is in memory whole."""
    step = max(1, _ROWS_AT_ONCE // max(1, tracks.sizes["point"]))
    for start in range(0, max(1, tracks.sizes["frame"]), step):
        yield tracks_table(tracks, slice(start, start + step))


def columns_table(parts: list[Part]) -> pd.DataFrame:
    """Every column of every table: table, column, unit, meaning."""
    rows = [
        (part.told.key, name, unit, part.table.attrs["long_name"][name])
        for part in parts
        for name, unit in _units(part).items()
    ]
    return pd.DataFrame(rows, columns=_LISTED)


def data_package(contents: Contents, parts: list[Part]) -> dict[str, Any]:
    """The description of the tables after the Frictionless specification, version 1."""
    return {
        "profile": "tabular-data-package",
        "name": re.sub(r"[^a-z0-9._]+", "-", contents.stem.lower()).strip("-") or "results",
        "title": contents.name,
        "resources": [_resource(part) for part in parts],
        **{name: _plain(text) for name, text in contents.texts.items() if name != "title"},
    }


def _plain(text: str) -> Any:
    """A text that is JSON as what it says."""
    return json.loads(text) if text.startswith("{") else text


def _resource(part: Part) -> dict[str, Any]:
    told = {column.name: column for column in part.told.columns}
    fields = [
        {
            "name": name,
            "type": _type(told[name]),
            "description": part.table.attrs["long_name"][name],
            **({"unit": unit} if unit else {}),
        }
        for name, unit in _units(part).items()
    ]
    return {
        "name": part.told.key,
        "path": f"{part.told.key}.csv",
        "profile": "tabular-data-resource",
        "description": f"{part.told.about} A row is {part.told.row}.",
        "encoding": "utf-8",
        "schema": {"fields": fields, "missingValues": [""]},
    }


def _type(column: Column) -> str:
    if column.is_text:
        return "string"
    return "integer" if column.is_whole else "number"


def _units(part: Part) -> dict[str, str]:
    units: dict[str, str] = part.table.attrs["units"]
    return units
