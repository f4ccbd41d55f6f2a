"""Shape of the mound from one surface: crest, height at the face, flank, front and its slope, area."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.face import face_at_surface
from ploughval.compare.quantity import MISSING, Quantity

Floats = NDArray[np.float64]
_SMOOTH_DEPTHS = 0.05  # running mean of heights, and width over which a local slope is read
_THRESHOLD_DEPTHS, _THRESHOLD_NOISE = 0.02, 4.0
_SCARP_DEPTHS, _SCARP_NOISE = 0.1, 6.0  # least height of a front whose slope is read
_FLATTER = 0.5  # of the steepest so far: where the front's slope ends
_MIDDLE = (0.15, 0.85)  # of the front's height: between its rounded foot and shoulder
_BEHIND_DEPTHS = 0.1  # a surface that begins further ahead of the face does not tell its height there
_GREATEST = np.sqrt(2.0)
_LEAST_KNOWN = 2.0  # stds that a flank's length must be: of one less known the slope may be anything
_CORNER_DEPTHS = 0.01  # std of a front's place from how a measured surface rounds its foot
_PAST_DEPTHS = 0.5  # the area is taken so far past the front


@dataclass(frozen=True, slots=True)
class Reading:
    """How surfaces of a test are read: the same for the measured and for the predicted one.

    Attributes
    ----------
    depth_mm : float
        Depth of the tip.
    step_mm : float
        Spacing at which heights are read.
    noise_mm : float
        Standard uncertainty of a measured height above the initial surface.
    shared_mm : float
        Length of surface over which that error is the same.
    scale_std : float
        Relative standard uncertainty of all lengths, from the calibration.
    lean : float
        Tangent of the face's inclination: the mound begins where the face meets the surface.
    """

    depth_mm: float
    step_mm: float
    noise_mm: float
    shared_mm: float
    scale_std: float = 0.0
    lean: float = 0.0

    @property
    def threshold_mm(self) -> float:
        """Height from which on the surface has left its initial level."""
        return max(_THRESHOLD_DEPTHS * self.depth_mm, _THRESHOLD_NOISE * self.noise_mm)

    @property
    def window_mm(self) -> float:
        """Width over which heights are averaged and local slopes are read."""
        return _SMOOTH_DEPTHS * self.depth_mm


@dataclass(frozen=True, slots=True)
class Mound:
    """The mound at one travel; a part that the surface does not show is NaN.

    Standard uncertainties are those of docs/theory-comparison-lines.md, Eqs (7) to (9).

    Attributes
    ----------
    crest : Quantity
        Greatest height above the initial surface, mm.
    crest_x : Quantity
        Middle of what is as high as the crest, within the threshold: world x, mm.
    face : Quantity
        Height above the initial surface at the blade's face, mm.
    front : Quantity
        From the face to where the surface leaves its initial level, mm.
    flank : Quantity
        Mean slope from near the crest down to near the front, steps and terraces included, degrees.
    slope : Quantity
        Of the front, the lowest step of the flank, degrees.
    area : Quantity
        Between the surface and the initial one, mm2.
    """

    crest: Quantity = MISSING
    crest_x: Quantity = MISSING
    face: Quantity = MISSING
    front: Quantity = MISSING
    flank: Quantity = MISSING
    slope: Quantity = MISSING
    area: Quantity = MISSING


def mound_of(
    surface_mm: Floats, rest_mm: Floats, u_mm: float, reading: Reading, *, widest_gap_mm: float = np.inf
) -> Mound:
    """Describe the mound ahead of the blade.

    Parameters
    ----------
    surface_mm : (M, 2) float
        The surface, in order of x, all finite.
    rest_mm : (K, 2) float
        The surface before the blade moved, likewise.
    u_mm : float
        Travel of the blade: world x of its tip.
    reading : Reading
        Spacing, noise and threshold.
    widest_gap_mm : float
        Between points further apart than this the surface is not known.

    Returns
    -------
    Mound
    """
    face_mm = face_at_surface(surface_mm, u_mm, reading.lean)
    ahead = surface_mm[surface_mm[:, 0] >= face_mm - 1e-9]
    if len(ahead) < 2 or ahead[-1, 0] - face_mm < reading.window_mm:
        return Mound()
    x = face_mm + np.arange(0.0, ahead[-1, 0] - face_mm, reading.step_mm)
    raw = np.interp(x, ahead[:, 0], ahead[:, 1]) - np.interp(x, rest_mm[:, 0], rest_mm[:, 1])
    raw = np.where(_unknown(x, ahead[:, 0], widest_gap_mm), np.nan, raw)
    height = _running_mean(raw, reading)
    if np.isnan(height).all() or np.nanmax(height) <= reading.threshold_mm:
        return Mound()
    crest, crest_x = _crest(x, height, reading)
    began = ahead[0, 0] - face_mm <= _BEHIND_DEPTHS * reading.depth_mm
    # Half of the window is missing at the face: its mean is that much less certain.
    face = _length(float(height[0]), np.sqrt(2.0) * reading.noise_mm, reading) if began else MISSING
    foot = int(np.flatnonzero(height > reading.threshold_mm)[-1])
    if foot >= len(x) - 2 or np.isnan(height[: foot + 2]).any():
        return Mound(crest, crest_x, face)
    slope = _front_slope(x, raw, height, foot, reading)
    front = _front(x - face_mm, height, reading)
    past = x <= x[foot] + _PAST_DEPTHS * reading.depth_mm
    area = float(np.trapezoid(np.nan_to_num(raw[past]), x[past])) if began else float("nan")
    own = reading.noise_mm * np.sqrt(reading.shared_mm * (x[past][-1] - face_mm))
    std = float(np.hypot(own, 2.0 * reading.scale_std * area))
    flank = _flank(x, height, crest.value, reading)
    return Mound(crest, crest_x, face, front, flank, slope, Quantity(area, std) if began else MISSING)


def _unknown(x: Floats, seen: Floats, widest_mm: float) -> NDArray[np.bool_]:
    """Places in gaps of the seen surface."""
    after = np.clip(np.searchsorted(seen, x), 1, len(seen) - 1)
    return np.asarray((seen[after] - seen[after - 1] > widest_mm) & (x >= seen[0]))


def _running_mean(values: Floats, reading: Reading) -> Floats:
    """Means over the window, of what of it there is at the ends."""
    half = max(round(0.5 * reading.window_mm / reading.step_mm), 0)
    kernel = np.ones(2 * half + 1)
    if len(values) <= 2 * half:
        return values
    return np.asarray(
        np.convolve(values, kernel, mode="same") / np.convolve(np.ones(len(values)), kernel, mode="same")
    )


def _length(value: float, own_std: float, reading: Reading) -> Quantity:
    return Quantity(value, float(np.hypot(own_std, reading.scale_std * value)))


def _crest(x: Floats, height: Floats, reading: Reading) -> tuple[Quantity, Quantity]:
    top = float(np.nanmax(height))
    level = x[height >= top - reading.threshold_mm]
    half = 0.5 * float(level[-1] - level[0])
    place = Quantity(float(level[0]) + half, float(np.hypot(half / np.sqrt(3.0), reading.step_mm)))
    # The greatest of several heights is too high by about their std.
    return _length(top, _GREATEST * reading.noise_mm, reading), place


def _front(ahead: Floats, height: Floats, reading: Reading) -> Quantity:
    """Where the surface falls to the threshold for the last time; its foot is rounded where it is seen."""
    place, std = _crossing(ahead, height, reading.threshold_mm, reading)
    return _length(place, float(np.hypot(std, _CORNER_DEPTHS * reading.depth_mm)), reading)


def _crossing(x: Floats, height: Floats, level: float, reading: Reading) -> tuple[float, float]:
    """Where a surface falls below a level for the last time, and how far a std of its height moves that.

    A terrace that is about as high as the level makes the place as uncertain as the terrace is long.
    """
    wide = 2.0 * reading.noise_mm
    places = [_last_above(x, height, one) for one in (level, level - wide, level + wide)]
    return places[0], (places[1] - places[2]) / 4.0


def _flank(x: Floats, height: Floats, crest_mm: float, reading: Reading) -> Quantity:
    """Slope between the last places that are as high as 85 and as 15 % of the crest."""
    fall = (_MIDDLE[1] - _MIDDLE[0]) * crest_mm
    if crest_mm < max(_SCARP_DEPTHS * reading.depth_mm, _SCARP_NOISE * reading.noise_mm):
        return MISSING
    (low, low_std), (high, high_std) = (_crossing(x, height, share * crest_mm, reading) for share in _MIDDLE)
    length, length_std = low - high, float(np.hypot(low_std, high_std))
    if length < max(reading.step_mm, _LEAST_KNOWN * length_std):
        return MISSING
    slope = fall / length
    std = slope * length_std / length
    return Quantity(float(np.degrees(np.arctan(slope))), float(np.degrees(std) / (1.0 + slope**2)))


def _last_above(x: Floats, height: Floats, level: float) -> float:
    """Place at which a surface falls below a level for the last time; its end if it does not."""
    above = np.flatnonzero(height > level)
    k = int(above[-1]) if above.size else 0
    if k == len(x) - 1 or height[k] <= level:
        return float(x[k])
    return float(x[k] + (x[k + 1] - x[k]) * (height[k] - level) / (height[k] - height[k + 1]))


def _front_slope(x: Floats, raw: Floats, height: Floats, foot: int, reading: Reading) -> Quantity:
    """Median slope (Theil 1950) of the front, from its foot up to where it flattens to half its steepest."""
    width = max(round(reading.window_mm / reading.step_mm), 1)
    steepest, top = 0.0, foot
    for k in range(foot, width - 1, -1):
        local = (height[k - width] - height[k]) / (width * reading.step_mm)
        steepest = max(steepest, local)
        if local < _FLATTER * steepest:
            break
        top = k - width
    rise = float(height[top] - reading.threshold_mm)
    if rise < max(_SCARP_DEPTHS * reading.depth_mm, _SCARP_NOISE * reading.noise_mm):
        return MISSING
    low, high = (reading.threshold_mm + share * rise for share in _MIDDLE)
    part = np.arange(top, foot + 1)
    part = part[(height[part] >= low) & (height[part] <= high)]
    if len(part) < 4:
        return MISSING
    i, j = np.triu_indices(len(part), k=max(len(part) // 3, 1))
    slope = float(np.median((raw[part][i] - raw[part][j]) / (x[part][j] - x[part][i])))
    length = float(x[part][-1] - x[part][0])
    off = raw[part] + slope * x[part]
    scatter = 1.4826 * float(np.median(np.abs(off - np.median(off))))
    pieces = max(length / max(reading.shared_mm, reading.step_mm), 1.0)
    std = max(scatter, reading.noise_mm) * np.sqrt(12.0 / pieces) / length
    return Quantity(float(np.degrees(np.arctan(slope))), float(np.degrees(std) / (1.0 + slope**2)))
