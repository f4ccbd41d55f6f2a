"""Whether one line through the tip is enough: rival mechanisms of motion (theory-bands.md, section 4)."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.special import ndtr

from ploughval.tracers.increment import Motion
from ploughval.tracers.line import BandLine, block_velocity
from ploughval.tracers.shares import height_above
from ploughval.tracers.view import Floats

_LEAST_STD = 0.004  # mm/mm
_STRAYS = 0.02
_STRAY_DENSITY = 0.25  # of strays, over rates from -0.5 to 1.5 in both components
_LEAST_POINTS = 12
_LEAST_SETS = 3.0  # independent subsets between two lines
_SURE = 10.0  # evidence from which a rival is named, natural logarithm: one in 22 000
_PART = (0.08, 0.92)  # of the block's motion, between two bands
_ALONG = 0.05  # of the block's motion: the least shearing along the blade that counts
_REACHES = np.array([0.5, 1.0, 2.0, 4.0])  # of shearing along the blade, in subsets
_FANS_DEG = np.array([2.0, 4.0, 8.0, 16.0, 30.0])
_WIDTHS = np.array([0.5, 1.0, 2.0, 4.0])  # of a zone of shearing, standard widths in subsets
_TURNS_DEG = np.arange(-8.0, 8.1, 1.0)


class Mechanism(StrEnum):
    """How the sand ahead of the blade moved in an increment."""

    ONE_BAND = "one_band"
    TWO_BANDS = "two_bands"
    SHEAR_ALONG_BLADE = "shear_along_blade"
    DIFFUSE = "diffuse"
    STILL = "still"


@dataclass(frozen=True, slots=True)
class Verdict:
    """The mechanism of an increment.

    Attributes
    ----------
    mechanism : Mechanism or None
        None: too few points, or too little travel, to tell.
    evidence : float
        Half the difference of BIC (natural logarithm) by which the best rival leads one band; negative: one
        band is enough. NaN where there was no band to rival.
    """

    mechanism: Mechanism | None
    evidence: float


@dataclass(frozen=True, slots=True, eq=False)
class _Clear:
    """Points clear of a line, in order of their angle about the tip; rates in their own noise."""

    place: Floats
    rate: Floats
    std: Floats
    sharing: float

    @property
    def angle(self) -> Floats:
        return np.asarray(np.arctan2(self.place[:, 1], self.place[:, 0]))

    def logs(self, expected: Floats) -> Floats:
        """Logarithm of the density of each rate (N,), given what is expected, (2,) or (N, 2), Eq. (10)."""
        off = ((self.rate - expected) ** 2).sum(axis=1)
        bell = np.exp(-off / (2 * self.std**2)) / (2 * np.pi * self.std**2)
        return np.asarray(np.log((1 - _STRAYS) * bell + _STRAYS * _STRAY_DENSITY))

    def lead(self, logs: Floats, single: Floats, parameters: int) -> float:
        """Evidence of a rival with so many parameters more, Eq. (11)."""
        independent = max(len(self.rate) / self.sharing, 2.0)
        return float((logs - single).sum() / self.sharing - parameters / 2 * np.log(independent))


def judge(motion: Motion, line: BandLine | None, *, resolved: bool) -> Verdict:
    """Compare one band with its rivals.

    Parameters
    ----------
    motion : Motion
        Of the increment.
    line : BandLine or None
        The fitted band; None: nothing moves with the blade.
    resolved : bool
        Whether there were travel and points enough to see motion.
    """
    if not resolved:
        return Verdict(None, np.nan)
    if line is None:
        return Verdict(Mechanism.STILL, np.nan)
    beta = float(np.radians(line.beta_deg))
    clear = _clear_of(motion, beta, line.velocity)
    if len(clear.place) < _LEAST_POINTS:
        return Verdict(None, np.nan)
    moving = height_above(clear.place, beta) > 0
    single = clear.logs(moving[:, None] * line.velocity)
    rivals = {
        Mechanism.TWO_BANDS: _two_bands(clear, single, line.velocity),
        Mechanism.SHEAR_ALONG_BLADE: _along_blade(clear, single, moving, line.velocity, motion.reach_mm),
        Mechanism.DIFFUSE: _diffuse(clear, single, beta, line.velocity, motion),
    }
    best = max(rivals, key=lambda name: rivals[name])
    found = best if rivals[best] > _SURE else Mechanism.ONE_BAND
    return Verdict(found, max(rivals[best], clear.lead(single, single, 3)))


def _clear_of(motion: Motion, beta: float, velocity: Floats) -> _Clear:
    """Points more than half a subset from the line; noise as large as most of them show."""
    above = height_above(motion.place, beta)
    clear = np.abs(above) > motion.reach_mm / 2
    angle = np.arctan2(motion.place[:, 1], motion.place[:, 0])
    order = np.flatnonzero(clear)[np.argsort(angle[clear], kind="stable")]
    place, rate = motion.place[order], motion.rate[order]
    std = np.maximum(motion.std[order], _LEAST_STD)
    if len(order):
        rest = np.hypot(*(rate - (above[order] > 0)[:, None] * velocity).T) / 1.1774  # median of Rayleigh's
        std = std * max(float(np.median(rest / std)), 1.0)
    cells = np.unique(np.floor(place / motion.reach_mm), axis=0)
    return _Clear(place, rate, std, max(len(place) / max(len(cells), 1), 1.0))


def _two_bands(clear: _Clear, single: Floats, velocity: Floats) -> float:
    """Evidence of a second line through the tip with sand between that moves by a part, Eq. (12)."""
    best = -np.inf
    for part in (0.25, 0.5, 0.75):
        middle, top = part * velocity, velocity
        for _ in range(3):
            low, high, logs = _two_cuts(clear, middle, top)
            if high - low < max(_LEAST_SETS * clear.sharing, 4) or len(clear.rate) - high < 4:
                break
            middle, top = (np.median(clear.rate[a:b], axis=0) for a, b in ((low, high), (high, None)))
        else:
            share = float(middle @ top / (top @ top))
            if _PART[0] < share < _PART[1]:
                best = max(best, clear.lead(logs, single, 3))
    return best


def _two_cuts(clear: _Clear, middle: Floats, top: Floats) -> tuple[int, int, Floats]:
    """Best places of two cuts in the order of angles, between rest, middle and top, and every point's log."""
    rest, part, whole = (clear.logs(np.asarray(m)) for m in (np.zeros(2), middle, top))
    sums = [np.concatenate([[0.0], np.cumsum(v)]) for v in (rest, part, whole)]
    gain = sums[0] - sums[1]
    best = np.maximum.accumulate(gain)
    high = int(np.argmax(best + sums[1] - sums[2]))
    low = int(np.argmax(gain[: high + 1]))
    return low, high, np.concatenate([rest[:low], part[low:high], whole[high:]])


def _along_blade(
    clear: _Clear, single: Floats, moving: np.ndarray, velocity: Floats, reach_mm: float
) -> float:
    """Evidence of motion in the block that differs beside the blade and fades with the distance, Eq. (13)."""
    best = -np.inf
    off = clear.rate - velocity
    used = moving & (np.abs(off).max(axis=1) < 0.5)
    if used.sum() < _LEAST_POINTS:
        return best
    for reach in _REACHES * reach_mm:
        fading = np.exp(-clear.place[:, 0] / reach)
        design = np.column_stack([np.ones(used.sum()), fading[used]]) / clear.std[used, None]
        (shift, extra), *_ = np.linalg.lstsq(design, off[used] / clear.std[used, None], rcond=None)
        beside = float(np.hypot(*extra)) * np.exp(-0.5 * reach_mm / reach)
        if beside < _ALONG * float(np.hypot(*velocity)):
            continue
        expected = moving[:, None] * (velocity + shift + fading[:, None] * extra)
        best = max(best, clear.lead(clear.logs(expected), single, 3))
    return best


def _diffuse(clear: _Clear, single: Floats, beta: float, velocity: Floats, motion: Motion) -> float:
    """Evidence of motion that fades in gradually, over a fan of angles or a zone along the line, Eq. (14)."""
    best = -np.inf
    share = clear.rate @ velocity / (velocity @ velocity)
    if (np.abs(share - 0.5) < 0.5 - _PART[0]).sum() < _LEAST_SETS * clear.sharing:
        return best  # nothing moves by a part
    far = float(np.max(np.hypot(*clear.place.T)))
    for turn in np.radians(_TURNS_DEG):
        angle = beta + turn
        above = height_above(clear.place, angle)
        fans = [np.radians(f) for f in _FANS_DEG if np.radians(f) * far / 2 > motion.reach_mm / 2]
        parts = [ndtr((clear.angle - angle) / fan) for fan in fans]
        parts += [ndtr(above / width) for width in _WIDTHS * motion.reach_mm]
        block = block_velocity(motion, min(angle + np.radians(5.0), 1.5))[0]
        for part in parts:
            best = max(best, clear.lead(clear.logs(part[:, None] * block), single, 1))
    return best
