"""Drawn inputs carried through stand-in models whose spread is known in closed form."""

import numpy as np
import pytest

import ploughval.model
from ploughval.compare.ensemble import draw_ensemble, std_about
from ploughval.compare.inputs import draw_values, uncertain_inputs
from ploughval.errors import ConvergenceError
from ploughval.scene import Scene


def scene(blade=None, model=None, **soil):
    base = {"unit_weight_kN_m3": 16.0, "peak_friction_deg": 50.0, "residual_friction_deg": 32.0}
    return Scene.model_validate(
        {
            "test": {"name": "t"},
            "blade": {"depth_mm": 30, "width_mm": 1000} | (blade or {}),
            "soil": base | soil,
            "model": model or {},
            "compare": {"draws": 64},
        }
    )


@pytest.fixture(autouse=True)
def scenes_for_histories(monkeypatch):
    """A run is the scene that it was made with."""
    monkeypatch.setattr(ploughval.model, "simulate", lambda changed, *, displacement_mm: changed)


def test_no_stated_uncertainty_means_no_runs():
    ensemble = draw_ensemble(scene(), "stated", 60.0)
    assert (len(ensemble), ensemble.inputs, ensemble.centre) == (0, (), "stated")
    spread = ensemble.spread(lambda one: {"m": 1.0})["m"]
    assert (spread.std, spread.dominant) == (0.0, "")


def test_the_spread_of_a_product_is_that_of_the_propagation_law():
    stated = scene(peak_friction_std_deg=2.0, unit_weight_std_kN_m3=0.5)
    ensemble = draw_ensemble(stated, stated, 60.0)
    spread = ensemble.spread(lambda s: {"m": s.soil.unit_weight_kN_m3 * s.soil.peak_friction_deg})["m"]
    # m = gamma phi: u^2 = (50 x 0.5)^2 + (16 x 2)^2 + (0.5 x 2)^2; a hypercube of 64 is good to 3 %.
    assert spread.std == pytest.approx(np.sqrt(25.0**2 + 32.0**2 + 1.0), rel=0.03)
    assert spread.dominant == "peak_friction_deg"
    assert spread.shares["peak_friction_deg"] == pytest.approx(32.0**2 / (25.0**2 + 32.0**2), abs=0.05)


def test_the_same_inputs_give_the_same_draws():
    stated = scene(peak_friction_std_deg=2.0, unit_weight_std_kN_m3=0.5)
    first, second = (draw_ensemble(stated, stated, 60.0).values for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_every_equally_probable_interval_of_an_input_is_met_once():
    inputs = uncertain_inputs(scene(peak_friction_std_deg=2.0, unit_weight_std_kN_m3=0.5))
    draws = draw_values(inputs, 10, np.random.default_rng(1))
    rows = np.array([next(draws) for _ in range(10)])
    from scipy.stats import norm

    for column, one in zip(rows.T, inputs, strict=True):
        places = np.floor(10 * norm.cdf(column, one.value, one.std)).astype(int)
        assert sorted(places) == list(range(10))


def test_impossible_sand_is_drawn_anew_and_counted():
    stated = scene(residual_friction_deg=49.5, residual_friction_std_deg=1.0)
    ensemble = draw_ensemble(stated, stated, 60.0)
    residual = np.array([one.soil.residual_friction_deg for one in ensemble])
    assert len(ensemble) == 64
    assert residual.max() <= 50.0
    # A normal exceeds its mean by half a deviation in 31 % of the draws.
    assert 15 <= ensemble.refused <= 45


def test_lengths_and_wall_friction_stay_positive_with_the_probability_of_the_cut_normal():
    stated = scene(mobilization_length_std_mm=1.0, wall_friction_std_deg=2.0)
    ensemble = draw_ensemble(stated, stated, 60.0)
    length, wall = (np.array([getattr(s.soil, k) for s in ensemble]) for k in
                    ("mobilization_length_mm", "wall_friction_deg"))  # fmt: skip
    assert (length >= 0).all()
    assert ensemble.refused == 0
    # Half a normal: mean square equal to the variance, although its own scatter is 0.6 of it.
    spread = ensemble.spread(lambda s: {"wall": s.soil.wall_friction_deg})["wall"]
    assert spread.std == pytest.approx(2.0, rel=0.02)
    assert wall.std() == pytest.approx(2.0 * np.sqrt(1 - 2 / np.pi), rel=0.05)


def test_depth_is_drawn_and_a_given_surface_rises_with_it():
    stated = scene({"depth_std_mm": 0.5}, {"initial_surface_mm": [[0, 30], [100, 35]]})
    ensemble = draw_ensemble(stated, stated, 60.0)
    depth = np.array([one.blade.depth_mm for one in ensemble])
    lift = np.array([one.model.initial_surface_mm[1][1] for one in ensemble]) - 35
    assert depth.std() == pytest.approx(0.5, rel=0.03)
    np.testing.assert_allclose(lift, depth - 30, atol=1e-12)


def test_values_that_some_draws_lack_are_counted_and_the_rest_spread():
    stated = scene(unit_weight_std_kN_m3=0.5)
    ensemble = draw_ensemble(stated, stated, 60.0)

    def values(one):
        weight = one.soil.unit_weight_kN_m3
        return {"often": weight if weight < 16.5 else np.nan, "seldom": weight if weight < 15.5 else np.nan}

    spreads = ensemble.spread(values)
    # One deviation above the mean lies 15.9 % of a normal: 10.2 of 64 intervals.
    assert spreads["often"].lacking in (10, 11)
    assert f"{spreads['often'].lacking} of 64" in spreads["often"].remark
    assert np.isfinite(spreads["often"].std)
    assert np.isnan(spreads["seldom"].std)


def test_sand_that_the_model_cannot_run_is_drawn_anew_until_most_fail(monkeypatch):
    def refusing(limit):
        def run(changed, *, displacement_mm):
            if changed.soil.unit_weight_kN_m3 > limit:
                raise ConvergenceError("no mechanism")
            return changed

        return run

    stated = scene(unit_weight_std_kN_m3=0.5)
    monkeypatch.setattr(ploughval.model, "simulate", refusing(16.5))
    assert len(draw_ensemble(stated, stated, 60.0)) == 64
    few = draw_ensemble(stated, stated, 60.0).spread(lambda one: {"m": 1.0})["m"]
    assert "drawn anew" in few.remark
    monkeypatch.setattr(ploughval.model, "simulate", refusing(14.9))  # 2.2 deviations below: 1.4 % can be run
    left = draw_ensemble(stated, stated, 60.0)
    assert 5 < len(left) < 40
    remark = left.spread(lambda one: {"m": 1.0})["m"].remark
    assert f"only {len(left)} of {len(left) + left.refused} draws" in remark
    monkeypatch.setattr(ploughval.model, "simulate", refusing(10.0))
    nothing = draw_ensemble(stated, stated, 60.0)
    assert len(nothing) == 0
    spread = nothing.spread(lambda one: {"m": 1.0})["m"]
    assert np.isnan(spread.std)
    assert "none of the drawn inputs" in spread.remark


def test_a_finer_tolerance_is_not_spent_on_the_draws():
    stated = scene(model={"tolerance": 1e-5}, unit_weight_std_kN_m3=0.5)
    ensemble = draw_ensemble(stated, "fine", 60.0)
    assert {one.model.tolerance for one in ensemble} == {1e-3}
    assert ensemble.centre.model.tolerance == 1e-3


def test_deviations_are_taken_from_the_stated_run_point_by_point():
    drawn = np.array([[1.0, 2.0, np.nan, 5.0], [3.0, 2.0, np.nan, np.nan]])
    found = std_about(np.array([1.0, np.nan, 0.0, 5.0]), drawn)
    # (0, 2): sqrt(2); about the draws' own mean: 0; nobody has it; one of two is half.
    np.testing.assert_allclose(found, [np.sqrt(2.0), 0.0, np.nan, 0.0])
