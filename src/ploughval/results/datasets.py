"""Tables as datasets: units and meanings on every variable, reason codes of forces as flags."""

import numpy as np
import pandas as pd
import xarray as xr

from ploughval import axes
from ploughval.axes import ForceStatus
from ploughval.results.catalogue import TableFile

ROW = "row"
_FLAGGED = ("force.csv", "force_frames.csv")  # their status is of ForceStatus
_UNITS = frozenset({"1", *axes.UNITS.values()})


def table_dataset(table: pd.DataFrame, told: TableFile) -> xr.Dataset:
    """A table as a dataset of dimension ``row``.

    Parameters
    ----------
    table : DataFrame
        Some or all columns of ``told``.
    told : TableFile
        What they mean.

    Returns
    -------
    Dataset
        A variable for each column. Words stay words, but for the status of a force, which becomes a code with
        ``flag_values`` and ``flag_meanings``. A column whose unit differs from row to row has no ``units``.
    """
    variables = {}
    for column in told.columns:
        if column.name not in table:
            continue
        attrs: dict[str, object] = {"long_name": column.meaning}
        values = table[column.name].to_numpy()
        if column.name == "status" and told.name in _FLAGGED:
            codes = {str(status): np.int8(code) for code, status in enumerate(ForceStatus)}
            values = np.array([codes[word] for word in values], dtype=np.int8)
            attrs |= {"flag_values": np.array(list(codes.values())), "flag_meanings": " ".join(codes)}
        elif column.is_text:
            values = values.astype(str)
        elif column.unit in _UNITS:
            attrs["units"] = column.unit
        variables[column.name] = (ROW, values, attrs)
    return xr.Dataset(variables, attrs={"title": told.about, "rows": told.row})
