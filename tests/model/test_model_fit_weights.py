"""Rows that count: independent noise counts in full, correlated misfit by its integrated autocorrelation."""

import numpy as np
import pytest

from ploughval.model.fit.weights import misfit_of


def autoregressive(count, share, seed):
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal(count)
    for k in range(1, count):
        rows[k] = share * rows[k - 1] + np.sqrt(1.0 - share**2) * rows[k]
    return rows


def test_independent_noise_of_the_told_size_counts_in_full():
    whole = sum(
        misfit_of(np.random.default_rng(k).standard_normal(400), 5).inflation == 1.0 for k in range(100)
    )
    assert whole >= 95  # each of the two tests refuses one good record in eighty


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_rows_together_are_those_of_an_autoregressive_noise(share):
    found = [misfit_of(autoregressive(4000, share, k), 5) for k in range(40)]
    together = np.array([misfit.rows_together for misfit in found])
    # integrated autocorrelation in closed form: (1 + r) / (1 - r)
    assert together.mean() == pytest.approx((1.0 + share) / (1.0 - share), rel=0.1)
    assert np.mean([m.independent for m in found]) == pytest.approx(4000 * (1 - share) / (1 + share), rel=0.1)


def test_inflation_makes_the_mean_of_correlated_rows_as_uncertain_as_it_is():
    share, count = 0.7, 1000
    rows = np.array([autoregressive(count, share, k) for k in range(300)])
    spread = rows.mean(axis=1).std()
    stated = np.mean([misfit_of(r, 1).inflation for r in rows]) / np.sqrt(count)
    assert stated == pytest.approx(spread, rel=0.15)  # 300 means: their spread is known to 4 %


def test_noise_larger_than_told_inflates_by_its_size():
    misfit = misfit_of(3.0 * np.random.default_rng(2).standard_normal(2000), 5)
    assert misfit.chi2 == pytest.approx(9.0, rel=0.1)
    assert misfit.inflation == pytest.approx(3.0, rel=0.15)
