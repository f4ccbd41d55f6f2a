"""Camera RAW to linear 16-bit samples, by LibRaw (extra `raw`)."""

from pathlib import Path
from typing import Any

import numpy as np

from ploughval.errors import DataError, MissingExtraError
from ploughval.photos.reading.exif import tags_of_tiff
from ploughval.photos.reading.grey import Samples
from ploughval.photos.reading.header import Header

ENDINGS = frozenset({".nef", ".nrw", ".cr2", ".cr3", ".arw", ".dng", ".orf", ".rw2", ".raf", ".pef"})


def raw_header(path: Path) -> Header:
    """Header of a RAW file; DataError where LibRaw cannot read it, MissingExtraError without rawpy."""
    rawpy = _rawpy(path)
    try:
        with rawpy.imread(str(path)) as raw:
            shape = (int(raw.sizes.height), int(raw.sizes.width))
    except rawpy.LibRawError as error:
        raise DataError(f"cannot be read as RAW: {_reason(error)}", path=path) from error
    return Header(shape, 16, tags=tags_of_tiff(path))


def decode_raw(path: Path) -> Samples:
    """Red, green and blue (H, W, 3) uint16, linear in light, as the sensor stands."""
    rawpy = _rawpy(path)
    try:
        with rawpy.imread(str(path)) as raw:
            image = raw.postprocess(
                output_bps=16,
                user_flip=0,
                gamma=(1, 1),
                user_wb=[1, 1, 1, 1],  # the camera's own balance may change from frame to frame
                no_auto_bright=True,
                adjust_maximum_thr=0.0,
            )
            return np.asarray(image, np.uint16)
    except rawpy.LibRawError as error:
        raise DataError(f"cannot be decoded as RAW: {_reason(error)}", path=path) from error


def _rawpy(path: Path) -> Any:
    try:
        import rawpy
    except ImportError:
        raise MissingExtraError("rawpy", "raw", f"Reading the RAW photograph {path.name}") from None
    return rawpy


def _reason(error: Exception) -> str:
    reason = error.args[0] if error.args else error
    return reason.decode(errors="replace") if isinstance(reason, bytes) else str(reason)
