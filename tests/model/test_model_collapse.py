"""The model against reference values and conservation laws.

The reference values come from two independent solutions extrapolated in step and spacing: places to 0.002 d,
forces to 0.001 P0.
"""

import numpy as np
import pytest

from ploughval.axes import BAND_COLUMNS, MODEL_FORCE_COLUMNS
from ploughval.errors import ConfigError, ConvergenceError, DataError
from ploughval.model import force_history, simulate
from ploughval.model.mechanism import block_areas, block_force, cheapest_band
from ploughval.model.softening import mobilised_friction_deg
from ploughval.model.surface import area_ahead
from ploughval.scene import Scene


def scene_of(*, depth=30.0, model=None, box=None, **soil):
    settings = {
        "peak_friction_deg": 50.0,
        "residual_friction_deg": 32.0,
        "mobilization_length_mm": 1.0,
        **soil,
    }
    return Scene.model_validate(
        {
            "test": {"name": "reference"},
            "blade": {"depth_mm": depth, "width_mm": 1000.0},
            "soil": {"unit_weight_kN_m3": 16.0, **settings},
            "model": model or {},
            "box": box or {},
        }
    )


def switches(history, depth=30.0):
    """u / d, P / P0 and outcrop / d at every switch."""
    force, bands = history.force, history.bands
    rows = np.searchsorted(force["u_mm"], bands["u_start_mm"][1:])
    return np.column_stack(
        [
            bands["u_start_mm"][1:] / depth,
            force["force_N"].to_numpy()[rows] / history.P0_N,
            bands["outcrop_x_mm"][1:] / depth,
        ]
    )


@pytest.mark.parametrize(
    ("soil", "first", "expected"),
    [
        ({}, 54.350, [(1.290, 1.790, 5.249), (3.270, 2.792, 8.424)]),
        ({"repose_deg": 50.0}, 54.350, [(1.240, 1.763, 5.163), (3.159, 2.739, 8.256)]),
        ({"wall_friction_deg": 10.0}, 94.026, [(1.882, 1.828, 7.373)]),
    ],
)
def test_switches_come_where_two_independent_solutions_have_them(soil, first, expected):
    history = simulate(scene_of(**soil), displacement_mm=3.3 * 30.0, tolerance=1e-4)
    assert abs(history.P0_N - first) < 0.001
    found = switches(history)
    assert found.shape == (len(expected), 3)
    np.testing.assert_allclose(found[:, ::2], np.array(expected)[:, ::2], atol=0.002)
    np.testing.assert_allclose(found[:, 1], np.array(expected)[:, 1], atol=0.001)


def test_loose_sand_switches_more_often():
    history = simulate(scene_of(peak_friction_deg=36.0), tolerance=1e-4)
    assert abs(history.P0_N - 27.733) < 0.001
    found = switches(history)
    np.testing.assert_allclose(found[:, 0], [0.391, 0.953, 1.702, 2.647], atol=0.002)
    np.testing.assert_allclose(found[:, 1], [1.353, 1.781, 2.288, 2.875], atol=0.0015)


def test_first_force_is_the_closed_form_and_softening_leaves_the_reference_trough():
    for wall in (0.0, 10.0):
        history = simulate(scene_of(wall_friction_deg=wall))
        assert history.force["force_N"][0] == pytest.approx(history.P0_N, rel=1e-9)
    history = simulate(scene_of(), tolerance=1e-4)
    assert history.force["force_N"].min() / history.P0_N == pytest.approx(0.4735, abs=1e-4)


def test_default_tolerance_is_within_what_it_promises():
    loose = simulate(scene_of(), displacement_mm=100.0)
    fine = simulate(scene_of(), displacement_mm=100.0, tolerance=3e-5)
    a, b = switches(loose), switches(fine)
    np.testing.assert_allclose(a[:, 0], b[:, 0], rtol=1e-3)
    np.testing.assert_allclose(a[:, 1], b[:, 1], rtol=1e-3)
    # the stated uncertainty is of the size of the true error, where both runs have the same band
    u = np.linspace(5.0, 38.0, 200)
    error = np.interp(u, loose.force["u_mm"], loose.force["force_N"])
    error -= np.interp(u, fine.force["u_mm"], fine.force["force_N"])
    assert np.sqrt(np.mean(error**2)) < 2.0 * loose.force_std_N < 0.002 * loose.force["force_N"].max()


def test_error_falls_in_proportion_to_the_increment():
    runs = [simulate(scene_of(), displacement_mm=60.0, tolerance=t) for t in (4e-3, 2e-3, 1e-3, 2e-5)]
    peaks = np.array([switches(run)[0, 1] for run in runs])
    errors = np.abs(peaks[:3] - peaks[3])
    np.testing.assert_allclose(errors[:2] / errors[1:], 2.0, rtol=0.15)


def test_outcrop_that_rides_with_the_block_keeps_its_distance_and_does_not_switch_within_five_depths():
    history = simulate(scene_of(model={"outcrop": "riding"}), displacement_mm=150.0)
    assert len(history.bands) == 1
    reach = history.force["outcrop_x_mm"] - history.force["u_mm"]
    np.testing.assert_allclose(reach, reach[0], rtol=1e-12)


@pytest.mark.parametrize("length", [0.1, 5.0, 20.0])
def test_switch_does_not_depend_on_the_mobilization_length(length):
    found = switches(simulate(scene_of(mobilization_length_mm=length), displacement_mm=45.0, tolerance=2e-4))
    np.testing.assert_allclose(found[0], (1.290, 1.790, 5.249), atol=0.002)


@pytest.mark.parametrize("depth", [1.0, 10_000.0])
def test_depth_only_scales_the_result(depth):
    history = simulate(scene_of(depth=depth, mobilization_length_mm=depth / 30.0))
    reference = simulate(scene_of())
    np.testing.assert_allclose(switches(history, depth), switches(reference), rtol=1e-9)
    assert pytest.approx((depth / 30.0) ** 2, rel=1e-12) == history.P0_N / reference.P0_N


def test_sand_that_does_not_soften_creeps_in_one_band():
    history = simulate(scene_of(peak_friction_deg=35.0, residual_friction_deg=35.0))
    assert len(history.bands) == 1
    force = history.force["force_N"].to_numpy()
    assert np.all(np.diff(force) > 0)
    assert np.all(np.diff(history.force["outcrop_x_mm"]) > 0)
    # creeping is the limit of ever smaller jumps
    nearly = simulate(scene_of(peak_friction_deg=35.1, residual_friction_deg=34.9))
    assert force[-1] == pytest.approx(nearly.force["force_N"].iloc[-1], rel=0.01)


HARD = {
    "no mobilization length": {"mobilization_length_mm": 0.0},
    "mobilization far beyond the travel": {"mobilization_length_mm": 1000.0},
    "wall friction near the limit": {"wall_friction_deg": 39.0},
    "repose below the band": {"repose_deg": 5.0},
    "cliffs": {"repose_deg": 88.0},
    "rising": {"model": {"initial_surface_mm": [(0, 30), (400, 80)]}},
    "falling below the tip": {"model": {"initial_surface_mm": [(0, 30), (100, -10)]}},
    "stepped": {"model": {"initial_surface_mm": [(0, 30), (60, 30), (60.1, 45), (200, 45), (201, 20)]}},
    "box": {"box": {"length_mm": 100.0}},
    "coarse": {"model": {"tolerance": 0.1}},
    "creeping": {"peak_friction_deg": 33.0, "residual_friction_deg": 33.0},
}


@pytest.mark.parametrize("name", HARD)
def test_hard_cases_stay_finite_and_conserve_area(name):
    history = simulate(scene_of(**HARD[name]))
    assert np.isfinite(history.force.to_numpy()).all()
    assert np.all(history.force["force_N"] > 0)
    assert np.isfinite(history.force_std_N)
    steepest = np.tan(history.law.repose) * (1 + 1e-6)
    area = area_ahead(history.surface(0.0))
    for increment in history.increments:
        area -= 0.5 * increment.du_mm**2 * np.tan(np.radians(increment.beta_deg))
        assert area_ahead(increment.sheared) == pytest.approx(area, rel=1e-10)
        assert area_ahead(increment.surface) == pytest.approx(area, rel=1e-10)
        assert increment.surface[0, 0] == pytest.approx(increment.u_mm + increment.du_mm, rel=1e-12)
        assert np.all(np.diff(increment.surface[:, 0]) > 0)
        assert np.abs(np.diff(increment.surface[:, 1]) / np.diff(increment.surface[:, 0])).max() <= steepest


def test_noisy_surface_converges_and_keeps_few_nodes():
    rng = np.random.default_rng(4)
    x = np.arange(0.0, 400.0, 0.8)
    model = {"initial_surface_mm": list(zip(x, 30.0 + rng.normal(0, 0.5, x.size), strict=True))}
    coarse, fine = (simulate(scene_of(model=model), displacement_mm=60.0, tolerance=t) for t in (1e-3, 2e-4))
    assert max(len(i.surface) for i in coarse.increments) <= 2 * len(x)
    np.testing.assert_allclose(switches(coarse), switches(fine), rtol=5e-3)


def test_box_that_is_too_short_ends_the_run_with_a_reason():
    open_run = simulate(scene_of(), displacement_mm=60.0)
    history = simulate(scene_of(box={"length_mm": 120.0}), displacement_mm=60.0)
    assert "end of the box" in history.end_reason
    # up to there it is the run without a wall: the band wanted next comes out at 157 mm, past the wall
    assert history.end_mm == pytest.approx(open_run.bands["u_start_mm"][1], rel=0.01)
    assert history.surface(history.end_mm)[-1, 0] == 120.0
    with pytest.raises(ConvergenceError, match="end of the box"):
        simulate(scene_of(box={"length_mm": 60.0}))


def test_tables_have_the_shared_columns_and_bands_cover_the_run():
    history = simulate(scene_of(), displacement_mm=60.0)
    assert tuple(history.force.columns) == MODEL_FORCE_COLUMNS
    assert tuple(history.bands.columns) == BAND_COLUMNS
    assert len(history.increments) == len(history.force) - 1
    assert history.force["u_mm"].iloc[-1] == 60.0
    bands = history.bands
    assert bands["u_end_mm"][0] == bands["u_start_mm"][1]
    slips = [i.du_mm / np.cos(np.radians(i.beta_deg)) for i in history.increments if i.band == 0]
    assert bands["slip_mm"][0] == pytest.approx(sum(slips), rel=1e-12)
    assert bands["beta_deg"][0] == pytest.approx(45.0 - 50.0 / 2, abs=1e-9)


@pytest.mark.parametrize("soil", [{}, {"wall_friction_deg": 10.0}, {"mobilization_length_mm": 20.0}])
def test_every_force_is_eq_1_of_its_surface_and_no_fresh_band_is_cheaper(soil):
    scene = scene_of(**soil)
    history = simulate(scene, displacement_mm=60.0)
    wall, gathered, band = scene.soil.wall_friction_deg, 0.0, -1
    for step in list(history.increments):
        gathered, band = (0.0, step.band) if step.band != band else (gathered, band)
        before = history.surface(step.u_mm)
        inside = before[before[:, 0] < step.outcrop_x_mm - 1e-9]
        block = np.vstack([inside, (step.outcrop_x_mm, step.outcrop_y_mm)])
        weight = 16e-6 * 1000.0 * block_areas(block, step.u_mm)[-1]
        phi = mobilised_friction_deg(gathered, 50.0, 32.0, scene.soil.mobilization_length_mm)
        assert step.force_N == pytest.approx(float(block_force(weight, step.beta_deg, phi, wall)), rel=1e-8)
        x, y = np.ascontiguousarray(before.T)
        fresh, _ = cheapest_band(x, y, len(x), np.tan(np.radians(50.0)), np.tan(np.radians(wall)))
        assert step.force_N <= 16e-6 * 1000.0 * fresh * (1 + 1e-8)
        gathered += step.du_mm / np.cos(np.radians(step.beta_deg))


def test_outcrop_keeps_its_place_while_its_band_lives():
    force = simulate(scene_of(), displacement_mm=60.0).force
    assert force.groupby("band")["outcrop_x_mm"].nunique().eq(1).all()
    first = force[force["band"] == 0]
    assert np.all(np.diff(first["beta_deg"]) > 0)


def test_surface_inside_an_increment_is_that_of_a_shorter_one():
    history = simulate(scene_of(), displacement_mm=60.0)
    increment = history.increments[100]
    before, middle = history.surface(increment.u_mm), history.surface(increment.u_mm + 0.5 * increment.du_mm)
    lost = area_ahead(before) - area_ahead(middle)
    assert lost == pytest.approx(
        0.125 * increment.du_mm**2 * np.tan(np.radians(increment.beta_deg)), rel=1e-6
    )
    np.testing.assert_array_equal(history.surface(increment.u_mm + increment.du_mm), increment.surface)
    with pytest.raises(DataError, match="outside the model run"):
        history.surface(61.0)


def test_force_alone_is_that_of_the_whole_history():
    light, whole = force_history(scene_of()), simulate(scene_of())
    np.testing.assert_array_equal(light.force_N, whole.force["force_N"])
    np.testing.assert_array_equal(light.band, whole.force["band"])


@pytest.mark.parametrize(
    ("model", "place"),
    [
        ({"initial_surface_mm": [(0, 30), (50, 30), (40, 30)]}, "initial_surface_mm.2"),
        ({"initial_surface_mm": [(0, -1), (50, 30)]}, "height above the tip"),
    ],
)
def test_impossible_initial_surface_is_refused(model, place):
    with pytest.raises(ConfigError, match=place):
        simulate(scene_of(model=model))


def test_scene_without_soil_is_refused():
    scene = scene_of().model_copy(update={"soil": None})
    with pytest.raises(ConfigError, match="soil"):
        simulate(scene)
    with pytest.raises(ConfigError, match="displacement_mm"):
        simulate(scene_of(), displacement_mm=-1.0)


@pytest.mark.parametrize("tolerance", [-1e-3, 0.0, 1e-12, 0.5, float("nan")])
@pytest.mark.parametrize("run", [simulate, force_history])
def test_a_tolerance_that_cannot_be_is_refused(run, tolerance):
    with pytest.raises(ConfigError, match="tolerance"):
        run(scene_of(), tolerance=tolerance)


def test_a_travel_of_too_many_increments_is_refused_before_it_starts():
    with pytest.raises(ConfigError, match="increments"):
        force_history(scene_of(), displacement_mm=1e8)
