"""Friction between the photographs: blocks and forces in closed form give the friction that made them."""

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import BAND_COLUMNS
from ploughval.compare.force.curve import Curve
from ploughval.compare.mobilised.block import Block, block_of
from ploughval.compare.mobilised.curve import band_curve, binned, curve_table
from ploughval.compare.mobilised.frames import mobilised_table
from ploughval.compare.mobilised.outcrop import outcrop_of
from ploughval.compare.mobilised.sources import SOURCES
from ploughval.compare.mobilised.surface import seen_surface
from ploughval.compare.mobilised.track import track_block
from ploughval.scene import Scene

DEPTH, WIDTH, GAMMA = 30.0, 218.0, 16.0
OUTCROP, HEAP = 150.0, 40.0  # mm: where the band comes out; base of the heap before the face
STARTS, TRAVEL = 9.3, 20.0  # of the blade, mm
PEAK, RESIDUAL, LENGTH = 48.0, 33.0, 1.2
FRAMES = np.arange(0.0, 21.0, 2.0)


def scene(blade=None, camera=None, **soil):
    base = {"unit_weight_kN_m3": GAMMA, "peak_friction_deg": 50.0, "residual_friction_deg": 32.0}
    tables = {
        "test": {"name": "t"},
        "blade": {"depth_mm": DEPTH, "width_mm": WIDTH} | (blade or {}),
        "soil": base | soil,
    }
    if camera is not None:
        tables["camera"] = camera
    return Scene.model_validate(tables)


def heap(u):
    """Surface of level sand whose swept part stands as a triangular heap before the face: area is kept."""
    x = np.sort(np.r_[np.linspace(u, 200.0, 801), u + HEAP])
    return x, DEPTH + (2 * DEPTH * u / HEAP) * np.clip(1 - (x - u) / HEAP, 0.0, None)


def block_area(u):
    """Sand ahead of the face up to the outcrop, less the triangle under the band, mm2."""
    return DEPTH * OUTCROP - (OUTCROP - u) * DEPTH / 2


def slip(u):
    """Slip since the start: the integral of sqrt(1 + (h / s)^2) over s = outcrop - u, in closed form."""

    def gathered(s):
        root = np.hypot(s, DEPTH)
        return root - DEPTH * np.arctanh(DEPTH / root)

    return gathered(OUTCROP - STARTS) - gathered(OUTCROP - u)


def friction(u):
    return PEAK - (PEAK - RESIDUAL) * np.clip(slip(u) / LENGTH, 0.0, 1.0)


def force(u, phi_deg, wall_deg=0.0):
    """Horizontal force of the closed polygon of weight, band reaction and face reaction."""
    beta = np.arctan2(DEPTH, OUTCROP - u)
    weight = GAMMA * 1e-6 * block_area(u) * WIDTH
    t = np.tan(beta + np.radians(phi_deg))
    return weight * t / (1 - np.tan(np.radians(wall_deg)) * t)


def measured(wall_deg=0.0, noise=0.0, shared=0.0):
    u = np.arange(0.005, TRAVEL, 0.01)
    F = force(u, np.where(u >= STARTS, friction(np.maximum(u, STARTS)), 40.0), wall_deg)
    return Curve(u, F, np.full(u.size, noise), np.full(u.size, shared), 0.01)


def surface(std_mm=0.0):
    lines = [
        pd.DataFrame({"frame": k, "u_mm": u, "x_mm": heap(u)[0], "y_mm": heap(u)[1], "std_mm": std_mm})
        for k, u in enumerate(FRAMES)
    ]
    return pd.concat(lines, ignore_index=True)


def bands(outcrop_std_mm=0.0):
    old = (0, 0.0, STARTS, 30.0, 0.0, 60.0, 0.0, 0.0)
    new = (1, STARTS, TRAVEL, 12.0, 0.0, OUTCROP, outcrop_std_mm, 0.0)
    return pd.DataFrame([old, new], columns=list(BAND_COLUMNS))


@pytest.mark.parametrize("wall", [0.0, 8.0])
def test_softening_within_the_first_millimetre_is_resolved_between_two_photographs(wall):
    curve = band_curve(scene(wall_friction_deg=wall), measured(wall), bands(), 1, seen_surface(surface()))
    table = curve_table(curve, STARTS, 0.0)
    after = table[table["slip_mm"] > 0.0]
    within = after[after["slip_mm"] < LENGTH]
    assert len(within) > 20
    np.testing.assert_allclose(after["slip_mm"], slip(after["u_mm"].to_numpy()), atol=1e-3)
    # 0.05 mm of force averaged over a fall of 12 degrees a mm: curvature and the kink stay below 0.02 degrees
    edge = (after["slip_mm"] - LENGTH).abs() < 0.06
    error = after["phi_deg"] - friction(after["u_mm"].to_numpy())
    assert error[~edge].abs().max() < 0.02
    assert error.abs().max() < 0.2


def test_rows_before_the_start_hold_the_friction_that_the_new_band_would_have_needed():
    curve = band_curve(scene(), measured(), bands(), 1, seen_surface(surface()))
    before = curve.u_mm < STARTS - 0.05
    assert before.sum() > 20
    np.testing.assert_allclose(curve.phi_deg[before], 40.0, atol=0.02)


def test_a_photograph_at_a_change_of_the_band_says_so_and_has_no_friction():
    """Photographs place the start at 9.3 mm, the force at 10.2: that at 10 mm is of neither band for sure."""
    table = mobilised_table(scene(), measured(), bands(), surface(), {1: 10.2}).set_index("u_mm")
    assert table.index[table["status"] == "changing"].tolist() == [10.0]
    assert np.isnan(table.loc[10.0, ["phi_deg", "phi_std_deg"]].to_numpy(float)).all()
    assert table.loc[12.0, "phi_deg"] == pytest.approx(RESIDUAL, abs=0.1)


def test_the_old_band_ends_with_the_photograph_before_the_switch():
    lines = surface()
    curve = band_curve(scene(), measured(), bands(), 0, seen_surface(lines))
    assert curve.first
    assert curve.u_mm.max() < 8.0 < STARTS


def test_block_rests_until_its_band_starts_and_then_goes_on_evenly():
    """Height 30 until the start, then + 0.3 a mm; area + 15 a mm, then + 12: blocks at photographs alone."""
    seen = np.arange(0.0, 11.0, 2.0)

    def state(u):
        after = np.maximum(u - 5.3, 0.0)
        return 2000.0 + 15.0 * (u - after) + 12.0 * after, 30.0 + 0.3 * after

    none = (0.0, 0.0)
    blocks = [Block(*state(u), 0.0, none, none, none, none) for u in seen.tolist()]
    u = np.linspace(0.0, 10.0, 101)
    track = track_block(u, seen, blocks, np.full(101, 120.0), 5.3)
    area, height = state(u)
    np.testing.assert_allclose(track.height_mm, height, atol=1e-9)
    np.testing.assert_allclose(track.area_mm2, area, atol=0.1)  # a hundredth of 1 %: heights of both ends mix
    np.testing.assert_allclose(track.beta_deg, np.degrees(np.arctan(height / (120.0 - u))), atol=1e-6)


def test_block_is_unknown_where_no_photograph_is_near():
    none = (0.0, 0.0)
    blocks = [Block(2000.0, 30.0, 0.0, none, none, none, none)] * 4
    u, seen = np.array([1.0, 9.0, 19.0, 30.0]), np.array([0.0, 2.0, 4.0, 20.0])
    track = track_block(u, seen, blocks, np.full(4, 120.0), 0.0)
    assert np.isfinite(track.area_mm2).tolist() == [True, False, False, False]


@pytest.mark.parametrize("lean", [0.0, 0.1, -0.05])
def test_derivatives_of_a_block_are_those_of_the_block_of_a_changed_surface(lean):
    u, line = 6.0, np.column_stack(heap(6.0))
    block = block_of(line, u, 43.0, DEPTH, lean)
    small = 1e-4

    def change(other, outcrop=43.0):
        moved = block_of(other, u, outcrop, DEPTH, lean)
        return (moved.area_mm2 - block.area_mm2) / small, (moved.height_mm - block.height_mm) / small

    lifted = np.add(block.by_level, block.by_height)
    np.testing.assert_allclose(lifted, change(line + np.array([0.0, small])), rtol=1e-6)
    np.testing.assert_allclose(block.by_outcrop, change(line, 43.0 + small), rtol=1e-2)
    scaled = change(line * (1 + small), 43.0 * (1 + small))
    np.testing.assert_allclose(block.by_scale, scaled, rtol=1e-2)


SMALL = 1e-3
CAMERA = {"photos": "p/*.png", "mm_per_px": 0.1, "tip_px": [100.0, 100.0], "direction": "right"}


def changed(name):
    """What one standard uncertainty of a source makes of scene, force, bands and surface."""
    seen, found, lines, F = scene(wall_friction_deg=5.0), bands(), surface(), measured(5.0)
    if name == "force_zero":
        F = Curve(F.u_mm, F.force_N + SMALL, F.noise_std_N, F.shared_std_N, F.step_mm)
    elif name == "force_gain":
        F = Curve(F.u_mm, F.force_N * (1 + SMALL), F.noise_std_N, F.shared_std_N, F.step_mm)
    elif name == "unit_weight":
        seen = scene(wall_friction_deg=5.0, unit_weight_kN_m3=GAMMA * (1 + SMALL))
    elif name == "depth":
        lines = lines.assign(y_mm=lines["y_mm"] + SMALL)
    elif name == "wall_friction":
        seen = scene(wall_friction_deg=5.0 + SMALL)
    elif name == "scale":
        lines = lines.assign(x_mm=lines["x_mm"] * (1 + SMALL), y_mm=lines["y_mm"] * (1 + SMALL))
        found = found.assign(outcrop_x_mm=found["outcrop_x_mm"] * (1 + SMALL))
    elif name == "outcrop":
        found = found.assign(outcrop_x_mm=found["outcrop_x_mm"] + SMALL)
    return band_curve(seen, F, found, 1, seen_surface(lines)).phi_deg


@pytest.mark.parametrize("name", sorted({*SOURCES} - {"surface", "outcrop_height"}))
def test_effect_of_a_source_is_what_its_change_makes_of_the_friction(name):
    shares = {"force_zero": (SMALL, 0.0), "force_gain": (0.0, SMALL)}
    zero, gain = shares.get(name, (0.0, 0.0))
    plain = measured(5.0)
    F = Curve(plain.u_mm, plain.force_N, plain.noise_std_N, np.hypot(zero, gain * plain.force_N), 0.01)
    stated = scene(
        {"depth_std_mm": SMALL if name == "depth" else 0.0},
        CAMERA | {"mm_per_px_std": 0.1 * SMALL if name == "scale" else 0.0},
        wall_friction_deg=5.0,
        wall_friction_std_deg=SMALL if name == "wall_friction" else 0.0,
        unit_weight_std_kN_m3=GAMMA * SMALL if name == "unit_weight" else 0.0,
    )
    found = bands(SMALL if name == "outcrop" else 0.0)
    curve = band_curve(stated, F, found, 1, seen_surface(surface()))
    effect = curve.response.shared[SOURCES.index(name)]
    # central and one-sided differences of a thousandth: 1 % of the effect, and rounding
    np.testing.assert_allclose(effect, changed(name) - curve.phi_deg, rtol=0.02, atol=2e-5)
    others = np.delete(curve.response.shared, SOURCES.index(name), axis=0)
    assert np.abs(others).max() < 1e-12


def test_scale_of_a_calibration_counts_as_one_that_is_stated():
    """What an error of the scale leaves open of places: 0.002 of their distance from the tip, rms by axis."""
    lines = surface()
    distance = np.hypot(lines["x_mm"], lines["y_mm"])
    told = lines.assign(calibration_std_mm=0.002 * distance / np.sqrt(2.0))
    stated = scene(camera=CAMERA | {"mm_per_px_std": 0.0002})
    rows = [
        band_curve(one, measured(), bands(), 1, seen_surface(table)).response.shared[SOURCES.index("scale")]
        for one, table in ((scene(), told), (stated, lines))
    ]
    assert np.abs(rows[0]).max() > 0.001
    np.testing.assert_allclose(rows[0], rows[1], rtol=1e-9)


def test_intervals_of_rows_cover_friction_under_drawn_forces():
    """95 % limits with a drawn zero, gain and noise hold the true friction in 90 to 98 % of 200 tests."""
    rng, zero, gain, noise = np.random.default_rng(5), 0.15, 0.01, 0.08
    plain, seen, where = measured(), seen_surface(surface()), bands()
    inside = []
    for _ in range(200):
        F = (plain.force_N + zero * rng.standard_normal()) * (1 + gain * rng.standard_normal())
        F = F + rng.normal(0, noise, F.size)
        shared = np.hypot(zero, gain * F)
        drawn = Curve(plain.u_mm, F, np.full(F.size, noise), shared, 0.01)
        curve = band_curve(scene(), drawn, where, 1, seen)
        pick = np.argmin(np.abs(curve.u_mm - (STARTS + 0.4)))
        error = curve.phi_deg[pick] - friction(curve.u_mm[pick])
        inside.append(abs(error) < 1.96 * curve.response.std[pick])
    assert 0.90 <= np.mean(inside) <= 0.98


def test_steps_of_force_are_fine_at_first_and_keep_the_mean():
    u = np.arange(0.0, 20.0, 0.01)
    curve = Curve(u, 3.0 + 0.1 * u, np.full(u.size, 0.2), np.zeros(u.size), 0.01)
    middle, width, F, noise = binned(curve, 4.0, 16.0, DEPTH)
    np.testing.assert_allclose(F, 3.0 + 0.1 * middle, atol=1e-9)
    assert middle.min() < 4.05 < 15.5 < middle.max() < 16.0
    near = middle < 11.0
    np.testing.assert_allclose(width[near], 0.05, atol=1e-9)
    np.testing.assert_allclose(noise[near], 0.2 / np.sqrt(5.0), rtol=0.1)
    assert width[~near].max() == pytest.approx(0.5)


def creeping(speed, scatter_mm=0.3):
    """Level sand and a band whose outcrop creeps ahead: force of friction 35, bands, surface, increments."""
    rng = np.random.default_rng(8)
    u = np.arange(0.005, TRAVEL, 0.01)
    reach = 45.0 + (speed - 1) * u
    beta = np.arctan2(DEPTH, reach)
    F = GAMMA * 1e-6 * DEPTH * reach / 2 * WIDTH * np.tan(beta + np.radians(35.0))
    curve = Curve(u, F, np.zeros(u.size), np.zeros(u.size), 0.01)
    band = pd.DataFrame([(4, 0.0, TRAVEL, 33.7, 0.0, 45.0, 0.3, 0.0)], columns=list(BAND_COLUMNS))
    x = np.arange(0.0, 200.0, 0.5)
    lines = [
        pd.DataFrame({"frame": k, "u_mm": one, "x_mm": x[x >= one], "y_mm": DEPTH})
        for k, one in enumerate(FRAMES)
    ]
    start = np.arange(0.0, TRAVEL)
    increments = pd.DataFrame({"u_mm": start, "du_mm": 1.0, "outcrop_std_mm": scatter_mm, "band": 4})
    increments["outcrop_x_mm"] = 45.0 + speed * (start + 0.5) + rng.normal(0, scatter_mm, start.size)
    return curve, band, pd.concat(lines, ignore_index=True), increments


def test_outcrop_that_clearly_creeps_ahead_is_followed():
    curve, band, lines, increments = creeping(0.5)
    found = band_curve(scene(), curve, band, 0, seen_surface(lines), increments)
    # 0.3 mm of scatter in 19 increments: 0.15 mm of outcrop at either end, 0.05 degrees
    np.testing.assert_allclose(found.phi_deg, 35.0, atol=0.15)
    assert np.abs(band_curve(scene(), curve, band, 0, seen_surface(lines)).phi_deg - 35.0).max() > 2.0
    table = mobilised_table(scene(), curve, band, lines, increments=increments)
    np.testing.assert_allclose(table["phi_deg"].dropna(), 35.0, atol=0.15)


def test_outcrop_that_scatters_or_goes_back_is_taken_to_stay():
    for speed in (0.0, -0.5):
        _, band, _, increments = creeping(speed)
        assert outcrop_of(band.iloc[0], increments).at(np.array([0.0, 15.0])).tolist() == [45.0, 45.0]
    _, band, _, vague = creeping(0.5, scatter_mm=6.0)
    assert outcrop_of(band.iloc[0], vague).speed == 0.0
