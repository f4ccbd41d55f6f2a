"""A folder of exported files, made aside and put into its place whole."""

import shutil
import tempfile
from collections.abc import Callable, Collection
from pathlib import Path

from ploughval.disk import unwritable
from ploughval.errors import DataError


def replace_folder(target: Path, write: Callable[[Path], None], endings: Collection[str]) -> None:
    """Make a folder beside its place and rename it there; an earlier export of the same kind goes.

    Parameters
    ----------
    target : Path
        The folder; what is above it is made when missing.
    write : callable
        Gets the temporary folder and writes every file there; lets OSError pass.
    endings : collection of str
        Of the files that an export of this kind writes: a folder that holds others is left alone.

    Raises
    ------
    DataError
        When the disk refuses, or the folder holds a file that no export of this kind writes.
    """
    foreign = _foreign(target, endings)
    if foreign is not None:
        raise DataError(
            f"{foreign}, which an export would replace; expected the folder of an earlier export, or none. "
            "Move it, or choose another --out",
            path=target,
        )
    aside: Path | None = None
    try:
        with unwritable(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            aside = Path(tempfile.mkdtemp(dir=target.parent, prefix=f".{target.name}.part-"))
            new, old = aside / "new", aside / "old"
            new.mkdir()
            write(new)
            if target.exists():
                target.rename(old)
            try:
                new.rename(target)
            except OSError:
                old.rename(target)
                raise
    finally:
        if aside is not None:
            shutil.rmtree(aside, ignore_errors=True)


def _foreign(target: Path, endings: Collection[str]) -> str | None:
    """What in the folder's place an export did not write, in words, or None."""
    if target.is_symlink() or (target.exists() and not target.is_dir()):
        return "is a file or a link"
    files = (path for path in sorted(target.rglob("*")) if path.is_symlink() or not path.is_dir())
    foreign = (path for path in files if path.is_symlink() or path.suffix not in endings)
    return next((f"holds {path.relative_to(target)}" for path in foreign), None)
