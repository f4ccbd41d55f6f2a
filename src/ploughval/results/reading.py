"""Files of a result folder: records, tables and tracks, each fault named with its place."""

import json
from collections.abc import Collection
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
import pandas as pd
import xarray as xr
from pydantic import BaseModel, ValidationError

from ploughval.columns import floats_of
from ploughval.errors import DataError
from ploughval.results.catalogue import FILES, Column

REMEDY = "Write it anew with: ploughval process"
NEEDED = MappingProxyType(
    {
        "mobilised.csv": ("frame", "u_mm", "slip_mm", "band", "phi_deg", "phi_std_deg"),
        "peaks.csv": ("source", "kind", "u_mm", "force_N"),
        "peak_pairs.csv": (
            "switch_experiment",
            "switch_model",
            "u_mm_experiment",
            "u_mm_model",
            "u_mm_error",
        ),
        "force_frames.csv": ("frame", "u_mm", "force_N", "force_std_N"),
        "force_envelope.csv": ("u_mm", "low_N", "high_N"),
    }
)
"""Columns without which a table is refused, where those are not all: earlier versions wrote fewer."""
_NO_NUMBER = ("", "nan", "NaN", "NA")
"""Cells without a number; among words all but the empty one are words."""
_TRACKED = ("x0_mm", "y0_mm", "x_mm", "y_mm", "std_mm", "zncc", "status", "time_s", "u_mm")

M = TypeVar("M", bound=BaseModel)


def read_record(path: Path, kind: type[M]) -> M | None:
    """A JSON file as a record; None where it is not there.

    Parameters
    ----------
    path : Path
        The file.
    kind : type of record
        What it is read as.

    Returns
    -------
    record or None

    Raises
    ------
    DataError
        Not readable as JSON, or not such a record.
    """
    found = read_json(path)
    if found is None:
        return None
    try:
        return kind.model_validate(found)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        shown = repr(first["input"])[:80]
        raise DataError(f"{place}: got {shown}; {first['msg']}. {REMEDY}", path=path) from None


def read_json(path: Path) -> dict[str, Any] | None:
    """A JSON file as a mapping; None where it is not there.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    dict or None

    Raises
    ------
    DataError
        Not readable as JSON, or another thing than an object.
    """
    if not path.is_file():
        return None
    try:
        found: object = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise DataError(f"not readable as JSON: {error}. {REMEDY}", path=path) from None
    if not isinstance(found, dict):
        raise DataError(f"got {repr(found)[:80]}; expected a JSON object. {REMEDY}", path=path)
    return found


def read_table(folder: Path, name: str) -> pd.DataFrame | None:
    """A table of a result folder; None where it is not there.

    Parameters
    ----------
    folder : Path
        The result folder.
    name : str
        The file, one of ``FILES``.

    Returns
    -------
    DataFrame or None
        Columns of numbers as float64, NaN where a cell is empty; columns of words as str.

    Raises
    ------
    DataError
        Not readable as CSV, a column is missing, or a cell is no number: file, line, column, what to do.
    """
    path, columns = folder / name, FILES[name].columns
    if not path.is_file():
        return None
    words = {column.name: str for column in columns if column.is_text}
    missing_words = {column.name: _NO_NUMBER for column in columns if not column.is_text}
    try:
        table = pd.read_csv(path, dtype=words, keep_default_na=False, na_values=missing_words)
    except (OSError, ValueError, pd.errors.ParserError) as error:
        raise DataError(f"not readable as CSV: {error}. {REMEDY}", path=path) from None
    needed: Collection[str] = NEEDED.get(name, FILES[name].units)
    missing = [column for column in needed if column not in table]
    if missing:
        raise DataError(
            f"columns {', '.join(missing)} are missing; expected {', '.join(needed)}. {REMEDY}", path=path
        )
    for column in columns:
        if column.name in table:
            table[column.name] = _values(table[column.name], column, path)
    return table


def _values(cells: pd.Series, column: Column, path: Path) -> pd.Series:
    """The cells of a column as words or as numbers."""
    if column.is_text:  # a row that ends early has no words there
        return cells.where(cells.notna(), "")
    numbers = floats_of(cells)
    wrong = np.isnan(numbers) & cells.notna().to_numpy()
    if wrong.any():
        row = int(wrong.argmax())
        raise DataError(
            f"line {row + 2}, {column.name}: got {cells.iloc[row]!r}; expected a number. {REMEDY}", path=path
        )
    return pd.Series(numbers, index=cells.index)


def read_tracks(folder: Path) -> xr.Dataset | None:
    """The tracked points of a result folder; None where they are not there.

    Parameters
    ----------
    folder : Path
        The result folder.

    Returns
    -------
    Dataset or None
        Dimensions and variables of :data:`ploughval.results.VARIABLES`.

    Raises
    ------
    DataError
        Not readable as NetCDF, or a variable is missing.
    """
    path = folder / "tracks.nc"
    if not path.is_file():
        return None
    try:
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as stored:
            tracks = stored.load()
    except Exception as error:  # a spoiled file can raise anything within HDF5
        raise DataError(f"not readable as netCDF: {error}. {REMEDY}", path=path) from None
    missing = [name for name in _TRACKED if name not in tracks]
    if missing:
        raise DataError(f"variables {', '.join(missing)} are missing. {REMEDY}", path=path)
    return tracks
