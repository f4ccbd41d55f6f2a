"""The mechanism inverted: friction put in comes back out."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from ploughval.axes import BAND_COLUMNS
from ploughval.compare.force.curve import model_curve
from ploughval.compare.mobilised.frames import mobilised_table
from ploughval.compare.mobilised.inversion import mobilised_friction
from ploughval.scene import Scene


def thrust(weight, beta, phi, wall):
    """Force from the closed polygon of weight, band reaction and face reaction, solved as a linear system."""
    b, p, w = np.radians([beta, phi, wall])
    # Unknown: face reaction N on the block (inclined by wall friction, downwards) and band reaction R.
    matrix = np.array([[np.cos(w), -np.sin(b + p)], [-np.sin(w), np.cos(b + p)]])
    return np.linalg.solve(matrix, [0.0, weight])[0]


@given(st.floats(1, 50), st.floats(10, 55), st.floats(0, 25), st.floats(0.1, 1e3))
def test_friction_from_a_closed_force_polygon_is_recovered(beta, phi, wall, weight):
    assume(beta + phi + wall < 85)
    force = thrust(weight, beta, phi, wall)
    assert float(mobilised_friction(force, weight, beta, wall)) == pytest.approx(phi, abs=1e-8)


def scene(lean=0.0, **soil):
    base = {"unit_weight_kN_m3": 16.0, "peak_friction_deg": 50.0, "residual_friction_deg": 32.0}
    blade = {"depth_mm": 30, "width_mm": 218, "inclination_deg": lean}
    return Scene.model_validate({"test": {"name": "t"}, "blade": blade, "soil": base | soil})


def level_case(phi_deg, wall_deg=0.0, outcrop_x=80.0, stds=0.0, *, lean_deg=0.0, load_kPa=0.0):
    """Level sand 30 mm above the tip, band fixed at an outcrop: area 15 (x - face), tan beta = 30 / (x - u).

    The face goes from the tip to the surface; a load stands on the surface ahead of it.
    """
    u = np.arange(0.0, 20.0, 2.0)
    length, face = outcrop_x - u, u + 30 * np.tan(np.radians(lean_deg))
    weight = (16e-6 * 15 + 1e-3 * load_kPa) * (outcrop_x - face) * 218
    beta = np.degrees(np.arctan(30 / length))
    inclined = [thrust(w, b, phi_deg, wall_deg + lean_deg) for w, b in zip(weight, beta, strict=True)]
    # the horizontal part: what load cells measure
    force = np.cos(np.radians(wall_deg + lean_deg)) * np.array(inclined)
    curve = model_curve(pd.DataFrame({"u_mm": u, "force_N": force}), stds)
    x = np.arange(-50, 200, 0.5)
    surface = pd.concat(
        [
            pd.DataFrame({"frame": k, "u_mm": one, "x_mm": x[x >= start], "y_mm": 30.0})
            for k, (one, start) in enumerate(zip(u, face, strict=True))
        ]
    )
    bands = pd.DataFrame([(1, 0.0, 18.0, beta[0], 0.0, outcrop_x, 0.0, 0.0)], columns=list(BAND_COLUMNS))
    return curve, bands, surface, beta


@pytest.mark.parametrize("wall", [0.0, 12.0])
def test_level_sand_returns_the_friction_that_made_the_force(wall):
    curve, bands, surface, beta = level_case(41.0, wall)
    table = mobilised_table(scene(wall_friction_deg=wall), curve, bands, surface)
    np.testing.assert_allclose(table["phi_deg"], 41.0, atol=1e-9)
    np.testing.assert_allclose(table["beta_deg"], beta, atol=1e-9)
    assert (table["status"] == "ok").all()
    # Slip: integral of du / cos(atan(30 / (80 - u))), that is of sqrt(1 + 900 / s^2) over s, on a fine grid.
    s = np.linspace(80 - 18.0, 80, 2001)
    exact = np.trapezoid(np.sqrt(1 + 900 / s**2), s)
    assert table["slip_mm"].iloc[-1] == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize(("lean", "load"), [(15.0, 0.0), (-20.0, 0.0), (4.0, 1.0), (-8.0, 1.0)])
def test_a_face_that_leans_bounds_the_block_and_inclines_the_force(lean, load):
    curve, bands, surface, _ = level_case(38.0, 6.0, lean_deg=lean, load_kPa=load)
    leaning = scene(lean, wall_friction_deg=6.0, surcharge_kPa=load)
    table = mobilised_table(leaning, curve, bands, surface)
    assert (table["status"] == "ok").all()
    np.testing.assert_allclose(table["phi_deg"], 38.0, atol=1e-9)
    # Block and blade keep in touch: the block moves by 1 / (1 - tan(lean) tan(beta)) along the box.
    s = np.linspace(80 - 18.0, 80, 2001)
    slip = np.hypot(1, 30 / s) / (1 - np.tan(np.radians(lean)) * 30 / s)
    assert table["slip_mm"].iloc[-1] == pytest.approx(np.trapezoid(slip, s), rel=1e-3)


def test_a_surcharge_weighs_on_the_block():
    """2 kPa on 80 mm of level surface, 218 mm wide: 34.88 N beside the sand's own weight."""
    curve, bands, surface, _ = level_case(41.0)
    bare = mobilised_table(scene(), curve, bands, surface)["weight_N"].iloc[0]
    loaded = mobilised_table(scene(surcharge_kPa=2.0), curve, bands, surface)["weight_N"].iloc[0]
    assert loaded - bare == pytest.approx(2e-3 * 80.0 * 218.0, rel=1e-9)


def test_uncertainty_of_the_force_reaches_the_angle():
    curve, bands, surface, _ = level_case(41.0, stds=0.05)
    table = mobilised_table(scene(), curve, bands, surface)
    force, weight = table["force_N"].to_numpy(), table["weight_N"].to_numpy()
    # phi = atan(P / W) - beta, so u(phi) = u(P) / W / (1 + (P / W)^2).
    expected = np.degrees(0.05 / weight / (1 + (force / weight) ** 2))
    np.testing.assert_allclose(table["phi_std_deg"], expected, rtol=0.02)


def test_missing_parts_are_named_and_stay_empty():
    curve, bands, surface, _ = level_case(41.0)
    hole = (surface["frame"] == 3) & surface["x_mm"].between(30, 40)
    surface = surface.assign(y_mm=surface["y_mm"].where(~hole))
    late = bands.assign(u_start_mm=3.0, u_end_mm=15.0)
    short = curve.until(11.0)
    table = mobilised_table(scene(), short, late, surface)
    assert (
        table["status"].tolist()
        == ["no_band"] * 2 + ["ok", "no_surface", "ok", "ok"] + ["no_force"] * 2 + ["no_band"] * 2
    )
    assert table["phi_deg"].notna().tolist() == [s == "ok" for s in table["status"]]
