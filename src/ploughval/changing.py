"""What changes from photograph to photograph: named, taken out, and put back into another object."""

import zlib
from collections.abc import Mapping
from copy import deepcopy
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray


class Changing:
    """Something that follows a series: made from the first photograph, changed by each that comes after.

    ``CHANGES`` names the attributes that later photographs change. An object made from the same first
    photograph that is given a snapshot goes on as the one that the snapshot was taken of.
    """

    CHANGES: ClassVar[tuple[str, ...]] = ()

    def snapshot(self) -> dict[str, Any]:
        """Copies of what changes, by its name; of parts that change themselves their own snapshots."""
        return {name: _taken(getattr(self, name)) for name in self.CHANGES}

    def restore(self, taken: Mapping[str, Any]) -> None:
        """Put back a snapshot, which is copied.

        Raises
        ------
        KeyError
            When something is missing in it.
        """
        for name in self.CHANGES:
            value = getattr(self, name)
            if isinstance(value, Changing):
                value.restore(taken[name])
            elif _holds_changing(value):
                for key, part in value.items():
                    part.restore(taken[name][key])
            else:
                setattr(self, name, deepcopy(taken[name]))


def _taken(value: Any) -> Any:
    if isinstance(value, Changing):
        return value.snapshot()
    if _holds_changing(value):
        return {key: part.snapshot() for key, part in value.items()}
    return deepcopy(value)


def _holds_changing(value: Any) -> bool:
    """Whether a value is a mapping of parts that change themselves."""
    return isinstance(value, dict) and any(isinstance(part, Changing) for part in value.values())


def packed(mask: NDArray[np.generic]) -> NDArray[np.uint8]:
    """A mask (H, W), nonzero or zero, in few bytes: (K,) uint8.

    >>> mask = np.eye(3, dtype=bool)
    >>> bool((unpacked(packed(mask), (3, 3)) == mask).all())
    True
    """
    return np.frombuffer(zlib.compress(np.packbits(mask != 0).tobytes(), 1), np.uint8)


def unpacked(data: NDArray[np.uint8], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """The mask of a shape (H, W) from :func:`packed`.

    Raises
    ------
    ValueError
        When the bytes are not those of such a mask.
    """
    count = int(np.prod(shape))
    try:
        bits = zlib.decompressobj().decompress(data.tobytes(), (count + 7) // 8 + 1)
    except zlib.error as error:
        raise ValueError(f"not a packed mask: {error}") from error
    if len(bits) != (count + 7) // 8:
        raise ValueError(f"got a packed mask of {len(bits)} bytes; expected that of {shape} pixels")
    return np.unpackbits(np.frombuffer(bits, np.uint8), count=count).reshape(shape).view(np.bool_)
