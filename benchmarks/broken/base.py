"""What a broken test folder is, the sound one that each is made from, and how its files are changed."""

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from ploughval.synth import EXAMPLE, make_folder

SOUND = replace(
    EXAMPLE,
    seed=5,
    name="sound",
    frames=4,
    displacement_mm=6.0,
    mm_per_px=0.9,
    layers_mm=(10.0, 20.0),
    dyed=False,
    rate_hz=10.0,
    rest_s=4.0,
    empty_runs=2,
    above_mm=20.0,
    below_mm=12.0,
    ahead_mm=140.0,
    behind_mm=20.0,
)
"""Four photographs of 255 x 73 px, 111 rows of a log, two empty runs."""
PHOTOGRAPH = "photos/0002.png"
"""One that is spoiled where one is: neither the first nor the last."""

Spoil = Callable[[Path], object]


@dataclass(frozen=True, slots=True)
class Case:
    """One broken folder.

    Attributes
    ----------
    name : str
        Name of the case.
    spoil : callable
        Gets a sound test folder and breaks it.
    told : tuple of str
        What the messages must hold: file, place, value, remedy.
    codes : tuple of int
        Exit codes that are right: 2 refused, 1 a part lost, 0 mended with a warning.
    kept : tuple of str
        Files of the results that must be there and hold numbers.
    folder : str
        Name of the test folder.
    heavy : bool
        Too large for the tests: hundreds of megabytes.
    slow : bool
        Seconds of the processor: left to the script.
    """

    name: str
    spoil: Spoil
    told: tuple[str, ...]
    codes: tuple[int, ...] = (2,)
    kept: tuple[str, ...] = ()
    folder: str = "test"
    heavy: bool = False
    slow: bool = False


def make_sound(folder: Path) -> None:
    """The sound test folder: measured, not modelled, so that it is processed in a second."""
    make_folder(folder, SOUND, overwrite=True)
    path = folder / "test.toml"
    path.write_text(path.read_text() + "\n[model]\nrun = false\n")


def setting(place: str, value: str) -> Spoil:
    """Set a key of test.toml, as ``blade.depth_mm``, to a text of TOML; without one it is taken out."""
    *table, key = place.split(".")
    head = f"[{'.'.join(table)}]"

    def spoil(folder: Path) -> None:
        lines = (folder / "test.toml").read_text().split("\n")
        if head not in lines:
            lines += [head]
        start = lines.index(head) + 1
        end = next((k for k in range(start, len(lines)) if lines[k].startswith("[")), len(lines))
        inside = [line for line in lines[start:end] if line.split("=")[0].strip() != key]
        added = [f"{key} = {value}"] if value else []
        (folder / "test.toml").write_text("\n".join([*lines[:start], *added, *inside, *lines[end:]]))

    return spoil


def together(*spoils: Spoil) -> Spoil:
    """Several changes, one after the other."""

    def spoil(folder: Path) -> None:
        for each in spoils:
            each(folder)

    return spoil


def written(name: str, data: bytes | str) -> Spoil:
    """A file with these contents in the place of what was there."""
    raw = data.encode() if isinstance(data, str) else data

    def spoil(folder: Path) -> None:
        path = folder / name
        path.unlink(missing_ok=True)
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(raw)

    return spoil


def changed(name: str, change: Callable[[bytes], bytes]) -> Spoil:
    """A file's bytes through a function."""
    return lambda folder: (folder / name).write_bytes(change((folder / name).read_bytes()))


def rows(name: str, change: Callable[[list[str]], list[str]]) -> Spoil:
    """A text table's lines, the header first, through a function."""

    def spoil(folder: Path) -> None:
        lines = (folder / name).read_text().splitlines()
        (folder / name).write_text("\n".join(change(lines)) + "\n")

    return spoil


def removed(name: str) -> Spoil:
    """A file taken away."""
    return lambda folder: (folder / name).unlink()


def linked(name: str, target: str) -> Spoil:
    """A symbolic link in the place of a file or folder."""

    def spoil(folder: Path) -> None:
        path = folder / name
        if path.is_dir() and not path.is_symlink():
            path.rename(folder / f"{name} as it was")
        path.unlink(missing_ok=True)
        path.symlink_to(target)

    return spoil


def piped(name: str) -> Spoil:
    """A named pipe, which nothing ever writes to, in the place of a file."""

    def spoil(folder: Path) -> None:
        (folder / name).unlink(missing_ok=True)
        os.mkfifo(folder / name)

    return spoil


def emptied(name: str) -> Spoil:
    """A directory in the place of a file."""

    def spoil(folder: Path) -> None:
        (folder / name).unlink(missing_ok=True)
        (folder / name).mkdir()

    return spoil


def closed(name: str, mode: int = 0) -> Spoil:
    """A file or folder without permission to read, or with another mode."""
    return lambda folder: (folder / name).chmod(mode)


def renamed(name: str, new: str) -> Spoil:
    """A photograph under another name, in photos.csv too."""

    def spoil(folder: Path) -> None:
        (folder / "photos" / name).rename(folder / "photos" / new)
        quoted = '"' + new.replace('"', '""') + '"' if any(c in new for c in ',"\n') else new
        table = folder / "photos.csv"
        table.write_bytes(table.read_bytes().replace(name.encode(), os.fsencode(quoted)))

    return spoil


def result_bytes(out: Path, *left_out: str) -> dict[str, bytes]:
    """Bytes of every file of a result folder by name, but some, and what is kept to go on from."""
    files = [path for path in sorted(out.rglob("*")) if path.is_file() and ".store" not in path.parts]
    return {
        path.relative_to(out).as_posix(): path.read_bytes() for path in files if path.name not in left_out
    }
