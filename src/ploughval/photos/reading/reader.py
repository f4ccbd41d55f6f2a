"""Reads the pictures of a series; a file whose pictures lean on each other stays open between them."""

import threading
from pathlib import Path

from ploughval.photos.reading import gif, video
from ploughval.photos.reading.decode import decode, naming_faults
from ploughval.photos.reading.gif import GifFile
from ploughval.photos.reading.grey import Channel, Samples, to_grey
from ploughval.photos.reading.video import VideoFile


class Reader:
    """Decodes pictures of any file, from any thread; those of a video or GIF are best asked for in order.

    Parameters
    ----------
    channel : str
        See :func:`ploughval.photos.reading.grey.to_grey`.
    """

    def __init__(self, channel: Channel = "grey") -> None:
        self._channel: Channel = channel
        self._lock = threading.Lock()
        self._file: GifFile | VideoFile | None = None

    def read(self, path: Path, page: int) -> Samples:
        """One picture, (H, W) uint8 or uint16; DataError where it cannot be decoded in full."""
        if path.suffix.lower() not in gif.ENDINGS | video.ENDINGS:
            return decode(path, page, channel=self._channel)
        with self._lock, naming_faults(path, "decoded"):
            if self._file is None or self._file.path != path:
                is_gif = path.suffix.lower() in gif.ENDINGS
                self._file = GifFile(path) if is_gif else VideoFile(path, self._channel)
            return to_grey(self._file.read(page), self._channel)
