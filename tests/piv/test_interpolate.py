"""Splines through every pixel, their prefilter, and slopes whose noise is known."""

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.ndimage import spline_filter

from ploughval.piv.interpolate import (
    PAD,
    SlopeFilter,
    basis_polynomials,
    centred_polynomials,
    filter_taps,
    filtered,
    plain_planes,
    slope_noise,
    slope_taps,
    spline_coefficients,
)


@pytest.mark.parametrize("spline", [3, 5])
def test_basis_polynomials_are_the_b_spline(spline):
    table = basis_polynomials(spline)
    basis = BSpline.basis_element(np.arange(spline + 2) - (spline + 1) / 2)
    for t in (0.0, 0.3, 0.77):
        mine = table @ t ** np.arange(spline + 1)
        nodes = np.arange(spline + 1) - spline // 2
        distance = np.clip(t - nodes, -(spline + 1) / 2, (spline + 1) / 2)
        assert mine == pytest.approx(basis(distance), abs=1e-12)


@pytest.mark.parametrize("spline", [3, 5])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_spline_passes_through_every_pixel(spline, kind):
    image = np.random.default_rng(2).integers(0, 250, (30, 40)).astype(kind)
    c = spline_coefficients(image, spline).astype(float)
    value = basis_polynomials(spline)[:-1, 0]
    rows = np.apply_along_axis(np.convolve, 0, c, value, "same")
    both = np.apply_along_axis(np.convolve, 1, rows, value, "same")[PAD:-PAD, PAD:-PAD]
    assert np.abs(both - image).max() < 1e-3


@pytest.mark.parametrize("spline", [3, 5])
def test_coefficients_are_those_of_the_recursive_prefilter(spline):
    image = np.random.default_rng(2).integers(0, 250, (70, 90)).astype(np.uint8)
    exact = spline_filter(image.astype(float), order=spline, mode="mirror")
    # The impulse response is cut where it has fallen below 1e-7.
    assert np.abs(spline_coefficients(image, spline)[PAD:-PAD, PAD:-PAD] - exact).max() < 2e-3


@pytest.mark.parametrize("spline", [3, 5])
def test_one_half_of_the_polynomials_serves_both_sides(spline):
    table, half = basis_polynomials(spline), centred_polynomials(spline).astype(float)
    for t in (0.0, 0.3, 0.77, 1.0):
        u = (t - 0.5) ** np.arange(spline + 1)
        mine = np.concatenate([half @ u, (half @ (u * (-1.0) ** np.arange(spline + 1)))[::-1]])
        assert mine == pytest.approx(table @ t ** np.arange(spline + 1), abs=1e-7)


@pytest.mark.parametrize("spline", [3, 5])
def test_slope_taps_measure_the_slope_of_a_ramp(spline):
    taps = slope_taps(spline)
    assert taps @ (np.arange(taps.size) * 2.5) == pytest.approx(2.5, rel=1e-3)


@pytest.mark.parametrize("slopes", list(SlopeFilter))
def test_filters_leave_a_plain_alone_and_keep_its_place(slopes):
    taps = filter_taps(slopes)
    assert taps.sum() == pytest.approx(1.0)
    assert taps == pytest.approx(taps[::-1])


@pytest.mark.parametrize("slopes", list(SlopeFilter))
def test_planes_hold_the_slopes_of_a_plane_and_their_product(slopes):
    y, x = np.mgrid[:80, :90]
    planes = filtered(plain_planes((3.0 * x - 2.0 * y).astype(np.float32), 5), slopes)
    middle = (slice(30, 50), slice(30, 60))
    assert planes.slope_x[middle] == pytest.approx(3.0, abs=5e-3)
    assert planes.slope_y[middle] == pytest.approx(-2.0, abs=5e-3)
    if slopes is not SlopeFilter.PLAIN:
        assert planes.product[middle] == pytest.approx(13.0, abs=3e-2)


@pytest.mark.parametrize("slopes", list(SlopeFilter))
def test_noise_adds_to_the_product_of_slopes_what_is_taken_off(slopes):
    noise = np.random.default_rng(1).normal(0.0, 1.0, (500, 500)).astype(np.float32)
    plain = plain_planes(noise, 5)
    planes = filtered(plain, slopes)
    product = planes.slope_x * plain.slope_x + planes.slope_y * plain.slope_y
    assert product.mean() == pytest.approx(slope_noise(5, slopes), rel=0.02)
