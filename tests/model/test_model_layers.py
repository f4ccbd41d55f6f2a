"""Material points and tracer layers against the block's motion written out by hand."""

import numpy as np
import pytest

from ploughval.axes import LAYER_COLUMNS
from ploughval.errors import DataError
from ploughval.model import simulate
from ploughval.scene import Scene


@pytest.fixture(scope="module")
def history():
    soil = {"unit_weight_kN_m3": 16.0, "peak_friction_deg": 50.0, "residual_friction_deg": 32.0}
    blade = {"depth_mm": 30.0, "width_mm": 218.0}
    scene = Scene.model_validate({"test": {"name": "layers"}, "blade": blade, "soil": soil})
    return simulate(scene, displacement_mm=60.0)


@pytest.mark.parametrize("k", [0, 40, 250])
def test_one_increment_moves_what_lies_above_the_band_and_nothing_else(history, k):
    step = history.increments[k]
    rng = np.random.default_rng(k)
    surface = history.surface(step.u_mm)
    x = rng.uniform(step.u_mm, step.u_mm + 150.0, 4000)
    points = np.column_stack([x, rng.uniform(0.0, 1.0, 4000) * np.interp(x, *surface.T)])
    moved = history.advect(points, step.u_mm, step.u_mm + step.du_mm)
    slope = np.tan(np.radians(step.beta_deg))
    above = (points[:, 1] > slope * (points[:, 0] - step.u_mm)) & (points[:, 0] < step.outcrop_x_mm)
    expected = points + np.where(above[:, None], step.du_mm * np.array([1.0, slope]), 0.0)
    stays = np.isfinite(moved[:, 0])
    np.testing.assert_allclose(moved[stays], expected[stays], atol=1e-10)
    over = expected[:, 1] > np.interp(expected[:, 0], *step.surface.T) + 1e-6
    np.testing.assert_array_equal(~stays, over)
    assert above.any()
    assert (~above).any()


def test_advection_in_parts_is_advection_at_once(history):
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(0, 150, 2000), rng.uniform(0, 29, 2000)])
    once = history.advect(points, 0.0, 57.0)
    parts = points
    for start, stop in [(0.0, 11.1), (11.1, 11.15), (11.15, 40.0), (40.0, 57.0)]:
        parts = history.advect(parts, start, stop)
    same = np.isfinite(once[:, 0]) & np.isfinite(parts[:, 0])
    np.testing.assert_allclose(parts[same], once[same], atol=1e-9)
    # a grain at the surface may be lost at one stop and not at another: less than one in two hundred
    assert np.mean(np.isfinite(once[:, 0]) != np.isfinite(parts[:, 0])) < 0.005


def test_surface_of_the_unbroken_block_is_a_material_line(history):
    first = history.bands.iloc[0]
    u = 0.9 * first["u_end_mm"]
    moved = history.advect([(1.0, 30.0)], 0.0, u)
    top = np.interp(moved[0, 0], *history.surface(u).T)
    assert moved[0] == pytest.approx((1.0 + u, top), abs=1e-8)


def test_cut_off_crest_has_avalanched(history):
    # sand at the surface just behind the outcrop is pushed over the front and rolls down
    moved = history.advect([(80.0, 29.9), (130.0, 29.9)], 0.0, 30.0)
    assert np.isnan(moved[0]).all()
    assert moved[1] == pytest.approx((130.0, 29.9), abs=1e-12)


def test_layers_start_level_and_are_torn_by_the_bands(history):
    table = history.layers([10.0, 20.0], [0.0, 30.0, 500.0], [0, 1, 2])
    assert tuple(table.columns) == LAYER_COLUMNS
    assert table["source"].eq("model").all()
    start = table[table["frame"] == 0]
    assert start["x_mm"].notna().all()
    np.testing.assert_array_equal(start["y_mm"], start["layer"])
    later = table[(table["frame"] == 1) & (table["layer"] == 20.0)]
    assert later["x_mm"].isna().any()
    ahead = later[later["x_mm"] > 85.0]
    np.testing.assert_array_equal(ahead["y_mm"], 20.0)
    # on the block a layer is lifted as much as the surface there
    lift = history.surface(30.0)[0, 1] - 30.0
    assert later["y_mm"].iloc[0] == pytest.approx(20.0 + lift, abs=1e-8)
    unreached = table[table["frame"] == 2]
    assert len(unreached) == 2
    assert unreached["x_mm"].isna().all()


def test_displacements_must_run_forwards(history):
    with pytest.raises(DataError, match="lies before"):
        history.advect([(0.0, 0.0)], 10.0, 5.0)
