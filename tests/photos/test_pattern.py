"""Grain size from the autocorrelation: closed form for Gaussian grains, noise, layers, what is refused."""

import numpy as np
import pytest

from ploughval.photos.pattern import LAGS, Texture, pattern_of, texture_of
from ploughval.synth import render_grains, sand_texture

SHAPE = (600, 1400)
ROUNDING = 1 / np.sqrt(12)


def strewn(std_px, *, seed=3, noise=0.0, contrast=25.0, shape=SHAPE):
    """8-bit picture of Gaussian grains of one standard deviation, strewn at random (Poisson)."""
    rng = np.random.default_rng(seed)
    height, width = shape
    count = int(0.25 * height * width / std_px**2)
    places = rng.uniform([-40, -40], [width + 40, height + 40], (count, 2))
    light = render_grains(places, np.full(count, 2 * std_px), rng.normal(size=count), shape)
    grey = light / light.std() * contrast + 120 + noise * rng.normal(size=shape)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


def closed_form_px(std_px):
    """docs/good-practice.md, Eq. (2), with the pixel's own width of variance 1/12."""
    return 4 * np.sqrt(np.log(2) * (std_px**2 + 1 / 12))


def measured(image, noise=None, sand=None):
    return pattern_of(texture_of(image, np.ones(image.shape, bool) if sand is None else sand), noise)


@pytest.mark.parametrize("std_px", [0.8, 1.0, 1.5, 2.0, 3.0, 5.0])
@pytest.mark.parametrize("noise", [0.0, 4.0])
def test_gaussian_grains_have_the_width_of_the_closed_form_within_2_percent(std_px, noise):
    found = measured(strewn(std_px, noise=noise), np.hypot(noise, ROUNDING))
    # 16 squares of 128 px hold few grains of 5 px: three standard uncertainties of their scatter are allowed
    assert found.size_px == pytest.approx(closed_form_px(std_px), rel=0.02, abs=3 * found.size_std_px)
    assert found.contrast_grey == pytest.approx(25.0, rel=0.05)


def test_noise_that_is_not_told_is_recognised_within_2_percent_of_the_size():
    found = measured(strewn(1.2, noise=8.0))
    assert found.size_px == pytest.approx(closed_form_px(1.2), rel=0.02)
    assert found.contrast_grey == pytest.approx(25.0, rel=0.05)


def test_stated_uncertainty_covers_the_scatter_between_pictures():
    found = [measured(strewn(2.0, seed=seed)) for seed in range(12)]
    off = np.array([f.size_px - closed_form_px(2.0) for f in found]) / [f.size_std_px for f in found]
    assert (np.abs(off) < 3).all()
    assert 0.4 < off.std() < 1.8  # 12 values of a standard deviation of 1: 99 % lie within


def test_grains_are_wide_along_the_rows_where_they_are_stretched():
    stretched = np.repeat(strewn(1.5, shape=(600, 700)), 2, axis=1)
    found = measured(stretched)
    assert found.across_px / found.down_px == pytest.approx(2.0, rel=0.05)


def test_level_layers_of_another_grey_do_not_change_the_size():
    image = strewn(1.5)
    striped = image.copy()
    striped[::12] -= 25
    striped[1::12] -= 25
    assert measured(striped).size_px == pytest.approx(measured(image).size_px, rel=0.01)


def test_slope_of_the_light_does_not_change_the_size():
    image = strewn(1.5, contrast=12.0)
    lit = np.clip(image + np.linspace(-60, 60, SHAPE[1]), 0, 255).astype(np.uint8)
    assert measured(lit).size_px == pytest.approx(measured(image).size_px, rel=0.01)


def test_size_scales_with_the_picture():
    image = strewn(1.5)
    doubled = np.repeat(np.repeat(image, 2, axis=0), 2, axis=1)
    assert measured(doubled).size_px == pytest.approx(2 * measured(image).size_px, rel=0.03)


def test_made_sand_lies_between_its_least_and_greatest_grain():
    rng = np.random.default_rng(5)
    picture = sand_texture(rng, (400, 600), diameter_px=(2.5, 6.0)).picture((400, 600))
    found = measured(np.rint(picture).astype(np.uint8))
    # 1 / e^2 diameters d: Gaussians of std d / 4, of which docs/good-practice.md, Eq. (2) makes 0.83 d
    assert closed_form_px(2.5 / 4) < found.size_px < closed_form_px(6.0 / 4)


def test_only_sand_is_looked_at():
    image = strewn(1.5)
    sand = np.zeros(SHAPE, bool)
    sand[300:] = True
    half = image.copy()
    half[:300] = strewn(4.0)[:300]
    assert measured(half, sand=sand).size_px == measured(image, sand=sand).size_px


def test_16_bit_pictures_have_the_same_size():
    image = strewn(1.5)
    assert measured(image.astype(np.uint16) * 200).size_px == pytest.approx(measured(image).size_px, rel=1e-9)


def test_small_sand_is_measured_on_smaller_squares():
    sand = np.zeros(SHAPE, bool)
    sand[100:170, 100:300] = True
    found = measured(strewn(1.0), sand=sand)
    assert found.side_px == 32  # three of 48 px are too few
    assert found.size_px == pytest.approx(closed_form_px(1.0), rel=0.1)


def test_no_sand_gives_no_pattern():
    assert measured(strewn(1.0), sand=np.zeros(SHAPE, bool)) is None
    assert measured(strewn(1.0)[:20, :20]) is None


@pytest.mark.parametrize("noise", [None, 30.0])
def test_white_noise_has_no_size(noise):
    rng = np.random.default_rng(1)
    image = np.clip(120 + 30 * rng.normal(size=(400, 400)), 0, 255).astype(np.uint8)
    found = measured(image, noise)
    assert np.isnan(found.size_px)
    assert np.isnan(found.size_std_px)


def test_even_grey_has_no_size():
    assert np.isnan(measured(np.full((300, 300), 90, np.uint8)).size_px)


def test_grains_too_wide_for_the_lags_have_no_size():
    constant = Texture(np.ones((4, 2, LAGS)), np.full(4, 100.0), 128)
    assert np.isnan(pattern_of(constant).size_px)
