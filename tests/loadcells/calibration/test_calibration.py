"""Calibration files to a response: what comes out of good ones, and what is said of wrong ones."""

import os
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ploughval.errors import CalibrationError, ConfigError, DataError, PloughvalError
from ploughval.loadcells.calibration.cells import RESULT_COLUMNS, calibrate_cells
from ploughval.run.provenance import input_digests
from ploughval.scene import load_scene

LOADS = (0, 10, 20, 30, 40, 50, 40, 30, 20, 10, 0)
ARMS = (0, 50, 100, 150)
HEAD = """
[test]
name = "a"
[blade]
depth_mm = 30.0
width_mm = 218.0
thickness_mm = 5.0
speed_mm_s = 1.0
[loadcells]
log = "loadcells.csv"
spacing_mm = 150.0
lower_to_tip_mm = 260.0
[loadcells.calibration]
"""


def table(arm, rng, *, loads=LOADS, noise_Nm=0.005, coefficients=((0.02, 0.0), (0.0, 0.025))):
    load = np.array(loads, float)
    moments = np.stack([load * (410 - arm), load * (260 - arm)]) / 1000
    readings = np.linalg.solve(coefficients, moments + noise_Nm * rng.normal(size=moments.shape))
    upper, lower = readings[0].round(2) + 100.0, readings[1].round(2) - 50.0
    return pd.DataFrame({"load_N": load, "arm_mm": float(arm), "upper": upper, "lower": lower})


def tables(*, arms=ARMS, seed=1, **options):
    rng = np.random.default_rng(seed)
    return [table(arm, rng, **options) for arm in arms]


def calibrated(folder, made, *, lines='files = ["calibration/*.csv"]'):
    (folder / "calibration").mkdir()
    for k, each in enumerate(made):
        each.to_csv(folder / f"calibration/cells-{k + 1}.csv", index=False)
    (folder / "loadcells.csv").write_text("time_s\n0\n")
    (folder / "test.toml").write_text(HEAD + lines)
    return calibrate_cells(load_scene(folder))


def said(result, *parts):
    return any(all(part in fault for part in parts) for fault in result.faults)


def test_good_files_give_the_constants_and_every_table(tmp_path):
    result = calibrated(tmp_path, tables())
    response = result.response
    std = np.sqrt([response.cov[k, k, k, k] for k in (0, 1)])
    assert (np.abs(response.coefficients[[0, 1], [0, 1]] - [0.02, 0.025]) < 4 * std).all()
    assert (std / [0.02, 0.025] < 0.001).all()
    assert tuple(result.points) == RESULT_COLUMNS
    assert len(result.points) == 44
    assert result.points["used"].all()
    assert result.points["line"].iloc[[0, 10, 11]].tolist() == [2, 12, 2]
    assert result.points["direction"].iloc[:11].tolist() == ["up"] * 6 + ["down"] * 5
    assert result.choice["model"].tolist()[0] == "straight"
    # 44 rows scatter by 0.005 N m; the standard deviation of that is known to 11 %.
    np.testing.assert_allclose(result.scatter_Nm, 0.005, rtol=0.35)


def test_the_force_does_not_follow_a_wrong_spacing_for_loads_at_known_arms(tmp_path):
    """With cross-talk in the model the spacing cancels between calibration and force."""
    result = calibrated(tmp_path, tables(noise_Nm=0.0, coefficients=((0.02, 0.0005), (0.0002, 0.025))))
    readings = np.linalg.solve(((0.02, 0.0005), (0.0002, 0.025)), [[40 * 0.39], [40 * 0.24]])
    response = result.response
    features = response.features(readings)[:, 0]
    change = 1.0  # mm of spacing
    upper, lower = (response.coefficients + change * response.by_spacing) @ features
    # Readings are written to 0.01 of up to 1025, so forces to about 1e-4.
    assert (upper - lower) * 1000 / (150 + change) == pytest.approx(40.0, abs=0.005)


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        ({"load_N": 40.0}, "not 40 N (one weight of 10 N less)"),
        ({"load_N": 50.0}, "(2 weights of 10 N less)"),
        ({"arm_mm": 100.0}, "(50 mm is an arm that was used)"),
        ({"load_N": -30.0}, "the sign of the load or of both readings is turned"),
        ({"upper": 740.0}, "the upper reading alone is off: 6"),
        ({"lower": 20.3}, "the lower reading alone is off: 20"),
        ({}, "the readings of the two cells are exchanged"),
        ({"upper": 900.0, "lower": 12.0}, "no single wrong load, arm or reading explains it"),
    ],
)
def test_one_wrong_point_is_named_with_its_cause_and_left_out(tmp_path, change, cause):
    made = tables()
    good = calibrated_in(tmp_path / "good", made)
    for name, value in change.items():
        made[1].loc[3, name] = value
    if not change:
        made[1].loc[3, ["upper", "lower"]] = made[1].loc[3, ["lower", "upper"]].to_numpy()
    result = calibrated_in(tmp_path / "wrong", made)
    point = result.points[~result.points["used"]]
    assert point[["file", "row", "line"]].to_numpy().tolist() == [["calibration/cells-2.csv", 3, 5]]
    assert said(result, "calibration/cells-2.csv, row 3 (line 5)", "Left out")
    assert said(result, cause), result.faults
    moved = np.abs(result.response.coefficients - good.response.coefficients)[[0, 1], [0, 1]]
    assert (moved < 2e-4 * np.array([0.02, 0.025])).all()


def calibrated_in(folder, made):
    folder.mkdir()
    return calibrated(folder, made)


def test_a_load_that_still_hangs_at_zero_is_said(tmp_path):
    made = tables()
    made[2].loc[10, ["upper", "lower"]] += [5 * 0.31 / 0.02, 5 * 0.16 / 0.025]
    assert said(
        calibrated(tmp_path, made), "cells-3.csv, row 10", "a load of about 5", "still hung on the blade"
    )


def test_two_wrong_points_are_refused_and_both_named(tmp_path):
    made = tables()
    made[1].loc[3, "load_N"] = 40.0
    made[2].loc[5, "arm_mm"] = 0.0
    with pytest.raises(CalibrationError, match="2 calibration points contradict the others") as caught:
        calibrated(tmp_path, made)
    assert "cells-2.csv, row 3 (line 5)" in str(caught.value)
    assert "cells-3.csv, row 5 (line 7)" in str(caught.value)
    assert "one weight of 10 N less" in str(caught.value)


def test_a_run_with_turned_sign_is_named(tmp_path):
    made = tables()
    made[1]["upper"] *= -1
    with pytest.raises(CalibrationError, match=r"cells-2.csv, run 1.*the sign of the upper cell is turned"):
        calibrated(tmp_path, made)


def test_a_run_in_kilograms_is_named(tmp_path):
    made = tables()
    made[3]["load_N"] /= 9.80665
    with pytest.raises(CalibrationError, match=r"cells-4.csv, run 1.*kilograms and newtons are mixed"):
        calibrated(tmp_path, made)


def test_a_run_with_exchanged_cells_is_named(tmp_path):
    made = tables()
    made[2][["upper", "lower"]] = made[2][["lower", "upper"]].to_numpy()
    with pytest.raises(CalibrationError, match=r"cells-3.csv, run 1.*upper and lower cell are exchanged"):
        calibrated(tmp_path, made)


def test_cells_exchanged_throughout_are_refused(tmp_path):
    made = tables()
    for each in made:
        each[["upper", "lower"]] = each[["lower", "upper"]].to_numpy()
    with pytest.raises(CalibrationError, match="readings of the two cells are exchanged in the calibration"):
        calibrated(tmp_path, made)


def test_a_cell_wired_the_other_way_round_throughout_is_said_and_used(tmp_path):
    made = tables()
    for each in made:
        each["upper"] *= -1
    result = calibrated(tmp_path, made)
    assert result.response.coefficients[0, 0] == pytest.approx(-0.02, rel=1e-3)
    assert said(result, "readings of the upper cell fall as the moment rises")


def test_one_arm_cannot_tell_cross_talk_and_says_so(tmp_path):
    result = calibrated(tmp_path, tables(arms=(0,)))
    assert result.condition == np.inf
    assert said(result, "the arms of the loads are all the same")
    assert result.choice.set_index("model").loc["cross-talk", "why_not"]


def test_what_a_session_leaves_open_is_said(tmp_path):
    close = calibrated_in(tmp_path / "close", tables(arms=(0, 10)))
    assert said(close, "the arms of the loads differ by little")
    loaded = [t[t["load_N"] > 0] for t in tables()]
    assert said(calibrated_in(tmp_path / "loaded", loaded), "no unloaded row")
    moved = tables(arms=(0, 0, 0, 0))
    for k, each in enumerate(moved):
        each["upper"] = 100 + (each["upper"] - 100) * (1 + 0.01 * k)
    assert said(calibrated_in(tmp_path / "moved", moved), "the runs' sensitivities differ by 1.3 %")
    noisy = tables(arms=(0,), noise_Nm=0.6)
    result = calibrated_in(tmp_path / "noisy", noisy)
    assert said(result, "of full scale about the fit")


def test_uncertain_weights_widen_the_constants(tmp_path):
    exact, loose = tables(arms=(0,)), tables(arms=(0,))
    for each in loose:
        each["load_std_N"] = 0.002 * each["load_N"]
    a, b = calibrated_in(tmp_path / "a", exact), calibrated_in(tmp_path / "b", loose)
    std = [np.sqrt(r.response.cov[0, 0, 0, 0]) / 0.02 for r in (a, b)]
    # Five weights, each off by its own 0.2 %: of the slope through them 0.2 % / sqrt(5) to 0.2 %.
    assert std[0] < 0.0005
    assert 0.0009 < std[1] < 0.002
    assert said(a, "no load_std_N")
    assert not said(b, "no load_std_N")


def test_masses_and_moments_are_the_same_calibration(tmp_path):
    made = tables()
    masses = [t.assign(mass_kg=t["load_N"] / 9.81).drop(columns="load_N") for t in made]
    moments = [
        t.assign(
            moment_upper_Nm=t["load_N"] * (410 - t["arm_mm"]) / 1000,
            moment_lower_Nm=t["load_N"] * (260 - t["arm_mm"]) / 1000,
        ).drop(columns=["load_N", "arm_mm"])
        for t in made
    ]
    for name in "abc":
        (tmp_path / name).mkdir()
    files = 'files = ["calibration/*.csv"]'
    a = calibrated(tmp_path / "a", made)
    b = calibrated(tmp_path / "b", masses, lines=f"{files}\ng_m_s2 = 9.81")
    c = calibrated(tmp_path / "c", moments)
    np.testing.assert_allclose(b.response.coefficients, a.response.coefficients, rtol=1e-9)
    np.testing.assert_allclose(c.response.coefficients, a.response.coefficients, rtol=1e-9)
    assert said(b, "masses became loads with g = 9.81 m/s^2")
    assert not said(a, "masses")
    assert a.response.by_spacing.any()
    assert not c.response.by_spacing.any()


def test_a_row_without_reading_is_not_used_and_said(tmp_path):
    made = tables()
    made[0].loc[4, "lower"] = np.nan
    result = calibrated(tmp_path, made)
    row = result.points.iloc[4]
    assert not row["used"]
    assert row["reason"] == "load, arm or reading missing"
    assert np.isnan(row["residual_upper_Nm"])
    assert said(result, "calibration/cells-1.csv line 6")


def test_a_staircase_log_is_a_calibration(tmp_path):
    rng = np.random.default_rng(2)
    loads = [0.0, 10.0, 20.0, 10.0, 0.0]
    for arm in (0, 150):
        level = np.repeat(loads, 60)
        upper = level * (410 - arm) / 1000 / 0.02 + 100 + 0.3 * rng.normal(size=level.size)
        lower = level * (260 - arm) / 1000 / 0.025 - 50 + 0.3 * rng.normal(size=level.size)
        log = {"time_s": np.arange(level.size) / 10, "moment_upper_Nm": upper, "moment_lower_Nm": lower}
        pd.DataFrame(log).to_csv(tmp_path / f"stairs-{arm}.csv", index=False, sep=";", decimal=",")
    lines = "".join(
        "[[loadcells.calibration.staircases]]\n"
        f'log = "stairs-{arm}.csv"\nloads_N = {loads}\narm_mm = {arm}.0\n'
        for arm in (0, 150)
    )
    result = calibrated(tmp_path, [], lines=lines)
    assert {"stairs-0.csv", "stairs-150.csv"} <= set(input_digests(load_scene(tmp_path)))
    # Medians of some 30 rows of noise 0.3: 0.07 counts of up to 410: constants to 0.02 %, four times that.
    gains = result.response.coefficients[[0, 1], [0, 1]]
    np.testing.assert_allclose(gains, [0.02, 0.025], rtol=8e-4)
    assert result.points["run"].tolist() == ["1"] * 10
    assert result.points["file"].tolist() == ["stairs-0.csv"] * 5 + ["stairs-150.csv"] * 5


def test_two_real_cells_in_series_return_as_published(tmp_path):
    root = os.environ.get("PLOUGHVAL_SHARED")
    shared = Path(root) if root else Path(__file__).resolve().parents[4] / "shared"
    log = shared / "realdata/loadcells_series_hx711/LoadCellCalibrationData.txt"
    if not log.is_file():
        pytest.skip("the real log is not here")
    shutil.copy(log, tmp_path / "series.csv")
    loads = [0.0, 44.48, 88.96, 133.45, 177.93, 133.45, 88.96, 44.48, 0.0]
    lines = (
        f'[[loadcells.calibration.staircases]]\nlog = "series.csv"\nloads_N = {loads}\narm_mm = 0.0\n'
        '[loadcells.columns]\nmoment_upper_Nm = "11"\nmoment_lower_Nm = "12"\n'
    )
    result = calibrated(tmp_path, [], lines=lines)
    assert result.points["direction"].tolist() == ["up"] * 5 + ["down"] * 4
    assert result.points["used"].all()
    quality = result.quality.set_index(["quantity", "cell"])["percent_of_full_scale"]
    # Published: the way back repeats the way up to 0.3 per cent of full load.
    assert (quality["hysteresis"] < 0.3).all()
    # 4.448 N per 1000 counts of either cell, at levers of 0.41 and 0.26 m.
    gains = result.response.coefficients[[0, 1], [0, 1]] / [0.41, 0.26]
    np.testing.assert_allclose(gains, 4.448e-3, rtol=0.008)


def test_given_constants_are_the_response_and_tables_are_empty(tmp_path):
    result = calibrated(tmp_path, [], lines="upper_Nm_per_unit = 2.0\nlower_Nm_per_unit = 3.0\n")
    np.testing.assert_array_equal(result.response.coefficients, np.diag([2.0, 3.0]))
    assert result.points.empty
    assert result.choice.empty
    assert result.quality.empty


def test_settings_that_contradict_each_other_or_name_no_file_are_refused(tmp_path):
    for k, (lines, message) in enumerate(
        [
            ('files = ["calibration/*.csv"]\nupper_Nm_per_unit = 2.0', "either constants or files"),
            ('files = ["nothing/*.csv"]', "loadcells.calibration.files.0"),
            ("upper_Nm_per_unit = 0.0", "a number other than 0"),
        ]
    ):
        (tmp_path / str(k)).mkdir()
        with pytest.raises(ConfigError, match=message):
            calibrated(tmp_path / str(k), tables(arms=(0,)), lines=lines)


def test_text_for_a_number_is_named_with_file_and_line(tmp_path):
    made = tables(arms=(0,))
    made[0] = made[0].astype(object)
    made[0].loc[3, "load_N"] = "thirty"
    with pytest.raises(DataError, match=r"cells-1.csv.*line 5: load_N is 'thirty'; expected a number"):
        calibrated(tmp_path, made)


def test_spoiled_tables_are_read_or_refused_but_never_break_anything(tmp_path):
    rng = np.random.default_rng(20)
    tokens = ["1e300", "-1e15", "inf", "nan", "", "abc", ";", ",", "\n", '"', "\0", "é", "9" * 40, "down"]
    written = [t.to_csv(index=False) for t in tables(arms=(0, 100))]
    (tmp_path / "calibration").mkdir()
    (tmp_path / "loadcells.csv").write_text("time_s\n0\n")
    (tmp_path / "test.toml").write_text(HEAD + 'files = ["calibration/*.csv"]')
    outcomes = set()
    for _ in range(150):
        for k, text in enumerate(written):
            place = int(rng.integers(40, len(text)))
            spoiled = (
                text[:place] + tokens[rng.integers(len(tokens))] + text[place + int(rng.integers(0, 4)) :]
            )
            (tmp_path / f"calibration/cells-{k}.csv").write_text(spoiled)
        try:
            response = calibrate_cells(load_scene(tmp_path)).response
        except PloughvalError as error:
            outcomes.add(type(error).__name__)
        else:
            outcomes.add("read")
            assert np.isfinite(response.coefficients).all()
            assert np.isfinite(response.cov).all()
    assert outcomes >= {"read", "DataError"}
    assert outcomes <= {"read", "DataError", "CalibrationError"}
