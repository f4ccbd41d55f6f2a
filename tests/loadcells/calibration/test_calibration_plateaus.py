"""Levels of staircases: made ones with their exact levels, and two real calibration sessions."""

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import DataError
from ploughval.loadcells.calibration.fitted import fit_response
from ploughval.loadcells.calibration.plateaus import find_plateaus

POUND_N = 4.4482216
LOADS = np.array([0, 10, 20, 30, 40, 30, 20, 10, 0]) * POUND_N


def shared(name):
    root = os.environ.get("PLOUGHVAL_SHARED")
    folder = (Path(root) if root else Path(__file__).resolve().parents[4] / "shared") / "realdata" / name
    if not folder.is_dir():
        pytest.skip("the real log is not here")
    return folder


def staircase(rng, loads, *, gain=(50.0, -40.0), noise=5.0, rows=60):
    """Levels of so many rows with ramps of 10 rows and a swing after each, as hands leave it."""
    level = np.repeat(np.asarray(loads, float), rows + 10)
    t = np.arange(level.size) % (rows + 10)
    before = np.concatenate([np.full(rows + 10, loads[0]), np.repeat(loads[:-1], rows + 10)])
    level = np.where(t < 10, before + (level - before) * t / 10, level)
    level = level + np.where(t >= 10, 3.0 * np.exp(-(t - 10) / 4) * np.sin(t), 0.0)
    return np.outer(gain, level) + [[1000.0], [200.0]] + noise * rng.normal(size=(2, level.size))


def test_levels_of_a_made_staircase_are_found_within_the_noise_of_their_median():
    rng = np.random.default_rng(1)
    loads = np.array([0, 10, 20, 40, 20, 0], float)
    found = find_plateaus(staircase(rng, loads), loads)
    np.testing.assert_array_equal(found["load_N"], loads)
    # The median of at least 25 rows of noise 5 scatters by 1.3: four times that.
    np.testing.assert_allclose(found["upper"], 1000 + 50 * loads, atol=5)
    np.testing.assert_allclose(found["lower"], 200 - 40 * loads, atol=5)


def test_dropouts_and_missing_rows_leave_no_trace():
    rng = np.random.default_rng(2)
    loads = np.array([0, 10, 20, 10, 0], float)
    clean = staircase(rng, loads)
    spoiled = clean.copy()
    spoiled[0, [33, 120, 121, 260]] = -8e6
    spoiled[1, [50, 190]] = np.nan
    a, b = find_plateaus(clean, loads), find_plateaus(spoiled, loads)
    np.testing.assert_allclose(b[["upper", "lower"]], a[["upper", "lower"]], atol=3)


def test_a_load_named_twice_in_a_row_is_one_level():
    loads = [0.0, 10.0, 10.0, 20.0, 0.0]
    assert len(find_plateaus(staircase(np.random.default_rng(3), loads), np.array(loads))) == 4


def test_loads_that_the_log_does_not_follow_are_refused_with_those_that_it_does():
    made = staircase(np.random.default_rng(4), [0.0, 10.0, 20.0, 30.0, 0.0])
    with pytest.raises(
        DataError, match=r"levels found are those of the loads 0, 10, 20, 30, 0 N; expected 0, 10"
    ):
        find_plateaus(made, np.array([0.0, 10.0, 30.0, 20.0, 0.0]))


def test_constant_readings_and_too_few_rows_are_refused():
    with pytest.raises(DataError, match="readings of both cells are constant"):
        find_plateaus(np.zeros((2, 100)), np.array([0.0, 10.0]))
    with pytest.raises(DataError, match="20 rows for 2 loads"):
        find_plateaus(np.zeros((2, 20)), np.array([0.0, 10.0]))


def series():
    table = pd.read_csv(shared("loadcells_series_hx711") / "LoadCellCalibrationData.txt", header=None)
    return table[0].to_numpy(float) / 1000, table[[10, 11]].to_numpy(float).T


def test_plateaus_of_two_real_cells_in_series_are_the_published_ones():
    time, readings = series()
    found = find_plateaus(readings, LOADS)
    # Published as median-filtered means; noise of 80 counts, medians of some 40 rows: four times 15 counts.
    upper = [-3, 9970, 19986, 29918, 39891, 29917, 19958, 9994, 28]
    lower = [-2, 10031, 20050, 30114, 40165, 30154, 20105, 10048, 15]
    np.testing.assert_allclose(found["upper"], np.add(5794, upper), atol=60)
    np.testing.assert_allclose(found["lower"], np.add(12458, lower), atol=60)
    start = [0, 17.2, 34.6, 51.1, 65.9, 77.1, 90.8, 103.3, 113.5]
    assert (time[found["first_row"]] - time[0] > np.subtract(start, 1)).all()
    assert (time[found["last_row"]] - time[0] < [*start[1:], 132.4]).all()


def test_two_real_cells_in_series_have_the_constant_of_their_makers():
    _, readings = series()
    found = find_plateaus(readings, LOADS)
    loads = found["load_N"].to_numpy()
    fitted = fit_response(found[["upper", "lower"]].to_numpy().T, np.stack([loads, loads]))
    fit = fitted.choice.fit
    assert fit.left_out == ()
    # 1000 counts a pound is a round figure: the cells agree with it, and with each other, within 0.8 %.
    np.testing.assert_allclose(fit.coefficients[[0, 1], [0, 1]], POUND_N / 1000, rtol=0.008)
    # The way back repeats the way up within 0.3 per cent of full load, so points lie near the line.
    assert np.abs(fit.residuals).max() < 0.003 * LOADS.max()


def gym():
    folder = shared("loadcell_gym_hx711")
    return pd.read_csv(folder / "finalRecording.csv"), pd.read_csv(folder / "finalCalibration.csv")


def test_ten_levels_of_an_irregular_real_log_are_those_their_author_read():
    recording, levels = gym()
    loads = np.concatenate([levels["real"].iloc[[1]], levels["real"]])  # it begins with a weight on
    reading = recording["raw reading"].to_numpy()
    found = find_plateaus(np.stack([reading, reading]), loads)
    # The cell creeps by thousands of counts at each level: 2000 are 0.2 per cent of full load.
    np.testing.assert_allclose(found["upper"].iloc[1:], levels["measured"], atol=2000)


def test_the_constant_of_a_real_calibration_is_the_published_one():
    _, levels = gym()
    reading, load = levels["measured"].to_numpy(), levels["real"].to_numpy()
    fit = fit_response(np.stack([reading, reading]), np.stack([load, load])).choice.fit
    assert fit.model.name == "straight"
    assert fit.left_out == ()
    assert fit.coefficients[0, 0] == pytest.approx(0.0035872, abs=5e-8)
    assert fit.zeros[0, 0] == pytest.approx(1_035_687, abs=0.5)
    assert np.abs(fit.residuals).max() == pytest.approx(23.2, abs=0.05)
