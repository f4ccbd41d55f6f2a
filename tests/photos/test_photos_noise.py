"""Noise against grey level, from pairs of pictures made with noise that is known."""

import io
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from ploughval.errors import DataError
from ploughval.photos.noise import noise_curve
from ploughval.photos.reading.decode import decode
from ploughval.synth import sand_texture

CLAY = Path(os.environ.get("PLOUGHVAL_SHARED", Path(__file__).parents[3] / "shared"))
CLAY = CLAY / "realdata" / "tbar_clay_geopyv"
SHAPE = (400, 500)
ROUNDING = 1 / 12  # variance of rounding to whole levels


def sand(generator, low=20.0, high=230.0):
    """Grains 3 px wide under light that changes over 40 px."""
    grains, light = (cv2.GaussianBlur(generator.normal(size=SHAPE), (0, 0), width) for width in (1.5, 40.0))
    picture = (low + high) / 2 + 25 * grains / grains.std() + 40 * light / light.std()
    return picture.clip(low, high)


def photograph(generator, scene, gain, floor, top=255):
    noise = np.sqrt(gain * scene + floor) * generator.normal(size=scene.shape)
    return (scene + noise).round().clip(0, top).astype(np.uint8 if top == 255 else np.uint16)


def pair(seed, gain, floor, **options):
    generator = np.random.default_rng(seed)
    scene = sand(generator)
    return [photograph(generator, scene, gain, floor, **options) for _ in range(2)]


@pytest.mark.parametrize(("gain", "floor"), [(0.05, 1.0), (0.02, 0.2), (0.0, 4.0), (0.2, 0.0)])
def test_the_curve_and_its_line_are_found_within_their_uncertainty(gain, floor):
    ratios, lines = [], []
    for seed in range(6):
        curve = noise_curve(*pair(seed, gain, floor))
        truth = np.sqrt(gain * curve.grey + floor + ROUNDING)
        ratios.append((curve.std - truth) / curve.std_std)
        lines.append(
            [(curve.gain - gain) / curve.gain_std, (curve.floor - floor - ROUNDING) / curve.floor_std]
        )
        np.testing.assert_allclose(
            curve.std, truth, rtol=0.06
        )  # 8 000 pixels a class: 0.9 % each, and rounding
        assert curve.misfit < 2
    ratios = np.concatenate(ratios)
    assert np.mean(np.abs(ratios) <= 2) >= 0.87  # 95 % but for rounding of noise below one level
    assert np.abs(lines).max() < 4.5


def test_16_bit_noise_is_found_in_levels_of_16_bits():
    generator = np.random.default_rng(4)
    scene = 200 * sand(generator)
    curve = noise_curve(*(photograph(generator, scene, 3.0, 400.0, top=65535) for _ in range(2)))
    assert abs(curve.gain - 3.0) < 3.5 * curve.gain_std
    np.testing.assert_allclose(curve.level(scene), np.sqrt(3 * scene + 400), rtol=0.05)


def test_sand_that_moved_does_not_count():
    generator = np.random.default_rng(3)
    scene = sand(generator)
    moved = scene.copy()
    moved[100:220, 150:350] = np.roll(scene[100:220, 150:350], 3, axis=1)
    curve = noise_curve(photograph(generator, scene, 0.05, 1), photograph(generator, moved, 0.05, 1))
    np.testing.assert_allclose(curve.std, np.sqrt(0.05 * curve.grey + 1 + ROUNDING), rtol=0.04)


def test_a_mask_leaves_out_what_it_covers():
    generator = np.random.default_rng(3)
    scene = sand(generator)
    first, second = (photograph(generator, scene, 0.05, 1) for _ in range(2))
    second[:, :300] = np.roll(second[:, :300], 5, axis=0)  # more than half
    still = np.zeros(SHAPE, bool)
    still[:, 310:] = True
    curve = noise_curve(first, second, still)
    np.testing.assert_allclose(curve.std, np.sqrt(0.05 * curve.grey + 1 + ROUNDING), rtol=0.06)


@pytest.mark.parametrize("shift_px", [0.0, 0.125])
def test_light_that_flickers_and_a_small_shake_are_taken_off(shift_px):
    generator = np.random.default_rng(6)
    fine = cv2.GaussianBlur(generator.normal(size=(8 * 300, 8 * 400)).astype(np.float32), (0, 0), 12)
    fine = 128 + 30 * (fine - fine.mean()) / fine.std()

    def scene(steps):
        return cv2.resize(np.roll(fine, steps, 1), (400, 300), interpolation=cv2.INTER_AREA).astype(float)

    first = photograph(generator, scene(0), 0.02, 1)
    second = photograph(generator, 1.02 * scene(round(8 * shift_px)) + 1, 0.02, 1)
    curve = noise_curve(first, second)
    ratio = curve.std / np.sqrt(0.02 * curve.grey + 1 + ROUNDING)
    assert abs(ratio.mean() - 1) < 0.02  # 1.02 of light alone makes half of this


def test_clipped_levels_are_left_out():
    generator = np.random.default_rng(2)
    scene = 3 * sand(generator) - 250  # black and white over wide parts
    curve = noise_curve(*(photograph(generator, scene.clip(0, 255), 0.0, 9.0) for _ in range(2)))
    assert curve.grey.min() > 9
    assert curve.grey.max() < 246
    np.testing.assert_allclose(curve.std, np.sqrt(9 + ROUNDING), rtol=0.05)


def test_12_bits_in_16_are_clipped_at_their_own_end():
    generator = np.random.default_rng(2)
    scene = (40 * sand(generator) - 3500).clip(0, 4095)
    pictures = [photograph(generator, scene, 0.0, 900.0, top=4095).astype(np.uint16) for _ in range(2)]
    curve = noise_curve(*pictures)
    assert curve.grey.max() < 4095 - 90
    np.testing.assert_allclose(curve.std, 30, rtol=0.06)


@pytest.mark.parametrize("quality", [98, 95, 90, 80])
def test_what_jpeg_repeats_is_not_seen_and_the_rest_is(quality):
    generator = np.random.default_rng(1)
    scene = sand(generator)
    first, second = (through_jpeg(photograph(generator, scene, 0.05, 1), quality) for _ in range(2))
    inside = (scene > 40) & (scene < 210)
    repeat = np.std((first.astype(float) - second)[inside]) / np.sqrt(2)
    error = np.sqrt(np.mean((first - scene)[inside] ** 2))
    found = noise_curve(first, second).level(scene[inside]).mean()
    assert found == pytest.approx(repeat, rel=0.04)
    assert 0.85 * error < found < 1.02 * error  # at quality 80 a tenth of the error is the same in both


@pytest.mark.skipif(not CLAY.is_dir(), reason="the shared photographs are not here")
def test_real_photographs_give_the_same_curve_in_every_pair():
    first, second, third = (decode(path) for path in sorted(CLAY.glob("*.jpg"))[:3])
    one, other = noise_curve(first, second), noise_curve(second, third)
    np.testing.assert_allclose(one.std, other.level(one.grey), rtol=0.05)
    assert 1.0 < one.level(np.array([150.0])).item() < 3.0  # a camera's JPEG in good light: about two levels


def through_jpeg(picture, quality):
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=quality)
    return np.asarray(Image.open(file))


def test_the_floor_of_a_curve_that_bends_down_has_no_root():
    generator = np.random.default_rng(9)
    scene = sand(generator)
    first, second = (
        (scene + 0.02 * scene * generator.normal(size=SHAPE)).round().astype(np.uint8) for _ in range(2)
    )
    curve = noise_curve(first, second)  # std proportional to grey: variance is no line
    assert curve.misfit > 2
    assert np.isnan(curve.read_std)
    np.testing.assert_allclose(
        curve.level(curve.grey), np.sqrt((0.02 * curve.grey) ** 2 + ROUNDING), rtol=0.06
    )


def test_what_cannot_be_measured_is_refused():
    first, second = pair(0, 0.05, 1)
    with pytest.raises(DataError, match="same picture twice"):
        noise_curve(first, first)
    with pytest.raises(DataError, match="two grey pictures alike"):
        noise_curve(first, second[:-1])
    with pytest.raises(DataError, match="2000 still pixels"):
        noise_curve(first, second, np.zeros(SHAPE, bool))
    with pytest.raises(DataError, match="at least 13 rows"):
        noise_curve(first[:8], second[:8])


@pytest.mark.parametrize(("shift_px", "excess"), [(0.0, 0.03), (0.2, 0.06), (0.5, 0.2)])
def test_fine_sand_that_a_shake_moves_is_hardly_taken_for_noise(shift_px, excess):
    grains, generator = sand_texture(np.random.default_rng(3), (240, 400)), np.random.default_rng(4)
    first, second = (
        np.rint(grains.moved((along, 0.0)).picture((240, 400)) + generator.normal(0, 2.0, (240, 400)))
        for along in (0.0, shift_px)
    )
    curve = noise_curve(first.clip(0, 255).astype(np.uint8), second.clip(0, 255).astype(np.uint8))
    found = curve.level(np.array(140.0))
    assert abs(found / np.hypot(2.0, 12**-0.5) - 1) < excess
