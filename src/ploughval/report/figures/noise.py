"""Noise of the camera against grey level."""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from ploughval.report.figures.style import MEASURED, MUTED, new_figure, styled


@styled
def noise_figure(
    grey: ArrayLike, std: ArrayLike, std_std: ArrayLike, *, gain: float | None, floor: float | None
) -> Figure:
    """Standard deviation of the noise by grey level, and the line through its square.

    Parameters
    ----------
    grey, std, std_std : (K,) float, grey levels
        Classes, their noise and its standard uncertainty.
    gain, floor : float or None
        variance = gain grey + floor; None: no line is drawn.
    """
    levels, noise = np.asarray(grey, float), np.asarray(std, float)
    figure = new_figure(2.5)
    axes = figure.subplots()
    if gain is not None and floor is not None:
        fine = np.linspace(levels[0], levels[-1], 100)
        axes.plot(fine, np.sqrt(np.maximum(gain * fine + floor, 0.0)), color=MUTED, lw=1.2, ls="--")
    axes.errorbar(
        levels, noise, yerr=2 * np.asarray(std_std, float), fmt="o", ms=3.5, color=MEASURED, elinewidth=0.9
    )
    axes.set_ylim(0, 1.25 * float(noise.max()))
    axes.set_xlabel("grey level")
    axes.set_ylabel("noise, grey levels")
    return figure
