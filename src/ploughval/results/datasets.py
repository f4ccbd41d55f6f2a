"""Tables as datasets: units and meanings on every variable, reason codes of forces as flags."""

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ploughval import axes
from ploughval.axes import ForceStatus
from ploughval.errors import DataError
from ploughval.results.catalogue import TableFile
from ploughval.results.reading import REMEDY

ROW = "row"
_FLAGGED = ("force.csv", "force_frames.csv")  # their status is of ForceStatus
_UNITS = frozenset({"1", *axes.UNITS.values()})


_CODES = {str(status): np.int8(code) for code, status in enumerate(ForceStatus)}


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

    Raises
    ------
    DataError
        A status of a force that is none: file, line, what was expected.
    """
    variables = {}
    for column in told.columns:
        if column.name not in table:
            continue
        attrs: dict[str, object] = {"long_name": column.meaning}
        values = table[column.name].to_numpy()
        if column.name == "status" and told.name in _FLAGGED:
            values = _codes(list(values), told.name)
            attrs |= {"flag_values": np.array(list(_CODES.values())), "flag_meanings": " ".join(_CODES)}
        elif column.is_text:
            values = values.astype(str)
        elif column.unit in _UNITS:
            attrs["units"] = column.unit
        variables[column.name] = (ROW, values, attrs)
    return xr.Dataset(variables, attrs={"title": told.about, "rows": told.row})


def _codes(words: list[str], name: str) -> NDArray[np.int8]:
    """Codes of the words of a status, in the order of ForceStatus."""
    unknown = next((row for row, word in enumerate(words) if word not in _CODES), None)
    if unknown is not None:
        said = f"got {words[unknown]!r}; expected one of {', '.join(_CODES)}"
        raise DataError(f"line {unknown + 2}, status: {said}. {REMEDY}", path=name)
    return np.array([_CODES[word] for word in words], dtype=np.int8)
