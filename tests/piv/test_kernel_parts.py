"""Compiled kernels are kept by the file of their outermost function; it must change with its parts."""

import hashlib
from pathlib import Path

import pytest

from ploughval.piv import band_kernel, band_line, kernel

FOLDER = Path(kernel.__file__).parent
SAMPLING = ("compiled", "algebra", "sampling")


def digest(names):
    """First digits of a hash over the text of some files of the room."""
    text = "".join((FOLDER / f"{name}.py").read_text(encoding="utf-8") for name in names)
    return hashlib.sha1(text.encode(), usedforsecurity=False).hexdigest()[:12]


@pytest.mark.parametrize(
    ("module", "parts"),
    [
        (kernel, SAMPLING),
        (band_line, (*SAMPLING, "kernel")),
        (band_kernel, (*SAMPLING, "kernel", "band_shape")),
    ],
)
def test_kernel_knows_the_parts_it_was_compiled_from(module, parts):
    assert digest(parts) == module.PARTS, (
        f"set PARTS of {module.__name__} to this digest, in this order of files"
    )
