"""Several test folders and where their results go: a place each, and no test twice."""

import os
from collections.abc import Sequence
from pathlib import Path

from ploughval.errors import ConfigError, Fault
from ploughval.run.urls import is_url, joined, last_name, shown

SETTINGS = "test.toml"


def result_folders(folders: Sequence[str], out: str | None) -> list[str | None]:
    """Where each test's results go: OUT itself for one test, OUT/<folder name> for several.

    Parameters
    ----------
    folders : sequence of str
        Test folders, or their test.toml; paths or URLs.
    out : str or None
        None: each test's own results.

    Returns
    -------
    list of str or None
        None: the test's own.

    Examples
    --------
    >>> result_folders(["x/a", "y/a", "z/b"], "o") == [os.path.join("o", name) for name in ("a", "a-2", "b")]
    True
    """
    if out is None:
        return [None] * len(folders)
    if len(folders) == 1:
        return [out]
    names: list[str] = []
    for folder in folders:
        name, count = last_name(folder_of(folder)), 1
        # by case too: some file systems do not tell names apart by it
        while _numbered(name, count).casefold() in {known.casefold() for known in names}:
            count += 1
        names.append(_numbered(name, count))
    return [str(joined(out, name)) for name in names]


def _numbered(name: str, count: int) -> str:
    return name if count == 1 else f"{name}-{count}"


def refuse_doubles(folders: Sequence[str], targets: Sequence[str | None]) -> None:
    """Refuse a test that is given twice, and two tests whose results would lie in one folder.

    Parameters
    ----------
    folders : sequence of str
        Test folders, or their test.toml.
    targets : sequence of str or None
        Where the results of each go, as of :func:`result_folders`.

    Raises
    ------
    ConfigError
        With every such pair.
    """
    faults = []
    tests: dict[object, int] = {}
    results: dict[object, int] = {}
    for index, (folder, target) in enumerate(zip(folders, targets, strict=True)):
        test = folder_of(folder)
        place = str(joined(test, "results")) if target is None else target
        first = tests.setdefault(_identity(test), index)
        other = results.setdefault(_identity(place), index)
        if first != index:
            faults.append(
                Fault(
                    shown(folder), f"the test {shown(folders[first])} again", "each test once", "Leave it out"
                )
            )
        elif other != index:
            clash = f"results in {shown(place)}, where those of {shown(folders[other])} go"
            faults.append(Fault(shown(folder), clash, "a result folder for each test", "Give --out"))
    if faults:
        raise ConfigError("several tests", faults)


def folder_of(place: str) -> str:
    """The test folder of a folder or of its test.toml.

    >>> folder_of("s3://b/a/test.toml"), folder_of("a/")
    ('s3://b/a', 'a/')
    """
    if is_url(place):
        return place.removesuffix(f"/{SETTINGS}")
    return str(Path(place).parent) if Path(place).name == SETTINGS else place


def _identity(place: str) -> object:
    """The same for two names of one folder, whether it is there or is still to be made."""
    if is_url(place):
        return place.rstrip("/")
    path = Path(os.path.realpath(place))
    for made in (path, *path.parents):
        try:
            state = made.stat()
        except OSError:
            continue
        return state.st_dev, state.st_ino, path.relative_to(made).as_posix()
    return path
