"""Verdicts at the boundary, areas in closed form, inputs propagated through a stand-in model."""

import numpy as np
import pytest

import ploughval.model
from ploughval.compare.validation import (
    area_metric,
    distance,
    input_stds,
    judge,
    perturbed_runs,
    verdict,
)
from ploughval.scene import Scene


def scene(**soil):
    base = {"unit_weight_kN_m3": 16.0, "peak_friction_deg": 50.0, "residual_friction_deg": 32.0}
    return Scene.model_validate(
        {"test": {"name": "t"}, "blade": {"depth_mm": 30, "width_mm": 1000}, "soil": base | soil}
    )


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


def test_what_is_unknown_is_not_judged():
    assert judge("force_mean_N", (np.nan, np.nan), (20.0, 1.0)).agrees is None
    assert judge("force_mean_N", (10.0, np.nan), (20.0, 1.0)).agrees is None
    assert distance("layers_rms_mm", 0.1, experiment_std=np.nan, model_std=0.1).agrees is None
    assert distance("layers_rms_mm", 0.2, experiment_std=0.1, model_std=0.0).agrees is True
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


def test_inputs_are_perturbed_one_at_a_time_and_only_those_stated(monkeypatch):
    seen = []

    def stand_in(changed, *, displacement_mm):
        seen.append((changed.soil.peak_friction_deg, changed.soil.unit_weight_kN_m3, displacement_mm))
        return changed.soil

    monkeypatch.setattr(ploughval.model, "simulate", stand_in)
    runs = perturbed_runs(scene(peak_friction_std_deg=2.0, unit_weight_std_kN_m3=0.5), "base", 60.0)
    assert sorted(seen) == [(48.0, 16.0, 60.0), (50.0, 15.5, 60.0), (50.0, 16.5, 60.0), (52.0, 16.0, 60.0)]
    ends = [
        (*({"m": s.unit_weight_kN_m3 * s.peak_friction_deg} for s in run.histories), run.span) for run in runs
    ]
    # m = gamma phi: u = sqrt((50 x 0.5)^2 + (16 x 2)^2).
    assert input_stds(ends)["m"] == pytest.approx(np.hypot(25.0, 32.0))


def test_no_stated_uncertainty_means_no_runs():
    assert perturbed_runs(scene(), "base", 60.0) == ()
    assert input_stds([]) == {}


def test_a_barred_side_is_replaced_by_the_run_as_it_is(monkeypatch):
    monkeypatch.setattr(ploughval.model, "simulate", lambda changed, displacement_mm: changed.soil)
    base = scene(residual_friction_deg=49.5, residual_friction_std_deg=1.0)
    (run,) = perturbed_runs(base, base.soil, 60.0)
    assert [soil.residual_friction_deg for soil in run.histories] == [48.5, 49.5]
    values = [(*({"m": s.residual_friction_deg} for s in run.histories), run.span)]
    assert input_stds(values)["m"] == pytest.approx(1.0)


def test_a_value_that_a_perturbed_run_lacks_leaves_the_uncertainty_unknown():
    assert np.isnan(input_stds([({"m": 1.0}, {"m": np.nan}, 2.0)])["m"])
