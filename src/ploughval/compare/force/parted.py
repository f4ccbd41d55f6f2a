"""What all rows of a force share, parted into an offset and a gain that do not know each other."""

import numpy as np

from ploughval.compare.force.curve import Curve


def parted(force: Curve) -> tuple[float, float]:
    """Shared standard uncertainty of a force as s^2 = offset^2 + (gain F)^2.

    An offset (friction, zeros) is the same at any force, a gain (calibration) grows with it: the variance
    against the square of the force is a straight line, neither part of which is negative.

    Parameters
    ----------
    force : Curve
        With its shared part; rows of NaN are passed over.

    Returns
    -------
    offset_N, gain : float
        In N, and relative; 0 where nothing is shared.
    """
    from scipy.optimize import nnls  # slow to import, not needed before a force is parted

    known = np.isfinite(force.shared_std_N) & np.isfinite(force.force_N)
    F, s = force.force_N[known], force.shared_std_N[known]
    if not np.any(s > 0) or not np.any(F):
        return (float(s.mean()) if s.size else 0.0), 0.0
    columns = np.column_stack([np.ones(F.size), F**2])
    size = columns.mean(axis=0)
    offset, gain = nnls(columns / size, s**2)[0] / size
    return float(np.sqrt(offset)), float(np.sqrt(gain))
