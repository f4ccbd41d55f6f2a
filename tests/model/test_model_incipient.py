"""Inclined blades, sloping ground and surcharge against Coulomb's passive force."""

import numpy as np
import pytest

from ploughval.errors import ConvergenceError
from ploughval.model import force_history, simulate
from ploughval.model.incipient import incipient
from ploughval.model.mechanism import initial_force
from ploughval.scene import Scene

DEPTH, WEIGHT, WIDTH = 30.0, 16e-6, 1000.0


def scene_of(*, inclination=0.0, surface=None, box=None, model=None, **soil):
    settings = {"peak_friction_deg": 36.0, "residual_friction_deg": 32.0, "repose_deg": 60.0, **soil}
    return Scene.model_validate(
        {
            "test": {"name": "incipient"},
            "blade": {"depth_mm": DEPTH, "width_mm": WIDTH, "inclination_deg": inclination},
            "soil": {"unit_weight_kN_m3": 16.0, **settings},
            "model": {"initial_surface_mm": surface, **(model or {})},
            "box": box or {},
        }
    )


def sloping(slope_deg):
    """Even ground through (0, DEPTH), from 10 depths behind the tip to 1000 ahead."""
    slope = np.tan(np.radians(slope_deg))
    return [(-10 * DEPTH, DEPTH * (1 - 10 * slope)), (1e3 * DEPTH, DEPTH * (1 + 1e3 * slope))]


def coulomb_by_search(phi, wall, lean, slope, surcharge):
    """Least force over two million bands, by equilibrium of each triangle: force per width, N/mm."""
    phi, wall, lean, slope = np.radians([phi, wall, lean, slope])
    beta = np.linspace(slope, np.pi / 2 - phi - wall - lean, 2_000_001)[1:-1]
    height = DEPTH / (1 - np.tan(slope) * np.tan(lean))  # of the face's top
    top = height * np.tan(lean)
    out = DEPTH / (np.tan(beta) - np.tan(slope))
    ok = out > top
    area = 0.5 * (out * height - top * out * np.tan(beta))  # shoelace: tip, outcrop, top
    weight = WEIGHT * area + surcharge * (out - top)
    force = weight * np.sin(beta + phi) / np.cos(beta + phi + wall + lean)
    return force[ok].min()


CASES = [
    (36.0, 0.0, 0.0, 0.0, 0.0),
    (36.0, 12.0, 10.0, 0.0, 0.0),
    (36.0, 12.0, -20.0, 0.0, 0.0),
    (30.0, 10.0, 0.0, 12.0, 0.0),
    (40.0, 0.0, -15.0, -8.0, 0.0),
    (33.0, 15.0, 8.0, 6.0, 2.5e-3),
    (33.0, 5.0, -30.0, 10.0, 0.4e-3),
    (45.0, 3.0, 12.0, -10.0, 0.0),
]


@pytest.mark.parametrize(("phi", "wall", "lean", "slope", "surcharge"), CASES)
def test_first_force_is_coulombs_for_inclined_blades_sloping_ground_and_surcharge(
    phi, wall, lean, slope, surcharge
):
    scene = scene_of(
        inclination=lean,
        surface=sloping(slope),
        peak_friction_deg=phi,
        residual_friction_deg=phi - 3.0,
        wall_friction_deg=wall,
        surcharge_kPa=1e3 * surcharge,
    )
    height = DEPTH / (1 - np.tan(np.radians(slope)) * np.tan(np.radians(lean)))
    closed = initial_force(
        height, WEIGHT, phi, wall, inclination_deg=lean, slope_deg=slope, surcharge=surcharge
    )
    assert incipient(scene).force_N == pytest.approx(WIDTH * closed, rel=1e-9)
    # and the closed form against a plain search (2e6 bands: a flat minimum, 1e-9 of P)
    assert closed == pytest.approx(coulomb_by_search(phi, wall, lean, slope, surcharge), rel=1e-8)


def test_published_coefficients():
    # passive coefficients of Coulomb as tabled in textbooks (three figures): vertical wall, level ground
    tabled = {
        (30.0, 0.0): 3.000,
        (30.0, 10.0): 4.143,
        (30.0, 20.0): 6.105,
        (40.0, 10.0): 6.946,
        (40.0, 20.0): 11.771,
    }
    for (phi, wall), expected in tabled.items():
        assert 2.0 * initial_force(1.0, 1.0, phi, wall) == pytest.approx(expected, abs=1.5e-3)


@pytest.mark.parametrize("model", [{}, {"direction": "least_softened"}])
def test_vertical_blade_begins_as_the_march_does(model):
    rng = np.random.default_rng(2)
    surface = [(30.0 * k, 30.0 + rng.normal(0.0, 1.0)) for k in range(12)]
    scene = scene_of(surface=surface, model=model, wall_friction_deg=10.0, surcharge_kPa=0.3, repose_deg=32.0)
    first = incipient(scene)
    row = simulate(scene, displacement_mm=5.0).force.iloc[0]
    assert first.force_N == pytest.approx(row["force_N"], rel=1e-12)
    assert first.beta_deg == pytest.approx(row["beta_deg"], rel=1e-12)
    assert first.outcrop_x_mm == pytest.approx(row["outcrop_x_mm"], rel=1e-12)


def test_blade_that_leans_back_digs_cheaply_and_one_that_leans_ahead_dearly():
    forces = [
        incipient(scene_of(inclination=a, wall_friction_deg=10.0)).force_N for a in (-30, -10, 0, 10, 20)
    ]
    assert np.all(np.diff(forces) > 0)


def test_march_begins_at_the_closed_form_under_surcharge_and_soon_is_light_again():
    scene = scene_of(surcharge_kPa=0.2)
    history = simulate(scene)
    load = 0.2e-3 * DEPTH
    expected = WIDTH * (0.5 * WEIGHT * DEPTH**2 + load) * np.tan(np.radians(45 + 36 / 2)) ** 2
    assert pytest.approx(expected, rel=1e-12) == history.P0_N
    assert history.force["force_N"][0] == pytest.approx(expected, rel=1e-9)
    # Eq. 1 with the load on the block, at every row, from the outcrop and the angle alone plus the area
    for step in list(history.increments)[::40]:
        surface = history.surface(step.u_mm)
        x, y = surface[surface[:, 0] < step.outcrop_x_mm].T
        x, y = np.append(x, step.outcrop_x_mm), np.append(y, step.outcrop_y_mm)
        reach = step.outcrop_x_mm - step.u_mm
        area = np.trapezoid(y, x) - 0.5 * reach * step.outcrop_y_mm
        least, most = (
            (WEIGHT * area + 0.2e-3 * reach) * WIDTH * np.tan(np.radians(step.beta_deg + phi))
            for phi in (32, 36)
        )
        assert least * (1 - 1e-9) <= step.force_N <= most * (1 + 1e-9)


def test_heavy_surcharge_hides_the_weight_of_the_sand():
    # limit: force in proportion to the load, whatever the sand weighs; one part in load / weight is left
    heavy = simulate(scene_of(surcharge_kPa=1e5), displacement_mm=30.0)
    twice = simulate(scene_of(surcharge_kPa=2e5), displacement_mm=30.0)
    np.testing.assert_allclose(twice.force["force_N"], 2.0 * heavy.force["force_N"], rtol=1e-4)


def test_no_surcharge_is_the_limit_of_a_small_one():
    none, small = (force_history(scene_of(surcharge_kPa=q)) for q in (0.0, 1e-9))
    u = np.linspace(0.0, 90.0, 500)
    a, b = (np.interp(u, run.u_mm, run.force_N) for run in (none, small))
    np.testing.assert_allclose(a, b, rtol=1e-5)


def test_first_band_that_locks_or_passes_the_box_is_refused():
    with pytest.raises(ConvergenceError, match="end of the box"):
        incipient(scene_of(box={"length_mm": 40.0}))
    with pytest.raises(ConvergenceError, match="locks"):
        incipient(scene_of(inclination=58.0, wall_friction_deg=20.0))
