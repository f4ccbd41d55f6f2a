"""Curves of the mobilised friction of all bands and what is read from them, as tables."""

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from ploughval.compare.force.curve import Curve
from ploughval.compare.mobilised.curve import (
    CURVE_COLUMNS,
    BandCurve,
    band_curve,
    curve_table,
)
from ploughval.compare.mobilised.surface import seen_surface
from ploughval.compare.softening.fit import Softening, fit_softening
from ploughval.compare.softening.interval import Interval
from ploughval.scene import Scene

SOFTENING_COLUMNS = (
    "band", "peak_deg", "peak_std_deg", "peak_low_deg", "peak_high_deg",
    "residual_deg", "residual_std_deg", "residual_low_deg", "residual_high_deg",
    "length_mm", "length_std_mm", "length_low_mm", "length_high_mm",
    "origin_mm", "origin_std_mm", "points", "scatter", "drift", "law", "note",
)  # fmt: skip
ALL = "all"
_VAGUE_DEG = 10.0  # an angle whose 95 % interval reaches further from it is not determined
_TELLS = 2.0  # of AICc: less does not tell two descriptions apart (Burnham and Anderson 2002, 2.6)


@dataclass(frozen=True, slots=True)
class FrictionFindings:
    """Mobilised friction between the photographs, and what is read from it.

    Attributes
    ----------
    curve : DataFrame of CURVE_COLUMNS
        One row a step of travel; slip counts from where the band took over, as its own curve shows.
    softening : DataFrame of SOFTENING_COLUMNS
        One row a band and one for all together (``band`` is "all"), limits of 95 %; NaN what is not
        determined, and the note says why.
    """

    curve: pd.DataFrame
    softening: pd.DataFrame

    @property
    def origins_mm(self) -> dict[int, float]:
        """Travel at which the slip of each band began, by its number."""
        alone = self.softening[self.softening["band"] != ALL]
        return {int(band): float(at) for band, at in zip(alone["band"], alone["origin_mm"], strict=True)}

    @property
    def overall(self) -> pd.Series | None:
        """The row for all bands together, or that of the only one."""
        return None if self.softening.empty else self.softening.iloc[-1]


def read_friction(
    scene: Scene,
    force: Curve,
    bands: pd.DataFrame,
    surface: pd.DataFrame,
    increments: pd.DataFrame | None = None,
) -> FrictionFindings:
    """Mobilised friction of every band, and peak, residual and mobilization length.

    Parameters
    ----------
    scene : Scene
        With [soil] and the blade.
    force : Curve
        Measured force over travel.
    bands : DataFrame
        BAND_COLUMNS, measured.
    surface : DataFrame
        SURFACE_COLUMNS, measured, and std_mm where it is known.
    increments : DataFrame or None
        INCREMENT_COLUMNS, which show whether an outcrop creeps; None: all stay.

    Returns
    -------
    FrictionFindings
    """
    seen, depth = seen_surface(surface), scene.blade.depth_mm
    curves, tables, rows = [], [], []
    for row in range(len(bands)) if len(seen.lines) else ():
        curve = band_curve(scene, force, bands, row, seen, increments)
        if curve is None:
            continue
        fit = fit_softening([curve], depth)
        if fit is not None and _elsewhere(curve, fit):
            # the block just before the switch stands on where that was: once more from there
            there = band_curve(scene, force, _moved(bands, row, fit.origins[0][0]), row, seen, increments)
            curve = curve if there is None else replace(there, start_mm=curve.start_mm)
            fit = fit_softening([curve], depth)
        curves.append(curve)
        origin = (curve.start_mm, float("nan")) if fit is None else fit.origins[0]
        tables.append(curve_table(curve, *origin))
        if fit is not None:
            rows.append(_row(str(curve.band), fit, _rise_note(curve, fit)))
    together = fit_softening(curves, depth) if len(rows) > 1 else None
    if together is not None:
        rows.append(_row(ALL, together, ""))
    table = pd.concat(tables, ignore_index=True) if tables else pd.DataFrame(columns=list(CURVE_COLUMNS))
    return FrictionFindings(table, pd.DataFrame(rows, columns=list(SOFTENING_COLUMNS)))


def _elsewhere(curve: BandCurve, fit: Softening) -> bool:
    """Whether the friction places the start of a band off where the photographs do."""
    apart = abs(fit.origins[0][0] - curve.start_mm)
    return not curve.first and apart > float(curve.width_mm[0]) / 2


def _moved(bands: pd.DataFrame, row: int, start_mm: float) -> pd.DataFrame:
    """The bands, one of them beginning elsewhere."""
    starts = bands["u_start_mm"].to_numpy(dtype=np.float64).copy()
    starts[row] = start_mm
    return bands.assign(u_start_mm=starts)


def _rise_note(curve: BandCurve, fit: Softening) -> str:
    """What is left out before the first peak of the blade's first band."""
    left = fit.origins[0][0] - curve.start_mm
    if not curve.first or left <= 2 * float(curve.width_mm[0]):
        return ""
    return f"friction rises over the first {left:.2g} mm of travel: slip counts from there"


def _row(name: str, fit: Softening, note: str) -> tuple[object, ...]:
    """One row of SOFTENING_COLUMNS, with what is not determined left out and said."""
    notes = [note] if note else []
    told = fit.fall > _TELLS
    softens = told and fit.peak.value > fit.residual.value
    if not softens:
        why = "the friction does not fall with slip" if told else "one friction describes the curve as well"
        notes.append(f"no softening is told: {why}; it stands as the residual")
    length: tuple[float, ...] = _told_length(fit, notes) if softens else (np.nan,) * 4
    peak: tuple[float, ...] = (np.nan,) * 4
    residual: tuple[float, ...] = (np.nan,) * 4
    if not softens:
        residual = _told("friction", fit.level, notes, fit)
    else:
        # with a length that may be as short or as long as it likes, one end of the line is never seen
        peak = _told("peak", fit.peak, notes, fit, seen=bool(np.isfinite(fit.length.low95)))
        residual = _told("residual", fit.residual, notes, fit, seen=bool(np.isfinite(fit.length.high95)))
    exponential = softens and fit.gain > _TELLS
    origin = fit.origins[0] if name != ALL else (np.nan, np.nan)
    return (
        name, *peak, *residual, *length, *origin, fit.rows, fit.scatter, fit.drift,
        "exponential" if exponential else "linear", "; ".join(notes),
    )  # fmt: skip


def _told(
    what: str, found: Interval, notes: list[str], fit: Softening, *, seen: bool = True
) -> tuple[float, ...]:
    """Value, std and 95 % limits of an angle, NaN where it is not determined."""
    ends = found.low95, found.high95
    reach = np.nanmax(np.abs(np.array(ends) - found.value)) if np.isfinite(ends).any() else np.inf
    if seen and np.isfinite(ends).all() and reach <= _VAGUE_DEG:
        return found.value, found.std, *ends
    slips = f"slip was seen from {fit.least_slip_mm:.3g} to {fit.most_slip_mm:.3g} mm"
    notes.append(f"{what} not determined: {slips}")
    return (np.nan,) * 4


def _told_length(fit: Softening, notes: list[str]) -> tuple[float, ...]:
    """Mobilization length, std and 95 % limits; an open end leaves it out."""
    found = fit.length
    if np.isfinite([found.low95, found.high95]).all():
        return found.value, found.std, found.low95, found.high95
    said = []
    if np.isfinite(found.high95):
        said.append(f"at most {found.high95:.3g} mm")
    if np.isfinite(found.low95):
        said.append(f"at least {found.low95:.3g} mm")
    limits = f", {said[0]}" if said else ""
    notes.append(f"length not determined{limits}: slip was seen from {fit.least_slip_mm:.3g} mm on")
    return np.nan, np.nan, found.low95, found.high95
