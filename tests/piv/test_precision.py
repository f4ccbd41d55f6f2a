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
    clean, noisy = (noise_bound(sand.picture(noise=s, kind=np.float32)) for s in (0.0, 6.0))
    assert noisy - clean == pytest.approx(36.0, rel=0.1)
    assert 0.0 < clean < 20.0
