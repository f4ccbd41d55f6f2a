"""Broken folders: names, links, pipes, permissions, and paths that lead out of the test folder."""

import os
from collections.abc import Callable
from pathlib import Path

from broken.base import (
    PHOTOGRAPH,
    Case,
    closed,
    emptied,
    linked,
    piped,
    removed,
    renamed,
    setting,
    together,
    written,
)

_MEASURED = ("force.csv", "tracks.nc", "run.json")
_OUT = ("a path inside the test folder", "Copy")
_STRANGE = {
    "spaces": "a photo of sand.png",
    "quotes": "a \"photo\" of 'sand'.png",
    "a line break": "a\nphoto.png",
    "emoji": "sand \U0001f3d6\ufe0f.png",
    "Greek and Japanese": "άμμος 砂.png",
    "Arabic, from the right": "رمل.png",
    "a letter with a separate accent": "sable e\u0301crase\u0301.png",
    "HTML": "<script>alert(1)<&#47;script>.png",
    "a percent and a hash": "50%25#1?.png",
    "braces and backslashes": "{x}\\n$HOME`id`.png",
    "a terminal's escape": "\x1b[31mred.png",
    "235 letters": f"{'x' * 231}.png",
}
_FOLDERS = {
    "spaces": "a test of sand",
    "quotes": "a \"test\" of 'sand'",
    "a line break": "a\ntest",
    "emoji and alphabets": "\U0001f3d6 άμμος 砂 رمل",
    "brackets": "test [1]*?",
    "a dash in front": "-rf",
    "HTML": "<img src=x onerror=alert(1)>",
    "a terminal's escape": "\x1b[2Jtest",
}


def _strange_names() -> list[Case]:
    """Names that are unusual but right: nothing is lost."""
    photographs = [
        Case(f"name: a photograph with {what}", renamed("0002.png", name), (), (0,), _MEASURED)
        for what, name in _STRANGE.items()
    ]
    folders = [
        Case(f"name: a folder with {what}", lambda _: None, (), (0,), _MEASURED, folder=name)
        for what, name in _FOLDERS.items()
    ]
    return [*photographs, *folders]


def _bytes_name(folder: Path) -> None:
    path = folder / "photos" / os.fsdecode(b"0002-\xff\xfe.png")
    (folder / PHOTOGRAPH).rename(path)


def _out_of(place: str, wrap: Callable[[str], str] = lambda name: f'"{name}"') -> list[Case]:
    """A key that names files with names that lead out of the folder."""
    names = {
        "up": "../outside.csv",
        "up and back": "photos/../../outside.csv",
        "from the root": "/etc/passwd",
        "of Windows": "C:/outside.csv",
        "of a share": "//host/outside.csv",
        "with backslashes": "..\\\\outside.csv",
        "with a NUL": "out\\u0000side.csv",
        "of 5000 letters": "x" * 5000,
        "empty": "",
    }
    found = []
    for what, name in names.items():
        told = (
            "test.toml",
            place,
            "an existing file" if "letters" in what else "a path inside the test folder",
        )
        if "letters" in what and place in ("camera.photos", "loadcells.calibration.files"):
            told = ("test.toml", place, "at least one file that matches")
        codes: tuple[int, ...] = (2,)
        if "letters" in what and place == "loadcells.empty":  # a run that is missing costs that run alone
            told, codes = ("no file matches", "[loadcells] empty"), (1,)
        found.append(Case(f"path: {place} {what}", setting(place, wrap(name)), told, codes))
    return found


def _linked_photographs() -> list[Case]:
    outside = ("test.toml", "camera.photos", "lies outside the test folder", "Copy")
    return [
        Case(
            "link: a photograph to nowhere",
            linked(PHOTOGRAPH, "/nowhere/at/all.png"),
            ("0002.png", "not there"),
            (1,),
        ),
        Case("link: a photograph to itself", linked(PHOTOGRAPH, "0002.png"), ("0002.png", "not there"), (1,)),
        Case("link: a photograph to /", linked(PHOTOGRAPH, "/"), ("0002.png", "not there"), (1,)),
        Case(
            "link: a photograph out of the folder", linked(PHOTOGRAPH, "/etc/passwd"), (*outside, "0002.png")
        ),
        Case("link: a photograph up", _linked_up, (*outside, "0002.png")),
        Case("link: all photographs to /", linked("photos", "/"), ("test.toml", "camera.photos", "outside")),
        Case("link: all photographs to a folder beside", _linked_beside, outside),
        Case(
            "link: all photographs to the test folder", linked("photos", "."), ("test.toml", "camera.photos")
        ),
        Case(
            "link: a pattern through a link to /",
            together(linked("root", "/"), setting("camera.photos", '"root/*/*.png"')),
            ("test.toml", "camera.photos"),
        ),
        Case("link: a photograph to another one", linked(PHOTOGRAPH, "0001.png"), (), (0,), _MEASURED),
    ]


def _linked_tables() -> list[Case]:
    return [
        Case(
            "link: the log to nowhere",
            linked("loadcells.csv", "/nowhere"),
            ("loadcells.log", "existing file"),
        ),
        Case(
            "link: the log to itself",
            linked("loadcells.csv", "loadcells.csv"),
            ("loadcells.log", "existing file"),
        ),
        Case("link: the log to /", linked("loadcells.csv", "/"), ("loadcells.log", "an existing file")),
        Case(
            "link: the log to a device",
            linked("loadcells.csv", "/dev/zero"),
            ("loadcells.log", "existing file"),
        ),
        Case(
            "link: the log out of the folder",
            linked("loadcells.csv", "/etc/passwd"),
            ("loadcells.log", "outside"),
        ),
        Case(
            "link: the times out of the folder",
            linked("photos.csv", "/etc/passwd"),
            ("camera.times", "outside"),
        ),
        Case("link: test.toml to nowhere", linked("test.toml", "/nowhere"), ("test.toml", "ploughval init")),
        Case("link: test.toml to itself", linked("test.toml", "test.toml"), ("test.toml",)),
        Case("link: test.toml to /", linked("test.toml", "/"), ("test.toml",)),
        Case("link: test.toml to a device", linked("test.toml", "/dev/zero"), ("test.toml", "file")),
        Case(
            "link: an empty run out of the folder",
            linked("empty/run1.csv", "/etc/passwd"),
            ("empty", "outside"),
        ),
    ]


def _linked_beside(folder: Path) -> None:
    (folder / "photos").rename(folder.parent / "photos of another")
    (folder / "photos").symlink_to("../photos of another")


def _linked_up(folder: Path) -> None:
    (folder / PHOTOGRAPH).rename(folder.parent / "one.png")
    (folder / PHOTOGRAPH).symlink_to("../../one.png")


def _no_files() -> list[Case]:
    """Pipes and directories in the place of files; files in the place of directories."""
    return [
        Case("pipe: a photograph", piped(PHOTOGRAPH), ("0002.png", "not there"), (1,)),
        Case("pipe: the log", piped("loadcells.csv"), ("loadcells.log", "an existing file")),
        Case("pipe: the times", piped("photos.csv"), ("camera.times", "an existing file")),
        Case("pipe: test.toml", piped("test.toml"), ("test.toml", "a file")),
        Case("pipe: an empty run", piped("empty/run1.csv"), ("run1.csv",), (1,), _MEASURED),
        Case("directory: a photograph", emptied(PHOTOGRAPH), ("0002.png", "not there"), (1,)),
        Case("directory: the log", emptied("loadcells.csv"), ("loadcells.log", "an existing file")),
        Case("directory: the times", emptied("photos.csv"), ("camera.times", "an existing file")),
        Case("directory: test.toml", emptied("test.toml"), ("test.toml", "file")),
        Case("directory: the photographs are a file", _flat, ("camera.photos", "at least one file")),
        Case("missing: test.toml", removed("test.toml"), ("test.toml", "ploughval init")),
        Case("missing: the log", removed("loadcells.csv"), ("loadcells.log", "photos.csv")),
        Case("missing: the times", removed("photos.csv"), ("camera.times", "loadcells.csv")),
        Case("missing: a photograph", removed(PHOTOGRAPH), ("0002.png", "not there"), (1,), _MEASURED),
        Case(
            "missing: an empty run of two",
            removed("empty/run1.csv"),
            ("a single empty-box run",),
            (0,),
            _MEASURED,
        ),
        Case(
            "missing: an empty run that is named",
            _named_run,
            ("empty/run1.csv", "no file matches"),
            (1,),
            _MEASURED,
        ),
        Case("missing: all empty runs", _no_runs, ("no file matches", "empty/*.csv"), (1,), _MEASURED),
        Case(
            "name: a photograph of bytes that are no text", _bytes_name, ("camera.photos", "UTF-8", "Rename")
        ),
    ]


def _flat(folder: Path) -> None:
    (folder / "photos").rename(folder / "other")
    written("photos", "")(folder)


def _no_runs(folder: Path) -> None:
    for path in (folder / "empty").iterdir():
        path.unlink()


def _named_run(folder: Path) -> None:
    setting("loadcells.empty", '["empty/run1.csv", "empty/run2.csv"]')(folder)
    removed("empty/run1.csv")(folder)


def _no_results(folder: Path) -> None:
    out = folder.parent.parent / "out"
    out.mkdir()
    out.chmod(0o555)


def _permissions() -> list[Case]:
    """Seen only by those who are not root."""
    told = ("ermission",)
    return [
        Case("permission: a photograph", closed(PHOTOGRAPH), (*told, "0002"), (1,), _MEASURED),
        Case("permission: the photographs", closed("photos"), (*told, "test.toml", "camera.photos")),
        Case("permission: the log", closed("loadcells.csv"), (*told, "loadcells.csv"), (1, 2)),
        Case("permission: the times", closed("photos.csv"), (*told, "photos.csv")),
        Case("permission: test.toml", closed("test.toml"), (*told, "test.toml")),
        Case("permission: the folder", closed("."), ("test.toml",)),
        Case("permission: the empty runs", closed("empty"), ("[loadcells] empty", *told), (1,), _MEASURED),
        Case("permission: names alone of the photographs", closed("photos", 0o444), (*told, "camera.photos")),
        Case("permission: names alone of the folder", closed(".", 0o444), ("test.toml",)),
        Case("permission: an empty run", closed("empty/run1.csv"), (*told, "run1.csv"), (1,), _MEASURED),
        Case("permission: the results", _no_results, ("cannot be written", *told)),
    ]


def cases() -> list[Case]:
    """All of them."""

    def listed(name: str) -> str:
        return f'["{name}"]'

    ways: list[Case] = []
    for place in ("camera.photos", "camera.times", "camera.calibration", "loadcells.log"):
        ways += _out_of(place)
    for place in ("loadcells.empty", "loadcells.calibration.files"):
        ways += _out_of(place, listed)
    return [
        *_strange_names(),
        *_linked_photographs(),
        *_linked_tables(),
        *_no_files(),
        *_permissions(),
        *ways,
    ]
