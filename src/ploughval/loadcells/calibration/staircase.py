"""Calibration points from a log in which known loads were hung on one after the other."""

from pathlib import Path

import numpy as np
import pandas as pd

from ploughval.errors import DataError
from ploughval.loadcells.calibration.plateaus import find_plateaus
from ploughval.loadcells.calibration.table import POINT_COLUMNS
from ploughval.loadcells.calibration.text import read_columns
from ploughval.scene import LogColumns, Staircase


def read_staircase(path: Path, given: Staircase, columns: LogColumns) -> pd.DataFrame:
    """Read a log and find the levels of its loads.

    Parameters
    ----------
    path : Path
        A text table with the two readings; times are not needed.
    given : Staircase
        Loads in their order, and their arm.
    columns : LogColumns
        What the columns of the readings are called.

    Returns
    -------
    DataFrame
        As from table.read_table; ``row`` is the first row of the log that was used, from 0 after
        the headers, ``line`` its line in the file.

    Raises
    ------
    DataError
        The log cannot be read, or its levels do not follow the loads.
    """
    names = {"upper": columns.moment_upper_Nm, "lower": columns.moment_lower_Nm}
    read = read_columns(path, names, frozenset(names))
    missing = [names[key] for key in names if key not in read.text]
    if missing:
        raise DataError(
            f"no column {', '.join(map(repr, missing))}; the columns there are: {', '.join(read.there)}. "
            "Name the right ones in [loadcells.columns] of test.toml",
            path=path,
        )
    readings = np.stack([read.numbers(key, path) for key in names])
    try:
        found = find_plateaus(readings, np.array(given.loads_N))
    except DataError as error:
        raise DataError(str(error), path=path) from None
    table = pd.DataFrame({key: found.get(key, np.nan) for key in POINT_COLUMNS}, index=range(len(found)))
    first = found["first_row"].to_numpy(int)
    return table.assign(
        file=given.log,
        row=first,
        line=read.line[first],
        arm_mm=given.arm_mm,
        load_std_N=np.where(found["load_N"] == 0, 0.0, given.load_std_N),
        arm_std_mm=given.arm_std_mm,
        run="",
        direction="",
        from_mass=False,
    )
