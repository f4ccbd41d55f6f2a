"""One MAT-file for MATLAB and Octave: a struct for each table, units beside them, NaN for what is missing."""

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.io import savemat

from ploughval.axes import Status
from ploughval.export.contents import Contents, Part
from ploughval.results import VARIABLES
from ploughval.run.kept.written import write_bytes

_HEADER = 116  # bytes of text at the beginning of the file, in which a date would stand


def write_mat(contents: Contents, out: Path) -> list[Path]:
    """Write NAME.mat, version 7; the same results give the same bytes.

    Parameters
    ----------
    contents : Contents
        What is exported.
    out : Path
        Folder.

    Raises
    ------
    DataError
        When the disk refuses.
    """
    buffer = io.BytesIO()
    savemat(buffer, mat_variables(contents), do_compression=True, long_field_names=True, oned_as="column")
    data = bytearray(buffer.getvalue())
    data[:_HEADER] = (
        f"MATLAB 5.0 MAT-file, {contents.texts['source']}"[:_HEADER].ljust(_HEADER).encode("ascii")
    )
    path = out / f"{contents.stem}.mat"
    write_bytes(path, data)
    return [path]


def mat_variables(contents: Contents) -> dict[str, Any]:
    """The variables of the file.

    Returns
    -------
    dict of str to array, str or dict
        A struct for each table with a column vector for each of its columns (words: cell arrays), those of
        the model together in ``model``; ``tracks`` with matrices of frame by point, and what its codes of
        status mean; ``units`` with the same structs, their fields texts; ``about`` with the texts of the
        test.
    """
    values: dict[str, Any] = {"about": {"name": contents.name, **contents.texts}}
    units: dict[str, Any] = {}
    for part in contents.parts:
        *above, key = part.told.name.removesuffix(".csv").split("/")
        for tree, leaf in ((values, _columns(part)), (units, _known(part.table.attrs["units"]))):
            for name in above:
                tree = tree.setdefault(name, {})
            tree[key] = leaf
    if "model" in values:
        values["model"]["horizontal_share"] = contents.horizontal_share
    if contents.tracks is not None:
        names = [name for name in VARIABLES if name in contents.tracks]
        values["tracks"] = {name: _matrix(contents.tracks[name].to_numpy()) for name in names}
        values["tracks"]["status_codes"] = np.array([[int(status)] for status in Status], dtype=np.float64)
        values["tracks"]["status_meanings"] = _cells([status.meaning for status in Status])
        units["tracks"] = {name: VARIABLES[name].unit for name in names}
    values["units"] = units
    return values


def _columns(part: Part) -> dict[str, Any]:
    told = {column.name: column for column in part.told.columns}
    return {
        name: _cells(list(part.table[name])) if told[name].is_text else _matrix(part.table[name].to_numpy())
        for name in part.table.attrs["units"]
    }


def _known(units: dict[str, str]) -> dict[str, str]:
    """Units of the columns that have one."""
    return {name: unit for name, unit in units.items() if unit}


def _matrix(values: NDArray[Any]) -> NDArray[np.float64]:
    """Numbers as MATLAB calculates with them; a vector as a column."""
    numbers = values.astype(np.float64)
    return numbers if numbers.ndim == 2 else numbers.reshape(-1, 1)


def _cells(words: list[str]) -> NDArray[np.object_]:
    """Words as a column of a cell array."""
    cells = np.empty((len(words), 1), dtype=object)
    cells[:, 0] = words
    return cells
