"""Motion that is far, turned or torn, and hints that are wrong."""

import numpy as np
import pytest

from ploughval.axes import Status
from ploughval.piv import correlate

WRONG_PX = 0.5  # a vector that errs by more is wrong: a hundred times what clean sand gives
SIGMAS = 6.0  # the largest of some hundred normal errors is 3.5; those of textures scatter more
ALIAS_PX = 0.006  # of clean 8 bit sand: grains down to 0.6 px standard deviation alias
SHIFT = (1.3, -0.6)


def turned(angle_deg, shift=(0.0, 0.0)):
    c, s = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    gradient = np.array([[c, -s], [s, c]]) - np.eye(2)
    return (lambda p: (p - [130, 110]) @ gradient.T + shift), gradient


@pytest.mark.parametrize("angle", [-15, 15])
@pytest.mark.parametrize("shift", [(0.0, 0.0), (25.4, -14.2)])
def test_rotation_of_15_degrees_is_found_without_hints(sand, angle, shift, errors, assert_none_wrong):
    motion, gradient = turned(angle, shift)
    points = sand.points(12)
    tracks = correlate(sand.picture(), sand.picture(motion), points)
    arrived = points + motion(points)
    inside = ((arrived > 24) & (arrived < np.array(sand.shape[::-1]) - 25)).all(axis=1)
    assert tracks.valid[inside].all()
    # First order describes a rotation exactly: rounding and aliasing are left.
    assert np.nanmax(errors(tracks, motion(points))[inside]) < 0.03
    assert (
        np.abs(tracks.gradient[inside] - gradient).max() < 0.01
    )  # 0.03 px over the 15 px to the rim, fivefold
    assert_none_wrong(tracks, motion(points))


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("shift", [(45.3, -10.6), (30.2, 60.4), (-52.0, 3.5)])
def test_few_points_far_beyond_the_subset_need_no_neighbours(sand, shift, count):
    points = np.array([[128.0, 112.0], [110.0, 96.0], [141.0, 99.0]])[:count]
    tracks = correlate(sand.picture(noise=5, seed=1), sand.picture(shift, noise=5, seed=2), points)
    assert tracks.valid.all()
    assert np.abs(tracks.displacement - shift).max() < SIGMAS * 0.0145  # noise 5: 0.0145 px (test_precision)


@pytest.mark.parametrize("shift", [(-80.2, 40.1), (90.5, 5.5), (120.3, 70.2)])
def test_displacement_beyond_the_search_is_refused_not_guessed(sand, shift, assert_none_wrong):
    for seed in range(4):
        points = np.random.default_rng(seed).uniform([90, 80], [170, 140], (20, 2))
        tracks = correlate(
            sand.picture(noise=5, seed=2 * seed + 1), sand.picture(shift, noise=5, seed=2 * seed + 2), points
        )
        assert_none_wrong(tracks, shift)


def test_blocks_that_part_by_40_px_are_both_found_and_nothing_between(sand, assert_honest, errors):
    def motion(p):
        return np.where(p[:, :1] < 130, [-20.3, 3.2], [20.4, -5.1])

    points = sand.points(10, margin=38)
    tracks = correlate(sand.picture(), sand.picture(motion), points)
    clear = np.abs(points[:, 0] - 130) > 18
    assert tracks.valid[clear].all()
    assert np.nanmax(errors(tracks, motion(points))[clear]) < 0.02
    # Grains of up to 3 px radius lie across the cut: beside it, either block's motion, but none between.
    error, cut = errors(tracks, motion(points)), np.abs(points[:, 0] - 130) <= 3
    other = motion(260.0 - points)
    error[cut] = np.fmin(error, errors(tracks, other))[cut]
    assert_honest(tracks)
    bad = error > np.maximum(WRONG_PX, 2.0 * tracks.std.max(axis=1))
    assert not bad.any(), (
        f"{points[bad].tolist()} {tracks.displacement[bad].round(2)} +- {tracks.std[bad].round(2)}"
    )


@pytest.mark.parametrize(("normal", "shear"), [(0.1, 0.0), (0.0, 0.3), (-0.1, 0.2)])
def test_large_strain_between_frames_is_followed_or_refused(sand, normal, shear, assert_none_wrong):
    gradient = np.array([[normal, shear], [0.0, -normal]])

    def motion(p):
        return (p - [130, 110]) @ gradient.T

    points = sand.points(12)
    tracks = correlate(sand.picture(), sand.picture(motion), points)
    assert_none_wrong(tracks, motion(points), px=0.1)
    assert tracks.valid.mean() > 0.9


@pytest.mark.parametrize("off", [(5.0, 5.0), (50.0, -40.0), (1e5, 1e5)])
def test_wrong_hints_of_some_points_are_mended_by_their_neighbours(sand, off, assert_none_wrong):
    points = sand.points(12)
    guess = np.tile(SHIFT, (len(points), 1))
    guess[::7] += off
    tracks = correlate(sand.picture(), sand.picture(SHIFT), points, guess=guess)
    assert_none_wrong(tracks, SHIFT, px=ALIAS_PX)
    assert tracks.valid.all(), f"{[Status(s).name for s in np.unique(tracks.status)]}"


def test_wild_hints_give_no_wrong_vectors(sand, assert_none_wrong):
    points, rng = sand.points(14), np.random.default_rng(5)
    for guess in (rng.normal(0, 30, points.shape), np.full(points.shape, 1e300), np.full(points.shape, -1e4)):
        assert_none_wrong(correlate(sand.picture(), sand.picture(SHIFT), points, guess=guess), SHIFT)
