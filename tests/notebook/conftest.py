"""A small test, processed as users do it."""

from dataclasses import replace

import pytest

from ploughval import process
from ploughval.synth import EXAMPLE, make_folder


@pytest.fixture(scope="session")
def processed(tmp_path_factory):
    """Four coarse photographs, a log and layers."""
    folder = tmp_path_factory.mktemp("notebook") / "small"
    make_folder(folder, replace(EXAMPLE, frames=4, mm_per_px=0.8, displacement_mm=3.0, name="small", seed=3))
    return process(folder)
