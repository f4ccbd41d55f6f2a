"""Compiled sums and a small inverse, for the kernels."""

import numpy as np

from ploughval.piv.compiled import Floats, Singles, compiled


@compiled
def total(values: Singles, n: int) -> float:
    """Sum of the first n elements."""
    whole = np.float32(0.0)
    for i in range(n):
        whole += values[i]
    return float(whole)


@compiled
def dot(a: Singles, b: Singles, n: int) -> float:
    """Product of the first n elements."""
    whole = np.float32(0.0)
    for i in range(n):
        whole += a[i] * b[i]
    return float(whole)


@compiled
def invert(a: Floats, inverse: Floats) -> bool:
    """Inverse of a symmetric positive definite matrix by Gauss-Jordan; False where it is singular."""
    n = a.shape[0]
    scale = 0.0
    for i in range(n):
        scale = max(scale, a[i, i])
        for j in range(n):
            inverse[i, j] = 1.0 if i == j else 0.0
    for i in range(n):
        pivot = a[i, i]
        if not pivot > 1e-10 * scale:
            return False
        for j in range(n):
            a[i, j] /= pivot
            inverse[i, j] /= pivot
        for k in range(n):
            if k != i:
                factor = a[k, i]
                for j in range(n):
                    a[k, j] -= factor * a[i, j]
                    inverse[k, j] -= factor * inverse[i, j]
    return True
