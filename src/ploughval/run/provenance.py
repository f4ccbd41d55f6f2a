"""Where results come from: versions, hashes of inputs and of the code itself."""

import hashlib
import platform
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ploughval.scene import Scene

PACKAGES = ("numpy", "scipy", "opencv-python-headless", "pandas", "xarray", "numba", "pillow", "scikit-image")


def versions() -> dict[str, str]:
    """Versions of ploughval, Python and of the packages that touch numbers."""
    found = {"ploughval": ploughval_version(), "python": platform.python_version()}
    for name in PACKAGES:
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


@lru_cache(maxsize=1)
def code_digest() -> str:
    """SHA-256 over ploughval's own source files: a stage's result is only reused by the same code."""
    root = Path(__file__).resolve().parents[1]
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def file_digest(path: Path) -> str:
    """SHA-256 of a file's bytes, hexadecimal; 'unreadable' when it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return "unreadable"


def input_digests(scene: Scene) -> dict[str, str]:
    """SHA-256 of every file that the scene names, by its path relative to the test folder."""
    cells = scene.loadcells
    logs = [] if cells is None else [*cells.log_patterns, *cells.empty, *cells.calibration.patterns]
    files = _files(scene, [scene.source.name, *_window_patterns(scene), *logs])
    return {name: file_digest(scene.folder / name) for name in files}


def window_files(scene: Scene) -> list[str]:
    """The files that the walk through the photographs depends on, relative to the test folder."""
    return _files(scene, _window_patterns(scene))


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
