"""Stage results kept by content beside the result files, so that a run resumes."""

import hashlib
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from ploughval.run.written import write_aside

CACHE = ".store"


def key_of(*parts: str) -> str:
    """Content key: SHA-256 over length-prefixed texts, so that no two lists of parts collide."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode("utf-8")
        digest.update(str(len(data)).encode() + b":" + data)
    return digest.hexdigest()


class Store:
    """Arrays of finished stages, kept beside the results under the key of all that they came from."""

    def __init__(self, results: Path, *, fresh: bool = False) -> None:
        self._folder = results / CACHE
        self._fresh = fresh

    def load(self, stage: str, key: str) -> dict[str, NDArray[Any]] | None:
        """Arrays of a finished stage, or None when it has to run."""
        path = self._path(stage, key)
        if self._fresh or not path.is_file():
            return None
        try:
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
                return {name: file[name] for name in file.files}
        except (OSError, ValueError, EOFError, KeyError, BadZipFile):
            return None

    def save(self, stage: str, key: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep the arrays of a finished stage and drop what the stage left under other keys."""
        path = self._path(stage, key)
        write_aside(path, lambda p: _write_npz(p, arrays))
        for old in self._folder.glob(f"{stage}-*.npz"):
            if old != path:
                with suppress(OSError):
                    old.unlink()

    def _path(self, stage: str, key: str) -> Path:
        return self._folder / f"{stage}-{key[:32]}.npz"


def _write_npz(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)
