"""Whether one line through the tip is enough: rival mechanisms of motion.

docs/theory-bands.md, section 4.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy.special import ndtr

from ploughval.tracers.increment import Motion, cells_of
from ploughval.tracers.line import BandLine
from ploughval.tracers.shares import height_above
from ploughval.tracers.view import Floats

_MODEL_STD = 0.03  # mm/mm: no mechanism is exact, and none is named for less
_STRAYS = 0.02
_STRAY_DENSITY = 0.25  # of strays, over rates from -0.5 to 1.5 in both components
_LEAST_POINTS = 12
_WIDTH = 0.1  # of the change across a band, in subsets: what correlation leaves of it
_TRANSITION = 0.3  # std of the part that a point in the middle of the change moves by
_MEDIAN_DISTANCE = 1.1774  # of two components of unit variance (Rayleigh)
_ROUGH = 0.15  # mm/mm, first guess of how well the motion between two bands is known
_LEAST_SETS = 2.0  # independent subsets between two lines
_STEEPEST = 20  # one in so many points
_SURE = 5.0  # evidence from which a rival is named, natural logarithm: one in 150
_PART = (0.08, 0.92)  # of the block's motion, between two bands
_ALONG = 0.05  # of the block's motion: the least shearing along the blade that counts
_REACHES = np.array([0.5, 1.0, 2.0, 4.0])  # of shearing along the blade, in subsets
_FANS_DEG = np.array([2.0, 4.0, 8.0, 16.0, 30.0])
_WIDTHS = np.array([0.5, 1.0, 2.0, 4.0])  # of a zone of shearing, standard widths in subsets
_ANGLES_DEG = np.arange(5.0, 80.0, 2.0)


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
    spread_deg : float
        Half the angle between the lines above which sand moves by a quarter and by three quarters of the
        block's motion: what "the" line is uncertain by where one is not enough
        (docs/theory-bands.md, Eq. (16)); else 0.
    """

    mechanism: Mechanism | None
    evidence: float
    spread_deg: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class _Points:
    """Points in order of their angle about the tip, with rates and their noise.

    ``sharing``: points that share one subset's worth of information; ``width_mm``: of the change at a band.
    """

    place: Floats
    rate: Floats
    std: Floats
    sharing: float
    width_mm: float

    @property
    def angle(self) -> Floats:
        """About the tip, rad, ascending."""
        return np.asarray(np.arctan2(self.place[:, 1], self.place[:, 0]))

    def above(self, angle: float) -> Floats:
        """Part of the motion above a line that a point sees, 0 to 1."""
        return np.asarray(ndtr(height_above(self.place, angle) / self.width_mm))

    def steepest(self) -> Floats:
        """Median rate (2,) of the points that stand steepest above the tip."""
        return np.asarray(np.median(self.rate[-max(len(self.rate) // _STEEPEST, 4) :], axis=0))

    def logs(self, expected: Floats, doubt: Floats | float = 0.0) -> Floats:
        """Logarithm of the density of each rate (N,), given what is expected, (2,) or (N, 2).

        docs/theory-bands.md, Eq. (11).
        """
        spread = self.std**2 + np.square(doubt)
        off = ((self.rate - expected) ** 2).sum(axis=1)
        bell = np.exp(-off / (2 * spread)) / (2 * np.pi * spread)
        return np.asarray(np.log((1 - _STRAYS) * bell + _STRAYS * _STRAY_DENSITY))

    def lead(self, logs: Floats, single: Floats, parameters: int) -> float:
        """Evidence of a rival with so many parameters more (docs/theory-bands.md, Eq. (12))."""
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
    if not resolved or len(motion.place) < _LEAST_POINTS:
        return Verdict(None, np.nan)
    if line is None:
        return Verdict(Mechanism.STILL, np.nan)
    beta = float(np.radians(line.beta_deg))
    points = _points_of(motion, line)
    part = points.above(beta)
    single = points.logs(part[:, None] * line.velocity, _doubt(part, line.velocity))
    two, apart_deg = _two_bands(points, single, line.velocity)
    rivals = {
        Mechanism.TWO_BANDS: two,
        Mechanism.SHEAR_ALONG_BLADE: _along_blade(points, single, part, line.velocity, motion.reach_mm),
        Mechanism.DIFFUSE: _diffuse(points, single, line.velocity, motion),
    }
    best = max(rivals, key=lambda name: rivals[name])
    found = best if rivals[best] > _SURE else Mechanism.ONE_BAND
    spread = 0.0 if found is Mechanism.ONE_BAND else _spread_deg(points, line.velocity)
    if found is Mechanism.TWO_BANDS:
        spread = max(spread, apart_deg / 2)
    return Verdict(found, max(rivals[best], points.lead(single, single, 3)), spread)


def _points_of(motion: Motion, line: BandLine) -> _Points:
    """The points; noise as large as most of those clear of the line show."""
    order = np.argsort(np.arctan2(motion.place[:, 1], motion.place[:, 0]), kind="stable")
    place, rate, std = motion.place[order], motion.rate[order], np.hypot(motion.std[order], _MODEL_STD)
    above = height_above(place, float(np.radians(line.beta_deg)))
    clear = np.abs(above) > motion.reach_mm / 2
    if clear.any():
        rest = np.hypot(*(rate - (above > 0)[:, None] * line.velocity)[clear].T) / _MEDIAN_DISTANCE
        std = std * max(float(np.median(rest / std[clear])), 1.0)
    sharing = max(len(place) / cells_of(place, motion.reach_mm)[0], 1.0)
    width = _WIDTH * motion.reach_mm
    return _Points(place, rate, std, sharing, width)


def _spread_deg(points: _Points, velocity: Floats) -> float:
    """Half the angle between the lines that part a quarter and three quarters of the motion best, degrees."""
    share = points.rate @ velocity / (velocity @ velocity)
    lines = []
    for level in (0.25, 0.75):
        wrong_below = np.concatenate([[0], np.cumsum(share > level)])
        wrong_above = np.concatenate([np.cumsum((share < level)[::-1])[::-1], [0]])
        cut = int(np.argmin(wrong_below + wrong_above))
        lines.append(points.angle[min(cut, len(share) - 1)])
    return float(np.degrees(abs(lines[1] - lines[0])) / 2)


def _doubt(part: Floats, velocity: Floats) -> Floats:
    """Std of the rate of points within the change across a band: what their subsets see is not known."""
    return np.asarray(2 * _TRANSITION * np.minimum(part, 1 - part) * np.hypot(*velocity))


def _two_bands(points: _Points, single: Floats, velocity: Floats) -> tuple[float, float]:
    """Evidence of a second line with sand between that moves by a part; their angle, degrees.

    docs/theory-bands.md, Eq. (13).
    """
    best, apart = -np.inf, 0.0
    beginnings = [(part * velocity, velocity) for part in (0.25, 0.5, 0.75)]
    beginnings.append((velocity, points.steepest()))  # the block that was fitted is the one between
    for middle, top in beginnings:
        low = high = 0
        for blur in (_ROUGH, _ROUGH / 2, 0.0):
            low, high = _two_cuts(points, middle, top, blur)
            if high - low < max(_LEAST_SETS * points.sharing, 4) or len(points.rate) - high < 4:
                break
            middle, top = (np.median(points.rate[a:b], axis=0) for a, b in ((low, high), (high, None)))
        else:
            if _PART[0] < float(middle @ top / (top @ top)) < _PART[1]:
                lead = points.lead(_two_logs(points, low, high, middle, top), single, 3)
                if lead > best:
                    best, apart = lead, float(np.degrees(points.angle[high - 1] - points.angle[low]))
    return best, apart


def _two_cuts(points: _Points, middle: Floats, top: Floats, blur: float) -> tuple[int, int]:
    """Best places of two cuts in the order of angles, between rest, middle and top."""
    logs = [points.logs(np.asarray(m), blur) for m in (np.zeros(2), middle, top)]
    rest, part, whole = (np.concatenate([[0.0], np.cumsum(v)]) for v in logs)
    gain = rest - part
    high = int(np.argmax(np.maximum.accumulate(gain) + part - whole))
    return int(np.argmax(gain[: high + 1])), high


def _two_logs(points: _Points, low: int, high: int, middle: Floats, top: Floats) -> Floats:
    """Logarithms of the densities (N,) with two bands through the tip at two cuts."""
    angle = points.angle
    lower, upper = (points.above(float(angle[k - 1] + angle[k]) / 2) for k in (max(low, 1), high))
    expected = lower[:, None] * middle + upper[:, None] * (top - middle)
    return points.logs(expected, np.hypot(_doubt(lower, middle), _doubt(upper, top - middle)))


def _along_blade(points: _Points, single: Floats, part: Floats, velocity: Floats, reach_mm: float) -> float:
    """Evidence of motion in the block that differs beside the blade and fades with the distance.

    docs/theory-bands.md, Eq. (14).
    """
    best = -np.inf
    off = points.rate - velocity
    used = (part > 0.99) & (np.abs(off).max(axis=1) < 0.5)
    if used.sum() < _LEAST_POINTS:
        return best
    for reach in _REACHES * reach_mm:
        fading = np.exp(-points.place[:, 0] / reach)
        design = np.column_stack([np.ones(used.sum()), fading[used]]) / points.std[used, None]
        (shift, extra), *_ = np.linalg.lstsq(design, off[used] / points.std[used, None], rcond=None)
        beside = float(np.hypot(*extra)) * np.exp(-0.5 * reach_mm / reach)
        if beside < _ALONG * float(np.hypot(*velocity)):
            continue
        expected = part[:, None] * (velocity + shift + fading[:, None] * extra)
        best = max(best, points.lead(points.logs(expected, _doubt(part, velocity)), single, 3))
    return best


def _diffuse(points: _Points, single: Floats, velocity: Floats, motion: Motion) -> float:
    """Evidence of motion that fades in gradually, over a fan of angles or a zone along the line.

    docs/theory-bands.md, Eq. (15).
    """
    best = -np.inf
    share = points.rate @ velocity / (velocity @ velocity)
    if (np.abs(share - 0.5) < 0.5 - _PART[0]).sum() < _LEAST_SETS * points.sharing:
        return best  # nothing moves by a part
    far = float(np.max(np.hypot(*points.place.T)))
    blocks = (velocity, points.steepest())
    fans = [f for f in np.radians(_FANS_DEG) if f * far > motion.reach_mm]
    for angle in np.radians(_ANGLES_DEG):
        above = height_above(points.place, angle)
        parts = [ndtr((points.angle - angle) / fan) for fan in fans]
        parts += [ndtr(above / width) for width in _WIDTHS * motion.reach_mm]
        for part in parts:
            for block in blocks:
                best = max(best, points.lead(points.logs(part[:, None] * block), single, 1))
    return best
