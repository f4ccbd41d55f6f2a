"""A test behind a URL: staged into local scratch, processed there, its results put back."""

import json
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath
from typing import Any

from ploughval.errors import ConfigError, DataError, Fault, PloughvalError
from ploughval.limits import FILE_BYTES, SETTINGS_BYTES, size_in_words
from ploughval.run.kept.store import CACHE, key_of
from ploughval.run.kept.written import write_json, write_text
from ploughval.run.outcome import Outcome
from ploughval.run.remote.mirror import Entry, Mirror
from ploughval.run.results import FILES
from ploughval.run.urls import is_url, joined, shown
from ploughval.scene import read_toml
from ploughval.scene_faults import named_files

SETTINGS = "test.toml"
FITTED = ("fit.json", "fit_force.csv", "fit_profiles.csv", "fit_landscape.csv")
"""What an earlier fit left among the results, and the page shows."""
_LAST = ("report.html", "run.json")
_SMALL = ("camera.times", "camera.calibration")


class Staged:
    """A test of which the folder, the results or both are behind a URL, with its copy on this machine.

    Parameters
    ----------
    folder : path-like or str
        Test folder: a path or a URL.
    out : path-like, str or None
        Result folder: a path or a URL; None: ``results`` in the test folder.
    scratch : Path
        Folder of this machine in which the copy is made; an earlier copy of the same test is used again.

    Attributes
    ----------
    folder, out : Path
        Where test and results are on this machine.
    is_remote : bool
        Whether there is a URL at all; without one nothing is copied.

    Raises
    ------
    PloughvalError
        A URL that cannot be used.
    """

    def __init__(self, folder: Path | str, out: Path | str | None, scratch: Path) -> None:
        folder, out = _places(folder, out)
        self._marker = copy_name(folder, out)
        self._base = scratch / self._marker
        self._test = self._mirror(folder, "test")
        self._results = self._mirror(out, "results")
        self.folder = Path(folder) if self._test is None else self._test.here
        self.out = Path(out) if self._results is None else self._results.here
        self.is_remote = self._test is not None or self._results is not None
        self._folder_shown, self._out_shown = shown(folder), shown(out)

    def bring(self, *, fresh: bool = False) -> None:
        """Fetch what the test's settings name and, unless it starts over, what earlier runs kept.

        Raises
        ------
        PloughvalError
            Without settings, with files beyond a limit, names that lead elsewhere, or a store that fails.
        """
        if self._test is not None:
            self._bring_test(self._test)
        if self._results is not None:
            kept = {
                name: entry for name, entry in self._results.files().items() if _is_kept(name, fresh=fresh)
            }
            self._results.fetch(kept)
            self._results.keep_only(kept)

    def keep(self) -> None:
        """Put back what the store holds, so that another machine goes on from there."""
        if self._results is None:
            return
        self._results.put(sorted(name for name in self._local() if _in_store(name)))
        there = self._results.files(CACHE)
        self._results.drop(name for name in there if _in_store(name) and not (self.out / name).is_file())

    def deliver(self, outcome: Outcome) -> Outcome:
        """Put the results back, run.json last; the outcome as seen from outside."""
        if not self.is_remote:
            return outcome
        self._name_places()
        if self._results is not None:
            there = self._results.files()
            self._results.drop(name for name in _LAST if name in there)
            local = self._local()
            self._results.put([*sorted(local - set(_LAST)), *(name for name in _LAST if name in local)])
            stale = [n for n in there if (n in FILES or _in_store(n)) and n not in local]
            self._results.drop(stale)
        return self._told(outcome)

    def remove(self) -> None:
        """Remove the copy."""
        remove_copy(self._base.parent, self._marker)

    @contextmanager
    def named(self) -> Iterator[None]:
        """Let errors name the places as they were given instead of their copies.

        Raises
        ------
        PloughvalError
            With the text of the one that was raised.
        """
        try:
            yield
        except PloughvalError as error:
            text = self.outside(str(error))
            if text == str(error):
                raise
            raise PloughvalError(text) from None

    def outside(self, text: str) -> str:
        """A text with the places as they were given instead of their copies, here or on another machine."""
        for copy, place in ((self.folder, self._folder_shown), (self.out, self._out_shown)):
            if self._base in copy.parents:
                for slash in "/\\":
                    text = _replaced(
                        text.replace(str(copy), place), f"{self._marker}{slash}{copy.name}", place
                    )
        return text

    def _mirror(self, place: Path | str, name: str) -> Mirror | None:
        if not is_url(place):
            return None
        return Mirror(str(place), self._base / name, self._base / f"{name}.json")

    def _bring_test(self, test: Mirror) -> None:
        there = test.files() if test.holds(SETTINGS) else {}  # what is no test may be large to list
        settings = there.get(SETTINGS)
        if settings is None:
            expected, remedy = "a test folder with its test.toml", "Check the address."
            raise ConfigError(
                f"{self._folder_shown}/{SETTINGS}", [Fault("file", "nothing", expected, remedy)]
            )
        self._refuse_large({SETTINGS: SETTINGS_BYTES}, there)
        test.fetch({SETTINGS: settings})
        limits = wanted_files(_raw_settings(test.here / SETTINGS), there)
        self._refuse_large(limits, there)
        self._refuse_inputs(limits)
        named = {SETTINGS: settings, **{name: there[name] for name in limits}}
        test.fetch(named)
        test.keep_only(named)

    def _refuse_large(self, limits: Mapping[str, int], there: Mapping[str, Entry]) -> None:
        for name, most in limits.items():
            size = there[name].size
            if size > most:
                told = f"holds {size_in_words(size)}; expected at most {size_in_words(most)}"
                raise DataError(
                    f"{told}. Keep only the part of the test in it", path=f"{self._folder_shown}/{name}"
                )

    def _refuse_inputs(self, names: Iterable[str]) -> None:
        """Refuse a result folder in which a file of the test itself would be written over."""
        inputs = {f"{self._folder_shown}/{name}" for name in names}
        taken = [name for name in FILES if f"{self._out_shown}/{name}" in inputs]
        if taken:
            expected = f"a folder apart from the test's own {', '.join(taken)}"
            fault = Fault("--out", self._out_shown, expected, "Choose another place.")
            raise ConfigError(f"{self._folder_shown}/{SETTINGS}", [fault])

    def _local(self) -> set[str]:
        """Files of the result folder here that are results or kept for later."""
        names = (path.relative_to(self.out).as_posix() for path in self.out.rglob("*") if path.is_file())
        return {name for name in names if name in FILES or name in FITTED or _in_store(name)}

    def _name_places(self) -> None:
        """Let records and page name the places as they were given."""
        for name in ("run.json", "metrics.json"):
            path = self.out / name
            if path.is_file():
                value = json.loads(path.read_text("utf-8"))
                if name == "run.json":
                    value["folder"] = self._folder_shown
                write_json(path, _mapped(value, self.outside))
        page = self.out / "report.html"
        if page.is_file():
            text = page.read_text("utf-8")
            if (named := self.outside(text)) != text:
                write_text(page, named)

    def _told(self, outcome: Outcome) -> Outcome:
        report = None if outcome.report is None else joined(self._out_shown, Path(outcome.report).name)
        results = self._out_shown if is_url(self._out_shown) else Path(self._out_shown)
        return replace(
            outcome,
            results=results,
            report=report,
            faults=tuple(map(self.outside, outcome.faults)),
            warnings=tuple(map(self.outside, outcome.warnings)),
        )


def copy_name(folder: Path | str, out: Path | str | None) -> str:
    """The name that a copy of a test has in scratch: on every machine the same, and without secrets."""
    return f"ploughval-{key_of(*map(str, _places(folder, out)))[:16]}"


def remove_copy(scratch: Path, name: str) -> None:
    """Remove a copy by its name."""
    shutil.rmtree(scratch / name, ignore_errors=True)


def _places(folder: Path | str, out: Path | str | None) -> tuple[Path | str, Path | str]:
    """Test and result folder: URLs without what changes nothing, paths from the root."""
    test = _without_settings(folder) if is_url(folder) else Path(folder).resolve()
    results = joined(test, "results") if out is None else out
    if not is_url(test):
        results = str(results).removeprefix("file://")  # where the test is, no copy is needed
    return test, str(results).rstrip("/") if is_url(results) else Path(results).resolve()


def wanted_files(data: Mapping[str, Any], names: Iterable[str]) -> dict[str, int]:
    """The files among the names that the raw settings of a test ask for, each with its largest size, bytes.

    >>> list(wanted_files({"camera": {"photos": "p/*.png"}}, ["p/1.png", "p/q/2.png", "p/1.txt"]))
    ['p/1.png']
    """
    wanted: dict[str, int] = {}
    names = list(names)
    for place, pattern, is_pattern in named_files(data):
        most = SETTINGS_BYTES if place in _SMALL else FILE_BYTES
        for name in names:
            if name == str(PurePosixPath(pattern)) or (is_pattern and matches(name, pattern)):
                wanted[name] = min(most, wanted.get(name, most))
    return wanted


def matches(name: str, pattern: str) -> bool:
    """Whether a name with forward slashes is one that the pattern finds in its folder.

    >>> matches("a/b/c.png", "**/*.png"), matches("c.png", "**/*.png"), matches("a/c.png", "*.png")
    (True, True, False)
    """
    parts = name.split("/")
    reached = {0}
    for piece in PurePosixPath(pattern).parts:
        if piece == "**":
            reached = set(range(min(reached), len(parts) + 1)) if reached else reached
        else:
            reached = {k + 1 for k in reached if k < len(parts) and fnmatchcase(parts[k], piece)}
    return len(parts) in reached


def _replaced(text: str, end: str, place: str) -> str:
    """A text with a place instead of every path that ends so, on whatever machine it was.

    >>> _replaced("frame 3: /tmp/x/m/test/a.png: empty", "m/test", "s3://b/t")
    'frame 3: s3://b/t/a.png: empty'
    """
    *before, rest = text.split(end)
    return "".join(part[: _path_begin(part)] + place for part in before) + rest


def _path_begin(text: str) -> int:
    """Where the path begins that a text ends in."""
    return max(text.rfind(sign) for sign in " \t\n\"'<>") + 1


def _without_settings(url: Path | str) -> str:
    """The test folder that a URL means, which may end in its test.toml."""
    return str(url).rstrip("/").removesuffix(f"/{SETTINGS}")


def _raw_settings(path: Path) -> dict[str, Any]:
    """What a test.toml says; nothing where it is none, which processing the test then tells."""
    with suppress(ConfigError):
        return read_toml(path)
    return {}


def _in_store(name: str) -> bool:
    return name.startswith(f"{CACHE}/") and name.endswith(".npz") and f"{CACHE}/." not in name


def _is_kept(name: str, *, fresh: bool) -> bool:
    return name in FITTED or (_in_store(name) and not fresh)


def _mapped(value: Any, change: Any) -> Any:
    if isinstance(value, dict):
        return {key: _mapped(item, change) for key, item in value.items()}
    if isinstance(value, list):
        return [_mapped(item, change) for item in value]
    return change(value) if isinstance(value, str) else value
