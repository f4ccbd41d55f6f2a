"""Pictures of an animated GIF, composed one upon the other, with the times at which they are shown."""

import io
import itertools
from pathlib import Path

from PIL import Image

from ploughval.limits import PICTURE_BYTES, read_limited
from ploughval.photos.reading.grey import Samples
from ploughval.photos.reading.header import Header
from ploughval.photos.reading.pillow import samples_of

ENDINGS = frozenset({".gif"})


def gif_header(image: Image.Image) -> Header:
    """Header of an open GIF; without times where it gives a picture no duration."""
    count = int(getattr(image, "n_frames", 1))
    durations_ms = []
    for page in range(count - 1):
        image.seek(page)
        durations_ms.append(float(image.info.get("duration", 0)))
    shown = itertools.accumulate(durations_ms, initial=0.0)
    times = tuple(ms / 1000 for ms in shown) if count > 1 and min(durations_ms) > 0 else ()
    return Header(image.size[::-1], 8, tuple(range(count)), page_time_s=times)


class GifFile:
    """An animated GIF that stays open between its pictures: each is drawn upon those before it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._image = Image.open(io.BytesIO(read_limited(path, PICTURE_BYTES, "Part it.")))

    def read(self, page: int) -> Samples:
        """Samples of a picture, (H, W) or (H, W, 3)."""
        self._image.seek(page)
        return samples_of(self._image).copy()
