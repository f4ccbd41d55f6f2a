"""What a folder holds that could be a test: photographs and their times, logs, empty runs, calibrations."""

import glob
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from ploughval.errors import PloughvalError
from ploughval.photos.reading.decode import ENDINGS
from ploughval.run.setup.survey_logs import Logs, find_logs
from ploughval.run.setup.survey_photos import Photos, find_photos
from ploughval.run.setup.survey_tables import ENDINGS as TABLES
from ploughval.run.setup.survey_tables import TableFile, look_at_table, of_empty_box

_NO_TEST = frozenset({"results", "truth"})
_BOARD_ROOMS = frozenset({"calibration", "calib", "kalibrierung", "board"})
_CALIBRATION = "calibration.json"


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """What was found in a folder; names are relative to it, with forward slashes.

    Attributes
    ----------
    photos : Photos or None
    logs : Logs
    empty : tuple of str
        Patterns of runs that by their names or folder are of an empty box.
    boards : tuple of str
        Pictures in a folder for the calibration.
    cell_tables : tuple of str
        Tables that calibrate the cells.
    calibrations : tuple of str
        calibration.json that fit the photographs; those outside of the folder begin with "..".
    """

    photos: Photos | None = None
    logs: Logs = field(default_factory=Logs)
    empty: tuple[str, ...] = ()
    boards: tuple[str, ...] = ()
    cell_tables: tuple[str, ...] = ()
    calibrations: tuple[str, ...] = ()


def survey(folder: Path) -> Survey:
    """Look through a folder and its folders, two levels down, without changing anything."""
    files = sorted(p for depth in ("*", "*/*", "*/*/*") for p in folder.glob(depth) if p.is_file())
    files = [p for p in files if not any(part.startswith(".") for part in p.relative_to(folder).parts)]
    files = [p for p in files if not _NO_TEST & set(_rooms(p, folder))]
    in_board_room = [p for p in files if _BOARD_ROOMS & set(_rooms(p, folder))]
    tables = [look_at_table(p, folder) for p in files if p.suffix.lower() in TABLES]
    photos = find_photos(
        [p for p in files if p not in set(in_board_room) and not of_empty_box(p, folder)],
        folder,
        [t.path for t in tables if t.kind == "times"],
    )
    return Survey(
        photos=photos,
        logs=_logs([t for t in tables if t.path not in set(in_board_room)], folder),
        empty=_patterns([t.path for t in tables if t.kind == "empty"], folder),
        boards=tuple(_name(p, folder) for p in in_board_room if p.suffix.lower() in ENDINGS),
        cell_tables=tuple(_name(t.path, folder) for t in tables if t.kind == "calibration"),
        calibrations=_calibrations(folder, photos),
    )


def _logs(tables: Sequence[TableFile], folder: Path) -> Logs:
    """The logs; where no table has the columns of one, the first that may be one."""
    known, unclear = ([t for t in tables if t.kind == kind] for kind in ("log", "unclear"))
    found = find_logs(known or unclear, folder)
    left = [_name(t.path, folder) for t in unclear] if known else []
    return replace(found, left=(*found.left, *left))


def _rooms(path: Path, folder: Path) -> tuple[str, ...]:
    """Names of the folders between `folder` and a file, lower case."""
    return tuple(part.lower() for part in path.relative_to(folder).parts[:-1])


def _name(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix()


def _patterns(paths: Sequence[Path], folder: Path) -> tuple[str, ...]:
    """Patterns of the files like these in their folders; the names themselves at the top."""
    found = [
        _name(p, folder)
        if p.parent == folder
        else f"{glob.escape(p.parent.relative_to(folder).as_posix())}/*{p.suffix}"
        for p in paths
    ]
    return tuple(dict.fromkeys(found))


def _calibrations(folder: Path, photos: Photos | None) -> tuple[str, ...]:
    """Files calibration.json here or in the results of a test beside, for photographs of this size."""
    if photos is None or photos.header is None:
        return ()
    from ploughval.photos.calibration.file import read_calibration

    own = [*folder.glob(_CALIBRATION), *folder.glob(f"*/{_CALIBRATION}")]
    beside = sorted(folder.resolve().parent.glob(f"*/results/{_CALIBRATION}"))
    found = []
    for path in [*own, *(p for p in beside if folder.resolve() not in p.parents)]:
        try:
            read_calibration(path, photos.header.shape)
        except PloughvalError:
            continue
        found.append(Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix())
    return tuple(found)
