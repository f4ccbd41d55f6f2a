"""About how much memory a test takes, told before it is processed from the size of what it reads."""

import warnings
from pathlib import Path

from ploughval.limits import PICTURE_PIXELS
from ploughval.run.urls import is_url
from ploughval.scene import Scene, load_scene

BASE_BYTES = 350_000_000
"""What a test with small photographs and a short log takes: the libraries and the report."""
BYTES_A_PIXEL = 55
"""Of one photograph, however many there are."""
BYTES_A_LOG_BYTE, MOST_OF_LOGS = 14, 1_600_000_000
"""Long logs take less for each byte: the longest that are read are processed within 2 GB."""
VIDEO_PIXELS = 8_300_000
"""A picture of a film whose size is not looked up."""


def needed_bytes(folder: str) -> int:
    """About the most memory that processing a test takes; one whose settings are refused reads nothing.

    Parameters
    ----------
    folder : str
        A test folder; for a URL nothing is looked up.
    """
    if is_url(folder):
        return BASE_BYTES
    try:
        scene = load_scene(folder)
        return BASE_BYTES + BYTES_A_PIXEL * _pixels(scene) + _of_logs(scene)
    except Exception:  # whatever is wrong with a test, it will say so itself, and stop no other
        return BASE_BYTES


def _of_logs(scene: Scene) -> int:
    cells = scene.loadcells
    patterns = [] if cells is None else cells.log_patterns
    held = sum(path.stat().st_size for pattern in patterns for path in scene.matches(pattern))
    return min(BYTES_A_LOG_BYTE * held, MOST_OF_LOGS)


def _pixels(scene: Scene) -> int:
    """Pixels of the first photograph by its header; by its bytes where the header is of no known kind."""
    if scene.camera is None:
        return 0
    path = next(iter(scene.matches(scene.camera.photos)), None)
    if path is None:
        return 0
    if scene.camera.times == "video":
        return VIDEO_PIXELS
    return _by_header(path) or min(path.stat().st_size, PICTURE_PIXELS)


def _by_header(path: Path) -> int:
    from PIL import Image

    try:
        with warnings.catch_warnings(action="ignore"), Image.open(path) as picture:
            return picture.width * picture.height
    except Exception:  # a header that Pillow does not know, or a broken one
        return 0
