"""Frames of a video, read one after the other, with the times at which they are shown.

Seeking in a compressed video lands near a frame, not on it, and the number of frames in its header is an
estimate: frames are counted by reading on, and a frame before the last one read is reached from the start.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ploughval.errors import DataError
from ploughval.photos.reading.grey import Channel, Samples
from ploughval.photos.reading.header import Header

ENDINGS = frozenset(
    {".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mts", ".m2ts", ".wmv", ".mpg", ".mpeg"}
)
_LUMA_FORMATS = {b"I420": 8, b"Y42B": 8, b"444P": 8, b"Y800": 8, b"Y1\0\x10": 16}
"""Formats of samples whose first plane is grey, and its bits; others are converted to colours of 8 bits."""
_ERRORS = 2  # level of OpenCV's log: errors and what is worse


def video_header(path: Path) -> Header:
    """Size, number of frames and their times, found by going through the video once.

    Raises
    ------
    DataError
        A video that cannot be opened or holds no frame.
    """
    state = path.stat()
    return _scan(path, state.st_size, state.st_mtime_ns)


@lru_cache(maxsize=8)
def _scan(path: Path, size: int, changed_ns: int) -> Header:
    capture = _open(path)
    stated = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
    shown_ms = []
    while capture.grab():
        shown_ms.append(float(capture.get(cv2.CAP_PROP_POS_MSEC)))
    if not shown_ms:
        raise DataError("holds no frame that can be read", path=path)
    shape = (int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)), int(capture.get(cv2.CAP_PROP_FRAME_WIDTH)))
    notes: tuple[str, ...] = ()
    if stated > len(shown_ms):
        notes = (f"{path.name} states {stated} frames but holds {len(shown_ms)}: it may be cut short",)
    times = tuple(((np.array(shown_ms) - shown_ms[0]) / 1000).tolist())
    bits = _LUMA_FORMATS.get(_format(capture), 8)
    return Header(shape, bits, tuple(range(len(times))), page_time_s=times, notes=notes)


class VideoFile:
    """A video that stays open between frames.

    Parameters
    ----------
    path : Path
        The video.
    channel : str
        With ``"grey"`` the stored luma is taken as it is (full or limited range), else a colour.
    """

    def __init__(self, path: Path, channel: Channel = "grey") -> None:
        self.path, self._channel, self._next = path, channel, 0
        self._capture = self._opened()

    def _opened(self) -> Any:
        capture = _open(self.path)
        if self._channel == "grey" and _format(capture) in _LUMA_FORMATS:
            capture.set(cv2.CAP_PROP_CONVERT_RGB, 0)
        return capture

    def read(self, page: int) -> Samples:
        """Samples of a frame, (H, W) or (H, W, 3); ValueError where the video ends before it."""
        if page < self._next:
            self._capture, self._next = self._opened(), 0
        while self._next <= page:
            if not self._capture.grab():
                raise ValueError(f"the video ends after {self._next} frames")
            self._next += 1
        with _quiet():
            read, image = self._capture.retrieve()
        if not read:
            raise ValueError(f"frame {page} of the video cannot be decoded")
        return image[..., 2::-1] if image.ndim == 3 else image  # type: ignore[no-any-return]


def _open(path: Path) -> Any:
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    if not capture.isOpened():
        raise DataError(
            "is not a video that can be read (damaged, cut short, or a codec not known)", path=path
        )
    capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
    return capture


@contextmanager
def _quiet() -> Iterator[None]:
    """Without OpenCV's warning, for each frame, that luma of full range is taken as it is."""
    log: Any = getattr(cv2.utils, "logging", cv2)  # OpenCV 4 has the two functions at its top
    level = log.getLogLevel()
    log.setLogLevel(_ERRORS)
    try:
        yield
    finally:
        log.setLogLevel(level)


def _format(capture: Any) -> bytes:
    return int(capture.get(cv2.CAP_PROP_CODEC_PIXEL_FORMAT)).to_bytes(4, "little", signed=True)
