"""Verdicts at the boundary."""

import numpy as np
import pytest

from ploughval.compare.validation import distance, judge, rms, verdict


def test_the_verdict_turns_at_twice_the_validation_uncertainty():
    metric = judge("force_mean_N", (10.0, 3.0), (20.0, 0.0), input_std=4.0)
    assert (metric.error, metric.validation_std, metric.model_std) == (10.0, 5.0, 4.0)
    assert metric.agrees is True
    assert judge("force_mean_N", (10.0, 3.0), (20.0001, 0.0), input_std=4.0).agrees is False
    assert judge("force_mean_N", (20.0001, 3.0), (10.0, 4.0)).agrees is False
    assert metric.unit == "N"


def test_an_error_well_within_the_uncertainty_agrees():
    assert judge("force_mean_N", (10.0, 3.0), (11.0, 0.0)).agrees is True
    assert judge("force_mean_N", (10.0, 3.0), (10.0, 0.0)).agrees is True


def test_both_sides_are_kept_as_they_are_and_inputs_count_only_where_they_are_known():
    metric = judge("work_mJ", (4.0, 0.3), (5.0, 0.4), note="n")
    assert (metric.experiment, metric.experiment_std) == (4.0, 0.3)
    assert (metric.model, metric.model_std) == (5.0, 0.4)
    assert (metric.numerical_std, metric.input_std, metric.note) == (0.4, 0.0, "n")
    apart = distance("layers_rms_mm", 1.0, experiment_std=0.3, numerical_std=0.4)
    assert (apart.model_std, apart.input_std) == (0.4, 0.0)
    assert apart.validation_std == pytest.approx(0.5)


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


def test_a_distance_has_no_sides_but_the_same_three_parts():
    metric = distance(
        "layers_rms_mm",
        14.0,
        experiment_std=2.0,
        numerical_std=3.0,
        input_std=6.0,
        dominant_input="phi",
        note="n",
    )
    assert (metric.error, metric.validation_std) == (14.0, pytest.approx(7.0))
    assert metric.model_std == pytest.approx(np.sqrt(45.0))
    assert (metric.experiment_std, metric.numerical_std, metric.input_std) == (2.0, 3.0, 6.0)
    assert (metric.dominant_input, metric.note, metric.unit) == ("phi", "n", "mm")
    assert np.isnan([metric.experiment, metric.model]).all()


def test_root_mean_square_passes_over_what_was_not_measured():
    assert rms(np.array([3.0, np.nan, -4.0])) == pytest.approx(np.sqrt(12.5))
    assert np.isnan(rms(np.array([np.nan])))
