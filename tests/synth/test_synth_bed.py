"""The bed of grains: nothing in the blade, nothing in the air, and the truth's own motion."""

from dataclasses import replace

import numpy as np
import pytest

from ploughval.errors import ConfigError
from ploughval.synth import SynthOptions
from ploughval.synth.bed import fill_bed
from ploughval.synth.motion import Trench, plan_motion
from ploughval.synth.view import View, expose, frame_view, light_field

OPTIONS = SynthOptions(displacement_mm=6.0, frames=4)


@pytest.fixture
def scene_of_grains(toy_history):
    history = toy_history(displacement=6.0)
    frames = np.linspace(0.0, 6.0, 4)
    motion = plan_motion(history.increments, history.surface, frames, Trench(30.0, 5.0, 32.0))
    view = frame_view(motion, OPTIONS)
    return motion, view, fill_bed(np.random.default_rng(1), view, motion, OPTIONS)


def test_grains_follow_the_truth_until_they_avalanche(scene_of_grains):
    motion, _, bed = scene_of_grains
    truth = motion.positions(bed.positions_mm)
    for frame, steps in enumerate(motion.frame_steps):
        bed.advance(motion, int(steps), np.random.default_rng(2))
        kept = ~bed.avalanched
        np.testing.assert_array_equal(bed.positions_mm[kept], truth[frame, kept])
        assert np.isnan(truth[frame, ~kept]).all()
    assert 50 < (~kept).sum() < 0.2 * len(kept)


def test_no_grain_is_lost_or_stands_in_the_blade_or_in_the_air(scene_of_grains):
    motion, _, bed = scene_of_grains
    count = len(bed.positions_mm)
    for steps in motion.frame_steps[1:]:
        bed.advance(motion, int(steps), np.random.default_rng(2))
        u = (motion.u_mm + motion.du_mm)[steps - 1]
        x, y = bed.positions_mm.T
        assert not np.any((x > u - 5.0) & (x < u - 1e-9) & (y > 0))
        ahead, behind = x >= u, x <= u - 5.0
        assert np.all(y[ahead] <= np.interp(x[ahead], *motion.surfaces[steps].T) + motion.skin_mm)
        assert np.all(y[behind] <= np.interp(x[behind], *motion.trench.profile(u).T) + motion.skin_mm)
    assert len(bed.positions_mm) == count
    assert np.isfinite(bed.positions_mm).all()


def test_avalanched_sand_is_as_dense_as_the_bed(scene_of_grains):
    motion, view, bed = scene_of_grains
    bed.advance(motion, len(motion), np.random.default_rng(2))
    x, y = bed.positions_mm.T
    fresh = (x > -4.0) & (x < 0.8) & (y > 0)  # the trench: nothing but slumped sand
    profile = motion.trench.profile(6.0)
    places = np.linspace(-4.0, 0.8, 1001)
    area_px = np.trapezoid(np.interp(places, *profile.T), places) / view.mm_per_px**2
    density = bed.areas_px[fresh].sum() / area_px
    assert bed.avalanched[fresh].all()
    assert density == pytest.approx(1.0, abs=0.1)  # about 400 grains of uneven size


def test_greys_of_sand_air_and_layers_and_the_height_of_the_surface(scene_of_grains):
    _, view, bed = scene_of_grains
    picture = bed.canvas(view.shape, 45.0).draw(view.to_px(bed.positions_mm)) + 45.0
    columns = slice(80, view.shape[1])
    rows = {height: round(view.to_px(np.array([[0.0, height]]))[0, 1]) for height in (-3, 10, 12.5, 35)}
    assert picture[rows[35], columns].mean() == pytest.approx(45.0, abs=0.1)
    assert picture[rows[-3], columns].mean() == pytest.approx(140.0, abs=12)  # one row of 340 px, sd 28
    assert picture[rows[10], columns].mean() < 0.75 * picture[rows[12.5], columns].mean()
    profile = picture[:, columns].mean(axis=1)
    level = (45.0 + profile[rows[-3] - 10 : rows[-3]].mean()) / 2
    surface_row = np.interp(level, profile[: rows[12.5]], np.arange(rows[12.5]))
    expected = view.to_px(np.array([[0.0, 30.0]]))[0, 1]
    # centres end at the surface; the uneven greys of 340 columns move its mean by about 0.1 px
    assert surface_row == pytest.approx(expected, abs=0.35)


def test_margins_widen_the_frame_and_leave_the_sand_where_it_was(scene_of_grains):
    motion, view, _ = scene_of_grains
    wide = frame_view(motion, replace(OPTIONS, above_mm=37.5, below_mm=25.5, ahead_mm=42.0, behind_mm=24.0))
    # 0.3 mm/px; without margins stated they are 7.5, 7.5, 12 and 12 mm: 100, 60, 100 and 40 px more
    np.testing.assert_allclose(np.subtract(wide.tip_px, view.tip_px), (40.0, 100.0), atol=0.1)
    np.testing.assert_allclose(np.subtract(wide.shape, view.shape), (160, 140), atol=1)  # whole pixels
    with pytest.raises(ConfigError, match="above_mm"):
        replace(OPTIONS, above_mm=-1.0)


def test_the_blade_covers_exactly_its_share_of_each_pixel():
    view = View((40, 60), (20.3, 30.6), 0.5)
    cover = view.blade_cover(2.6, 5.0)  # face at 20.3 + 5.2 = 25.5, back at 15.5, tip at 30.6
    assert cover.sum() == pytest.approx(10.0 * 31.1)
    assert cover[10, 15:27].tolist() == [0.0, *[1.0] * 10, 0.0]
    assert cover[31, 20] == pytest.approx(0.1, abs=1e-6)
    assert view.blade_cover(2.7, 5.0)[10, 26] == pytest.approx(0.2, abs=1e-6)


def test_light_falls_to_the_corners_and_changes_slowly_across():
    light = light_field((101, 201), vignetting=0.1, gradient=0.04)
    assert light[50, 100] == pytest.approx(1.0)
    assert light[0, 0] == pytest.approx(0.9 * 0.98)
    assert light[50, 200] - light[50, 0] == pytest.approx(0.04 * 0.95)


def test_noise_has_its_standard_deviation_on_8_and_16_bit():
    flat = np.full((300, 300), 120.0, dtype=np.float32)
    for bits, per_grey in ((8, 1.0), (16, 257.0)):
        levels = expose(flat, np.random.default_rng(1), noise_grey=2.0, bit_depth=bits)
        assert levels.dtype == np.dtype(f"uint{bits}")
        assert levels.mean() / per_grey == pytest.approx(120.0, abs=0.05)
        # rounding to whole greys adds 1/12 to the variance at 8 bit
        assert levels.std() / per_grey == pytest.approx((4 + (bits == 8) / 12) ** 0.5, rel=0.01)
