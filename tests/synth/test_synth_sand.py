"""Grains and their pictures against integrals that were not computed by the code under test."""

import math

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.special import erf

from ploughval.synth import render_grains, sand_texture
from ploughval.synth.sand import Canvas


def plain_grains(positions, radii, amplitudes, shape):
    """The numpy twin of the kernel: every grain in every pixel, without a stencil."""
    image = np.zeros(shape)
    edges = [np.arange(n + 1) - 0.5 for n in shape]
    for (x, y), radius, amplitude in zip(positions, radii, amplitudes, strict=True):
        down, across = (
            np.diff(erf((edge - c) * math.sqrt(2) / radius)) / 2
            for edge, c in zip(edges, (y, x), strict=True)
        )
        image += amplitude * np.outer(down, across)
    return image


def test_a_grain_adds_up_to_its_amplitude():
    for radius in (0.6, 1.3, 3.0):
        image = render_grains([[20.3, 17.8]], radius, 250.0, (40, 45))
        # the stencil of 4.5 standard deviations leaves out 1.4e-5 of the light
        assert image.sum(dtype=float) == pytest.approx(250.0, rel=2e-5)


def test_pixels_equal_the_numerical_integral_of_the_profile_also_after_half_a_pixel():
    def profile(y, x):
        return 100.0 * 2 / (math.pi * 1.7**2) * math.exp(-2 * ((x - cx) ** 2 + (y - 10.4) ** 2) / 1.7**2)

    for cx in (12.0, 12.5):
        image = render_grains([[cx, 10.4]], 1.7, 100.0, (21, 25))
        for column, row in ((12, 10), (13, 11), (10, 9), (14, 10)):
            exact, _ = dblquad(profile, column - 0.5, column + 0.5, row - 0.5, row + 0.5, epsabs=1e-10)
            assert image[row, column] == pytest.approx(exact, rel=1e-6)  # float32


def test_the_kernel_equals_its_numpy_twin_also_across_the_border():
    rng = np.random.default_rng(3)
    positions = rng.uniform(-6, 46, (300, 2))
    radii, amplitudes = rng.uniform(1.0, 3.5, 300), rng.normal(0, 200, 300)
    image = render_grains(positions, radii, amplitudes, (37, 41))
    # 300 grains cut at 4.5 standard deviations: at most 4e-5 of each peak is missing
    np.testing.assert_allclose(image, plain_grains(positions, radii, amplitudes, (37, 41)), atol=0.02)


def test_drawing_again_what_moved_gives_the_pixels_of_drawing_all():
    rng = np.random.default_rng(4)
    positions = rng.uniform(-8, 208, (4000, 2))
    radii, amplitudes = rng.uniform(1.0, 3.5, 4000), rng.normal(0, 200, 4000)
    canvas = Canvas(radii, amplitudes, (170, 200))
    canvas.draw(positions)
    for few in (slice(0, 0), slice(7, 30), slice(0, 900), slice(None)):
        positions = positions.copy()
        positions[few] += rng.normal(0, 20, positions[few].shape)
        positions[5] = np.nan
        again = canvas.draw(positions)
        assert np.array_equal(again, render_grains(positions, radii, amplitudes, (170, 200)))


def test_a_whole_pixel_shift_moves_the_pixels_and_nothing_else():
    grains = sand_texture(np.random.default_rng(5), (60, 80))
    before, after = grains.picture((60, 80)), grains.moved((7.0, -3.0)).picture((60, 80))
    np.testing.assert_allclose(after[:-3, 7:], before[3:, :-7], atol=1e-3)  # float32 sums in another place


def test_grains_that_are_not_finite_are_left_out():
    positions = np.array([[5.0, 5.0], [np.nan, 5.0], [5.0, np.inf]])
    image = render_grains(positions, 1.5, 10.0, (11, 11))
    assert np.array_equal(image, render_grains(positions[:1], 1.5, 10.0, (11, 11)))


def test_no_grains_give_a_black_picture_and_no_radius_is_refused():
    assert not render_grains(np.empty((0, 2)), 1.0, 1.0, (4, 5)).any()
    with pytest.raises(ValueError, match="radii_px"):
        render_grains([[1.0, 1.0]], 0.0, 1.0, (4, 4))


def test_the_texture_has_the_stated_grey_and_contrast():
    image = sand_texture(np.random.default_rng(11), (300, 400)).picture((300, 400))
    assert image.mean() == pytest.approx(140, abs=2)
    assert image.std() == pytest.approx(28, abs=2)
    assert image[:40].std() == pytest.approx(28, abs=4)  # no empty border
    assert image[:, -40:].std() == pytest.approx(28, abs=4)


def test_the_same_seed_gives_the_same_grains_and_another_seed_does_not():
    first, again, other = (sand_texture(np.random.default_rng(s), (50, 50)) for s in (1, 1, 2))
    assert np.array_equal(first.picture((50, 50)), again.picture((50, 50)))
    assert not np.array_equal(first.picture((50, 50)), other.picture((50, 50)))
