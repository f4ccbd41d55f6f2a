"""Files of a result folder: records and tables, each fault named with its place."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
import pandas as pd
from pydantic import BaseModel, ValidationError

from ploughval.columns import floats_of
from ploughval.errors import DataError

REMEDY = "Write it anew with: ploughval process"

M = TypeVar("M", bound=BaseModel)


def read_record(path: Path, kind: type[M]) -> M | None:
    """A JSON file as a record; None where it is not there."""
    if not path.is_file():
        return None
    try:
        return kind.model_validate(json.loads(path.read_text(encoding="utf-8")))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        shown = repr(first["input"])[:80]
        raise DataError(f"{place}: got {shown}; {first['msg']}. {REMEDY}", path=path) from None
    except (OSError, ValueError, RecursionError) as error:
        raise DataError(f"not readable as JSON: {error}. {REMEDY}", path=path) from None


def read_table(path: Path, columns: Sequence[str]) -> pd.DataFrame | None:
    """A CSV file with these columns; None where it is not there."""
    if not path.is_file():
        return None
    try:
        table = pd.read_csv(path)
    except (OSError, ValueError, pd.errors.ParserError) as error:
        raise DataError(f"not readable as CSV: {error}. {REMEDY}", path=path) from None
    missing = [name for name in columns if name not in table]
    if missing:
        raise DataError(
            f"columns {', '.join(missing)} are missing; expected {', '.join(columns)}. {REMEDY}", path=path
        )
    for name in columns:
        if name in _WORDS:
            table[name] = table[name].astype("object").where(table[name].notna(), "").astype(str)
            continue
        numbers = floats_of(table[name])
        wrong = np.isnan(numbers) & table[name].notna().to_numpy()
        if wrong.any():
            row = int(wrong.argmax())
            raise DataError(
                f"line {row + 2}, {name}: got {table[name].iloc[row]!r}; expected a number. {REMEDY}",
                path=path,
            )
        table[name] = numbers
    return table


_WORDS = {
    "status",
    "source",
    "kind",
    "unit",
    "mechanism",
    "file",
    "run",
    "direction",
    "used",
    "reason",
    "model",
    "why_not",
    "quantity",
    "cell",
    "definition",
    "note",
    "parameter",
    "map",
    "group",
    "item",
    "text",
}
