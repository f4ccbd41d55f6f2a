"""Where results come from: versions, hashes of inputs and of the code itself."""

import hashlib
import platform
from collections.abc import Iterable
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ploughval.scene import Scene

DRAWING = ("matplotlib", "jinja2")
PACKAGES = ("numpy", "scipy", "opencv-python-headless", "pandas", "xarray", "numba", "pillow", "scikit-image")


def versions() -> dict[str, str]:
    """Versions of ploughval, Python and of the packages that touch numbers."""
    return {"ploughval": ploughval_version(), "python": platform.python_version()} | _versions(PACKAGES)


def drawing_versions() -> dict[str, str]:
    """Versions of the packages that draw and lay out pages."""
    return _versions(DRAWING)


@cache
def _versions(packages: tuple[str, ...]) -> dict[str, str]:
    found = {}
    for name in packages:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def ploughval_version() -> str:
    """The installed version of ploughval."""
    try:
        return version("ploughval")
    except PackageNotFoundError:
        return "unknown"


@cache
def code_digest(*rooms: str) -> str:
    """SHA-256 over ploughval's own files: a stage's result is only reused by the same code.

    Parameters
    ----------
    *rooms : str
        Packages and modules, such as ``piv`` and ``run.walk.window``; none: all there is, templates too.
    """
    known, digest = _code(), hashlib.sha256()
    for name in sorted({name for room in rooms or ("",) for name in _names(room, known)}):
        digest.update(name.encode() + b"\0" + known[name])
    return digest.hexdigest()


@cache
def _code() -> dict[str, bytes]:
    """SHA-256 of each of ploughval's own files by its name, without what Python compiled.

    All are read at once: where the files change under a process that works on, later stages still name the
    code that earlier ones ran.
    """
    root = Path(__file__).resolve().parents[1]
    files = [path for path in root.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    return {path.relative_to(root).as_posix(): hashlib.sha256(path.read_bytes()).digest() for path in files}


def _names(room: str, known: Iterable[str]) -> list[str]:
    """Files of a room: of a package all, or a module's one.

    Raises
    ------
    FileNotFoundError
        When there is no such room.
    """
    place = room.replace(".", "/")
    names = [name for name in known if not room or name == f"{place}.py" or name.startswith(f"{place}/")]
    if not names:
        raise FileNotFoundError(room)
    return names


def file_digest(path: Path) -> str:
    """SHA-256 of a file's bytes, hexadecimal; 'unreadable' when it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return "unreadable"


def input_digests(scene: Scene) -> dict[str, str]:
    """SHA-256 of every file that the scene names, by its path relative to the test folder."""
    files = [*_files(scene, [scene.source.name]), *window_files(scene), *log_files(scene)]
    return {name: file_digest(scene.folder / name) for name in sorted(set(files))}


def window_files(scene: Scene) -> list[str]:
    """The files that the walk through the photographs depends on, relative to the test folder."""
    return _files(scene, _window_patterns(scene))


def log_files(scene: Scene) -> list[str]:
    """The files that the force depends on, relative to the test folder."""
    cells = scene.loadcells
    if cells is None:
        return []
    return _files(scene, [*cells.log_patterns, *cells.empty, *cells.calibration.patterns])


def _window_patterns(scene: Scene) -> list[str]:
    camera = scene.camera
    if camera is None:
        return []
    times = [] if camera.times_file is None else [camera.times_file]
    boards = [] if camera.board is None else [camera.board.picture]
    earlier = [] if camera.calibration is None else [camera.calibration]
    return [camera.photos, *times, *boards, *earlier]


def _files(scene: Scene, patterns: list[str]) -> list[str]:
    files = {path for pattern in patterns for path in scene.matches(pattern)}
    return [path.relative_to(scene.folder).as_posix() for path in sorted(files)]
