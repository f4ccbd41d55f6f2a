"""The rows of a band that tell its softening, and where its slip may have begun."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ploughval.compare.mobilised.curve import BandCurve

Floats = NDArray[np.float64]
_RISE_DEPTHS = 1 / 30  # rows so far before a band's start tell how friction rose up to it
_FIRST_DEPTHS = 0.1  # travel within which the first peak lies
_RISE_STDS = 5.0  # of the noise: a smaller rise to it is none
_LEAST_ROWS = 8
_STEEPEST_DEG = 85.0  # of a band: once the blade has come to its outcrop it tells nothing


@dataclass(frozen=True, slots=True, eq=False)
class FittedRows:
    """Rows of one band that are fitted, and the range of its origin.

    Attributes
    ----------
    curve : BandCurve
        Cut to these N rows.
    low, high, place, place_std : float, mm
        Travels between which slip began, and where as far as the photographs tell, with its std.
    ends, slips : pair of (N,) float, mm
        Travel at either end of each row, and the slip there from the first row on.
    path : pair of (M,) float, mm
        Travel and slip there, from well before the rows to well after.
    """

    curve: BandCurve
    low: float
    high: float
    place: float
    place_std: float
    ends: tuple[Floats, Floats]
    slips: tuple[Floats, Floats]
    path: tuple[Floats, Floats]

    def slip_of(self, origin_mm: float) -> float:
        """Slip at an origin.

        Parameters
        ----------
        origin_mm : float, mm
            Travel.

        Returns
        -------
        float, mm
            Counted as in ``slips``.
        """
        return float(np.interp(origin_mm, *self.path))


def rows_of(curve: BandCurve, depth_mm: float) -> FittedRows | None:
    """The rows of a band that are fitted, and where its slip may have begun.

    Parameters
    ----------
    curve : BandCurve
        Of one band.
    depth_mm : float, mm
        Of the tip.

    Returns
    -------
    FittedRows or None
        None with fewer than 8 rows after the start. Rows of a band that is steeper than 85 degrees are left
        out: there the blade has come to its outcrop.
    """
    usable = curve.beta_deg < _STEEPEST_DEG
    if not usable.any():
        return None
    if not usable.all():
        curve = _cut(curve, usable)
    if curve.first:
        kept, low, high, place, spread = _first(curve, depth_mm)
    else:
        low, place = curve.start_low_mm, curve.start_mm
        interval = curve.start_high_mm - low
        high = min(curve.start_high_mm, place + interval / 2)
        spread = max(interval / np.sqrt(12.0), float(curve.width_mm.min()))
        kept = curve.u_mm >= place - _RISE_DEPTHS * depth_mm
    if (curve.u_mm[kept] > place).sum() < _LEAST_ROWS:
        return None
    cut = _cut(curve, kept)
    ends = cut.u_mm - cut.width_mm / 2, cut.u_mm + cut.width_mm / 2
    path_u = np.concatenate([[cut.u_mm[0] - depth_mm], cut.u_mm, [cut.u_mm[-1] + depth_mm]])
    path = path_u, cut.slip_at(float(cut.u_mm[0]), path_u)
    slips = np.interp(ends[0], *path), np.interp(ends[1], *path)
    return FittedRows(cut, low, high, place, float(spread), ends, slips, path)


def _first(curve: BandCurve, depth_mm: float) -> tuple[NDArray[np.bool_], float, float, float, float]:
    """Rows kept, least, greatest and likeliest origin of the blade's first band, and the std of that.

    Friction is mobilised on the way to the first peak, before the band slips: those rows are left out.
    """
    near = np.flatnonzero(curve.u_mm <= curve.u_mm[0] + _FIRST_DEPTHS * depth_mm)
    top = int(np.argmax(curve.phi_deg[near]))
    noise = float(np.hypot(curve.response.fresh[0], curve.response.fresh[top]))
    if curve.phi_deg[top] - curve.phi_deg[0] <= _RISE_STDS * noise:
        top = 0
    kept = np.arange(len(curve.u_mm)) >= top
    width = float(curve.width_mm[top])
    if not top:
        return kept, curve.start_mm, curve.start_mm + width, curve.start_mm, 0.1 * width
    place = float(curve.u_mm[top]) - width / 2
    return kept, place - width, place + width, place, width / np.sqrt(12.0)


def _cut(curve: BandCurve, kept: NDArray[np.bool_]) -> BandCurve:
    response = curve.response
    names = ("u_mm", "width_mm", "phi_deg", "stretch", "beta_deg", "weight_N", "force_N")
    return replace(
        curve,
        response=replace(
            response,
            fresh=response.fresh[kept],
            shared=response.shared[:, kept],
            photographs=response.photographs[:, kept],
        ),
        **{name: getattr(curve, name)[kept] for name in names},
    )
