"""Zeros, noise and drift at rest from records with known offsets."""

import numpy as np
import pytest

from ploughval.loadcells.zero import unknown_zero, zero_of


def test_zeros_and_noise_are_those_put_in():
    rng = np.random.default_rng(0)
    cov = np.array([[4e-6, 2e-6], [2e-6, 9e-6]])
    cells = np.array([[0.3], [-0.1]]) + np.linalg.cholesky(cov) @ rng.normal(size=(2, 20000))
    zero = zero_of(np.arange(20000) * 1e-3, cells)
    np.testing.assert_allclose(zero.mean, [0.3, -0.1], atol=4 * np.sqrt(9e-6 / 20000))
    # Relative scatter of a variance from n samples: sqrt(2 / n) = 1 %; four of those.
    np.testing.assert_allclose(zero.noise_cov, cov, rtol=0.06)
    np.testing.assert_allclose(zero.mean_cov, zero.noise_cov / 20000, rtol=1e-12)
    assert not zero.drifts
    assert (zero.rows, zero.middle_s, zero.end_s, zero.span_s) == pytest.approx(
        (20000, 9.9995, 19.999, 19.999)
    )


def test_correlated_noise_widens_the_zeros_but_white_noise_does_not():
    rng = np.random.default_rng(1)
    slow = np.cumsum(rng.normal(size=(2, 20000)), axis=1) * 1e-4
    zero = zero_of(np.arange(20000.0), slow)
    assert (np.diag(zero.mean_cov) > 20 * np.diag(zero.noise_cov) / 20000).all()


def test_drift_is_noted_and_its_size_is_right():
    rng = np.random.default_rng(2)
    t = np.linspace(0, 10, 5000)
    cells = np.stack([0.002 * t, 0 * t]) + rng.normal(0, 0.003, (2, t.size))
    zero = zero_of(t, cells)
    assert zero.drifts
    assert zero.drift[0] == pytest.approx(0.02, abs=4 * zero.drift_std[0])
    assert abs(zero.drift[1]) < 4 * zero.drift_std[1]


def test_two_rows_are_no_rest():
    assert zero_of(np.arange(2.0), np.ones((2, 2))) is None


@pytest.mark.parametrize("value", [0.1, 0.3, -7.7e3, 1e-9])
def test_a_constant_record_neither_scatters_nor_drifts(value):
    zero = zero_of(np.arange(1234) * 0.01, np.full((2, 1234), value))
    assert not zero.drifts
    # The mean of equal numbers is good to a few units in the last place of 1234 sums.
    np.testing.assert_allclose(zero.mean, value, rtol=1e-12)
    assert np.sqrt(zero.noise_cov).max() <= 1e-12 * abs(value)


def test_a_record_without_rest_has_its_noise_from_second_differences():
    rng = np.random.default_rng(3)
    cov = np.array([[4e-6, 2e-6], [2e-6, 9e-6]])
    t = np.arange(20000) * 1e-3
    cells = np.stack([5 + 3 * np.sin(t), 2 * t]) + np.linalg.cholesky(cov) @ rng.normal(size=(2, t.size))
    cells[:, 500] = np.nan
    zero = unknown_zero(cells)
    # Second differences are correlated over three rows: sqrt(2 x 35 / 18 / n) = 1.4 %; four of those.
    np.testing.assert_allclose(zero.noise_cov, cov, rtol=0.06)
    assert (zero.rows, zero.mean.tolist(), zero.mean_cov.any()) == (0, [0.0, 0.0], False)
