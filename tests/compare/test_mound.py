"""The mound read from heaps of known shape, from noisy ones, and from the model's own surfaces."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest

from ploughval.compare.case import Case
from ploughval.compare.ensemble import Ensemble
from ploughval.compare.inputs import Input
from ploughval.compare.mound.history import MOUND_COLUMNS, lines_of, reading_of, rest_of
from ploughval.compare.mound.metrics import mound_metrics
from ploughval.compare.mound.shape import Reading, mound_of
from ploughval.model import simulate
from ploughval.scene import Scene

DEPTH = 30.0
REST = np.array([[0.0, DEPTH], [300.0, DEPTH]])
SHARP = Reading(DEPTH, 0.3, 0.003, 15.0)
NOISY = Reading(DEPTH, 0.3, 0.15, 15.0)


def heap(crest, slope_deg, plateau=0.0, face=20.0, step=0.3):
    """A plateau from the face on, then a straight slope to the initial level."""
    foot = face + plateau + crest / np.tan(np.radians(slope_deg))
    x = np.arange(face, 300.0, step)
    return np.column_stack([x, DEPTH + np.interp(x, [face, face + plateau, foot], [crest, crest, 0.0])])


def scene(**soil):
    base = {"unit_weight_kN_m3": 16.0, "peak_friction_deg": 50.0, "residual_friction_deg": 32.0}
    return Scene.model_validate(
        {"test": {"name": "t"}, "blade": {"depth_mm": DEPTH, "width_mm": 218.0}, "soil": base | soil}
    )


@dataclass
class StandIn:
    """A model whose heap grows with the travel: a plateau of half of it, with a slope of 30 degrees."""

    share: float = 0.5
    end_mm: float = 60.0

    @property
    def force(self):
        return pd.DataFrame({"u_mm": [0.0, self.end_mm]})

    def surface(self, u_mm):
        return heap(max(self.share * u_mm, 1e-6), 30.0, plateau=40.0, face=u_mm)


def table(shares, noise=0.0, rng=None, std=0.1):
    """Measured surfaces of such heaps, every 5 mm of travel; a share is the crest over the travel."""
    parts = []
    for frame, share in enumerate(shares):
        u = 5.0 * frame
        x, y = heap(max(share * u, 1e-6), 30.0, plateau=40.0, face=u).T
        y = y + (np.zeros(x.size) if rng is None else rng.normal(0.0, noise, x.size))
        parts.append(pd.DataFrame({"frame": frame, "u_mm": u, "x_mm": x, "y_mm": y, "std_mm": std}))
    return pd.concat(parts, ignore_index=True)


def case(drawn=()):
    inputs = (Input("residual_friction_deg", 32.0, 1.0, 0.0),) if drawn else ()
    runs = tuple(StandIn(share) for share in drawn)
    model = StandIn()
    return Case(scene(), model, Ensemble(inputs, np.arange(float(len(drawn)))[:, None], runs, model))


def by_name(metrics):
    return {metric.name: metric for metric in metrics}


@pytest.mark.parametrize("slope_deg", [20.0, 32.0, 45.0])
@pytest.mark.parametrize("plateau", [0.0, 40.0])
def test_triangles_and_trapezoids_are_read_as_they_were_made(slope_deg, plateau):
    found = mound_of(heap(12.0, slope_deg, plateau), REST, 20.0, SHARP)
    tangent = np.tan(np.radians(slope_deg))
    # A mean over 1.5 mm rounds the peak of a triangle by a quarter of what it falls in that length, and by
    # twice that at the face, where half the window is missing.
    rounding = 0.0 if plateau else 0.5 * 0.5 * 1.5 * tangent
    assert found.crest.value == pytest.approx(12.0, abs=rounding + 1e-9)
    assert found.face.value == pytest.approx(12.0, abs=rounding + 1e-9)
    # The surface leaves its level by the threshold, 0.6 mm, before it meets it.
    assert found.front.value == pytest.approx(plateau + (12.0 - 0.6) / tangent, abs=0.05)
    assert found.slope.value == pytest.approx(slope_deg, abs=0.01)
    # Where the crest is rounded, 15 and 85 % of it are nearer to the foot: the slope between them stays.
    assert found.flank.value == pytest.approx(slope_deg, abs=0.3)
    area = 12.0 * plateau + 0.5 * 12.0**2 / tangent
    assert found.area.value == pytest.approx(area, rel=2e-3)
    if plateau:
        assert found.crest_x.value == pytest.approx(20.0 + 0.5 * plateau, abs=1.0)


def test_stated_uncertainties_cover_noisy_heaps():
    """400 trapezoids: 95 % would be 380 within two; fewer than 360 (90 %) are refused.

    Errors are the same over 15 mm of surface, as where it is read from straight pieces.
    """
    rng = np.random.default_rng(5)
    inside = {"crest": 0, "face": 0, "front": 0, "flank": 0, "slope": 0, "area": 0}
    made = heap(12.0, 32.0, 30.0)
    tangent = np.tan(np.radians(32.0))
    truth = {"crest": 12.0, "face": 12.0, "front": 30 + 11.4 / tangent, "flank": 32.0, "slope": 32.0}
    truth["area"] = 12.0 * 30.0 + 0.5 * 12.0**2 / tangent
    for _ in range(400):
        pieces = rng.normal(0.0, 0.15, 40)
        places = np.arange(40) * 15.0 + rng.uniform(-15, 0)
        noise = np.interp(made[:, 0] - 20.0, places, pieces)
        found = mound_of(made + np.column_stack([np.zeros(len(made)), noise]), REST, 20.0, NOISY)
        for name, value in truth.items():
            quantity = getattr(found, name)
            inside[name] += abs(quantity.value - value) <= 2 * quantity.std
    assert all(count >= 360 for count in inside.values()), inside


@pytest.mark.parametrize("repose_deg", [25.0, 32.0, 40.0])
def test_fronts_of_the_model_have_the_slope_of_repose(repose_deg):
    history = simulate(scene(repose_deg=repose_deg), displacement_mm=3.0 * DEPTH)
    found = [
        mound_of(history.surface(u), history.surface(0.0), u, SHARP).slope.value
        for u in np.linspace(0.3, 3.0, 28) * DEPTH
    ]
    known = np.array(found)[np.isfinite(found)]
    # Just after a switch the new front is still too low to be read.
    assert known.size >= 14
    np.testing.assert_allclose(known, repose_deg, atol=0.3)


def test_the_models_mound_holds_what_the_blade_swept_less_the_wedge_left_behind():
    history = simulate(scene(), displacement_mm=2.0 * DEPTH)
    for u in (15.0, 30.0, 60.0):
        found = mound_of(history.surface(u), history.surface(0.0), u, SHARP)
        # All the swept area but the triangles du^2 tan(beta) / 2 under the tip, which shrink with the step.
        assert found.area.value == pytest.approx(DEPTH * u, rel=0.01)


def test_a_flat_surface_has_no_mound_and_a_front_out_of_sight_no_place():
    assert np.isnan(mound_of(REST, REST, 20.0, SHARP).crest.value)
    cut = heap(12.0, 32.0, 30.0)
    found = mound_of(cut[cut[:, 0] < 55.0], REST, 20.0, SHARP)
    assert found.crest.value == pytest.approx(12.0)
    assert np.isnan([found.front.value, found.slope.value, found.area.value]).all()


def test_a_gap_hides_what_lies_in_it_and_a_hidden_face_its_height():
    made = heap(12.0, 32.0, 30.0)
    holed = made[(made[:, 0] < 52.0) | (made[:, 0] > 64.0)]
    assert np.isnan(mound_of(holed, REST, 20.0, NOISY, widest_gap_mm=6.0).area.value)
    far = made[made[:, 0] > 26.0]
    found = mound_of(far, REST, 20.0, SHARP)
    assert np.isnan([found.face.value, found.area.value]).all()
    assert found.front.value == pytest.approx(30 + 11.4 / np.tan(np.radians(32.0)), abs=0.05)


def test_a_terrace_makes_the_flank_flatter_and_leaves_the_front_its_slope():
    upper, lower = heap(12.0, 32.0, 20.0), heap(6.0, 32.0, 60.0)
    stepped = np.column_stack([upper[:, 0], np.maximum(upper[:, 1], lower[:, 1])])
    found = mound_of(stepped, REST, 20.0, SHARP)
    tangent = np.tan(np.radians(32.0))
    # 85 % of 12 mm lies on the upper slope, 15 % on the lower one: 40 mm of terrace stand between, less
    # what the two slopes overlap.
    run = (60.0 + (6.0 - 1.8) / tangent) - (20.0 + (12.0 - 10.2) / tangent)
    assert found.flank.value == pytest.approx(np.degrees(np.arctan(8.4 / run)), abs=0.05)
    assert found.slope.value == pytest.approx(32.0, abs=0.05)


def test_a_terrace_as_high_as_a_reading_makes_it_uncertain():
    def stepped(low):
        upper, lower = heap(12.0, 32.0, 20.0), heap(low, 32.0, 60.0)
        return np.column_stack([upper[:, 0], np.maximum(upper[:, 1], lower[:, 1])])

    # 15 % of the crest is 1.8 mm; the noise is 0.15 mm.
    just_under, just_over, clear = (mound_of(stepped(h), REST, 20.0, NOISY).flank for h in (1.7, 1.9, 6.0))
    assert just_under.value - just_over.value > 5.0
    assert abs(just_under.value - just_over.value) < 2 * max(just_under.std, just_over.std)
    assert clear.std < 0.5


@pytest.mark.parametrize("crest", [1.3, 2.0, 3.1, 6.0])
def test_no_flank_is_told_with_an_uncertainty_that_an_angle_cannot_have(crest):
    """Noise of a tenth of the crest or more, and a terrace at 15 % of it: the run may be next to nothing."""
    noisy = Reading(DEPTH, 0.3, 0.2, 15.0)
    for share in (0.1, 0.15, 0.2, 0.8, 0.85):
        upper, lower = heap(crest, 32.0, 20.0), heap(share * crest, 32.0, 60.0)
        found = mound_of(
            np.column_stack([upper[:, 0], np.maximum(upper[:, 1], lower[:, 1])]), REST, 20.0, noisy
        )
        assert np.isnan(found.flank.value) == np.isnan(found.flank.std)
        assert not found.flank.std > 0.5 * np.degrees(0.5)  # slope / 2 of its tangent is at most so much


@pytest.mark.parametrize("lean_deg", [-15.0, 10.0, 25.0])
def test_before_a_face_that_leans_the_mound_begins_where_it_meets_the_surface(lean_deg):
    """The same heap, moved to the face's place at 42 mm above the tip, is the same mound."""
    lean = np.tan(np.radians(lean_deg))
    upright = mound_of(heap(12.0, 32.0, 20.0), REST, 20.0, SHARP)
    place = 20.0 + lean * (DEPTH + 12.0)
    line = heap(12.0, 32.0, 20.0, face=place)
    rest = np.array([[-100.0, DEPTH], [300.0, DEPTH]])
    leaning = mound_of(line, rest, 20.0, Reading(DEPTH, 0.3, 0.003, 15.0, lean=lean))
    for part in ("crest", "face", "front", "flank", "slope", "area"):
        assert getattr(leaning, part).value == pytest.approx(getattr(upright, part).value, rel=1e-6), part
    assert leaning.face.value == pytest.approx(12.0, abs=1e-6)


def test_a_low_front_has_no_slope_but_a_place():
    found = mound_of(heap(2.0, 32.0, 30.0), REST, 20.0, NOISY)
    assert np.isnan(found.slope.value)
    assert np.isfinite(found.front.value)


def test_noise_comes_from_the_stated_or_from_the_still_end():
    rng = np.random.default_rng(2)
    stated = table([0.5] * 5, std=0.2)
    rest, seen = rest_of(lines_of(stated), DEPTH)
    assert seen
    assert reading_of(stated, rest, DEPTH).noise_mm == pytest.approx(0.2 * 2)
    shaken = table([0.5] * 5, noise=0.3, rng=rng).drop(columns="std_mm")
    noise = reading_of(shaken, rest_of(lines_of(shaken), DEPTH)[0], DEPTH).noise_mm
    assert noise == pytest.approx(0.3 * np.sqrt(2), rel=0.2)


def test_the_same_heap_agrees_and_one_a_tenth_higher_is_that_much_off():
    same = by_name(mound_metrics(case(), table([0.5] * 11))[0])
    for name, metric in same.items():
        assert metric.error == pytest.approx(0.0, abs=1e-6), name
        assert metric.agrees is True, name
    higher, rows = mound_metrics(case(), table([0.55] * 11))
    named = by_name(higher)
    assert named["surface_crest_end_mm"].error == pytest.approx(-0.05 * 50.0)
    assert named["surface_crest_end_mm"].agrees is False
    u = np.arange(1, 11) * 5.0
    assert named["surface_crest_mean_mm"].error == pytest.approx(-0.05 * u.mean(), rel=1e-3)
    assert named["surface_crest_rms_mm"].error == pytest.approx(0.05 * np.sqrt(np.mean(u**2)), rel=1e-3)
    assert rows is not None
    assert tuple(rows.columns) == MOUND_COLUMNS
    assert rows["source"].value_counts().to_dict() == {"experiment": 11, "model": 11}


def test_inputs_and_calibration_are_parts_of_the_uncertainty():
    measured = table([0.5] * 11)
    measured["calibration_std_mm"] = 0.002 * np.hypot(measured["x_mm"], measured["y_mm"])
    named = by_name(mound_metrics(case(drawn=(0.4, 0.6)), measured)[0])
    crest = named["surface_crest_end_mm"]
    assert crest.input_std == pytest.approx(0.1 * 50.0)
    assert crest.experiment_std == pytest.approx(np.hypot(0.2 * np.sqrt(2), 0.002 * 25.0), rel=1e-3)
    area = named["surface_area_end_mm2"]
    assert area.experiment_std >= 2 * 0.002 * area.experiment


def test_a_series_that_starts_late_takes_the_initial_surface_as_level_and_says_so():
    late = table([0.5] * 11)
    metrics, _ = mound_metrics(case(), late[late["frame"] > 3])
    assert all("taken as level" in metric.note for metric in metrics)
    assert by_name(metrics)["surface_crest_end_mm"].error == pytest.approx(0.0, abs=1e-6)
    assert mound_metrics(case(), late[late["u_mm"] > 100]) == ([], None)
