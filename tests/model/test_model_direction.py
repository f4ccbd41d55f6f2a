"""The direction of a fresh band: of least force, or of least force once softened."""

import numpy as np
import pytest

from ploughval.errors import ConvergenceError
from ploughval.model import force_history, simulate
from ploughval.model.mechanism import block_areas, block_force
from ploughval.scene import Scene

HALF_WEIGHT = 0.5 * 16e-6 * 1000.0 * 30.0**2  # unit weight d^2 / 2 for the blade's width, N


def scene_of(direction=None, box=None, surface=None, **soil):
    model = {} if direction is None else {"direction": direction}
    return Scene.model_validate(
        {
            "test": {"name": "direction"},
            "blade": {"depth_mm": 30.0, "width_mm": 1000.0},
            "soil": {
                "unit_weight_kN_m3": 16.0,
                "peak_friction_deg": 50.0,
                "residual_friction_deg": 32.0,
                **soil,
            },
            "model": {**model, "initial_surface_mm": surface},
            "box": box or {},
        }
    )


def test_least_force_is_the_default_to_the_last_bit():
    default, named = force_history(scene_of()), force_history(scene_of("least_force"))
    np.testing.assert_array_equal(default.force_N, named.force_N)
    np.testing.assert_array_equal(default.u_mm, named.u_mm)


@pytest.mark.parametrize(("peak", "residual"), [(50.0, 32.0), (40.0, 30.0), (36.0, 32.0)])
def test_first_band_leaves_as_rankine_has_it_for_softened_sand_at_the_price_of_fresh_sand(peak, residual):
    scene = scene_of("least_softened", peak_friction_deg=peak, residual_friction_deg=residual)
    history = simulate(scene, displacement_mm=5.0)
    beta = 45.0 - residual / 2.0
    assert history.force["beta_deg"][0] == pytest.approx(beta, abs=1e-9)
    price = np.tan(np.radians(beta + peak)) / np.tan(np.radians(beta))
    assert history.force["force_N"][0] / HALF_WEIGHT == pytest.approx(price, rel=1e-9)
    assert history.force["force_N"][0] > history.P0_N  # P0 stays the least force of fresh sand


def test_sand_softens_to_rankines_residual_force():
    # with hardly any mobilization length the trough is the passive force at residual friction, to the
    # slip on the way: one part in the increments; the direction of least force leaves it dearer
    soil = {"mobilization_length_mm": 1e-6}
    rankine = np.tan(np.radians(45.0 + 32.0 / 2.0)) ** 2
    troughs = {
        name: simulate(scene_of(name, **soil), displacement_mm=3.0, tolerance=1e-4).force["force_N"].min()
        for name in ("least_softened", "least_force")
    }
    assert troughs["least_softened"] / HALF_WEIGHT == pytest.approx(rankine, rel=2e-3)
    assert troughs["least_force"] > 1.05 * troughs["least_softened"]


def test_switch_comes_where_a_plain_search_finds_the_fresh_band_as_dear_as_the_old_one():
    # the only band of its row is weighed against nodes 0.02 mm apart: place and price of the fresh band
    history = simulate(scene_of("least_softened"), displacement_mm=25.0, tolerance=5e-4)
    row = int(np.flatnonzero(np.diff(history.force["band"]))[0]) + 1
    u, price, _, place, _ = history.force.iloc[row]
    surface = history.surface(u)
    x = np.union1d(np.arange(u, u + 200.0, 0.02), surface[:, 0])
    x = x[x <= u + 200.0]
    nodes = np.column_stack([x, np.interp(x, *surface.T)])
    beta = np.degrees(np.arctan2(nodes[1:, 1], nodes[1:, 0] - u))
    weight = 16e-6 * 1000.0 * block_areas(nodes, u)[1:]
    softened, fresh = (block_force(weight, beta, phi) for phi in (32.0, 50.0))
    best = int(np.argmin(softened))
    assert place == pytest.approx(x[1 + best], abs=0.3)  # the least is flat: 0.02 mm moves it by 1e-7 of P
    assert price == pytest.approx(np.interp(place, x[1:], fresh), rel=1e-5)
    # until then the old band was cheaper than the fresh one, and after the switch it would not be
    old = history.increments[row - 1]
    at = int(np.searchsorted(x, old.outcrop_x_mm)) - 1
    assert softened[at] == pytest.approx(price, rel=2e-3)


def test_direction_does_not_matter_where_sand_does_not_soften():
    runs = [
        force_history(scene_of(d, peak_friction_deg=33.0, residual_friction_deg=33.0))
        for d in ("least_force", "least_softened")
    ]
    np.testing.assert_array_equal(runs[0].force_N, runs[1].force_N)


def test_steeper_bands_come_more_often():
    counts = [len(simulate(scene_of(d)).bands) for d in ("least_force", "least_softened")]
    assert counts[1] > counts[0]


def test_band_that_locks_at_peak_friction_is_refused():
    # rising sand and a rough blade: the direction that is cheap once softened is impossible while fresh
    soil = {"peak_friction_deg": 60.0, "residual_friction_deg": 15.0, "wall_friction_deg": 14.0}
    force_history(scene_of("least_force", **soil))
    with pytest.raises(ConvergenceError, match="locks"):
        force_history(scene_of("least_softened", **soil))
