"""How the kernels of this room are compiled, and the arrays they take."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]

KERNEL: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc", "nsz", "arcp"},
    "_nrt": False,
}
"""Options of every kernel. ``_nrt``: views of arrays are not counted; counting them is atomic and took half
the time. Nothing may be allocated inside."""
_PART: dict[str, Any] = KERNEL | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
compiled = njit(**_PART, forceinline=True)
"""Parts of a kernel, put into each kernel whole: without wrappers for Python, and kept in the kernel's own
cache, they compile faster. A part that stays a function would be shared by all kernels of a process, which
call the copy that was compiled or loaded first: numbers would depend on whether the cache was there."""
inlined = njit(**(_PART | {"inline": "always"}))
"""Parts that are compiled anew where they are called, so that a constant length vectorises them."""
