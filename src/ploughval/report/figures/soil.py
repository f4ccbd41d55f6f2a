"""Friction mobilised on the bands against slip: measured curves, what is read from them, the model's line."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ploughval.report.figures.look import legend_outside
from ploughval.report.figures.style import INK, MODEL, SERIES, new_figure, styled

_MARKERS = "osD^vP"
_DASHES = ("-", (0, (4, 1.5)), (0, (1.5, 1)), (0, (6, 1.5, 1.5, 1.5)))  # bands differ without their colours
_TWO_SIDED = 1.96
_NEAR_LENGTHS = 4.0  # slip shown at the left, in mobilization lengths
_NEAR_SHARE = 0.6  # ... and at most of all slip
_MARGIN = 0.05
_SHOWN = (0.5, 99.5)  # percentiles of the measured values


@dataclass(frozen=True, slots=True)
class SofteningLine:
    """Friction falling from a peak to a residual over a length of slip.

    Attributes
    ----------
    peak_deg, residual_deg : float, degrees
        Friction angles.
    length_mm : float, mm
        Mobilization length.
    """

    peak_deg: float
    residual_deg: float
    length_mm: float

    @property
    def known(self) -> bool:
        """Whether all three are numbers."""
        return bool(np.isfinite([self.peak_deg, self.residual_deg, self.length_mm]).all())


@styled
def mobilised_figure(
    frames: pd.DataFrame,
    curve: pd.DataFrame | None = None,
    *,
    read: SofteningLine | None = None,
    assumed: SofteningLine | None = None,
) -> Figure:
    """Mobilised friction against slip: the softening at the left, all of it at the right.

    Parameters
    ----------
    frames : DataFrame
        Columns band, slip_mm, phi_deg, phi_std_deg: the friction in the photographs.
    curve : DataFrame or None
        The same columns by steps of travel; its 95 % limits are shaded.
    read, assumed : SofteningLine or None
        The line read from the curves, and the model's.
    """
    shown = frames if curve is None or curve.empty else curve
    far = float(np.nanmax(shown["slip_mm"].to_numpy(float), initial=0.0))
    lengths = [line.length_mm for line in (read, assumed) if line is not None and line.known]
    near = min(_NEAR_LENGTHS * max(lengths, default=far), far)
    both = curve is not None and not curve.empty and 0 < near < _NEAR_SHARE * far
    figure = new_figure(3.6)
    columns = figure.subplots(1, 2 if both else 1, sharey=True, squeeze=False)[0]
    for axes, end in zip(columns, (near, far) if both else (far,), strict=True):
        _bands(axes, frames, curve)
        _lines(axes, end, read, assumed)
        axes.set_xlim(-_MARGIN * end, (1 + _MARGIN) * end)
        axes.set_xlabel("slip on the band, mm")
    columns[0].set_ylabel("mobilised friction φ, °")
    columns[0].set_ylim(*_range(shown, [line for line in (read, assumed) if line is not None and line.known]))
    legend_outside(figure, *columns[0].get_legend_handles_labels(), columns=4)
    return figure


def _range(shown: pd.DataFrame, lines: Sequence[SofteningLine]) -> tuple[float, float]:
    """Ordinates that hold the curves after their start, and the lines."""
    slipped = shown[shown["slip_mm"] >= 0]
    reach = _TWO_SIDED * slipped["phi_std_deg"].fillna(0.0)
    measured = np.array([*(slipped["phi_deg"] - reach), *(slipped["phi_deg"] + reach)])
    measured = measured[np.isfinite(measured)]
    known = [value for line in lines for value in (line.peak_deg, line.residual_deg)]
    if measured.size:
        known += np.percentile(measured, _SHOWN).tolist()  # a stray row does not flatten the rest
    if not known:
        return 0.0, 90.0
    low, high = min(known), max(known)
    margin = max(_MARGIN * (high - low), 0.5)
    return max(float(low - margin), 0.0), float(high + margin)


def _bands(axes: Axes, frames: pd.DataFrame, curve: pd.DataFrame | None) -> None:
    """Curves with their limits, and marks at the photographs, a colour a band."""
    colours = [c for c in SERIES if c != MODEL]
    known = frames.dropna(subset=["phi_deg"])
    numbers = [*known["band"], *([] if curve is None else curve["band"])]
    for place, band in enumerate(sorted({float(number) for number in numbers})):
        colour, marks = colours[place % len(colours)], known[known["band"] == band]
        own = None if curve is None else curve[(curve["band"] == band) & (curve["slip_mm"] >= 0)]
        drawn = own is not None and not own.empty
        if len(marks):
            reach = _TWO_SIDED * marks["phi_std_deg"].fillna(0.0).to_numpy(float)
            axes.errorbar(
                marks["slip_mm"],
                marks["phi_deg"],
                yerr=None if drawn else reach,
                fmt=_MARKERS[place % len(_MARKERS)],
                ms=3.5,
                color=colour,
                elinewidth=0.9,
                label=f"band {band:g}",
            )
        if own is not None and drawn:
            slip, phi = own["slip_mm"].to_numpy(float), own["phi_deg"].to_numpy(float)
            reach = _TWO_SIDED * own["phi_std_deg"].to_numpy(float)
            axes.fill_between(slip, phi - reach, phi + reach, color=colour, alpha=0.18, linewidth=0)
            dash = _DASHES[place % len(_DASHES)]
            axes.plot(
                slip, phi, color=colour, ls=dash, lw=1.1, label=None if len(marks) else f"band {band:g}"
            )


def _lines(axes: Axes, end_mm: float, read: SofteningLine | None, assumed: SofteningLine | None) -> None:
    for line, colour, dashes, label in (
        (read, INK, "-", "read from the curves"),
        (assumed, MODEL, "--", "assumed by the model"),
    ):
        if line is not None and line.known:
            axes.plot(
                [0, line.length_mm, max(1.05 * end_mm, 1.5 * line.length_mm)],
                [line.peak_deg, line.residual_deg, line.residual_deg],
                color=colour,
                ls=dashes,
                lw=1.6,
                label=label,
            )
