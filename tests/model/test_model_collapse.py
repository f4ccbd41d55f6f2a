"""Reference values: two independent solutions extrapolated in step and spacing; places to 0.002 d, forces to 0.001 P0."""

import numpy as np
import pytest

from ploughval.model import simulate
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
    ("soil", "P0", "expected"),
    [
        ({}, 54.350, [(1.290, 1.790, 5.249), (3.270, 2.792, 8.424)]),
        ({"repose_deg": 50.0}, 54.350, [(1.240, 1.763, 5.163), (3.159, 2.739, 8.256)]),
        ({"wall_friction_deg": 10.0}, 94.026, [(1.882, 1.828, 7.373)]),
    ],
)
def test_switches_come_where_two_independent_solutions_have_them(soil, P0, expected):
    history = simulate(scene_of(**soil), displacement_mm=3.3 * 30.0, tolerance=1e-4)
    assert history.P0_N == pytest.approx(P0, abs=0.001)
    found = switches(history)
    assert found.shape == (len(expected), 3)
    np.testing.assert_allclose(found[:, ::2], np.array(expected)[:, ::2], atol=0.002)
    np.testing.assert_allclose(found[:, 1], np.array(expected)[:, 1], atol=0.0015)
