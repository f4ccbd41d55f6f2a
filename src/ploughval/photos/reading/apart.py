"""A picture that OpenCV decodes, in a process of its own: a file that breaks the decoder breaks nothing else.

The process runs this file as a program that needs nothing of the package, and writes the samples to its
output: a line of rows, columns, samples a pixel and bytes a sample, then the samples, blue first.
"""

import signal
import subprocess
import sys
from pathlib import Path
from typing import IO

import cv2
import numpy as np
from numpy.typing import NDArray

_PROGRAM = __file__
_FAULTS = {getattr(signal, name, 0) for name in ("SIGSEGV", "SIGBUS", "SIGABRT", "SIGILL", "SIGFPE")}
"""Signals that a file can bring about; others come from the system or its user."""
_PART_BYTES = 1 << 20
_REFUSED, _SHORT_OF_MEMORY = 3, 4


def decode_apart(path: Path) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """Samples as OpenCV decodes them.

    Returns
    -------
    (H, W) or (H, W, C) uint8 or uint16; of colours blue is first

    Raises
    ------
    ValueError
        What cannot be decoded, or breaks the decoder.
    MemoryError
        The decoder had too little memory.
    OSError
        No process can be started.
    """
    command = [sys.executable, "-P", _PROGRAM, str(path)]  # -P: nothing is imported from the working folder
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C is for the run: it does not make a picture damaged
    ) as process:
        assert process.stdout is not None
        image = _read(process.stdout)
    code = process.returncode
    if code == _SHORT_OF_MEMORY or (code < 0 and -code not in _FAULTS):
        raise MemoryError("the decoder of JPEG 2000 had too little memory, or was killed")
    if code < 0:
        raise ValueError(f"damaged: its decoder broke off (signal {-code})")
    if code or image is None:
        raise ValueError("truncated or damaged, or samples that are not 8 or 16 bit")
    return image


def _read(source: IO[bytes]) -> NDArray[np.uint8] | NDArray[np.uint16] | None:
    """The samples that the process writes; None where it ends before them."""
    words = source.readline(100).split()
    if len(words) != 4:
        return None
    rows, columns, samples, size = map(int, words)
    image = np.empty((rows, columns, samples), np.uint8 if size == 1 else np.uint16)
    room, filled = image.reshape(-1).view(np.uint8), 0
    while filled < room.size and (part := source.read(min(_PART_BYTES, room.size - filled))):
        room[filled : filled + len(part)] = np.frombuffer(part, np.uint8)
        filled += len(part)
    if filled < room.size:
        return None
    return image[..., 0] if samples == 1 else image


def _write(path: str, target: IO[bytes]) -> int:
    """Decode a file and write its samples; the exit code."""
    try:
        image = cv2.imdecode(np.fromfile(path, np.uint8), cv2.IMREAD_UNCHANGED)
    except MemoryError:
        return _SHORT_OF_MEMORY
    except cv2.error as error:
        return _SHORT_OF_MEMORY if error.code == cv2.Error.STS_NO_MEM else _REFUSED
    if image is None or image.dtype not in (np.uint8, np.uint16):
        return _REFUSED
    samples = image.shape[2] if image.ndim == 3 else 1
    target.write(f"{image.shape[0]} {image.shape[1]} {samples} {image.itemsize}\n".encode())
    target.write(np.ascontiguousarray(image).reshape(-1).view(np.uint8).data)
    target.flush()
    return 0


if __name__ == "__main__":
    sys.exit(_write(sys.argv[1], sys.stdout.buffer))
