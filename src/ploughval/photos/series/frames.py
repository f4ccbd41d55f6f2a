"""The photographs of a test as one series, read one by one."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.photos.reading.exif import Shot
from ploughval.photos.reading.grey import Samples
from ploughval.photos.reading.reader import Reader


@dataclass(frozen=True, slots=True, eq=False)
class FrameSeries:
    """Photographs numbered from 0 in order of time.

    Attributes
    ----------
    paths : tuple of Path
        File of each frame; a multi-page file stands once for each of its pictures.
    time_s : (F,) float
        Time on the camera's clock, s; NaN where unknown. From EXIF: seconds since the earliest photograph.
    time_std_s : (F,) float
        Standard uncertainty of each time, s: 0 where it is taken as given, NaN where the time is unknown. A
        clock of whole seconds has 1 / sqrt(12) s, a rectangular distribution (JCGM 100:2008, 4.3.7).
    shape : (H, W)
        Size of every picture, px, rows and columns as stored in the file.
    faults : dict
        Frames that cannot be used and why, as found without decoding; :meth:`read` refuses them.
    notes : tuple of str
        What was found wrong that belongs to no frame (order, files left out).
    pages : tuple of int
        Which picture of its file each frame is; empty where every file holds one.
    missing : tuple of str
        Photographs that have a time but are not there.
    bits : int
        Bits of a sample as stored, 8 or 16.
    shots : tuple of Shot
        What EXIF says of camera, lens and exposure, one a frame; empty where it was not asked.
    reader : Reader
        Decodes the files, and keeps a video open.
    """

    paths: tuple[Path, ...]
    time_s: NDArray[np.float64]
    time_std_s: NDArray[np.float64]
    shape: tuple[int, int]
    faults: dict[int, str]
    notes: tuple[str, ...] = ()
    pages: tuple[int, ...] = ()
    missing: tuple[str, ...] = ()
    bits: int = 8
    shots: tuple[Shot, ...] = ()
    reader: Reader = field(default_factory=Reader, repr=False)

    def __len__(self) -> int:
        return len(self.paths)

    def name(self, frame: int) -> str:
        """File of a frame, with the number of the picture where the series is in one file."""
        name = self.paths[frame].name
        return f"{name}, picture {self.pages[frame]}" if any(self.pages) else name

    def read(self, frame: int) -> Samples:
        """Decode one frame.

        Parameters
        ----------
        frame : int
            From 0 in order of time.

        Returns
        -------
        (H, W) uint8 or uint16, contiguous

        Raises
        ------
        DataError
            A frame in ``faults``, or a file that cannot be decoded in full.
        """
        if not 0 <= frame < len(self):
            raise DataError(f"no such frame; the series holds 0 to {len(self) - 1}", frame=frame)
        path = self.paths[frame]
        if frame in self.faults:
            raise DataError(self.faults[frame], path=path, frame=frame)
        try:
            image = self.reader.read(path, self.pages[frame])
        except DataError as error:
            raise DataError(str(error).removeprefix(f"{path}: "), path=path, frame=frame) from error
        if image.shape != self.shape:
            raise DataError(
                f"decodes to {size_text(image.shape)}; expected {size_text(self.shape)}",
                path=path,
                frame=frame,
            )
        return image


def size_text(shape: tuple[int, ...]) -> str:
    """Width and height as a text."""
    return f"{shape[1]} x {shape[0]} px"
