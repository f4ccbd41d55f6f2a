"""Nested values as named arrays for the store, and back: exact, and nothing that was stored is ever run."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.run.kept.table_arrays import parts_of, table_of

TREE = "tree"
"""Name of the array of characters that holds everything but the arrays, as JSON."""


def to_arrays(value: Any) -> dict[str, NDArray[Any]]:
    """A nested value as named arrays.

    Parameters
    ----------
    value
        Dictionaries, lists, tuples and dataclasses of arrays, tables, numpy's and Python's numbers, texts,
        members of enumerations and None.

    Returns
    -------
    dict of str to array
        Arrays under the path that leads to them, and the rest as one text.

    Raises
    ------
    TypeError
        When there is something else in it.
    """
    arrays: dict[str, NDArray[Any]] = {}
    tree = _encoded(value, "value", arrays)
    arrays[TREE] = np.array(json.dumps(tree))
    return arrays


def from_arrays(arrays: Mapping[str, NDArray[Any]], types: Sequence[type]) -> Any:
    """The value that :func:`to_arrays` was given.

    Parameters
    ----------
    arrays : mapping of str to array
        As :func:`to_arrays` gave them.
    types : sequence of type
        Dataclasses and enumerations that may be made; anything else is refused.

    Raises
    ------
    ValueError
        When the arrays are not such a value's.
    """
    try:
        tree = json.loads(str(arrays[TREE]))
        return _decoded(tree, arrays, {kind.__name__: kind for kind in types})
    except (KeyError, TypeError, IndexError, RecursionError) as error:
        raise ValueError(f"not a value that was stored: {error!r}") from error


def _encoded(value: Any, path: str, arrays: dict[str, NDArray[Any]]) -> Any:
    """The value for JSON; every container is a list that begins with its kind."""
    if isinstance(value, Enum):
        return ["enum", type(value).__name__, value.value]
    if value is None or type(value) in (bool, int, float, str):
        return value
    if isinstance(value, (np.ndarray, np.generic)):
        if value.dtype.hasobject:
            raise TypeError(f"{path}: an array of {value.dtype} cannot be stored; expected numbers or texts")
        arrays[path] = np.asarray(value)
        return ["array" if isinstance(value, np.ndarray) else "scalar", path]
    if isinstance(value, (list, tuple)):
        parts = [_encoded(part, f"{path}/{k}", arrays) for k, part in enumerate(value)]
        return ["list" if isinstance(value, list) else "tuple", parts]
    if isinstance(value, dict):
        pairs = []
        for k, (key, part) in enumerate(value.items()):
            if type(key) not in (bool, int, float, str):
                raise TypeError(f"{path}: a key of {type(key).__name__} cannot be stored")
            step = key if isinstance(key, str) and key.isidentifier() else k
            pairs.append([key, _encoded(part, f"{path}/{step}", arrays)])
        return ["dict", pairs]
    if isinstance(value, pd.DataFrame):
        return ["table", _encoded(parts_of(value), path, arrays)]
    if is_dataclass(value):
        named = {f.name: _encoded(getattr(value, f.name), f"{path}/{f.name}", arrays) for f in fields(value)}
        return ["object", type(value).__name__, named]
    raise TypeError(f"{path}: {type(value).__name__} cannot be stored")


def _decoded(tree: Any, arrays: Mapping[str, NDArray[Any]], types: Mapping[str, type]) -> Any:
    if not isinstance(tree, list):
        return tree
    match tree:
        case ["array", path]:
            return arrays[path]
        case ["scalar", path]:
            return arrays[path][()]
        case ["list", parts]:
            return [_decoded(part, arrays, types) for part in parts]
        case ["tuple", parts]:
            return tuple(_decoded(part, arrays, types) for part in parts)
        case ["dict", pairs]:
            return {key: _decoded(part, arrays, types) for key, part in pairs}
        case ["table", parts]:
            return table_of(_decoded(parts, arrays, types))
        case ["enum", name, value]:
            return types[name](value)
        case ["object", name, parts]:
            return types[name](**{k: _decoded(v, arrays, types) for k, v in parts.items()})
    raise ValueError(f"not a value that was stored: {str(tree)[:60]}")
