"""data/example is what its recipe makes."""

from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from ploughval.model import simulate
from ploughval.scene import load_scene
from ploughval.synth import EXAMPLE, load_truth
from ploughval.synth.camera import photographs
from ploughval.synth.logs import LogTruth, empty_truth, log_table
from ploughval.synth.options import Purpose
from ploughval.synth.settings import settings_text
from ploughval.synth.view import frame_view

FOLDER = Path(__file__).parents[2] / "data" / "example"

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="data/example is not in this copy")


def test_the_example_holds_its_recipe_and_is_accepted():
    truth, scene = load_truth(FOLDER), load_scene(FOLDER)
    assert truth.options == EXAMPLE
    assert scene.camera.tip_px == truth.tip_px
    assert (FOLDER / "test.toml").read_text(encoding="utf-8") == settings_text(EXAMPLE, truth.tip_px)
    size = sum(p.stat().st_size for p in FOLDER.rglob("*") if p.is_file())
    assert size < 3.8e6


def test_the_report_of_a_made_test_can_say_that_its_sand_is_the_model():
    notes = load_scene(FOLDER).test.notes
    assert "from seed 30" in notes
    assert "not that the model describes real sand" in notes


def test_the_photographs_are_made_again_from_the_recorded_motion():
    truth = load_truth(FOLDER)
    view = frame_view(truth.motion, EXAMPLE)
    for frame, levels in enumerate(photographs(view, truth.motion, EXAMPLE)):
        stored = cv2.imread(str(FOLDER / f"photos/{frame:04d}.png"), cv2.IMREAD_UNCHANGED)
        assert stored.dtype == np.uint8
        other = stored != levels
        # the same pixels; another mathematical library may round one in a thousand the other way
        assert other.mean() < 1e-3
        assert np.abs(stored.astype(int) - levels)[other].max(initial=0) <= 1


def test_the_logs_are_made_again_from_the_recorded_force():
    table = load_truth(FOLDER).force
    felt = LogTruth(*(table[name].to_numpy() for name in ("time_s", "u_mm", "force_N", "arm_mm")))
    logs = {"loadcells.csv": log_table(felt, EXAMPLE.rng(Purpose.LOG), EXAMPLE)}
    for run in (1, 2, 3):
        logs[f"empty/run{run}.csv"] = log_table(empty_truth(felt), EXAMPLE.rng(Purpose.LOG, run), EXAMPLE)
    for name, log in logs.items():
        # force and line of action are recorded to 1e-5 N and 1e-4 mm, moments to 1e-5 N m
        np.testing.assert_allclose(log, pd.read_csv(FOLDER / name), rtol=0, atol=1.5e-5)


def test_the_recorded_bands_are_the_models():
    bands, truth = simulate(EXAMPLE.true_scene).bands, load_truth(FOLDER).bands
    assert len(bands) == len(truth) == 3
    # the tolerance of the model, 1e-3 of a travel of 55 mm
    np.testing.assert_allclose(bands["u_start_mm"], truth["u_start_mm"], atol=0.055)
    np.testing.assert_allclose(bands["outcrop_x_mm"], truth["outcrop_x_mm"], atol=0.1)
    np.testing.assert_allclose(bands["beta_deg"], truth["beta_deg"], atol=0.05)


def test_sand_moves_a_few_pixels_between_photographs():
    truth = load_truth(FOLDER)
    points = np.stack(np.meshgrid(np.arange(5.0, 150.0, 5.0), np.arange(3.0, 28.0, 3.0)), axis=-1)
    steps = np.diff(truth.positions(points.reshape(-1, 2)), axis=0) / EXAMPLE.mm_per_px
    travelled = np.hypot(*np.moveaxis(steps, -1, 0))
    assert 6.0 < np.nanmax(travelled) < 10.0
