"""Subsets that a shear band crosses, against closed forms and a numpy twin of the fitted correlation."""

import numpy as np
import pytest
from scipy.ndimage import spline_filter

from ploughval.axes import Status
from ploughval.piv import Description, correlate
from ploughval.piv.band import match_bands, starts_of, two_sides
from ploughval.piv.interpolate import (
    PAD,
    SlopeFilter,
    basis_polynomials,
    filtered,
    plain_planes,
    spline_coefficients,
)
from ploughval.piv.subsets import ALL_SEEN, Pair, Recipe

ANGLE = np.deg2rad(65.0)  # of the normal
NORMAL, ALONG = np.array([np.cos(ANGLE), np.sin(ANGLE)]), np.array([-np.sin(ANGLE), np.cos(ANGLE)])
JUMP, WIDTH = 4.0 * ALONG, 5.0
GRADIENT = np.array([[0.01, -0.004], [0.006, -0.008]])
ORIGIN = np.array([130.0, 110.0])


def profile(t):
    t = np.clip(t, -1.0, 1.0)
    return t * (15 - 10 * t**2 + 3 * t**4) / 16


def motion(points):
    """Exactly the motion that is fitted: two sides that share a gradient, and a band through the middle."""
    s = (points - ORIGIN) @ NORMAL / WIDTH
    return (points - ORIGIN) @ GRADIENT.T + profile(s)[:, None] * JUMP


def pair_of(first, current, subset=31):
    recipe = Recipe(subset, 1, 5, SlopeFilter.NARROW)
    planes = filtered(plain_planes(first, 5), recipe.slopes)
    usable = np.ones(first.shape, np.uint8)
    return Pair(planes, usable, spline_coefficients(current, 5), ALL_SEEN, recipe)


def sides_at(points):
    """Both sides' motion at points as parameters, (N, 2, 2, 3)."""
    out = np.zeros((len(points), 2, 2, 3))
    for side, sign in ((0, -0.5), (1, 0.5)):
        out[:, side, :, 0] = (points - ORIGIN) @ GRADIENT.T + sign * JUMP
        out[:, side, :, 1:] = GRADIENT * 15
    return out


@pytest.fixture(scope="module")
def found(sand):
    points = ORIGIN + np.array([[0.0, 0.0], [4.0, -3.0], [-3.0, 8.0], [6.0, 5.0], [-7.3, -6.6]])
    pair = pair_of(sand.picture(noise=1, seed=1), sand.picture(motion, noise=1, seed=2))
    return points, pair, match_bands(pair, points, starts_of(pair, points, sides_at(points)), 0.0)


def test_line_of_a_band_is_found_before_the_fit(sand):
    points = ORIGIN + np.array([[0.0, 0.0], [5.0, -4.0], [-3.0, 7.0]])
    pair = pair_of(sand.picture(), sand.picture(motion))
    starts = starts_of(pair, points, sides_at(points))[:, 0]
    distance = (ORIGIN - points) @ NORMAL
    turned = np.abs(np.angle(np.exp(1j * (starts[:, 8] - ANGLE))))
    assert turned.max() < np.deg2rad(16)  # directions stand 15 degrees apart
    assert np.abs(starts[:, 9] - distance).max() < 2.5  # half the band's width


def test_parameters_of_a_band_of_the_fitted_form_are_recovered(found):
    points, _, bands = found
    assert (bands.fit.status == Status.OK).all()
    p = bands.params
    # Rigid grains of up to 3 px radius smear a band of 10 px: its parameters are only nearly those put in.
    assert np.abs(np.angle(np.exp(1j * (p[:, 8] - ANGLE)))).max() < np.deg2rad(1.5)
    centre = np.floor(points + 0.5)
    assert np.abs(p[:, 9] - (ORIGIN - centre) @ NORMAL).max() < 0.25
    assert np.abs(p[:, 6:8] - JUMP).max() < 0.2
    assert np.abs(p[:, 10] - WIDTH).max() < 1.0
    moved = bands.fit.params[:, :, 0] + np.einsum(
        "nad,nd->na", bands.fit.params[:, :, 1:] / 15, points - centre
    )
    assert np.abs(moved - motion(points)).max() < 0.08


def correlation(first, current, centre, p, half=15):
    """Zero-mean normalised correlation of a subset that moves as parameters say, in plain numpy."""
    offset = np.arange(-half, half + 1.0)
    dx, dy = (a.ravel() for a in np.meshgrid(offset, offset))
    s = profile((dx * np.cos(p[8]) + dy * np.sin(p[8]) - p[9]) / p[10])
    x = centre[0] + dx + p[0] + p[2] * dx + p[3] * dy + p[6] * s
    y = centre[1] + dy + p[1] + p[4] * dx + p[5] * dy + p[7] * s
    c = np.pad(spline_filter(current.astype(float), 5, mode="mirror"), PAD, mode="reflect")
    table = basis_polynomials(5)
    ix, iy = np.floor(x).astype(int), np.floor(y).astype(int)
    wx, wy = (table @ (t - i) ** np.arange(6)[:, None] for t, i in ((x, ix), (y, iy)))
    g = sum(wy[j] * wx[i] * c[iy + j - 2 + PAD, ix + i - 2 + PAD] for j in range(6) for i in range(6))
    f = first[(centre[1] + dy).astype(int), (centre[0] + dx).astype(int)].astype(float)
    return np.corrcoef(f, g)[0, 1]


def test_fitted_correlation_is_that_of_its_numpy_twin_and_greatest(sand, found):
    points, _, bands = found
    first, current = sand.picture(noise=1, seed=1), sand.picture(motion, noise=1, seed=2)
    steps = np.array([0.2, 0.2, 0.02, 0.02, 0.02, 0.02, 0.3, 0.3, 0.1, 0.6, 1.5])
    for n, point in enumerate(points):
        centre, p = np.floor(point + 0.5), bands.params[n]
        best = correlation(first, current, centre, p)
        assert bands.fit.zncc[n] == pytest.approx(best, abs=1e-5)
        for k, step in enumerate(steps):
            for sign in (-1, 1):
                other = p.copy()
                other[k] += sign * step
                assert correlation(first, current, centre, other) < best


def test_trial_steps_at_the_border_leave_the_subset_as_it_was(sand):
    points = np.array([[14.0, 104.0], [12.0, 110.0], [16.0, 118.0]])

    def beside(p):
        return np.where((p[:, :1] + 0.3 * p[:, 1:]) < 46.0, [-3.0, 0.5], [0.4, 0.2])

    pair = pair_of(sand.picture(), sand.picture(beside))
    sides = np.zeros((3, 2, 2, 3))
    sides[:, 0, :, 0], sides[:, 1, :, 0] = [-3.0, 0.5], [0.4, 0.2]
    bands = match_bands(pair, points, starts_of(pair, points, sides), 0.0)
    for n in np.flatnonzero(bands.fit.status == Status.OK):
        again = match_bands(pair, points[n : n + 1], bands.params[n][None, None], 0.0)
        # From its own result a fit stays where it is, and finds the same correlation.
        assert again.fit.zncc[0] == pytest.approx(bands.fit.zncc[n], abs=2e-4)


def test_sides_are_the_two_groups_of_neighbours_carried_on():
    known = np.array([[x, y] for x in (0.0, 20.0, 40.0) for y in (0.0, 20.0, 60.0, 80.0)])
    params = np.zeros((len(known), 2, 3))
    upper = known[:, 1] < 40
    params[:, 0, 2] = np.where(upper, 0.15, 0.0)  # shear of 0.01 a px above
    params[:, :, 0] = np.where(upper[:, None], [3.0, 0.0], [0.0, 1.0])
    params[:, 0, 0] += np.where(upper, 0.01 * known[:, 1], 0.0)
    sides = two_sides(known, params, np.array([[20.0, 40.0]]), 15.0, 100.0)[0, :, :, 0]
    order = np.argsort(sides[:, 0])
    assert sides[order[0]] == pytest.approx([0.0, 1.0])
    assert sides[order[1]] == pytest.approx([3.4, 0.0])  # 3 + 0.01 x 40 at the point
    many = two_sides(known, params, np.tile([20.0, 40.0], (1200, 1)), 15.0, 100.0)
    np.testing.assert_array_equal(many, np.broadcast_to(many[:1], many.shape))  # however they are parted
    np.testing.assert_array_equal(many[0, :, :, 0], sides)


def test_points_at_a_border_that_a_band_reaches_are_right_or_refused(sand):
    def beside(p):
        return np.where(((p - [20.0, 110.0]) @ NORMAL > 0)[:, None], 3.0 * ALONG, [0.0, 0.0])

    points = np.array([[x, y] for x in (4.0, 9.0, 14.0, 20.0, 26.0) for y in np.arange(60.0, 165.0, 8.0)])
    grid = sand.points(12)
    tracks = correlate(
        sand.picture(noise=1, seed=1), sand.picture(beside, noise=1, seed=2), np.vstack([points, grid])
    )
    error = np.abs(tracks.displacement - beside(tracks.points)).max(axis=1)
    clear = np.abs((tracks.points - [20.0, 110.0]) @ NORMAL) > 3.0
    assert np.nanquantile(error[clear], 0.99) < 0.1
    assert np.mean(error[clear] > 0.5) < 0.005
    assert (tracks.description == Description.BAND).any() or (tracks.description == Description.SIDE).any()
