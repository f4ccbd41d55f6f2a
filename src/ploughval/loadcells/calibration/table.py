"""Calibration tables: which load hung where, what the cells read, in which run and direction."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.loadcells.calibration.text import Columns, read_columns

Floats = NDArray[np.float64]
POINT_COLUMNS = (
    "file",
    "row",
    "line",
    "load_N",
    "arm_mm",
    "load_std_N",
    "arm_std_mm",
    "run",
    "direction",
    "moment_upper_Nm",
    "moment_lower_Nm",
    "upper",
    "lower",
)
_OWN_MOMENTS = ("moment_upper_Nm", "moment_lower_Nm")
_NUMERIC = ("load_N", "mass_kg", "arm_mm", "load_std_N", "arm_std_mm", *_OWN_MOMENTS, "upper", "lower")
_DIRECTIONS = ("", "up", "down")


def read_table(path: Path, name: str, *, g_m_s2: float) -> pd.DataFrame:
    """Read one calibration table.

    Parameters
    ----------
    path : Path
        Columns upper and lower (readings in the unit of the log) and load_N or mass_kg with arm_mm, or
        moment_upper_Nm and moment_lower_Nm; optional load_std_N, arm_std_mm, run, direction (up or down).
    name : str
        What messages call the file.
    g_m_s2 : float
        Acceleration of gravity by which masses become loads.

    Returns
    -------
    DataFrame
        POINT_COLUMNS without moments where load and arm were given, and ``from_mass``, whether the load is
        that of a mass; ``row`` counts from 0 after the headers.

    Raises
    ------
    DataError
        Columns are missing, text where a number was expected, or another direction than up and down.
    """
    names = {key: key for key in (*_NUMERIC, "run", "direction")}
    columns = read_columns(path, names, frozenset(_NUMERIC))
    _check_columns(columns, path)
    values = {key: columns.numbers(key, path) for key in _NUMERIC}
    weighed = "load_N" not in columns.text
    load = values["mass_kg"] * g_m_s2 if weighed else values["load_N"]
    direction = [word.casefold() for word in columns.words("direction")]
    odd = next((k for k, word in enumerate(direction) if word not in _DIRECTIONS), None)
    if odd is not None:
        raise DataError(
            f"line {columns.line[odd]}: direction is {direction[odd]!r}; expected up or down", path=path
        )
    table = pd.DataFrame({key: values.get(key, np.nan) for key in POINT_COLUMNS})
    return table.assign(
        file=name,
        row=np.arange(len(table)),
        line=columns.line,
        load_N=load,
        run=columns.words("run"),
        direction=direction,
        load_std_N=np.nan_to_num(values["load_std_N"]),
        arm_std_mm=np.nan_to_num(values["arm_std_mm"]),
        from_mass=weighed & np.isfinite(load),
    )


def _check_columns(columns: Columns, path: Path) -> None:
    there = set(columns.text)
    missing = [name for name in ("upper", "lower") if name not in there]
    if not there >= set(_OWN_MOMENTS):
        missing += [] if there & {"load_N", "mass_kg"} else ["load_N or mass_kg"]
        missing += [] if "arm_mm" in there else ["arm_mm"]
    if missing:
        raise DataError(
            f"no column {', '.join(missing)}; the columns there are: {', '.join(columns.there)}. "
            "A calibration needs upper, lower (readings) and load_N or mass_kg with arm_mm (height of the "
            "load above the tip), or moment_upper_Nm and moment_lower_Nm",
            path=path,
        )


def with_moments(points: pd.DataFrame, *, spacing_mm: float, lower_to_tip_mm: float) -> pd.DataFrame:
    """Points with the moments that load and arm make at the cells where no moments were given.

    M_lower = F (lower_to_tip - arm), M_upper = F (lower_to_tip + spacing - arm); without load no moment,
    whatever the arm (docs/theory-loadcell-calibration.md, Eq. (1)).
    """
    load = points["load_N"].to_numpy(float)
    arm = np.where(load == 0, 0.0, points["arm_mm"].to_numpy(float))
    lever = (lower_to_tip_mm - arm) / 1000
    made = (load * (lever + spacing_mm / 1000), load * lever)
    given = points[list(_OWN_MOMENTS)].notna().all(axis=1).to_numpy()
    moments = {
        name: np.where(given, points[name].to_numpy(float), values)
        for name, values in zip(_OWN_MOMENTS, made, strict=True)
    }
    return points.assign(**moments, moment_given=given)


def with_runs(points: pd.DataFrame) -> pd.DataFrame:
    """Points with run and direction filled in from the order of the moments where they are not named.

    Each file has runs of its own. Without a column ``run`` a new one starts after a return to zero. Rows go
    up until the first that carries less than the one before it, and down from there.
    """
    size = np.abs(points[list(_OWN_MOMENTS)].to_numpy(float)).max(axis=1)
    zero = size <= 1e-9 * np.nanmax(size, initial=0.0)
    runs, directions = points["run"].astype(str).to_list(), points["direction"].astype(str).to_list()
    files, named = points["file"].to_list(), [bool(r) for r in runs]
    count = 1
    for k in range(len(points)):
        first = k == 0 or files[k] != files[k - 1]
        if not named[k]:
            fresh = not first and zero[k - 1] and directions[k - 1] == "down"
            count = 1 if first else count + int(fresh)
            runs[k] = str(count)
        first = first or runs[k] != runs[k - 1]
        directions[k] = directions[k] or _direction(
            size, k, "up" if first else directions[k - 1], first=first
        )
    return points.assign(run=runs, direction=directions)


def _direction(size: Floats, k: int, before: str, *, first: bool) -> str:
    """Up or down by the change of the moment since the row before, which itself went ``before``."""
    if first or not np.isfinite(size[k - 1 : k + 1]).all() or size[k] == size[k - 1]:
        return before
    return "up" if size[k] > size[k - 1] else "down"


def run_numbers(points: pd.DataFrame) -> NDArray[np.intp]:
    """Runs of all files counted from 0 in their order: (N,) int."""
    labels: dict[tuple[str, str], int] = {}
    pairs: Sequence[tuple[str, str]] = list(zip(points["file"], points["run"], strict=True))
    return np.array([labels.setdefault(pair, len(labels)) for pair in pairs], dtype=np.intp)
