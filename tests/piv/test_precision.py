import numpy as np
import pytest

from ploughval.piv import correlate
from ploughval.piv.interpolate import spline_coefficients
from ploughval.piv.precision import interpolated_noise


@pytest.mark.parametrize("known", [True, False])
def test_predicted_standard_deviation_covers_the_errors(sand, known):
    shift, noise = np.array([0.3, -0.2]), 4.0
    points = sand.points(9)
    ratios = []
    for seed in range(3):
        first = sand.picture(noise=noise, seed=2 * seed)
        current = sand.picture(shift, noise=noise, seed=2 * seed + 1)
        tracks = correlate(first, current, points, noise=noise if known else None)
        assert tracks.valid.all()
        ratios.append((tracks.displacement - shift) / tracks.std)
    ratio = np.abs(np.concatenate(ratios))
    # About 400 independent subsets: 0.683 and 0.954 with a sampling error of 0.02 and 0.01.
    assert 0.62 < np.mean(ratio < 1) < 0.74
    assert 0.92 < np.mean(ratio < 2) < 0.98


def test_noise_doubles_and_so_does_the_prediction(sand):
    points = sand.points(30)
    std = [
        np.median(
            correlate(sand.picture(noise=s, seed=1), sand.picture((0.3, 0), noise=s, seed=2), points).std
        )
        for s in (2.0, 4.0)
    ]
    assert std[1] / std[0] == pytest.approx(2.0, rel=0.08)


@pytest.mark.parametrize("spline", [3, 5])
def test_interpolated_noise_agrees_with_interpolated_noise(spline):
    # 1 at the pixels; half-way what a half-pixel shift of white noise leaves (Monte Carlo, 1 %).
    gain = interpolated_noise(spline)
    assert gain[0] == pytest.approx(1.0, abs=1e-9)
    assert gain[-1] == pytest.approx(1.0, abs=1e-9)
    noise = np.random.default_rng(0).normal(size=(300, 300))
    c = spline_coefficients(noise, spline).astype(float)
    half = {3: np.array([1, 23, 23, 1]) / 48, 5: np.array([1, 237, 1682, 1682, 237, 1]) / 3840}[spline]
    values = {3: np.array([1, 4, 1]) / 6, 5: np.array([1, 26, 66, 26, 1]) / 120}[spline]
    along = np.apply_along_axis(np.convolve, 1, c, half, "valid")
    both = np.apply_along_axis(np.convolve, 0, along, values, "valid")
    assert both.var() == pytest.approx(gain[32], rel=0.02)
