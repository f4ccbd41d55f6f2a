"""Where measurements contradict each other: blade and log, heap and swept area."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.run.clock import Displacement

Floats = NDArray[np.float64]

APART_PX, APART_SHARE = 2.0, 0.02
"""Blade in the photographs and log: differences beyond pixels and beyond a share of the travel are said."""
SCALE, STDS = 0.005, 4.0
"""So is a travel that differs by this share and by so many standard deviations."""
HEAP_SHARE, HEAP_STDS = 0.05, 3.0
"""So is a heap that differs from what was swept by this share and by so many standard deviations."""
LONE_PX, LONE_SPREADS = 2.0, 8.0
"""So is a single frame off by so many pixels and so many robust standard deviations of the others."""


def lean_doubt(inclination_deg: float) -> str:
    """What a blade that leans does to what is read from photographs; empty for an upright one."""
    if inclination_deg == 0:
        return ""
    way = "ahead, over the sand" if inclination_deg > 0 else "back"
    return (
        f"the blade leans {abs(inclination_deg):g} degrees {way}, but in the photographs an upright face is "
        "looked for: blade, sand beside it, surface at the face, heap and bands are read less well"
    )


def doubts(displacement: Displacement, blade_x_mm: Floats, mm_per_px: float, travel_mm: float) -> list[str]:
    """What is to be doubted about times, scale and displacement.

    Parameters
    ----------
    displacement : Displacement
        Of the frames.
    blade_x_mm : (F,) float, mm
        Blade face in the photographs, NaN where not found.
    mm_per_px : float
        Scale of the photographs.
    travel_mm : float
        Of the blade in the test.

    Returns
    -------
    list of str
        A sentence for each doubt; none without a log.
    """
    if displacement.source != "log":
        return []
    said = []
    apart = displacement.difference_rms_mm
    if apart > max(APART_PX * mm_per_px, APART_SHARE * travel_mm):
        said.append(
            f"the blade in the photographs and the log's displacement differ by {apart:.3g} mm rms: "
            "check clock_offset_s, mm_per_px and direction"
        )
    scale, std = displacement.scale, displacement.scale_std
    if abs(scale - 1) > max(SCALE, STDS * std):
        said.append(
            f"the blade's travel in the photographs is {100 * (scale - 1):+.2f} % (std {100 * std:.2f} %) "
            "off the log's: check mm_per_px and the displacement sensor"
        )
    rest = blade_x_mm - (scale if np.isfinite(scale) else 1.0) * displacement.u_mm
    if np.isfinite(rest).any():
        rest -= np.nanmedian(rest)
        usual = 1.4826 * float(np.nanmedian(np.abs(rest)))
        for frame in np.flatnonzero(np.abs(rest) > max(LONE_PX * mm_per_px, LONE_SPREADS * usual)):
            said.append(
                f"frame {frame}: the blade stands {rest[frame]:+.3g} mm from where the log has it, "
                "other frames agree: is its time right?"
            )
    return said


def outside_log(displacement: Displacement, time_s: Floats, log_time_s: Floats) -> list[str]:
    """A sentence where photographs with a time lie outside of the log, with the two spans of time.

    Parameters
    ----------
    displacement : Displacement
        Of the frames, from the log.
    time_s : (F,) float, s
        Times of the photographs by the camera's clock, NaN where unknown.
    log_time_s : (N,) float, s
        Times of the log.
    """
    on_log = time_s - displacement.clock_offset_s
    outside = int(np.isnan(displacement.u_mm[np.isfinite(on_log)]).sum())
    if not outside:
        return []
    photographs, log = (f"{np.nanmin(t):.6g} to {np.nanmax(t):.6g} s" for t in (on_log, log_time_s))
    return [
        f"{outside} of {len(time_s)} photographs lie outside the log: their u_mm is empty. On the log's "
        f"clock they run from {photographs}, the log from {log}: check clock_offset_s"
    ]


def heap_doubts(volume: pd.DataFrame) -> list[str]:
    """A sentence where the area of the heap ahead of the blade does not answer to what the blade swept.

    Parameters
    ----------
    volume : DataFrame of VOLUME_COLUMNS
        Of all frames; only those with a ratio are judged, by their median.
    """
    known = volume.dropna(subset=["ratio", "std_mm2"])
    if known.empty:
        return []
    ratio = float(known["ratio"].median())
    std = float((known["std_mm2"] / known["swept_mm2"]).median())
    if abs(ratio - 1) <= max(HEAP_SHARE, HEAP_STDS * std):
        return []
    return [
        f"the heap ahead of the blade holds {100 * ratio:.0f} % (std {100 * std:.1f} %) of the area that the "
        "blade has swept: sand loosens or escapes, or scale, tip or surface are wrong"
    ]
