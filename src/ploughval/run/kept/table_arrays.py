"""Tables as plain values and arrays for the store, and back with the same types, rows and columns."""

from typing import Any

import numpy as np
import pandas as pd


def parts_of(table: pd.DataFrame) -> dict[str, Any]:
    """A table as dictionaries, lists, texts, numbers and arrays without objects.

    Raises
    ------
    TypeError
        When a column's name is not a text.
    """
    strange = [name for name in table.columns if not isinstance(name, str)]
    if strange:
        raise TypeError(f"a column that is named {strange[0]!r} cannot be stored; expected a text")
    return {
        "names": [str(name) for name in table.columns],
        "names_type": str(table.columns.dtype),
        "columns": [_column(table.iloc[:, k]) for k in range(table.shape[1])],
        "index": _index(table.index),
        "attrs": dict(table.attrs),
    }


def table_of(parts: dict[str, Any]) -> pd.DataFrame:
    """The table that :func:`parts_of` was given.

    Raises
    ------
    ValueError, KeyError, TypeError
        When the parts are not a table's.
    """
    index = _index_of(parts["index"])
    columns = {k: _series_of(column).set_axis(index) for k, column in enumerate(parts["columns"])}
    table = pd.DataFrame(columns, index=index)
    table.columns = pd.Index(parts["names"], dtype=parts["names_type"])
    table.attrs.update(parts["attrs"])
    return table


def _column(column: pd.Series) -> dict[str, Any]:
    """Numbers as they are; texts, objects and categories as places in a list of different values."""
    if isinstance(column.dtype, np.dtype) and not column.dtype.hasobject:
        return {"array": column.to_numpy()}
    if isinstance(column.dtype, pd.CategoricalDtype):
        values = _column(column.cat.categories.to_series())
        codes = column.cat.codes.to_numpy()
        return {"codes": codes, "categories": values, "ordered": bool(column.cat.ordered)}
    if isinstance(column.dtype, pd.StringDtype):
        codes, texts = pd.factorize(column)
        return {"codes": codes, "values": list(map(str, texts)), "type": str(column.dtype)}
    places: dict[tuple[type, str], int] = {}
    distinct: list[Any] = []
    found = np.empty(len(column), np.int64)
    for row, value in enumerate(column):
        name = (type(value), repr(value))
        if name not in places:
            places[name] = len(distinct)
            distinct.append(value)
        found[row] = places[name]
    return {"codes": found, "values": distinct, "type": str(column.dtype)}


def _series_of(parts: dict[str, Any]) -> pd.Series:
    if "array" in parts:
        return pd.Series(parts["array"])
    codes = parts["codes"]
    if "categories" in parts:
        categories = pd.Index(_series_of(parts["categories"]))
        return pd.Series(pd.Categorical.from_codes(codes, categories, ordered=parts["ordered"]))
    values = parts["values"]
    return pd.Series([None if code < 0 else values[code] for code in codes.tolist()], dtype=parts["type"])


def _index(index: pd.Index) -> dict[str, Any]:
    if isinstance(index, pd.RangeIndex):
        return {"name": index.name, "range": (index.start, index.stop, index.step)}
    return {"name": index.name, **_column(index.to_series())}


def _index_of(parts: dict[str, Any]) -> pd.Index:
    if "range" in parts:
        start, stop, step = parts["range"]
        return pd.RangeIndex(start, stop, step, name=parts["name"])
    index: pd.Index = pd.Index(_series_of(parts), name=parts["name"])
    return index
