"""A force record becomes a curve over travel without losing its values or its uncertainty."""

import numpy as np
import pandas as pd
import pytest

from ploughval.compare.force.curve import measured_curve, model_curve


def record(force_of_u, *, noise_N=0.0, shared_N=0.0, seed=0, rate=100, travel=60.0):
    rng = np.random.default_rng(seed)
    t = np.arange(0, travel + 15, 1 / rate)
    u = np.clip(t - 10, 0, travel)
    force = np.where(u > 0, force_of_u(u), 0.0) + rng.normal(0, noise_N, t.size)
    return pd.DataFrame(
        {
            "time_s": t,
            "u_mm": u + rng.normal(0, 0.002, t.size),
            "force_N": force,
            "force_std_N": np.hypot(noise_N, shared_N),
        }
    )


def test_a_straight_force_is_kept_to_rounding_of_its_noise():
    curve = measured_curve(record(lambda u: 10 + 0.2 * u, noise_N=0.05), 30.0)
    # Means of n rows scatter by 0.05 / sqrt(n); 4.5 of those hold every one of some 3000 points.
    error = curve.force_N - (10 + 0.2 * curve.u_mm)
    assert np.abs(error / curve.noise_std_N).max() < 4.5
    assert np.std(error / curve.noise_std_N) == pytest.approx(1.0, abs=0.1)
    assert curve.end_mm == pytest.approx(60.0, abs=0.1)
    assert curve.u_mm[0] < 0.1


def test_noise_and_shared_uncertainty_are_told_apart():
    curve = measured_curve(record(lambda u: 10 + 0 * u, noise_N=0.1, shared_N=0.2), 30.0)
    assert np.median(curve.shared_std_N) == pytest.approx(0.2, rel=0.05)
    assert (curve.noise_std_N < 0.1).all()


def test_rows_at_rest_do_not_pull_the_first_point_down():
    for seed in range(20):
        curve = measured_curve(record(lambda u: 20 - 0.1 * u, noise_N=0.02, seed=seed), 30.0)
        assert curve.force_N[0] == pytest.approx(20.0, abs=0.1)


def test_rows_without_force_are_passed_over_and_not_filled():
    table = record(lambda u: 5 + u)
    hole = (table["u_mm"] > 20) & (table["u_mm"] < 25)
    table.loc[hole, "force_N"] = np.nan
    curve = measured_curve(table, 30.0)
    assert not ((curve.u_mm > 20.1) & (curve.u_mm < 24.9)).any()


def test_a_record_without_motion_has_no_curve():
    assert measured_curve(record(lambda u: 1 + u, travel=0.1), 30.0) is None


def test_a_curve_is_cut_at_an_interpolated_point_and_is_unknown_outside():
    force = pd.DataFrame({"u_mm": [0.0, 1.0, 3.0], "force_N": [2.0, 4.0, 0.0]})
    curve = model_curve(force, 0.5)
    cut = curve.until(2.0)
    assert cut.u_mm.tolist() == [0.0, 1.0, 2.0]
    assert cut.force_N.tolist() == [2.0, 4.0, 2.0]
    values, std = curve.at(np.array([0.5, 2.0, 3.5]))
    np.testing.assert_array_equal(values, [3.0, 2.0, np.nan])
    np.testing.assert_array_equal(std, [0.5, 0.5, np.nan])


def test_the_horizontal_share_of_the_models_force_is_compared():
    """Load cells measure P cos 30 degrees where the blade's force P is inclined by 30 degrees."""
    force = pd.DataFrame({"u_mm": [0.0, 1.0], "force_N": [10.0, 20.0]})
    share = np.cos(np.radians(30.0))
    curve = model_curve(force, 0.5, share)
    np.testing.assert_allclose(curve.force_N, [10.0 * share, 20.0 * share])
    np.testing.assert_allclose(curve.shared_std_N, 0.5 * share)
