"""Verdicts at the boundary."""

import numpy as np
import pytest

from ploughval.compare.validation import distance, judge, verdict


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
