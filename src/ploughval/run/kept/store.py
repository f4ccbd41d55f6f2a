"""Stage results kept by content beside the result files, so that a run resumes."""

import hashlib
import json
import re
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.run.kept.written import clean_aside, write_aside

CACHE = ".store"
UNREADABLE = "what was kept cannot be read"
SAME = "same inputs, settings and code"
Arrays = dict[str, NDArray[Any]]
_NAME = re.compile(r"(?P<stage>[a-z]+)(?:-\d+)?-(?P<key>[0-9a-f]{32})\.npz")
_KEY = "__key__"
_BROKEN = (
    OSError,
    ValueError,
    EOFError,
    KeyError,
    TypeError,
    BadZipFile,
    NotImplementedError,
    RuntimeError,
    zlib.error,
)
"""What numpy and zipfile raise at a file that is cut off, changed or of another kind."""


@dataclass(frozen=True, slots=True)
class Key:
    """What a stage's result came from: a text for each part, by a name that a user understands.

    >>> Key.of(code="1", settings="2").digest == Key.of(settings="2", code="1").digest
    False
    """

    parts: tuple[tuple[str, str], ...]

    @classmethod
    def of(cls, **parts: str) -> "Key":
        """A key from named parts; an underscore in a name stands for a space."""
        return cls(tuple((name.replace("_", " "), part) for name, part in parts.items()))

    @property
    def digest(self) -> str:
        """SHA-256 over length-prefixed texts, so that no two lists of parts collide, hexadecimal."""
        return key_of(*(text for part in self.parts for text in part))

    def to_json(self) -> str:
        """The digest of each part, as text."""
        return json.dumps({name: key_of(part) for name, part in self.parts})

    def changed_from(self, told: str) -> list[str]:
        """Names of the parts that differ from another key's :meth:`to_json`."""
        before = json.loads(told)
        return [name for name, part in self.parts if before.get(name) != key_of(part)]


def key_of(*parts: str) -> str:
    """SHA-256 over length-prefixed texts, so that no two lists of parts collide, hexadecimal."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode("utf-8", "surrogatepass")
        digest.update(str(len(data)).encode() + b":" + data)
    return digest.hexdigest()


class Store:
    """Arrays of finished stages, kept beside the results under the key of all that they came from.

    Attributes
    ----------
    results : Path
        The result folder.
    refused : list of str
        What could not be kept, and why: it has to be made again by the next run.
    told : dict of str to (bool, str)
        Of each stage that was asked for: whether it was found, and why or why not.
    """

    def __init__(self, results: Path, *, fresh: bool = False) -> None:
        self.results = results
        self._folder = results / CACHE
        self._fresh = fresh
        self.refused: list[str] = []
        self.told: dict[str, tuple[bool, str]] = {}

    def load(self, stage: str, key: Key) -> Arrays | None:
        """Arrays of a finished stage, or None when it has to run: whatever is wrong with what was kept.

        What the stage left under other keys is dropped when it is found: a killed run had no time to.
        """
        path = self._path(stage, key)
        arrays = None if self._fresh else _read_npz(path)
        if arrays is not None and str(arrays.pop(_KEY, None)) == key.to_json():
            self.told[stage] = True, SAME
            self._drop_others(stage, path)
            return arrays
        self.told[stage] = False, self._why_not(stage, key)
        return None

    def _why_not(self, stage: str, key: Key) -> str:
        if self._fresh:
            return "asked to start over"
        if self._path(stage, key).is_file():
            return UNREADABLE
        for path in self._of(stage):
            with suppress(*_BROKEN), _opened(path) as file:
                return f"changed: {', '.join(key.changed_from(str(file[_KEY])))}"
        return "nothing was kept"

    def save(self, stage: str, key: Key, arrays: Mapping[str, NDArray[Any]]) -> bool:
        """Keep the arrays of a finished stage and drop what the stage left under other keys.

        Returns
        -------
        bool
            Whether they are kept. A disk that refuses costs only the keeping: ``refused`` says why.
        """
        path = self._path(stage, key)
        told = {_KEY: np.array(key.to_json())}
        try:
            write_aside(path, lambda aside: _write_npz(aside, {**arrays, **told}))
        except DataError as error:
            self.refused.append(f"{stage}: not kept for another run: {error}")
            return False
        self._drop_others(stage, path)
        return True

    def refuse(self, stage: str) -> None:
        """Say of a stage that was found that it is not what it should be, and has to run."""
        self.told[stage] = False, UNREADABLE

    def drop(self, stage: str) -> None:
        """Forget a stage and its numbered pieces, under whatever key."""
        _remove(self._of(stage, pieces=True))

    def clean(self) -> None:
        """Remove what killed runs left half-written and, when asked to start over, all that is kept.

        Only for who holds the folder's lock.
        """
        clean_aside(self._folder)
        if self._fresh:
            _remove(path for path in self._listed() if _NAME.fullmatch(path.name))

    def _drop_others(self, stage: str, path: Path) -> None:
        _remove(old for old in self._of(stage) if old != path)

    def _of(self, stage: str, *, pieces: bool = False) -> list[Path]:
        """Files of a stage, under whatever key."""
        found = ((path, _NAME.fullmatch(path.name)) for path in self._listed())
        names = ((path, match) for path, match in found if match is not None)
        if pieces:
            return [path for path, match in names if match["stage"] == stage]
        return [path for path, match in names if path.name == f"{stage}-{match['key']}.npz"]

    def _listed(self) -> list[Path]:
        try:
            return sorted(self._folder.iterdir())
        except OSError:
            return []

    def _path(self, stage: str, key: Key) -> Path:
        return self._folder / f"{stage}-{key.digest[:32]}.npz"


def _remove(paths: Iterator[Path] | list[Path]) -> None:
    for path in paths:
        with suppress(OSError):
            path.unlink(missing_ok=True)


def _read_npz(path: Path) -> Arrays | None:
    """The arrays of a file; None where there is none, or it is not whole."""
    if not path.is_file():
        return None
    with suppress(*_BROKEN), _opened(path) as file:
        return {name: file[name] for name in file.files}
    return None


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    # opened here, for numpy leaves a file open that is none of its own
    with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
        yield file


def _write_npz(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)
