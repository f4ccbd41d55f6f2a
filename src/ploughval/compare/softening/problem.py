"""Least squares of the softening line, rows weighted by the inverse of their whole covariance."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.mobilised.sources import OWN, SOURCES
from ploughval.compare.softening.law import Law, ahead, softened
from ploughval.compare.softening.rows import FittedRows

Floats = NDArray[np.float64]
PEAK, RESIDUAL = 0, 1
_VAGUE_DEG = 40.0  # std of an angle about which nothing is known beforehand
_LEVEL_DEG = 40.0  # ... and its mean
_STEEP = 60.0  # std of the rise of friction before a band takes over, degrees a mm
_FIXED = 1e12  # precision of what is held
_LEAST_NOISE_DEG = 1e-4
_ROUNDS, _HALVINGS, _DONE = 12, 5, 1e-4


@dataclass(frozen=True, slots=True)
class Noise:
    """Factors on what changes from photograph to photograph, on noise and on all that rows share."""

    drift: float = 1.0
    fresh: float = 1.0
    shared: float = 1.0
    floor_deg: float = 0.0  # added to the noise


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """Least squares at a given length.

    Attributes
    ----------
    values, cov : (P,) and (P, P) float
        Peak and residual, degrees; then rise, degrees a mm, and change of the origin, mm, of each band.
    chi2 : float
        Of the rows and of the origins' distance from where the photographs place them.
    origins : (B,) float, mm
        Travel at which each band's slip begins.
    """

    values: Floats
    cov: Floats
    chi2: float
    origins: Floats


class Problem:
    """Rows of all bands, weighted by the inverse of their whole covariance.

    That is D + S S^T, D diagonal of the fresh parts, S the effects of the shared sources; its inverse is
    W^2 - U^T U (Woodbury), with W = D^(-1/2) and U = L^(-1) S^T W^2, L L^T = 1 + S^T W^2 S.

    Parameters
    ----------
    bands : sequence of FittedRows
        Rows of each of B bands, N in all.
    noise : Noise
        Factors on the parts of the covariance.
    law : Law
        Shape of the fall.
    """

    def __init__(self, bands: Sequence[FittedRows], noise: Noise, law: Law = Law.LINEAR) -> None:
        self.bands, self.law = list(bands), law
        self.target = np.concatenate([b.curve.phi_deg for b in bands])
        fresh = np.concatenate([b.curve.response.fresh for b in bands])
        self.weight = 1 / (np.hypot(fresh, max(noise.floor_deg, _LEAST_NOISE_DEG)) * noise.fresh)
        self.shared = _shared(bands, noise.drift) * noise.shared
        lever = self.shared.T * self.weight**2
        self.lower = np.linalg.cholesky(np.eye(len(lever)) + lever @ self.shared)
        self.lever = np.linalg.solve(self.lower, lever)
        self.count = 2 + 2 * len(self.bands)
        # the force stands for a travel to within half a row of the log
        self.resolution = float(np.median([b.curve.row_mm for b in bands])) / np.sqrt(12.0)

    def design(self, length: float, origins: Floats) -> Floats:
        """What the parameters do to the rows.

        Parameters
        ----------
        length : float, mm
            Mobilization length.
        origins : (B,) float, mm
            Travel at which each band's slip begins.

        Returns
        -------
        (N, 2 + 2 B) float
            Columns of peak, residual, and of rise and origin (here 0) of each band.
        """
        parts = []
        for number, (band, origin) in enumerate(zip(self.bands, origins.tolist(), strict=True)):
            curve = band.curve
            low, high = (slip - band.slip_of(origin) for slip in band.slips)
            share = softened(low, high, length, self.law)
            own = np.zeros((len(curve.u_mm), 2 * len(self.bands)))
            own[:, 2 * number] = 0.0 if curve.first else -ahead(*band.ends, origin)
            parts.append(np.column_stack([1 - share, share, own]))
        return np.concatenate(parts)

    def solve(self, length: float, origins: Floats, moved: Floats | None = None) -> Solved:
        """Peak, residual and rises at given length and origins.

        Parameters
        ----------
        length : float, mm
            Mobilization length.
        origins : (B,) float, mm
            Travel at which each band's slip begins.
        moved : (N, B) float or None, degrees a mm
            Change of the friction with each origin, where those are to be free.

        Returns
        -------
        Solved
        """
        columns = self.design(length, origins)
        if moved is not None:
            columns[:, 3::2] = moved
        mean, precision = self._prior(origins, free=moved is not None)
        off = self.target - columns @ mean
        near, far = np.column_stack([columns, off]) * self.weight[:, None], self.lever @ columns
        far_off = self.lever @ off
        normal = near[:, :-1].T @ near[:, :-1] - far.T @ far
        side = near[:, :-1].T @ near[:, -1] - far.T @ far_off
        step, cov = _least(normal, side, precision)
        falls = np.flatnonzero(mean[2::2] + step[2::2] < 0)
        if falls.size:  # friction does not fall before a band takes over
            precision[2 + 2 * falls] = _FIXED
            step, cov = _least(normal, side, precision)
        chi2 = float(near[:, -1] @ near[:, -1] - far_off @ far_off)
        chi2 += float(step @ (normal @ step) - 2 * step @ side + step @ (precision * step))
        if moved is None:
            places = np.array([(b.place, b.place_std) for b in self.bands])
            chi2 += float((((origins - places[:, 0]) / places[:, 1]) ** 2).sum())
        return Solved(mean + step, cov, chi2, origins)

    @property
    def spread(self) -> float:
        """Logarithm of the determinant of the rows' covariance."""
        return float(2 * np.log(np.diag(self.lower)).sum() - 2 * np.log(self.weight).sum())

    def levels(self, length: float, found: Solved) -> Solved:
        """Peak and residual anew, and all that they are uncertain by, at the length and origins found.

        Rows count by their whole variance, none is used to put a shared source right: a slow drift of the
        friction would pass for an error of the force's zero. Then errors are carried through
        (docs/theory-mobilised.md, Eqs (9) and (10)).

        Parameters
        ----------
        length : float, mm
            Mobilization length.
        found : Solved
            The best fit at it.

        Returns
        -------
        Solved
            Values and covariance of peak and residual alone.
        """
        design = self.design(length, found.origins)
        kept = np.flatnonzero(design.any(axis=0) | (np.arange(self.count) <= RESIDUAL))
        held = np.array([1 / _VAGUE_DEG**2] * 2 + [1 / _STEEP**2, _FIXED] * len(self.bands))
        mean = np.array([_LEVEL_DEG] * 2 + [0.0] * (self.count - 2))
        fresh = 1 / self.weight**2
        count = 1 / (fresh + (self.shared**2).sum(axis=1))
        for _ in range(2):
            X, prior = design[:, kept], held[kept]
            inner = np.linalg.inv((X.T * count) @ X + np.diag(prior))
            take = inner @ (X.T * count)
            values = mean[kept] + take @ (self.target - X @ mean[kept])
            falls = kept[(values < 0) & (kept >= 2)]
            if not falls.size:
                break
            kept = np.setdiff1d(kept, falls)
        through = take @ self.shared
        cov = (take * fresh) @ take.T + through @ through.T + (inner * prior) @ inner
        slope = (values[PEAK] - values[RESIDUAL]) / length
        cov[PEAK, PEAK] += slope**2 * (float(found.cov[3::2, 3::2].max()) + self.resolution**2)
        return Solved(values[:2], cov[:2, :2], found.chi2, found.origins)

    def _prior(self, origins: Floats, *, free: bool) -> tuple[Floats, Floats]:
        mean, precision = np.zeros(self.count), np.ones(self.count)
        mean[:2], precision[:2] = _LEVEL_DEG, _VAGUE_DEG**-2
        for number, band in enumerate(self.bands):
            precision[2 + 2 * number] = _STEEP**-2
            precision[3 + 2 * number] = band.place_std**-2 if free else _FIXED
            mean[3 + 2 * number] = band.place - origins[number] if free else 0.0
        return mean, precision

    def best(self, length: float, origins: Floats) -> Solved:
        """Least squares at a given length, the origins found by Gauss-Newton.

        Parameters
        ----------
        length : float, mm
            Mobilization length.
        origins : (B,) float, mm
            Where to start from.

        Returns
        -------
        Solved
        """
        now = self.solve(length, origins)
        free = now
        for _ in range(_ROUNDS):
            free = self.solve(length, now.origins, self._by_origin(length, now))
            trial = self._stepped(length, now, free.values[3::2])
            if trial is None:
                break
            done = now.chi2 - trial.chi2 < _DONE
            now = trial
            if done:
                break
        # values at the optimum; covariance with the origins free
        return Solved(now.values, free.cov, now.chi2, now.origins)

    def _stepped(self, length: float, now: Solved, step: Floats) -> Solved | None:
        low, high = (np.array([getattr(b, name) for b in self.bands]) for name in ("low", "high"))
        for _ in range(_HALVINGS):
            trial = self.solve(length, np.clip(now.origins + step, low, high))
            if trial.chi2 < now.chi2:
                return trial
            step = step / 3
        return None

    def _by_origin(self, length: float, now: Solved) -> Floats:
        """Change of the friction for a mm of each band's origin, (N, B)."""
        half = 0.25 * np.array([float(b.curve.width_mm.min()) for b in self.bands])
        ends = [self.design(length, now.origins + sign * half) @ now.values for sign in (1, -1)]
        change = ends[0] - ends[1]
        result, at = np.zeros((len(change), len(self.bands))), 0
        for number, band in enumerate(self.bands):  # an origin moves the rows of its own band alone
            rows = slice(at, at + len(band.curve.u_mm))
            result[rows, number] = change[rows] / (2 * half[number])
            at = rows.stop
        return result


def _least(normal: Floats, side: Floats, precision: Floats) -> tuple[Floats, Floats]:
    """Solution and covariance of normal equations with a prior precision about zero."""
    cov = np.linalg.inv(normal + np.diag(precision))
    return np.asarray(cov @ side), np.asarray(cov)


def _shared(bands: Sequence[FittedRows], drift: float) -> Floats:
    """Effects of one standard uncertainty (N, K): of the common sources, then of each band's own."""
    common = [k for k, name in enumerate(SOURCES) if name not in OWN]
    own = [k for k, name in enumerate(SOURCES) if name in OWN]
    blocks = [b.curve.response for b in bands]
    columns = [np.concatenate([r.shared[k] for r in blocks]) for k in common]
    total, at = sum(r.fresh.size for r in blocks), 0
    for r in blocks:
        for effect in (*r.shared[own], *(drift * r.photographs)):
            column = np.zeros(total)
            column[at : at + r.fresh.size] = effect
            columns.append(column)
        at += r.fresh.size
    return np.array([c for c in columns if c.any()]).reshape(-1, total).T
