"""How likely the motion and the fate of points are, given a line (docs/theory-bands.md, section 2)."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from ploughval.tracers.increment import Motion
from ploughval.tracers.view import Floats

_LOGISTIC = 1.702  # a logistic function of 1.702 z is the normal distribution function of z to 0.01
_LEAST_SHARE_STD = 0.003
_TRANSITION = 0.3  # std of the share of a point in the middle of the change: what it sees is not known
_STRAYS = (0.01, 0.3)  # least and largest part of vectors that belong to neither side
_STRAY_DENSITY = 0.5  # of strays, over shares from -0.5 to 1.5
_TORN = (0.1, 0.4, 0.95)  # of the subsets whose middle a band crosses are lost: even chances
_TEARING = (0.06, 0.1, 0.15)  # standard width of the strip of losses, beyond what is swept, in subsets
_LEAST_LOSS = 0.002  # of subsets that no band crosses
_LEAST_CLEAR = 8  # points clear of a line that tell noise and strays


@dataclass(frozen=True, slots=True, eq=False)
class Shares:
    """Motion of points in parts of the block's, and the points that were lost.

    Attributes
    ----------
    place, lost : (N, 2), (M, 2) float, mm, relative to the tip half-way
    share, std : (N,) float
    strays, loss : float
        Parts of the points that belong to neither side, and that are lost without a band.
    travel_mm, far_mm, reach_mm : float, travel of the increment, length of the band, side of a subset
    """

    place: Floats
    lost: Floats
    share: Floats
    std: Floats
    strays: float
    loss: float
    travel_mm: float
    far_mm: float
    reach_mm: float

    def logs(self, angle: Floats, widths: Floats) -> Floats:
        """Log-likelihood (W, G) of lines at angles (G,), rad, with widths (W,) of the change, mm.

        docs/theory-bands.md, Eq. (6).
        """
        above, swept = self._geometry(self.place, angle)
        parts = (expit(_LOGISTIC * above / np.sqrt(width**2 + swept)) for width in widths)
        moved = [point_logs(self.share, self.std, part, self.strays).sum(axis=1) for part in parts]
        return np.stack(moved) + self._fates(above, swept, angle)

    def cuts(self, angle: Floats) -> Floats:
        """The same (G,) for a line without width to those that were seen: quick, for many angles."""
        own = np.arctan2(self.place[:, 1], self.place[:, 0])
        order = np.argsort(own, kind="stable")
        rest, move = (point_logs(self.share, self.std, np.float64(p), self.strays)[order] for p in (0.0, 1.0))
        below = np.concatenate([[0.0], np.cumsum(rest)])
        over = np.concatenate([np.cumsum(move[::-1])[::-1], [0.0]])
        cut = np.searchsorted(own[order], angle)
        gone = np.log(self._torn(*self._geometry(self.lost, angle), _TORN[1], _TEARING[1]))
        return np.asarray(below[cut] + over[cut] + gone.sum(axis=1))

    def at_rest(self) -> float:
        """Log-likelihood that nothing moves."""
        logs = point_logs(self.share, self.std, np.float64(0.0), self.strays).sum()
        return float(logs + len(self.lost) * np.log(self.loss))

    def near(self, low: float, high: float, reach: float) -> "Shares":
        """Only those points to which it matters where a line stands between two angles, rad."""
        seen, gone = (
            (height_above(p, low) > -reach) & (height_above(p, high) < reach) for p in (self.place, self.lost)
        )
        return replace(
            self,
            place=self.place[seen],
            lost=self.lost[gone],
            share=self.share[seen],
            std=self.std[seen],
        )

    def _geometry(self, place: Floats, angle: Floats) -> tuple[Floats, Floats]:
        """Heights (G, N) above lines, mm, and the variance of what a line sweeps there, mm2.

        docs/theory-bands.md, Eqs (3) and (4).
        """
        x, y = place.T
        sin, cos = np.sin(angle)[:, None], np.cos(angle)[:, None]
        above, along = cos * y - sin * x, cos * x + sin * y
        ramp = 0.5 * self.travel_mm * sin * (1 - np.clip(along / self.far_mm, 0.0, 1.0))
        return above, ramp**2 / 3

    def _torn(self, above: Floats, swept: Floats, part: float, width: float) -> Floats:
        """Probability that a point at a height above the line is lost (docs/theory-bands.md, Eq. (5))."""
        near = np.exp(-(above**2) / (2 * ((width * self.reach_mm) ** 2 + swept)))
        return np.asarray(self.loss + part * (1 - self.loss) * near)

    def _fates(self, above: Floats, swept: Floats, angle: Floats) -> Floats:
        """Log-likelihood (G,) that points seen, whose geometry is given, were kept and others lost."""
        lost = self._geometry(self.lost, angle)
        logs = [
            np.log(1 - self._torn(above, swept, part, width)).sum(axis=1)
            + np.log(self._torn(*lost, part, width)).sum(axis=1)
            for part in _TORN
            for width in _TEARING
        ]
        return np.asarray(np.logaddexp.reduce(logs, axis=0))


def point_logs(share: Floats, std: Floats, part: Floats | np.float64, strays: float) -> Floats:
    """Logarithm of the density of shares (N,), given the parts (..., N) of the block's motion expected."""
    spread = std**2 + (2 * _TRANSITION * np.minimum(part, 1 - part)) ** 2
    bell = np.exp(-((share - part) ** 2) / (2 * spread)) / np.sqrt(2 * np.pi * spread)
    return np.asarray(np.log((1 - strays) * bell + strays * _STRAY_DENSITY))


def height_above(place: Floats, angle: float) -> Floats:
    """Distance of points (N, 2) above the line through the tip, mm, negative below it."""
    return np.asarray(place[:, 1] * np.cos(angle) - place[:, 0] * np.sin(angle))


def shares_of(motion: Motion, velocity: Floats, angle: float | None) -> Shares:
    """Motion along the block's velocity (2,) in parts of it; noise, strays and losses from clear points.

    docs/theory-bands.md, Eq. (2).

    A point is clear of a line (angle, rad) by half a subset; without a line generous values are taken.
    """
    size = float(velocity @ velocity)
    share = motion.rate @ velocity / size
    std = np.maximum(motion.std / np.sqrt(size), _LEAST_SHARE_STD)
    along = motion.place[:, 0] if angle is None else motion.place @ [np.cos(angle), np.sin(angle)]
    shares = Shares(
        motion.place, motion.lost, share, std, strays=0.1, loss=0.02, travel_mm=motion.travel_mm,
        far_mm=float(np.max(along[share > 0.5], initial=motion.reach_mm)),
        reach_mm=motion.reach_mm,
    )  # fmt: skip
    if angle is None:
        return shares
    above = height_above(motion.place, angle)
    clear = np.abs(above) > motion.reach_mm / 2
    rest = (share - (above > 0))[clear]
    if len(rest) < _LEAST_CLEAR:
        return shares
    std = std * max(1.4826 * float(np.median(np.abs(rest) / std[clear])), 1.0)
    strays = float(np.mean(np.abs(rest) > np.maximum(5 * std[clear], 0.1)))
    away = (np.abs(height_above(motion.lost, angle)) > motion.reach_mm / 2).sum()
    loss = float(np.clip((away + 0.5) / (away + len(rest) + 1), _LEAST_LOSS, 0.99))
    return replace(shares, std=std, strays=float(np.clip(strays, *_STRAYS)), loss=loss)
