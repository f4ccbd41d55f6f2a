"""What a user may write, for mypy --strict against the installed wheel: every result has its own type."""

from pathlib import Path
from typing import assert_type

import numpy as np

from ploughval import load_results, load_scene, process, simulate
from ploughval.errors import PloughvalError
from ploughval.notebook import Plots, Result, Simulation
from ploughval.piv import Tracks, correlate
from ploughval.scene import Scene


def processed(folder: Path) -> Result | None:
    """Process a test folder, or read what is there of it."""
    try:
        result = process(folder, workers=2, fresh=True)
    except PloughvalError as refused:
        print(refused)
        return None
    assert_type(result, Result)
    assert_type(result.plot, Plots)
    assert_type(load_results(folder), Result)
    return result


def first_force_N(folder: Path) -> float:
    """The model's first force for the settings of a test folder."""
    scene = load_scene(folder)
    assert_type(scene, Scene)
    assert_type(scene.blade.depth_mm, float)
    history = simulate(scene, displacement_mm=30.0)
    assert_type(history, Simulation)
    assert_type(history.P0_N, float)
    return history.P0_N


def moved_px(first: np.ndarray, second: np.ndarray) -> float:
    """The mean displacement of one point between two pictures."""
    tracks = correlate(first, second, np.array([[50.0, 50.0]]), subset=31)
    assert_type(tracks, Tracks)
    return float(np.hypot(*tracks.displacement[0]))
