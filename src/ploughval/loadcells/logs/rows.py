"""Where the rows of a log stand: row of the log, line of the file, and file of several, in words."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

_SHOWN = 5


@dataclass(frozen=True, slots=True)
class FileRows:
    """The rows of one file that are in use.

    Attributes
    ----------
    name : str
        The file, for messages.
    count : int
    first_line : int or None
        Line of the file, from 1, of its first row; None for a file without lines.
    rows, lines : (count,) int or None
        Row from 0 after the headers and line of each; None where they follow one another.
    """

    name: str
    count: int
    first_line: int | None = None
    rows: NDArray[np.intp] | None = None
    lines: NDArray[np.intp] | None = None

    def take(self, places: NDArray[np.intp]) -> "FileRows":
        """Only the rows at these places, in this order."""
        return replace(self, count=places.size, rows=self._rows(places), lines=self._lines(places))

    def numbers(self) -> NDArray[np.intp]:
        """Row from 0 after the headers of every row in use: (count,) int."""
        return self._rows(np.arange(self.count))

    def describe(self, places: NDArray[np.intp]) -> str:
        """Rows at these places, with their lines.

        >>> FileRows("log.csv", 100, first_line=3).describe(np.array([4, 7]))
        'rows 4, 7 (lines 7, 10)'
        """
        one = places.size == 1
        text = f"row{'' if one else 's'} {', '.join(map(str, self._rows(places)))}"
        if self.first_line is None:
            return text
        return f"{text} (line{'' if one else 's'} {', '.join(map(str, self._lines(places)))})"

    def _rows(self, places: NDArray[np.intp]) -> NDArray[np.intp]:
        return places if self.rows is None else self.rows[places]

    def _lines(self, places: NDArray[np.intp]) -> NDArray[np.intp]:
        return places + (self.first_line or 0) if self.lines is None else self.lines[places]


def name_rows(places: NDArray[np.integer], files: Sequence[FileRows] = ()) -> str:
    """Rows in words: the first few, with file and line where these are known, and how many more.

    Parameters
    ----------
    places : (M,) int
        Places in the table, from 0.
    files : sequence of FileRows
        The files whose rows make up the table, in its order; none: places are rows.

    Returns
    -------
    str

    Examples
    --------
    >>> name_rows(np.array([4, 7])), name_rows(np.arange(10, 90))
    ('rows 4, 7', 'rows 10, 11, 12, 13, 14 and 75 more')
    """
    shown = np.asarray(places[:_SHOWN], dtype=np.intp)
    more = f" and {len(places) - _SHOWN} more" if len(places) > _SHOWN else ""
    if not files:
        return FileRows("", 0).describe(shown) + more
    starts = np.concatenate([[0], np.cumsum([file.count for file in files])])
    owner = np.searchsorted(starts, shown, side="right") - 1
    parts = []
    for k in dict.fromkeys(owner.tolist()):
        text = files[k].describe(shown[owner == k] - starts[k])
        parts.append(text if len(files) == 1 else f"{files[k].name} {text}")
    return "; ".join(parts) + more
