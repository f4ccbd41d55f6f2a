"""Flat, saturated, repeated and unrelated texture: refused with a reason, or measured and right."""

import numpy as np
import pytest

from ploughval.axes import Status
from ploughval.piv import correlate
from ploughval.synth.sand import Grains, sand_texture

WRONG_PX = 0.5  # a vector that errs by more is wrong: a hundred times what clean sand gives
ALIAS_PX = 0.006  # of clean 8 bit sand: grains down to 0.6 px standard deviation alias
SHIFT = (1.3, -0.6)


# Saturated and flat patches


@pytest.mark.parametrize("noise", [0, 1])
@pytest.mark.parametrize("grey", [0, 128, 255])
def test_flat_patch_is_refused_and_the_sand_around_it_is_measured(
    sand, grey, noise, errors, assert_none_wrong, noisy
):
    shift, points, rng = (2, -1), sand.points(6), np.random.default_rng(1)
    first, current = sand.picture(), sand.picture(shift)
    first[80:150, 90:170] = grey
    current[79:149, 92:172] = grey  # whole px: the patch moves with the sand, exactly
    tracks = correlate(noisy(first, rng, noise), noisy(current, rng, noise), points)
    depth = np.min([points[:, 0] - 90, 169 - points[:, 0], points[:, 1] - 80, 149 - points[:, 1]], axis=0)
    assert not tracks.valid[depth >= 16].any()  # nothing but the patch in the subset
    if noise == 0:
        assert (tracks.status[depth >= 16] == Status.FLAT).all()
    clear = depth < -16  # nothing but sand
    assert tracks.valid[clear].all()
    # Noise 1 of contrast 28 allows 0.003 px (test_sequence), six times that.
    assert np.nanmax(errors(tracks, shift)[clear]) < (0.02 if noise else 0.001)
    # At the patch's rim a row or two of sand and much noise are all that a subset holds.
    assert_none_wrong(tracks, shift, share=0.005 if noise else 0.0)


@pytest.mark.parametrize("grey", [128, 255])
def test_glare_that_stands_still_over_moving_sand_hardly_gives_a_third_motion(
    sand, grey, assert_honest, errors
):
    points = sand.points(6)
    first, current = sand.picture(), sand.picture((2.0, -1.0))
    first[80:150, 90:170] = current[80:150, 90:170] = grey
    tracks = correlate(first, current, points)
    assert_honest(tracks)
    inside = (points >= [90, 80]).all(axis=1) & (points <= [169, 149]).all(axis=1)
    outside = (points < [90 - 16, 80 - 16]).any(axis=1) | (points > [169 + 16, 149 + 16]).any(axis=1)
    assert tracks.valid[outside].all()
    assert np.nanmax(errors(tracks, (2.0, -1.0))[outside]) < 0.02
    # Sand moves by (2, -1), the glare's rim by nothing: any other motion is invented.
    error = errors(tracks, (2.0, -1.0))
    error[inside] = np.fmin(error, errors(tracks, (0.0, 0.0)))[inside]
    # A subset that holds a corner of the rim and sand has no line between its two motions: 5 in 100 remain.
    assert np.mean(error > WRONG_PX) < 0.05, (
        f"{np.sum(error > WRONG_PX)} invented, worst {np.nanmax(error):.2f} px"
    )


@pytest.mark.parametrize("gain", [1.5, 2.0, 3.0])
def test_saturated_sand_is_measured_within_its_std_or_refused(
    sand, gain, assert_none_wrong, assert_covered, rounded
):
    # 8, 60 and 97 % of the pixels are white.
    first, current = (rounded(sand.picture(s, kind=np.float32) * gain) for s in (None, SHIFT))
    tracks = correlate(first, current, sand.points(12))
    # 97 % white: the few grains left carry whole subsets, and their edges are cut.
    assert_none_wrong(tracks, SHIFT, share=0.03 if gain > 2 else 0.0)
    if gain <= 2:
        assert tracks.valid.all()
        assert_covered(tracks, SHIFT)


# Texture that does not tell how far, or in which direction, it moved


@pytest.fixture
def tiled(noisy):
    """Sand that repeats exactly every ``period`` px in x and in y, in noise of 1 grey level."""

    def make(period, shape, shift=(0.0, 0.0), noise_seed=0):
        tile = sand_texture(np.random.default_rng(3), (period, period), margin_px=0, grey=(105, 200))
        steps = [
            np.array([i, j]) * period
            for i in range(-4, shape[1] // period + 5)
            for j in range(-4, shape[0] // period + 5)
        ]
        count = len(steps)
        grains = Grains(
            np.concatenate([tile.positions_px + step for step in steps]),
            *(np.tile(values, count) for values in (tile.radii_px, tile.areas_px, tile.greys)),
        )
        return noisy(grains.moved(shift).picture(shape), np.random.default_rng(noise_seed), 1.0)

    return make


@pytest.mark.parametrize(
    ("period", "subset"),
    [(8, 9), (8, 31), (12, 61), (20, 15), (28, 15), (28, 61), (40, 15), (40, 31), (40, 61), (60, 31)],
)
def test_repeated_texture_is_told_where_it_moves_by_more_than_half_a_period(
    sand, period, subset, assert_none_wrong, tiled
):
    # 0.8 periods to the right and 0.2 to the left are one and the same pair of pictures.
    shift = (0.8 * period, -2.2)
    first, current = tiled(period, sand.shape, noise_seed=1), tiled(period, sand.shape, shift, noise_seed=2)
    tracks = correlate(first, current, sand.points(12), subset=subset)
    assert_none_wrong(tracks, shift)


def test_whole_period_of_a_tile_is_not_called_standstill(sand, assert_none_wrong, tiled):
    first, current = tiled(40, sand.shape, noise_seed=1), tiled(40, sand.shape, (40, 0), noise_seed=2)
    tracks = correlate(first, current, sand.points(12))
    assert_none_wrong(tracks, (40.0, 0.0))


def test_single_points_on_repeated_texture_are_told_as_well(sand, assert_honest, tiled):
    first, current = tiled(20, sand.shape, noise_seed=1), tiled(20, sand.shape, (16, 1), noise_seed=2)
    tracks = correlate(first, current, [[130.0, 110.0]])
    assert tracks.status.tolist() == [Status.AMBIGUOUS]
    assert_honest(tracks)


def test_sand_with_a_repeated_patch_keeps_the_vectors_of_the_sand(sand, errors, assert_none_wrong, rounded):
    # A printed scale in the picture: its marks repeat, the sand beside it does not.
    first, current = sand.picture(), sand.picture((2.0, 0.0))
    stripes = rounded(128 + 90 * np.sign(np.sin(2 * np.pi * np.arange(260) / 10)) + np.zeros((60, 1)))
    first[:60], current[:60] = stripes, np.roll(stripes, 2, axis=1)
    points = sand.points(10)
    tracks = correlate(first, current, points)
    below = points[:, 1] > 60 + 16
    assert tracks.valid[below].all()
    assert np.nanmax(errors(tracks, (2.0, 0.0))[below]) < 0.02
    assert_none_wrong(tracks, (2.0, 0.0))


@pytest.mark.parametrize("noise", [0, 1])
@pytest.mark.parametrize("order", [0, 1])
@pytest.mark.parametrize("period", [7, 19, 40])
def test_stripes_do_not_tell_the_motion_along_them(period, order, noise, assert_none_wrong, noisy, places):
    rng, (x, _) = np.random.default_rng(0), places((140, 170))
    first, current = (noisy(127 + 60 * np.sin(2 * np.pi * (x - s) / period), rng, noise) for s in (0.0, 1.0))
    points = np.stack([a.ravel() for a in np.meshgrid(np.arange(30, 140, 11.0), np.arange(30, 110, 11.0))], 1)
    tracks = correlate(first, current, points, order=order)
    assert_none_wrong(tracks, (1.0, 0.0))
    assert tracks.valid.mean() < 0.02


@pytest.mark.parametrize("noise", [0, 1])
@pytest.mark.parametrize("slant", [0.0, 0.5])
def test_straight_edge_does_not_tell_the_motion_along_it(slant, noise, assert_honest, noisy, places):
    rng, (x, y) = np.random.default_rng(0), places((120, 150))
    first, current = (
        noisy(60 + 120 / (1 + np.exp(-(x + slant * (y - 60) - 75 - s) / 1.5)), rng, noise) for s in (0.0, 1.3)
    )
    points = np.stack([a.ravel() for a in np.meshgrid(np.arange(25, 125, 12.0), np.arange(25, 95, 12.0))], 1)
    tracks = correlate(first, current, points)
    assert_honest(tracks)
    # Across the edge it may be right; along it any number is invented, however large its std.
    assert not tracks.valid.any(), (
        f"{tracks.displacement[tracks.valid][:3].round(2)} zncc {tracks.zncc.max()}"
    )


@pytest.mark.parametrize("kind", [np.float32, np.uint16])
@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("subset", [9, 31])
def test_even_ramp_of_light_is_refused(subset, order, kind, assert_honest, places):
    # A plane of grey levels that moves is a plane with another offset: nothing to measure.
    x, y = places((120, 150))
    points = np.stack([a.ravel() for a in np.meshgrid(np.arange(25, 125, 12.0), np.arange(25, 95, 12.0))], 1)
    for across, down in ((1.0, 0.5), (0.7, 0.0), (0.37, 0.61)):
        ramp = 20 + across * x + down * y
        first, current = (
            (r * (1 if kind == np.float32 else 100)).round(0 if kind != np.float32 else 6).astype(kind)
            for r in (ramp, ramp + 3)
        )
        tracks = correlate(first, current, points, subset=subset, order=order)
        assert_honest(tracks)
        assert not tracks.valid.any(), (
            f"slope {across, down}: {tracks.valid.sum()} valid,"
            f" {tracks.displacement[tracks.valid][0].round(2)} +- {tracks.std[tracks.valid][0].round(4)} px"
        )


@pytest.mark.parametrize("subset", [9, 31, 61])
def test_flat_field_of_noise_alone_gives_no_vectors(sand, subset, assert_honest, noisy):
    rng = np.random.default_rng(1)
    first, current = (noisy(np.full(sand.shape, 128.0), rng, 2.0) for _ in range(2))
    tracks = correlate(first, current, sand.points(12), subset=subset)
    assert_honest(tracks)
    assert not tracks.valid.any()


# Frames that are the same, or have nothing in common


@pytest.mark.parametrize(("subset", "order"), [(9, 1), (9, 2), (31, 0), (101, 1), (101, 2)])
def test_frame_against_itself_does_not_move_whatever_the_subset(sand, subset, order, assert_honest):
    picture = sand.picture(noise=5, seed=1)
    tracks = correlate(picture, picture, sand.points(20), subset=subset, order=order)
    assert tracks.valid.all()
    assert_honest(tracks)
    assert np.abs(tracks.displacement).max() < 1e-4  # a fifth of the step at which Gauss-Newton stops


@pytest.mark.parametrize(
    ("subset", "order"), [(9, 0), (9, 1), (15, 1), (21, 1), (31, 0), (31, 1), (31, 2), (61, 1)]
)
def test_unrelated_sand_gives_no_vectors_whatever_the_subset(sand, subset, order, assert_honest, other_sand):
    seeds, points = range(100, 104), sand.points(14)
    valid = 0
    for seed in seeds:
        tracks = correlate(sand.picture(), other_sand(sand.shape, seed), points, subset=subset, order=order)
        assert_honest(tracks)
        valid += int(tracks.valid.sum())
    # 4.5 standard deviations of chance are none in a hundred thousand: 1 % leaves room for many tries.
    assert valid <= 0.01 * len(points) * len(seeds), f"{valid} of {len(points) * len(seeds)} are valid"


def test_half_of_the_frame_that_was_churned_is_refused_and_the_other_half_measured(
    sand, errors, assert_none_wrong, other_sand
):
    points, shift = sand.points(9), SHIFT
    for seed in (50, 51):
        current = sand.picture(shift)
        current[:, 130:] = other_sand(sand.shape, seed)[:, 130:]
        tracks = correlate(sand.picture(), current, points)
        assert_none_wrong(tracks, shift)
        assert not tracks.valid[points[:, 0] > 130 + 15].any()
        clear = points[:, 0] < 130 - 18
        assert tracks.valid[clear].all()
        assert np.nanmax(errors(tracks, shift)[clear]) < ALIAS_PX
