"""Intervals of the fit against closed forms, what tells what, and what is not told."""

import sys

import numpy as np
import pytest

from ploughval.errors import MissingExtraError
from ploughval.model import fit_soil, force_history
from ploughval.model.fit import PARAMETERS, Discrepancy, Extras, SharedErrors
from ploughval.model.fit.information import information
from ploughval.model.fit.intervals import PROFILE_TOLERANCE, WIDTH, profile
from ploughval.model.fit.objective import objective_of
from ploughval.model.fit.record import read_record
from ploughval.model.fit.search import best_unknowns
from ploughval.model.fit.variables import space_of
from ploughval.scene import Scene

RIGHT = Discrepancy(0.0, 0.0)


def scene_of(peak=50.0, residual=32.0, length=1.0, **soil):
    table = {
        "unit_weight_kN_m3": 15.7,
        "peak_friction_deg": peak,
        "residual_friction_deg": residual,
        "mobilization_length_mm": length,
        **soil,
    }
    blade = {"depth_mm": 30.0, "width_mm": 218.0}
    return Scene.model_validate({"test": {"name": "fit"}, "blade": blade, "soil": table})


def record(scene, u, noise, seed, longer=1.0):
    """Force of the model at u, its teeth longer by a factor, with noise of a share of its mean."""
    history = force_history(scene, displacement_mm=1.1 * u[-1], tolerance=1e-4)
    force = np.interp(u / longer, history.u_mm, history.force_N)
    std = noise * force.mean()
    return force + np.random.default_rng(seed).normal(0.0, std, u.size), std


@pytest.mark.parametrize(("offset", "gain"), [(0.0, 0.0), (0.5, 0.0), (0.0, 0.02)])
def test_interval_of_the_unit_weight_is_that_of_a_straight_line(offset, gain):
    """The force is proportional to the unit weight: generalised least squares in closed form."""
    u = np.linspace(0.0, 30.0, 120)
    scene = scene_of()
    force, std = record(scene, u, 0.02, seed=4)
    fit = fit_soil(
        u, force, std, scene, parameters=("unit_weight_kN_m3",),
        shared=SharedErrors(offset, gain), discrepancy=RIGHT,
    )  # fmt: skip
    shape, _ = record(scene, u, 0.0, seed=4)
    covariance = std**2 * np.eye(u.size) + offset**2 + gain**2 * np.outer(shape, shape)
    precision = np.linalg.inv(covariance)
    factor_std = 1.0 / np.sqrt(shape @ precision @ shape)
    factor = factor_std**2 * (shape @ precision @ force)
    # the gain acts on the fitted force: 1.5 % of the unit weight apart, that changes its std as much
    assert fit.values[0] == pytest.approx(15.7 * factor, abs=0.05 * 15.7 * factor_std)
    assert fit.std[0] == pytest.approx(15.7 * factor_std, rel=0.03)
    half = 0.5 * (fit.interval_95[0, 1] - fit.interval_95[0, 0])
    assert half == pytest.approx(1.98 * 15.7 * factor_std, rel=0.03)  # Student, 118 degrees of freedom


def test_place_of_the_switch_tells_the_angles_and_not_the_length():
    u = np.linspace(0.0, 60.0, 300)
    scene = scene_of()
    force, std = record(scene, u, 0.01, seed=1)
    fit = fit_soil(u, force, std, scene, discrepancy=Discrepancy(0.005, 0.0))
    told = fit.information.to_json()
    places = {name: told["places of the switches"][name]["share"] for name in fit.parameters}
    assert places["peak_friction_deg"] > 0.001
    assert places["residual_friction_deg"] > 0.001
    assert places["mobilization_length_mm"] < 1e-6
    falls = sum(
        told[s]["mobilization_length_mm"]["share"] for s in ("first peak", "first fall", "later falls")
    )
    assert falls > 0.95  # while the friction falls, and nowhere else


def test_record_without_its_first_travel_says_that_the_length_is_not_told():
    u = np.linspace(3.0, 25.0, 150)
    length = PARAMETERS.index("mobilization_length_mm")
    said = 0
    for seed in (1, 2, 3):
        force, std = record(scene_of(), u, 0.01, seed=seed)
        fit = fit_soil(u, force, std, scene_of(45.0, 30.0, 2.0), discrepancy=RIGHT)
        open_below = not np.isfinite(fit.interval_95[length, 0])
        assert ("the first 3 mm are missing" in fit.message) == open_below
        said += open_below
        for limits, true in zip(fit.interval_95, (50.0, 32.0), strict=False):
            assert limits[0] - 0.2 < true < limits[1] + 0.2
    # one record in twenty has a first row so high that softening is seen in it: two of three do not at 99 %
    assert said >= 2


def test_noise_that_hides_the_length_is_not_taken_for_travel_that_is_missing():
    u = np.linspace(0.04, 25.0, 300)
    force, std = record(scene_of(), u, 1.5, seed=1)
    fit = fit_soil(u, force, std, scene_of(45.0, 30.0, 2.0), discrepancy=RIGHT)
    assert not np.isfinite(fit.interval_95[PARAMETERS.index("mobilization_length_mm")]).all()
    assert "mobilization_length_mm is not" in fit.message
    assert "are missing" not in fit.message


def test_length_of_a_few_rows_is_said_to_be_blurred():
    u = np.linspace(0.0, 30.0, 301)
    force, std = record(scene_of(length=0.15), u, 0.002, seed=4)
    told = ("mobilization_length_mm",)
    fit = fit_soil(u, force, std, scene_of(length=0.3), parameters=told, discrepancy=RIGHT)
    assert "about the travel between rows, 0.1 mm" in fit.message
    force, std = record(scene_of(length=1.0), u, 0.002, seed=4)
    assert (
        "travel between rows"
        not in fit_soil(u, force, std, scene_of(length=0.3), parameters=told, discrepancy=RIGHT).message
    )


def test_limits_of_a_profile_are_not_read_from_a_search_that_strayed():
    """Sand that does not soften: both angles in one narrow valley, from which a long step strays."""
    scene, u = scene_of(35.0, 35.0), np.linspace(0.02, 55.0, 300)
    force, noise = record(scene, u, 0.01, seed=1)
    read = read_record(u, force, noise, 30.0, least=3)
    shared = SharedErrors(offset_N=0.05, gain=0.01)
    objective = objective_of(space_of(scene, PARAMETERS), read, shared, Discrepancy(), PROFILE_TOLERANCE)
    best, _ = best_unknowns(objective)
    k, rise = PARAMETERS.index("residual_friction_deg"), 3.84
    std = float(information(objective, best, WIDTH).std[k])
    found = profile(objective, best, k, std, {0.95: rise})
    low, high = found.limits[0.95]
    assert low < 35.0 < high
    assert found.rises.max() < 5.0 * rise  # no limit read between a good fit and one that strayed


def test_longer_teeth_do_not_carry_the_angles_away():
    u = np.linspace(0.0, 75.0, 300)
    force, std = record(scene_of(), u, 0.02, seed=6, longer=1.08)
    fit = fit_soil(u, force, std, scene_of(45.0, 30.0, 2.0))
    truth = (50.0, 32.0)
    assert np.all(np.abs(fit.values[:2] - truth) < 1.0)  # plain squares are off by degrees (reports/fit)
    assert fit.switches["stretch"].iloc[0] == pytest.approx(0.08, abs=0.03)
    for limits, true in zip(fit.interval_95, truth, strict=False):
        assert limits[0] < true < limits[1]


def test_uncertainty_of_the_depth_widens_the_interval_as_least_squares_say():
    """Depth and unit weight unknown: a straight line with one column known beforehand."""
    u = np.linspace(0.0, 30.0, 150)
    scene, depth_std, more = scene_of(), 0.6, 0.05
    force, std = record(scene, u, 0.05, seed=8)
    uncertain = deep(scene, 30.0, depth_std)
    fit = fit_soil(u, force, std, uncertain, parameters=("unit_weight_kN_m3",), discrepancy=RIGHT)
    shape = record(scene, u, 0.0, seed=8)[0]
    slope = (
        record(deep(scene, 30.0 + more), u, 0.0, 8)[0] - record(deep(scene, 30.0 - more), u, 0.0, 8)[0]
    ) / (2.0 * more)
    precision = np.linalg.inv(std**2 * np.eye(u.size) + depth_std**2 * np.outer(slope, slope))
    assert fit.std[0] == pytest.approx(15.7 / np.sqrt(shape @ precision @ shape), rel=0.05)
    assert [shift.name for shift in fit.shifts] == ["depth_mm"]


def deep(scene, depth_mm, std_mm=0.0):
    """The scene at another depth."""
    blade = scene.blade.model_copy(update={"depth_mm": depth_mm, "depth_std_mm": std_mm})
    return scene.model_copy(update={"blade": blade})


def test_samples_and_profiles_give_the_same_interval():
    pytest.importorskip("emcee")
    u = np.linspace(0.0, 25.0, 80)
    scene = scene_of()
    force, std = record(scene, u, 0.02, seed=9)
    fit = fit_soil(
        u, force, std, scene, parameters=("unit_weight_kN_m3",),
        shared=SharedErrors(0.3), discrepancy=RIGHT, extras=Extras(samples=300),
    )  # fmt: skip
    low, _, middle, _, high = fit.posterior["unit_weight_kN_m3"]
    # 32 walkers of 210 steps, some 400 independent samples: ends of an interval to 12 % of its length
    assert middle == pytest.approx(fit.values[0], abs=0.3 * fit.std[0])
    assert high - low == pytest.approx(fit.interval_95[0, 1] - fit.interval_95[0, 0], rel=0.2)
    assert f"sampled: median {middle:.4g}, 95 % between {low:.4g} and {high:.4g}" in str(fit)


def test_samples_without_their_package_are_refused_before_anything_is_searched(monkeypatch):
    monkeypatch.setitem(sys.modules, "emcee", None)
    u, heard = np.linspace(0.0, 25.0, 80), []
    extras = Extras(samples=300, progress=lambda *step: heard.append(step))
    with pytest.raises(MissingExtraError, match=r"Sampling a fit .* pip install 'ploughval\[bayes\]'"):
        fit_soil(u, np.ones(80), 0.1, scene_of(), extras=extras)
    assert heard == []
