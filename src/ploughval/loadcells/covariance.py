"""Covariances that stay covariances after a part was taken off."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def positive(cov: Floats) -> Floats:
    """The covariance (2, 2) with negative variances along its axes set to zero.

    >>> positive(np.array([[4.0, 0.0], [0.0, -1.0]])).tolist()
    [[4.0, 0.0], [0.0, 0.0]]
    """
    values, vectors = np.linalg.eigh(cov)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)
