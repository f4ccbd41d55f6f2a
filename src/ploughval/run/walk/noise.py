"""The camera's noise against grey level, from the first two photographs that differ."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import DataError
from ploughval.photos.noise import NoiseCurve, noise_curve

Grey = NDArray[np.uint8] | NDArray[np.uint16]
ENOUGH = 50_000
"""Pixels of sand below the blade that are enough; with fewer all sand is looked at, less what moved."""
NO_NOISE = {"noise": np.empty((0, 4)), "noise_line": np.full(5, np.nan)}
"""Arrays of a walk in which no noise was measured."""
_LINE = ("gain", "gain_std", "floor", "floor_std", "misfit")


def noise_mask(low: NDArray[np.bool_], sand: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels (H, W) to measure noise on: sand that the blade cannot move where that is enough, else all."""
    return low if np.count_nonzero(low) >= ENOUGH else sand


def noise_arrays(first: Grey, second: Grey, mask: NDArray[np.bool_]) -> dict[str, NDArray[np.float64]] | None:
    """Noise of two photographs (H, W) as arrays for the store; None where they do not tell it.

    ``noise`` (K, 4): grey, std, its standard uncertainty and pixels of each class; ``noise_line`` (5,): gain,
    floor and misfit as in :class:`ploughval.photos.noise.NoiseCurve`.
    """
    try:
        curve = noise_curve(first, second, mask)
    except DataError:
        return None
    classes = np.column_stack([curve.grey, curve.std, curve.std_std, curve.count])
    return {"noise": classes, "noise_line": np.array([getattr(curve, name) for name in _LINE])}


def curve_from(noise: NDArray[np.float64], line: NDArray[np.float64]) -> NoiseCurve | None:
    """The noise from the store's arrays; None where it was not measured."""
    if not len(noise):
        return None
    told = dict(zip(_LINE, line.tolist(), strict=True))
    grey, std, std_std, count = noise.T
    return NoiseCurve(grey=grey, std=std, std_std=std_std, count=count.astype(np.intp), **told)


def noise_record(noise: NDArray[np.float64], line: NDArray[np.float64]) -> dict[str, Any] | None:
    """The noise for run.json; None where it was not measured."""
    curve = curve_from(noise, line)
    if curve is None:
        return None
    middle = float(np.average(curve.grey, weights=curve.count))
    return {
        "grey": curve.grey.tolist(),
        "std": curve.std.tolist(),
        "std_std": curve.std_std.tolist(),
        "read_std": curve.read_std,
        "mean_grey": middle,
        "std_at_mean_grey": float(curve.level(np.array(middle))),
        **{name: getattr(curve, name) for name in _LINE},
    }
