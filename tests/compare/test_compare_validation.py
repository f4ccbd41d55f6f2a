"""Verdicts at the boundary, and areas in closed form."""

import numpy as np
import pytest

from ploughval.compare.validation import area_metric, distance, judge, verdict


def test_the_verdict_turns_at_twice_the_validation_uncertainty():
    metric = judge("force_mean_N", (10.0, 3.0), (20.0, 0.0), input_std=4.0)
    assert (metric.error, metric.validation_std, metric.model_std) == (10.0, 5.0, 4.0)
    assert metric.agrees is True
    assert judge("force_mean_N", (10.0, 3.0), (20.0001, 0.0), input_std=4.0).agrees is False
    assert judge("force_mean_N", (20.0001, 3.0), (10.0, 4.0)).agrees is False
    assert metric.unit == "N"


def test_all_three_parts_of_the_validation_uncertainty_count():
    metric = judge("work_mJ", (0.0, 2.0), (1.0, 3.0), input_std=6.0)
    assert metric.validation_std == pytest.approx(7.0)
    assert (metric.experiment_std, metric.numerical_std, metric.input_std) == (2.0, 3.0, 6.0)


def test_what_is_unknown_is_not_judged():
    assert judge("force_mean_N", (np.nan, np.nan), (20.0, 1.0)).agrees is None
    assert judge("force_mean_N", (10.0, np.nan), (20.0, 1.0)).agrees is None
    assert distance("layers_rms_mm", 0.1, experiment_std=np.nan, numerical_std=0.1).agrees is None
    assert distance("layers_rms_mm", 0.2, experiment_std=0.1, numerical_std=0.0).agrees is True
    assert verdict(np.nan, 1.0) is None


def test_the_area_between_two_normal_distributions_matches_its_integral():
    x = np.linspace(-60, 60, 240_001)
    from scipy.stats import norm

    for error, a, b in ((0.0, 1.0, 3.0), (2.0, 0.5, 0.5), (-1.5, 2.0, 0.7), (4.0, 1e-9, 1.0)):
        area = np.trapezoid(np.abs(norm.cdf(x, 0, a) - norm.cdf(x, error, b)), x)
        # The trapezoid rule with steps of 0.0005 is good to that step where one distribution is a jump.
        assert area_metric(np.array([error]), np.array([a]), np.array([b]))[0] == pytest.approx(
            area, abs=5e-4
        )


def test_without_uncertainty_the_area_is_the_error():
    zero = np.zeros(3)
    assert area_metric(np.array([-2.0, 0.0, 1.0]), zero, zero).tolist() == [2.0, 0.0, 1.0]
