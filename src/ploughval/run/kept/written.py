"""Result files: written aside, synced and renamed, so that a file is whole or as it was."""

import json
import os
import re
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ploughval.disk import unwritable

_DEAD = re.compile(r"\..*\.part-[a-z0-9_]{8}(\..*)?", re.DOTALL)


def write_aside(path: Path, write: Callable[[Path], object]) -> None:
    """Write a file under another name beside its place, sync it, rename it into place and sync the folder.

    Whatever happens meanwhile, a death of the process or of the machine too, the name holds the old file or
    the whole new one; a temporary file may stay, which :func:`clean_aside` takes for what it is.

    Parameters
    ----------
    path : Path
        Final name; its folder is made when missing.
    write : callable
        Gets the temporary path and writes the file there.

    Raises
    ------
    DataError
        When the disk refuses (full, read-only, no permission).
    """
    temporary: Path | None = None
    try:
        with unwritable(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}.part-", suffix=path.suffix)
            os.close(handle)
            temporary = Path(name)
            write(temporary)
            with temporary.open("rb+") as file:
                os.fsync(file.fileno())
            temporary.chmod(0o644)
            temporary.replace(path)
            sync_folder(path.parent)
    finally:
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)


def clean_aside(folder: Path) -> None:
    """Remove the temporary files that a process which was killed has left in a folder, not in those below."""
    with suppress(OSError):
        dead = [path for path in folder.iterdir() if _DEAD.fullmatch(path.name) and path.is_file()]
        for path in dead:
            path.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Make a rename last beyond a loss of power; where a folder cannot be synced, the system sees to it."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def write_bytes(path: Path, data: bytes | bytearray) -> None:
    """Write bytes so that the file is there whole or not at all; raises as :func:`write_aside`."""
    write_aside(path, lambda aside: aside.write_bytes(data))


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text with Unix line ends, aside and renamed."""
    write_bytes(path, text.encode("utf-8"))


def write_json(path: Path, value: Any) -> None:
    """Write JSON with sorted keys; see :func:`json_text`."""
    write_text(path, json_text(value))


def json_text(value: Any) -> str:
    """JSON with sorted keys; NaN and infinity become null, for JSON has neither."""
    return json.dumps(_plain(value), indent=1, sort_keys=True, allow_nan=False) + "\n"


def write_csv(path: Path, table: pd.DataFrame, columns: Sequence[str]) -> None:
    """Write the named columns of a table; see :func:`put_csv`."""
    write_aside(path, lambda aside: put_csv(aside, [table], columns))


def put_csv(path: Path, parts: Iterable[pd.DataFrame], columns: Sequence[str]) -> None:
    """Fill a file with the named columns of tables, one below the other under the head of the first.

    NaN becomes an empty cell, floats keep 9 digits.

    Nine significant digits are a nanometre in a metre: below any noise, and the same on every machine.

    Raises
    ------
    OSError
        When the disk refuses.
    """
    with path.open("w", encoding="utf-8", newline="") as file:  # part by part: a log of hours is large
        for k, part in enumerate(parts):
            part.to_csv(
                file,
                columns=list(columns),
                index=False,
                header=k == 0,
                float_format="%.9g",
                lineterminator="\n",
            )


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, Path):
        return str(value)
    return value
