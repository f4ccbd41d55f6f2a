"""Peaks of saw-teeth whose every corner is known."""

import numpy as np
import pandas as pd
import pytest

from ploughval.compare.force.curve import Curve, measured_curve, model_curve
from ploughval.compare.force.peaks import find_extremes, least_prominence
from ploughval.compare.force.reading import read_force
from ploughval.compare.force.scalars import force_quantities

# P0 = 10 at the start, down to 5 at 1 mm, up to 18 at 38, down to 8 at 39, up to 26 at 95, and so on.
CORNERS_U = np.array([0.0, 1.0, 38.0, 39.0, 95.0, 96.0, 110.0])
CORNERS_F = np.array([10.0, 5.0, 18.0, 8.0, 26.0, 12.0, 14.0])


def saw(u):
    return np.interp(u, CORNERS_U, CORNERS_F)


def noisy_record(noise_N=0.05, seed=0):
    rng = np.random.default_rng(seed)
    t = np.arange(0, 120, 0.01)
    u = np.clip(t - 8, 0, 110)
    force = np.where(u > 0, saw(u), 0) + rng.normal(0, noise_N, t.size)
    shown = u + rng.normal(0, 0.002, t.size)
    return pd.DataFrame({"u_mm": shown, "force_N": force, "force_std_N": noise_N})


def exact_curve():
    return model_curve(pd.DataFrame({"u_mm": CORNERS_U, "force_N": CORNERS_F}), 0.0)


def test_every_corner_of_an_exact_saw_tooth_is_found():
    table = find_extremes(exact_curve(), 1.0)
    peaks, troughs = (table[table["kind"] == kind] for kind in ("peak", "trough"))
    assert peaks["u_mm"].tolist() == [0.0, 38.0, 95.0]
    assert peaks["force_N"].tolist() == [10.0, 18.0, 26.0]
    assert peaks["drop_N"].tolist() == [5.0, 10.0, 14.0]
    # Prominence: to the higher of the two lowest points that separate a peak from higher ground.
    assert peaks["prominence_N"].tolist() == [5.0, 10.0, 14.0]
    assert peaks["spacing_mm"].tolist()[:2] == [38.0, 57.0]
    assert troughs["u_mm"].tolist() == [1.0, 39.0, 96.0]
    assert troughs["force_N"].tolist() == [5.0, 8.0, 12.0]


def test_a_force_that_still_falls_or_rises_at_the_end_has_no_extreme_there():
    falling = model_curve(pd.DataFrame({"u_mm": [0, 1, 2.0], "force_N": [1.0, 9.0, 2.0]}), 0.0)
    assert find_extremes(falling, 1.0)["kind"].tolist() == ["peak"]
    rising = model_curve(pd.DataFrame({"u_mm": [0, 1, 2.0], "force_N": [1.0, 2.0, 9.0]}), 0.0)
    assert find_extremes(rising, 1.0).empty


@pytest.mark.parametrize("seed", range(5))
def test_noise_invents_no_peak_and_moves_none(seed):
    curve = measured_curve(noisy_record(seed=seed), 30.0)
    table = find_extremes(curve, least_prominence(curve, 10.0, None))
    peaks = table[table["kind"] == "peak"]
    # The greatest of some tens of noisy means of 2 rows lies within 4 noise widths, 0.14 N, of the corner.
    # The stated place is a rectangle of three noise widths: sqrt(3) deviations to either side, or a few.
    assert (np.abs(peaks["u_mm"] - [0.0, 38.0, 95.0]) < 4 * peaks["u_std_mm"]).all()
    assert (peaks["u_std_mm"] < 0.2).all()
    np.testing.assert_allclose(peaks["force_N"], [10.0, 18.0, 26.0], atol=0.2)
    troughs = table[table["kind"] == "trough"]
    np.testing.assert_allclose(troughs["force_N"], [5.0, 8.0, 12.0], atol=0.2)


def test_prominence_follows_the_setting_but_stays_above_the_noise():
    curve = Curve(np.arange(9.0), np.ones(9), np.full(9, 0.5), np.zeros(9), 1.0)
    assert least_prominence(curve, 100.0, None) == 10.0
    assert least_prominence(curve, 100.0, 0.2) == 20.0
    assert least_prominence(curve, 1.0, 0.2) == 3.0


def test_stick_and_slip_is_no_peak_of_its_own():
    u = np.linspace(0.005, 110, 22_000)
    ripple = 1.5 * (2 * u % 1)  # 0.5 mm apart, half as high again as a tenth of P0
    record = pd.DataFrame({"u_mm": u, "force_N": saw(u) + ripple, "force_std_N": 0.02})
    curve = measured_curve(record, 30.0)
    prominence = least_prominence(curve, 10.0, None)
    peaks = find_extremes(curve, prominence, rebound_mm=3.0)
    peaks = peaks[peaks["kind"] == "peak"]
    assert prominence > 1.5
    np.testing.assert_allclose(peaks["u_mm"], [0.0, 38.0, 95.0], atol=0.5)


def test_a_rebound_within_a_fall_belongs_to_it():
    force = pd.DataFrame(
        {"u_mm": [0, 0.5, 0.8, 1.7, 25, 27, 30.0], "force_N": [53, 29, 35, 23, 67, 43, 44.0]}
    )
    curve = model_curve(force, 0.0)
    assert find_extremes(curve, 5.0)["u_mm"].tolist() == [0.0, 0.5, 0.8, 1.7, 25.0, 27.0]
    joined = find_extremes(curve, 5.0, rebound_mm=3.0)
    assert joined["u_mm"].tolist() == [0.0, 1.7, 25.0, 27.0]
    assert joined["drop_N"].tolist()[0] == 30.0


def test_scalars_of_the_saw_tooth_are_exact():
    curve = exact_curve()
    found = force_quantities(read_force(curve, 1.0, 30.0), 30.0)
    work = 0.5 * np.sum((CORNERS_F[1:] + CORNERS_F[:-1]) * np.diff(CORNERS_U))
    assert found["work_mJ"].value == pytest.approx(work, rel=1e-12)
    assert found["force_mean_N"].value == pytest.approx(work / 110, rel=1e-12)
    assert found["first_peak_N"].value == 10.0
    assert found["first_trough_N"].value == 5.0
    assert found["first_switch_u_mm"].value == 38.0
    assert found["first_switch_N"].value == 18.0
    assert found["first_switch_drop_N"].value == 10.0
    assert found["peaks_count"].value == 3.0
    assert found["peak_spacing_mm"].value == 47.5


def test_a_history_without_peaks_has_a_mean_but_no_peak_scalars():
    rising = model_curve(pd.DataFrame({"u_mm": [0.0, 20.0], "force_N": [0.0, 9.0]}), 0.0)
    found = force_quantities(read_force(rising, 1.0, 30.0), 30.0)
    assert found["force_mean_N"].value == pytest.approx(4.5)
    assert found["peaks_count"].value == 0
    for name in ("first_trough_N", "first_switch_u_mm", "peak_spacing_mm", "first_switch_drop_N"):
        assert np.isnan(found[name].value)


def test_the_stated_uncertainty_of_the_mean_covers_offset_and_noise():
    errors, stds = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        table = noisy_record(noise_N=0.2, seed=seed).iloc[:4000]
        table = table.assign(force_N=table["force_N"] + 0.1 * rng.normal(), force_std_N=np.hypot(0.2, 0.1))
        curve = measured_curve(table, 30.0)
        mean = force_quantities(read_force(curve, 2.0, 30.0), 30.0)["force_mean_N"]
        grid = np.linspace(curve.u_mm[0], curve.end_mm, 20001)
        errors.append(mean.value - np.trapezoid(saw(grid), grid) / (grid[-1] - grid[0]))
        stds.append(mean.std)
    # 60 draws of a normal error: the ratio of its scatter to the stated value lies in 1 +- 0.28 (3 sigma).
    assert np.std(errors) / np.mean(stds) == pytest.approx(1.0, abs=0.28)
