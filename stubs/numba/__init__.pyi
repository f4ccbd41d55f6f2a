# What mypy is told of numba, which states no types: a kernel answers as the plain function does. Its
# arguments are not checked: it is compiled for any, NumPy's scalars where the function says int or float.
from collections.abc import Callable
from typing import Any, TypeVar

_Answer = TypeVar("_Answer")

def njit(**options: Any) -> Callable[[Callable[..., _Answer]], Callable[..., _Answer]]: ...
