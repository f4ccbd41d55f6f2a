"""Frames of a given size, and tests that end early."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from ploughval.scene import load_scene
from ploughval.synth import load_truth
from ploughval.synth.view import frame_view
from sequences.big import first_frames, framed


def test_photographs_have_the_size_asked_for(made):
    options = framed(made.truth.options, (333, 517))
    assert frame_view(made.truth.motion, options).shape == (333, 517)
    assert min(options.above_mm, options.below_mm, options.ahead_mm, options.behind_mm) > 0
    with pytest.raises(ValueError, match="more than"):
        framed(made.truth.options, (50, 517))


def test_a_test_that_ended_early_is_the_beginning_of_the_whole_one(made, tmp_path):
    first_frames(made.folder, tmp_path / "part", 5)
    truth, scene = load_truth(tmp_path / "part"), load_scene(tmp_path / "part")
    assert len(scene.matches(scene.camera.photos)) == len(truth.blade) == truth.options.frames == 5
    assert (tmp_path / "part/photos/0004.png").read_bytes() == (made.folder / "photos/0004.png").read_bytes()
    points = made.start_mm()
    np.testing.assert_array_equal(truth.positions(points), made.truth.positions(points)[:5])
    assert truth.bands["u_end_mm"].max() == truth.blade["u_mm"].max() == 8.0
    assert len(pd.read_csv(tmp_path / "part/photos.csv")) == 5
    assert replace(truth.options, frames=12, displacement_mm=22.0) == made.truth.options
