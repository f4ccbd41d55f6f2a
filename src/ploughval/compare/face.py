"""Where the blade's face meets the free surface."""

import math

import numpy as np
from numpy.typing import NDArray

from ploughval.scene import Scene


def lean_of(scene: Scene) -> float:
    """Tangent of the face's inclination to the vertical; positive: its top leans ahead, over the sand."""
    return math.tan(math.radians(scene.blade.inclination_deg))


def face_at_surface(line_mm: NDArray[np.float64], u_mm: float, lean: float) -> float:
    """Where (x) a face from the tip meets the surface, which goes on level before its first point.

    Parameters
    ----------
    line_mm : (M, 2) float
        The surface in order of x, all finite, one point at least.
    u_mm : float
        Travel of the tip.
    lean : float
        Of the face: see :func:`lean_of`.

    Returns
    -------
    float, mm
    """
    x, y = line_mm.T
    ahead = x - u_mm - lean * y
    k = int(np.argmax(ahead > 0))
    if k == 0 or lean == 0.0:
        return u_mm + lean * float(y[0])
    share = ahead[k - 1] / (ahead[k - 1] - ahead[k])
    return u_mm + lean * float(y[k - 1] + share * (y[k] - y[k - 1]))
