"""Stated standard deviations cover the errors, and follow noise and texture."""

import numpy as np
import pytest

from ploughval.piv import correlate
from ploughval.piv.interpolate import basis_polynomials, spline_coefficients
from ploughval.piv.precision import noise_bound, residual_share


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
def test_interpolation_averages_noise_by_the_share_that_is_taken_off(spline):
    noise = np.random.default_rng(0).normal(size=(200, 200))
    c = spline_coefficients(noise, spline).astype(float)
    table, got = basis_polynomials(spline), []
    for x, y in np.random.default_rng(1).random((20, 2)):
        along = np.apply_along_axis(np.convolve, 1, c, (table @ x ** np.arange(spline + 1))[::-1], "valid")
        both = np.apply_along_axis(np.convolve, 0, along, (table @ y ** np.arange(spline + 1))[::-1], "valid")
        got.append(both.var())
    # 20 fractions of a pixel: the mean over them is good to 3 %.
    assert 1.0 + np.mean(got) == pytest.approx(residual_share(spline), rel=0.03)


def test_noise_of_a_picture_is_bounded_from_itself(sand):
    everywhere = np.ones(sand.shape, np.uint8)
    clean, noisy = (noise_bound(sand.picture(noise=s, kind=np.float32), everywhere) for s in (0.0, 6.0))
    assert noisy - clean == pytest.approx(36.0, rel=0.1)
    assert 0.0 < clean < 20.0
    air = sand.picture(noise=6.0, kind=np.float32)
    air[:150] = 255.0
    sandy = everywhere.copy()
    sandy[:150] = 0
    assert noise_bound(air, sandy) == pytest.approx(noisy, rel=0.15)
    assert noise_bound(air, 0 * sandy) == np.inf


def test_standard_deviation_is_that_of_the_sand_where_half_the_picture_is_air(sand):
    noise, shift, points = 12.0, np.array([0.3, -0.2]), sand.points(9)
    points = points[points[:, 1] > 130]
    mask = np.ones(sand.shape, bool)
    mask[:110] = False
    ratios = []
    for seed in range(4):
        pictures = [sand.picture(s, noise=noise, seed=2 * seed + k) for k, s in enumerate((None, shift))]
        for picture in pictures:
            picture[:110] = 255
        tracks = correlate(*pictures, points, mask=mask)
        ratios.append((tracks.displacement - shift) / tracks.std)
    ratio = np.abs(np.concatenate(ratios))
    ratio = ratio[np.isfinite(ratio).all(axis=1)]
    # Some 300 independent subsets: 0.683 and 0.954 with a sampling error of 0.03 and 0.013.
    assert 0.59 < np.mean(ratio < 1) < 0.77
    assert 0.91 < np.mean(ratio < 2) < 0.99
