"""The sand's texture in the first photograph: taken with the walk, told in run.json with the noise off."""

from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ploughval.photos.noise import NoiseCurve
from ploughval.photos.pattern import LAGS, Pattern, Texture, pattern_of, texture_of

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8] | NDArray[np.uint16]

LEAST_GRAIN_PX = 3.0
"""Finer grains alias: the pixels hold what no interpolation can move rightly (Jones & Iadicola 2018, 2.3)."""
LEAST_ACROSS = 3.0
"""Grains that a subset should hold along a side (the same)."""
NO_TEXTURE: dict[str, Floats] = {"texture": np.empty((0, 2, LAGS)), "texture_squares": np.empty((0, 2))}
"""Arrays of a walk in which no texture was looked at."""


def texture_arrays(image: Grey, sand: NDArray[np.bool_]) -> dict[str, Floats]:
    """The texture of a photograph (H, W) as arrays for the store.

    ``texture`` (K, 2, LAGS): autocovariance as in :class:`ploughval.photos.pattern.Texture`;
    ``texture_squares`` (K, 2): mean grey and side, px, of each square.
    """
    found = texture_of(image, sand)
    squares = np.column_stack([found.mean_grey, np.full(len(found.mean_grey), float(found.side_px))])
    return {"texture": found.covariance, "texture_squares": squares}


def pattern_from(texture: Floats, squares: Floats, noise: NoiseCurve | None) -> Pattern | None:
    """Grain size and contrast, noise taken off where it was measured; None where no sand was looked at."""
    if not len(texture):
        return None
    grey = float(squares[:, 0].mean())
    level = None if noise is None else float(noise.level(np.array(grey)))
    return pattern_of(Texture(texture, squares[:, 0], int(squares[0, 1])), level)


def pattern_record(pattern: Pattern | None) -> dict[str, Any] | None:
    """The grains for run.json."""
    return None if pattern is None else asdict(pattern)


def grain_advice(size_px: float, subset_px: int) -> str:
    """What to do where grains are too fine for the pixels or too coarse for the subset; empty: they suit.

    >>> grain_advice(4.0, 31), grain_advice(12.0, 31)
    ('', 'beyond a third of the subset: set piv.subset_px to 37 or more')
    """
    if size_px < LEAST_GRAIN_PX:
        return "below 3 px grains alias: more pixels a millimetre, or slightly out of focus"
    if size_px * LEAST_ACROSS > subset_px:
        least = 2 * int(np.ceil(size_px * LEAST_ACROSS / 2)) + 1
        return f"beyond a third of the subset: set piv.subset_px to {least} or more"
    return ""
