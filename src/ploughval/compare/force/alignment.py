"""Two force histories at the same stage between switches: what differs in phase, and what in height."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def aligned_u(u_mm: Floats, to_mm: Floats, from_mm: Floats) -> Floats:
    """Travel of one curve at the same stage between its landmarks as another curve at ``u_mm``.

    Piecewise linear from the common start through the landmarks, shifted beyond the last (landmark
    registration: Ramsay & Silverman 2005, section 7.3).

    Parameters
    ----------
    u_mm : (N,) float
        Travel of the curve that stays.
    to_mm : (L,) float
        Its landmarks, rising.
    from_mm : (L,) float
        The same landmarks of the curve that is moved.

    Returns
    -------
    (N,) float, mm
    """
    to_mm, from_mm = np.append(0.0, to_mm), np.append(0.0, from_mm)
    keep = np.append(True, np.diff(to_mm) > 0)
    mapped = np.interp(u_mm, to_mm[keep], from_mm[keep])
    return np.asarray(np.where(u_mm > to_mm[-1], u_mm - to_mm[-1] + from_mm[-1], mapped))


def log_stretch(to_mm: Floats, from_mm: Floats) -> Floats:
    """Logarithm of how far each stretch between landmarks is drawn out, (L,); positive: ``from`` is longer.

    >>> log_stretch(np.array([10.0, 30.0]), np.array([20.0, 40.0])).round(3).tolist()
    [0.693, 0.0]
    """
    return np.asarray(np.log(np.diff(from_mm, prepend=0.0) / np.diff(to_mm, prepend=0.0)))
