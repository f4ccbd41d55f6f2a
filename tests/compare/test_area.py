"""The area between distributions against closed forms and against its integral."""

import numpy as np
import pytest
from scipy.special import erf
from scipy.stats import norm

from ploughval.compare.area import area_metric


def folded(error, spread):
    """Mean of |error + spread Z|: the area between two normal distributions whose deviations differ so."""
    z = abs(error) / (np.sqrt(2.0) * spread)
    return spread * np.sqrt(2 / np.pi) * np.exp(-(z**2)) + abs(error) * erf(z)


def test_two_certain_values_are_their_distance_apart():
    found = area_metric(np.array([3.0, 5.0, 2.0]), np.zeros(3), np.array([[5.0, 5.0, -1.0]]))
    np.testing.assert_allclose(found, [2.0, 0.0, 3.0], atol=1e-6)


@pytest.mark.parametrize(("error", "std"), [(0.0, 1.0), (1.0, 0.5), (-4.0, 2.0)])
def test_a_certain_model_against_a_normal_is_the_folded_normal(error, std):
    found = area_metric(np.array([10.0]), np.array([std]), np.array([[10.0 + error]]))
    assert found[0] == pytest.approx(folded(error, std), rel=1e-9)


@pytest.mark.parametrize(
    ("error", "a", "b"), [(0.0, 1.0, 3.0), (2.0, 0.5, 0.5), (-1.5, 2.0, 0.7), (9.0, 1.0, 1.0)]
)
def test_draws_of_a_normal_come_to_the_area_between_two_normals(error, a, b):
    """4000 quantiles of the normal: steps of at most 3 b / 4000 outside the last tails."""
    drawn = error + b * norm.ppf((np.arange(4000) + 0.5) / 4000)
    expected = abs(error) if a == b else folded(error, abs(a - b))
    found = area_metric(np.zeros(1), np.array([a]), drawn[:, None])[0]
    assert found == pytest.approx(expected, abs=2e-3 * b)


def test_few_draws_against_the_integral():
    rng = np.random.default_rng(0)
    x = np.linspace(-30, 40, 700_001)
    for n in (1, 2, 5, 64):
        drawn = rng.normal(1, 2, n)
        steps = np.searchsorted(np.sort(drawn), x, side="right") / n
        expected = np.trapezoid(np.abs(norm.cdf(x, 0.5, 0.8) - steps), x)
        found = area_metric(np.array([0.5]), np.array([0.8]), drawn[:, None])[0]
        assert found == pytest.approx(expected, abs=2e-4)  # the grid's step


def test_draws_that_lack_the_value_leave_the_others_and_nothing_is_not_zero():
    drawn = np.array([[1.0, np.nan], [np.nan, np.nan], [3.0, np.nan]])
    found = area_metric(np.array([2.0, 2.0]), np.array([1e-9, 1.0]), drawn)
    assert found[0] == pytest.approx(1.0, rel=1e-6)
    assert np.isnan(found[1])
    assert np.isnan(area_metric(np.array([np.nan]), np.array([1.0]), np.array([[1.0]]))[0])
