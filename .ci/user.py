"""What a user may write, for mypy --strict against the installed wheel: every result has its own type."""

from pathlib import Path
from typing import assert_type

import numpy as np

from ploughval import load_scene, process, simulate
from ploughval.errors import PloughvalError
from ploughval.model import History
from ploughval.piv import Tracks, correlate
from ploughval.run import Outcome
from ploughval.scene import Scene


def processed(folder: Path) -> Path | str | None:
    """Process a test folder; where its page is."""
    try:
        outcome = process(folder, workers=2, fresh=True)
    except PloughvalError as refused:
        print(refused)
        return None
    assert_type(outcome, Outcome)
    return outcome.results


def first_force_N(folder: Path) -> float:
    """The model's first force for the settings of a test folder."""
    scene = load_scene(folder)
    assert_type(scene, Scene)
    assert_type(scene.blade.depth_mm, float)
    history = simulate(scene, displacement_mm=30.0)
    assert_type(history, History)
    assert_type(history.P0_N, float)
    return history.P0_N


def moved_px(first: np.ndarray, second: np.ndarray) -> float:
    """The mean displacement of one point between two pictures."""
    tracks = correlate(first, second, np.array([[50.0, 50.0]]), subset=31)
    assert_type(tracks, Tracks)
    return float(np.hypot(*tracks.displacement[0]))
