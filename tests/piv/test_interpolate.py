import numpy as np
import pytest
from scipy.interpolate import BSpline

from ploughval.piv.interpolate import PAD, basis_polynomials, node_taps, spline_coefficients


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
    value = node_taps(spline)[0]
    rows = np.apply_along_axis(np.convolve, 0, c, value, "same")
    both = np.apply_along_axis(np.convolve, 1, rows, value, "same")[PAD:-PAD, PAD:-PAD]
    assert np.abs(both - image).max() < 1e-3


@pytest.mark.parametrize("smooth_px", [0.0, 0.7])
def test_slope_taps_measure_the_slope_of_a_ramp(smooth_px):
    # Coefficients of a straight line are its values, and smoothing does not bend it.
    _, smooth, slope, plain = node_taps(5, smooth_px)
    ramp = np.arange(slope.size) * 2.5
    assert slope @ ramp == pytest.approx(2.5)
    assert plain @ ramp == pytest.approx(2.5)
    assert smooth.sum() == pytest.approx(1.0)
