"""A folder behind a URL and its copy on this machine: what changed is fetched, files are put back whole."""

import errno
import json
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from uuid import uuid4

from ploughval.errors import DataError
from ploughval.limits import size_in_words
from ploughval.run.kept.written import write_aside, write_json
from ploughval.run.urls import WHOLE_OBJECTS, answering, file_system, shown, without_secrets
from ploughval.scene_faults import leaves

_STAMPS = ("ETag", "etag", "md5Hash", "content_md5", "generation", "mtime", "LastModified", "last_modified")
"""What drivers tell of a file that changes when its bytes do; `created` stands in where there is none."""
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EROFS}
_ELSEWHERE = "free space, or name another place: TMPDIR here, --local-directory of a dask worker"
_LOCAL = ("file", "local")


@dataclass(frozen=True, slots=True)
class Entry:
    """A file behind a URL: its size, bytes, a text that changes with it, and whether it is a link."""

    size: int
    stamp: str
    link: bool = False


class Mirror:
    """A folder behind a URL and its copy here.

    Parameters
    ----------
    url : str
        The folder.
    here : Path
        Where the copy is kept.
    record : Path
        JSON file that remembers what was fetched and put, so that only what changed goes over the network.
    """

    def __init__(self, url: str, here: Path, record: Path) -> None:
        self.url, self.here, self._record = url, here, record
        self._system, self._root = file_system(url)
        self._protocol = url.partition("://")[0]

    def files(self, inside: str = "") -> dict[str, Entry]:
        """Every file of the folder, or of a folder inside it, by its name with forward slashes."""
        root = f"{self._root}/{inside}".rstrip("/")
        with answering(self.url):
            self._system.invalidate_cache()
            try:
                found = self._system.find(root, detail=True)
            except FileNotFoundError:
                return {}
        start = len(self._root) + 1
        return {
            name[start:]: _entry(info) for name, info in sorted(found.items()) if _is_file(name, root, info)
        }

    def holds(self, name: str) -> bool:
        """Whether there is a file of this name, without a look at the others."""
        with answering(self.url):
            try:
                self._system.info(f"{self._root}/{name}")
            except FileNotFoundError:
                return False
        return True

    def fetch(self, entries: Mapping[str, Entry]) -> int:
        """Copy the files that are not here as they are there; each is here as a whole or not at all.

        Returns
        -------
        int
            How many came over the network.

        Raises
        ------
        DataError
            A name that leads elsewhere, a link, a full disk, a store that does not answer.
        """
        self._refuse(entries)
        known = self._known()
        wanted = [name for name, entry in entries.items() if not self._has(name, entry, known)]
        self._refuse_full(sum(entries[name].size for name in wanted))
        aside = self.here / f".incoming-{uuid4().hex}"
        places = [aside / str(k) for k in range(len(wanted))]
        try:
            with self._writing():
                aside.mkdir(parents=True)
            self._get(wanted, places)
            for name, place in zip(wanted, places, strict=True):
                self._take(place, name, entries[name], known)
            self._refuse_one_for_two(entries)
        finally:
            shutil.rmtree(aside, ignore_errors=True)
            write_json(self._record, known)
        return len(wanted)

    def keep_only(self, names: Iterable[str]) -> None:
        """Remove what was fetched earlier and is not among the names."""
        known = self._known()
        for name in set(known) - set(names):
            with suppress(OSError):
                (self.here / name).unlink()
            del known[name]
        write_json(self._record, known)

    def put(self, names: Iterable[str]) -> int:
        """Put files of the copy that changed in their places there, in this order; each appears as a whole.

        Returns
        -------
        int
            How many went over the network.
        """
        known = self._known()
        changed = [name for name in names if known.get(name, ["", -1, -1])[1:] != self._local_state(name)]
        if not changed:
            return 0
        with answering(self.url):
            for name in changed:
                self._put_one(name)
        there = self.files()
        for name in changed:
            if name in there:
                known[name] = [there[name].stamp, *self._local_state(name)]
        write_json(self._record, known)
        return len(changed)

    def drop(self, names: Iterable[str]) -> None:
        """Remove files there that are there."""
        known = self._known()
        with answering(self.url):
            for name in names:
                known.pop(name, None)
                with suppress(FileNotFoundError):
                    self._system.rm_file(f"{self._root}/{name}")
        write_json(self._record, known)

    def _get(self, names: list[str], places: list[Path]) -> None:
        if not names:
            return
        with answering(self.url):
            try:
                self._system.get([f"{self._root}/{name}" for name in names], list(map(str, places)))
            except FileNotFoundError as error:
                told = without_secrets(str(error), self.url)
                raise DataError(
                    f"a file went away meanwhile ({told}); run again", path=shown(self.url)
                ) from None
            except OSError as error:
                if error.errno in _FULL:
                    raise self._refused_here(error) from None
                raise

    def _put_one(self, name: str) -> None:
        source, target = self.here / name, f"{self._root}/{name}"
        if self._protocol in _LOCAL:
            write_aside(Path(target), lambda aside: shutil.copyfile(source, aside))
        elif self._protocol in WHOLE_OBJECTS:
            self._system.put_file(str(source), target)
        else:
            folder, _, last = target.rpartition("/")
            aside = f"{folder}/.{last}-{uuid4().hex[:8]}.aside"
            self._system.makedirs(folder, exist_ok=True)
            try:
                self._system.put_file(str(source), aside)
                self._system.mv(aside, target)
            except BaseException:
                with suppress(Exception):
                    self._system.rm_file(aside)
                raise

    def _take(self, place: Path, name: str, entry: Entry, known: dict[str, list[Any]]) -> None:
        """Move a file that came in to its name, if it is whole."""
        with self._writing():
            size = place.stat().st_size
            if size != entry.size:
                raise DataError(
                    f"{name} came in with {size} bytes; expected {entry.size}. It changed: run again",
                    path=shown(self.url),
                )
            target = self.here / name
            target.parent.mkdir(parents=True, exist_ok=True)
            place.replace(target)
        known[name] = [entry.stamp, *self._local_state(name)]

    def _has(self, name: str, entry: Entry, known: Mapping[str, list[Any]]) -> bool:
        state = [entry.stamp, *self._local_state(name)]
        return bool(entry.stamp) and known.get(name) == state and state[1] == entry.size

    def _local_state(self, name: str) -> list[int]:
        """Size and time of change of a file of the copy; -1 where it is not there."""
        try:
            state = (self.here / name).stat()
        except (OSError, ValueError):
            return [-1, -1]
        return [state.st_size, state.st_mtime_ns]

    def _known(self) -> dict[str, list[Any]]:
        try:
            known = json.loads(self._record.read_text("utf-8"))
        except (OSError, ValueError):
            return {}
        return known if isinstance(known, dict) else {}

    def _refuse(self, entries: Mapping[str, Entry]) -> None:
        folders = {parent for name in entries for parent in _parents(name)}
        for name, entry in entries.items():
            fault = _fault_of(name, entry, folders)
            if fault:
                raise DataError(fault, path=f"{shown(self.url)}/{name!r}"[:300])

    def _refuse_one_for_two(self, names: Iterable[str]) -> None:
        """Refuse names that are one to this machine's disk, as those that differ in case alone may be."""
        seen: dict[int, str] = {}
        for name in names:
            other = seen.setdefault((self.here / name).stat().st_ino, name)
            if other != name:
                told = f"{other!r} and {name!r} are one name to the disk of the copy, {self.here}"
                raise DataError(f"{told}; rename one of the two", path=shown(self.url))

    def _refuse_full(self, count: int) -> None:
        place = next(p for p in (self.here, *self.here.parents) if p.is_dir())
        free = shutil.disk_usage(place).free
        if count > free:
            raise DataError(
                f"has {size_in_words(free)} free for {size_in_words(count)} of {shown(self.url)}; "
                f"{_ELSEWHERE}",
                path=place,
            )

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Tell what this machine's disk refuses."""
        try:
            yield
        except OSError as error:
            raise self._refused_here(error) from None

    def _refused_here(self, error: OSError) -> DataError:
        return DataError(
            f"a copy of {shown(self.url)} cannot be written ({error.strerror or error}); {_ELSEWHERE}",
            path=self.here,
        )


def _is_file(name: str, root: str, info: Mapping[str, Any]) -> bool:
    kind = info.get("type", "file")
    return name.startswith(f"{root}/") and (kind in ("file", "link") or bool(info.get("islink")))


def _entry(info: Mapping[str, Any]) -> Entry:
    told = [str(info[key]) for key in _STAMPS if info.get(key) is not None] or [
        str(info.get("created") or "")
    ]
    size = int(info.get("size") or 0)
    stamp = " ".join([str(size), *told]) if any(told) else ""
    return Entry(size, stamp, info.get("type") == "link" or bool(info.get("islink")))


def _parents(name: str) -> list[str]:
    parts = name.split("/")[:-1]
    return ["/".join(parts[: k + 1]) for k in range(len(parts))]


def _fault_of(name: str, entry: Entry, folders: set[str]) -> str:
    """Why a name cannot be one of the copy; empty where it can."""
    if leaves(name) or "\0" in name or any(part in ("", ".") for part in name.split("/")):
        return "is no name inside a folder; expected parts between single slashes, none of them .. or ."
    if name in folders:
        return "is a file and a folder at once; rename one of the two"
    if entry.link:
        return "is a symbolic link; expected a file: put a copy of what it leads to in its place"
    return ""
