"""Tables that carry their units."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.results.catalogue import TableFile


def with_units(table: pd.DataFrame, told: TableFile) -> pd.DataFrame:
    """A copy of a table that says what it is.

    Parameters
    ----------
    table : DataFrame
        Some or all columns of ``told``.
    told : TableFile
        What they mean.

    Returns
    -------
    DataFrame
        ``attrs`` hold ``title`` (str), and as mappings from column ``units`` (text: "1" for plain numbers, ""
        for words) and ``long_name`` (what it means). Numbers of frames and of other
        things that are counted are int64 where each is there and whole.

    >>> from ploughval.results import FILES
    >>> with_units(pd.DataFrame({"frame": [0.0], "x_mm": [1.5]}), FILES["surface.csv"]).attrs["units"]
    {'frame': '1', 'x_mm': 'mm'}
    """
    told_of = {column.name: column for column in told.columns if column.name in table}
    found = table.copy()
    for name, column in told_of.items():
        if column.is_whole and _are_whole(found[name].to_numpy(np.float64)):
            found[name] = found[name].astype(np.int64)
    found.attrs = {
        "title": told.about,
        "units": {name: column.unit for name, column in told_of.items()},
        "long_name": {name: column.meaning for name, column in told_of.items()},
    }
    return found


def _are_whole(values: NDArray[np.float64]) -> bool:
    """Whether int64 holds every number as it is; NaN and infinity are none."""
    return bool(np.all((np.abs(values) < 2.0**53) & (values == np.round(values))))
