"""The files of a test's log, and how [loadcells] says to read them."""

from collections.abc import Sequence
from pathlib import Path

from ploughval.loadcells.logs.log import Log, read_log
from ploughval.scene import LoadCells, Scene


def log_paths(scene: Scene, cells: LoadCells) -> list[Path]:
    """Files of the log: each pattern's in the natural order of their names, none twice."""
    found: dict[Path, None] = {}
    for pattern in cells.log_patterns:
        paths = scene.matches(pattern) or [scene.path(pattern)]
        if len(paths) > 1:
            from ploughval.photos.series.order import natural_key

            paths = sorted(paths, key=lambda path: natural_key(path.as_posix()))
        found |= dict.fromkeys(paths)
    return list(found)


def read_cell_log(paths: Path | Sequence[Path], cells: LoadCells) -> Log:
    """Read a log, an empty run or a calibration run as the test's [loadcells] table says.

    Raises
    ------
    DataError, MissingExtraError
        As :func:`ploughval.loadcells.logs.log.read_log`.
    """
    return read_log(paths, cells.columns, rate_hz=cells.rate_hz, calibration=cells.calibration)
