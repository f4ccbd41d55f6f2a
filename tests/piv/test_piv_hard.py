"""Hard pictures: whatever is not measured is refused with a reason, and nothing that is returned is wrong."""

from itertools import product

import cv2
import numpy as np
import pytest

from ploughval.axes import Status
from ploughval.errors import CorrelationError
from ploughval.piv import Description, Tracker, correlate
from ploughval.scene import Piv
from ploughval.synth.sand import Grains, sand_texture

WRONG_PX = 0.5
"""A returned vector that errs by more is wrong: a hundred times what clean sand gives, and half a pixel."""
SIGMAS = 6.0
"""The largest of some hundred normal errors is 3.5 standard deviations; those of textures scatter more."""
ALIAS_PX = 0.006
"""Largest error of clean 8 bit sand: grains down to 0.6 px standard deviation alias (test_correlate)."""
SHIFT = (1.3, -0.6)


def assert_honest(tracks):
    """What is valid is finite; what is not has a reason and NaN, not a number."""
    valid = tracks.valid
    assert set(tracks.status.tolist()) <= {int(s) for s in Status}
    for values in (tracks.displacement, tracks.gradient, tracks.std):
        assert np.isfinite(values[valid]).all()
        assert np.isnan(values[~valid]).all()
    assert (tracks.std[valid] >= 0).all()
    assert (tracks.pixels[valid] > 0).all()
    assert np.isfinite(tracks.zncc).all()
    assert np.abs(tracks.zncc).max(initial=0.0) <= 1 + 1e-5  # sums in single precision


def errors(tracks, truth):
    """Larger component of the error of each vector (N,) px, NaN where there is none."""
    return np.abs(tracks.displacement - truth).max(axis=1)


def assert_none_wrong(tracks, truth, px=WRONG_PX, share=0.0):
    """At most a share of the valid vectors is wrong by more than ``px``."""
    assert_honest(tracks)
    error = errors(tracks, truth)
    worst = np.argsort(-np.nan_to_num(error))[:3]
    told = [
        (tracks.points[k].tolist(), tracks.displacement[k].round(3).tolist(), tracks.std[k].round(4).tolist())
        for k in worst
    ]
    wrong = int(np.sum(error > px))
    assert wrong <= share * tracks.valid.sum(), f"{wrong} of {tracks.valid.sum()} are wrong: {told}"


def assert_covered(tracks, truth, px=ALIAS_PX):
    """Errors stay within what the predicted standard deviation allows, beyond the aliasing of the grains."""
    assert_honest(tracks)
    excess = (np.abs(tracks.displacement - truth) - px) / np.maximum(tracks.std, 1e-9)
    assert np.nanmax(excess) < SIGMAS


def rounded(picture):
    return np.round(np.clip(picture, 0, 255)).astype(np.uint8)


def noisy(picture, rng, noise):
    return rounded(picture + rng.normal(0, noise, picture.shape))


def jpeg(picture, quality):
    return cv2.imdecode(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], 0)


def places(shape):
    """Columns and rows of all pixels."""
    return np.meshgrid(np.arange(shape[1]), np.arange(shape[0]))


def other_sand(shape, seed):
    """A picture of other sand of the same kind."""
    return rounded(
        sand_texture(np.random.default_rng(seed), shape, margin_px=20, grey=(105, 200)).picture(shape)
    )


# Saturated and flat patches


@pytest.mark.parametrize("noise", [0, 1])
@pytest.mark.parametrize("grey", [0, 128, 255])
def test_flat_patch_is_refused_and_the_sand_around_it_is_measured(sand, grey, noise):
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
def test_glare_that_stands_still_over_moving_sand_hardly_gives_a_third_motion(sand, grey):
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
def test_saturated_sand_is_measured_within_its_std_or_refused(sand, gain):
    # 8, 60 and 97 % of the pixels are white.
    first, current = (rounded(sand.picture(s, kind=np.float32) * gain) for s in (None, SHIFT))
    tracks = correlate(first, current, sand.points(12))
    # 97 % white: the few grains left carry whole subsets, and their edges are cut.
    assert_none_wrong(tracks, SHIFT, share=0.03 if gain > 2 else 0.0)
    if gain <= 2:
        assert tracks.valid.all()
        assert_covered(tracks, SHIFT)


# Texture that does not tell how far, or in which direction, it moved


def tiled(period, shape, shift=(0.0, 0.0), noise_seed=0):
    """Sand that repeats exactly every ``period`` px in x and in y, in noise of 1 grey level."""
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


@pytest.mark.parametrize(
    ("period", "subset"),
    [(8, 9), (8, 31), (12, 61), (20, 15), (28, 15), (28, 61), (40, 15), (40, 31), (40, 61), (60, 31)],
)
def test_repeated_texture_is_told_where_it_moves_by_more_than_half_a_period(sand, period, subset):
    # 0.8 periods to the right and 0.2 to the left are one and the same pair of pictures.
    shift = (0.8 * period, -2.2)
    first, current = tiled(period, sand.shape, noise_seed=1), tiled(period, sand.shape, shift, noise_seed=2)
    tracks = correlate(first, current, sand.points(12), subset=subset)
    assert_none_wrong(tracks, shift)


def test_whole_period_of_a_tile_is_not_called_standstill(sand):
    first, current = tiled(40, sand.shape, noise_seed=1), tiled(40, sand.shape, (40, 0), noise_seed=2)
    tracks = correlate(first, current, sand.points(12))
    assert_none_wrong(tracks, (40.0, 0.0))


def test_single_points_on_repeated_texture_are_told_as_well(sand):
    first, current = tiled(20, sand.shape, noise_seed=1), tiled(20, sand.shape, (16, 1), noise_seed=2)
    tracks = correlate(first, current, [[130.0, 110.0]])
    assert tracks.status.tolist() == [Status.AMBIGUOUS]
    assert_honest(tracks)


def test_sand_with_a_repeated_patch_keeps_the_vectors_of_the_sand(sand):
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
def test_stripes_do_not_tell_the_motion_along_them(period, order, noise):
    rng, (x, _) = np.random.default_rng(0), places((140, 170))
    first, current = (noisy(127 + 60 * np.sin(2 * np.pi * (x - s) / period), rng, noise) for s in (0.0, 1.0))
    points = np.stack([a.ravel() for a in np.meshgrid(np.arange(30, 140, 11.0), np.arange(30, 110, 11.0))], 1)
    tracks = correlate(first, current, points, order=order)
    assert_none_wrong(tracks, (1.0, 0.0))
    assert tracks.valid.mean() < 0.02


@pytest.mark.parametrize("noise", [0, 1])
@pytest.mark.parametrize("slant", [0.0, 0.5])
def test_straight_edge_does_not_tell_the_motion_along_it(slant, noise):
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
def test_even_ramp_of_light_is_refused(subset, order, kind):
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
def test_flat_field_of_noise_alone_gives_no_vectors(sand, subset):
    rng = np.random.default_rng(1)
    first, current = (noisy(np.full(sand.shape, 128.0), rng, 2.0) for _ in range(2))
    tracks = correlate(first, current, sand.points(12), subset=subset)
    assert_honest(tracks)
    assert not tracks.valid.any()


# Frames that are the same, or have nothing in common


@pytest.mark.parametrize(("subset", "order"), [(9, 1), (9, 2), (31, 0), (101, 1), (101, 2)])
def test_frame_against_itself_does_not_move_whatever_the_subset(sand, subset, order):
    picture = sand.picture(noise=5, seed=1)
    tracks = correlate(picture, picture, sand.points(20), subset=subset, order=order)
    assert tracks.valid.all()
    assert_honest(tracks)
    assert np.abs(tracks.displacement).max() < 1e-4  # a fifth of the step at which Gauss-Newton stops


@pytest.mark.parametrize(
    ("subset", "order"), [(9, 0), (9, 1), (15, 1), (21, 1), (31, 0), (31, 1), (31, 2), (61, 1)]
)
def test_unrelated_sand_gives_no_vectors_whatever_the_subset(sand, subset, order):
    seeds, points = range(100, 104), sand.points(14)
    valid = 0
    for seed in seeds:
        tracks = correlate(sand.picture(), other_sand(sand.shape, seed), points, subset=subset, order=order)
        assert_honest(tracks)
        valid += int(tracks.valid.sum())
    # 4.5 standard deviations of chance are none in a hundred thousand: 1 % leaves room for many tries.
    assert valid <= 0.01 * len(points) * len(seeds), f"{valid} of {len(points) * len(seeds)} are valid"


def test_half_of_the_frame_that_was_churned_is_refused_and_the_other_half_measured(sand):
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


# Depth, subsets, sizes


@pytest.mark.parametrize(
    ("first", "second"),
    list(product([np.uint8, np.uint16, np.float32], repeat=2)),
    ids=lambda kind: kind.__name__,
)
def test_depth_of_either_picture_changes_neither_vectors_nor_their_std(sand, first, second):
    # uint16 pictures are 200 times as bright as the others: gain is free.
    points = sand.points(20)
    tracks = correlate(sand.picture(kind=first), sand.picture(SHIFT, kind=second), points)
    assert tracks.valid.all()
    assert_honest(tracks)
    assert np.abs(tracks.displacement - SHIFT).max() < ALIAS_PX
    assert (tracks.std > 1e-4).all()  # aliasing alone leaves errors of 6e-4 px; a weight 1 / std^2 must exist
    assert_covered(tracks, SHIFT, px=0.0)


@pytest.mark.parametrize("noise", [0, 3])
@pytest.mark.parametrize("subset", [9, 15, 21, 41, 61, 81, 101])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_subsets_of_9_to_101_px_measure_clean_sand(sand, subset, order, noise):
    points = sand.points(20)
    first, current = sand.picture(noise=noise, seed=1), sand.picture(SHIFT, noise=noise, seed=2)
    tracks = correlate(first, current, points, subset=subset, order=order)
    assert tracks.valid.all()
    assert_none_wrong(tracks, SHIFT)
    assert_covered(tracks, SHIFT)


def test_wider_subsets_are_more_precise_and_say_so(sand):
    first, current = sand.picture(noise=4, seed=1), sand.picture(SHIFT, noise=4, seed=2)
    found = [correlate(first, current, sand.points(16), subset=side) for side in (15, 31, 61)]
    spread = [float(np.std(t.displacement - SHIFT)) for t in found]
    told = [float(np.sqrt(np.mean(t.std**2))) for t in found]
    # Noise falls with the side: each step halves it, within the scatter of 130 correlated errors.
    for finer, wider in ((0, 1), (1, 2)):
        assert 1.5 < spread[finer] / spread[wider] < 3.0
        assert 1.5 < told[finer] / told[wider] < 3.0


@pytest.mark.parametrize("shape", [(1, 260), (220, 1), (1, 1), (2, 260), (15, 260), (0, 260), (0, 0)])
def test_picture_of_a_few_rows_is_refused_in_words(shape):
    picture = np.random.default_rng(0).integers(0, 255, shape).astype(np.uint8)
    with pytest.raises(CorrelationError, match="at least 16 x 16 px"):
        correlate(picture, picture, [[0.0, 0.0], [8.0, 0.3]])


@pytest.mark.parametrize("shape", [(16, 200), (20, 200), (200, 24), (31, 31), (40, 40)])
@pytest.mark.parametrize("subset", [9, 15, 31, 101])
def test_narrow_pictures_are_measured_where_a_subset_fits(shape, subset):
    grains = sand_texture(np.random.default_rng(2), shape, margin_px=30, grey=(105, 200))
    first, current = rounded(grains.picture(shape)), rounded(grains.moved(SHIFT).picture(shape))
    x, y = (a[::5, ::5].ravel() for a in places(shape))
    points = np.stack([x, y], axis=1).astype(float)
    tracks = correlate(first, current, points, subset=subset)
    assert_none_wrong(tracks, SHIFT)
    half, room = subset // 2, np.array(shape[::-1]) - 1
    whole = ((points >= half + 2) & (points <= room - half - 2)).all(axis=1)
    assert tracks.valid[whole].all()
    if subset == 101:
        assert (tracks.status == Status.EDGE).all()


# Places and pixels that are not there


def test_points_outside_the_picture_or_in_its_corners_are_at_the_edge_and_do_no_harm(sand):
    inner, first, current = [[130.0, 110.0], [60.0, 60.0]], sand.picture(), sand.picture(SHIFT)
    width, height = sand.shape[1], sand.shape[0]
    outer = [[-40, 110], [300, 110], [130, -30], [130, 260], [-1e6, 1e6], [1e6, 5], [-0.6, -0.6], [0, 0]]
    outer += [[width - 1, height - 1], [width - 0.5, height - 0.5], [width, 0], [0, height]]
    alone = correlate(first, current, inner)
    tracks = correlate(first, current, inner + outer)
    assert_honest(tracks)
    assert (tracks.status[2:] == Status.EDGE).all()
    assert tracks.valid[:2].all()
    # Gauss-Newton stops within 5e-4 px of its limit, from either guess.
    assert np.abs(tracks.displacement[:2] - alone.displacement).max() < 5e-4


def test_border_of_the_picture_counts_only_the_pixels_there_are(sand):
    picture = sand.picture()
    points = np.array([[0, 110], [3, 110], [5, 3], [259, 110], [256, 100], [15, 15], [14, 15]], float)
    tracks = correlate(picture, picture, points)
    assert_honest(tracks)
    # 31 x 31 cut at the border; (5, 3): 21 x 19 are 0.415 of it, more than the 0.4 that are needed.
    whole = [16 * 31, 19 * 31, 21 * 19, 16 * 31, 19 * 31, 31 * 31, 30 * 31]
    assert tracks.valid.all()
    assert tracks.pixels.tolist() == whole


def test_points_on_the_border_are_measured_from_what_is_left_of_their_subsets(sand):
    x, y = np.meshgrid([0, 1, 2, 4, 8, 12, 130, 250, 259], [0, 1, 3, 6, 10, 110, 200, 215, 219])
    points = np.stack([x.ravel(), y.ravel()], axis=1).astype(float)
    for shift in (SHIFT, (-2.4, 3.3), (8.3, -9.2)):
        tracks = correlate(sand.picture(), sand.picture(shift), points)
        assert_none_wrong(tracks, shift, px=0.25)
        assert_covered(tracks, shift)
        assert tracks.valid.mean() > 0.35  # up to half of them have left the picture
        assert (tracks.status[~tracks.valid] == Status.EDGE).all()


@pytest.mark.parametrize("where", ["reference", "current", "both"])
def test_hole_of_nan_is_left_out_and_the_sand_around_it_measured(sand, where):
    first, current, points = (
        sand.picture(kind=np.float32),
        sand.picture(SHIFT, kind=np.float32),
        sand.points(8),
    )
    if where != "current":
        first[90:130, 100:150] = np.nan
    if where != "reference":
        current[90:130, 100:150] = [[np.nan], [np.inf], [-np.inf], [np.nan]] * 10
    tracks = correlate(first, current, points)
    deep = (points > [100 + 12, 90 + 12]).all(axis=1) & (points < [149 - 12, 129 - 12]).all(axis=1)
    assert not tracks.valid[deep].any()
    clear = (points < [100 - 20, 90 - 20]).any(axis=1) | (points > [149 + 20, 129 + 20]).any(axis=1)
    assert tracks.valid[clear].all()
    assert (tracks.pixels[clear] == 31 * 31).all()
    # Six standard deviations of a subset cut to 0.4 of its pixels and to one side of its point, 0.003 px.
    assert_none_wrong(tracks, SHIFT, px=0.02)
    cut = tracks.valid & ~clear
    assert (tracks.pixels[cut] >= 0.4 * 0.4 * 31 * 31).all()
    assert (tracks.pixels[cut] < 31 * 31).any()


def test_single_dead_pixels_of_nan_cost_nothing_but_pixels(sand):
    first, current = sand.picture(kind=np.float32), sand.picture(SHIFT, kind=np.float32)
    rng, points = np.random.default_rng(1), sand.points(12)
    for picture in (first, current):
        picture[rng.random(sand.shape) < 0.001] = np.nan
    tracks = correlate(first, current, points)
    assert tracks.valid.all()
    assert_none_wrong(tracks, SHIFT, px=0.01)
    assert (tracks.pixels < 31 * 31).any()


@pytest.mark.parametrize("where", ["reference", "current", "both"])
def test_picture_of_nan_gives_no_vectors(sand, where):
    nothing, picture = np.full(sand.shape, np.nan, np.float32), sand.picture(kind=np.float32)
    first = picture if where == "current" else nothing
    current = picture if where == "reference" else nothing
    tracks = correlate(first, current, sand.points(30))
    assert_honest(tracks)
    assert not tracks.valid.any()


def masks(shape):
    x, y = places(shape)
    rng = np.random.default_rng(0)
    return {
        "half": x < 130,
        "stripes": (x // 8) % 2 == 0,
        "checker": (x + y) % 2 == 0,
        "random": rng.random(shape) < 0.6,
        "disc": np.hypot(x - 130, y - 110) < 70,
        "slope": y > 60 + 0.4 * x,
    }


@pytest.mark.parametrize("name", ["half", "stripes", "checker", "random", "disc", "slope"])
def test_subset_uses_the_pixels_of_any_mask_and_says_how_many(sand, name):
    mask, points, half = masks(sand.shape)[name], sand.points(9, margin=3), 15
    tracks = correlate(sand.picture(), sand.picture(SHIFT), points, mask=mask)
    padded = np.pad(mask, half)
    there = np.array([padded[y : y + 31, x : x + 31].sum() for x, y in points.astype(int)])
    # Cut to 0.4 of its pixels and to one side of its point, a subset has five times the std of 0.0011 px.
    assert_none_wrong(tracks, SHIFT, px=0.05)
    assert not tracks.valid[there < 0.4 * 31 * 31].any()
    room = np.array(sand.shape[::-1]) - 1
    inside = ((points >= half + 2) & (points <= room - half - 2)).all(axis=1)
    on = mask[points[:, 1].astype(int), points[:, 0].astype(int)]
    assert tracks.valid[inside & on & (there >= 0.4 * 31 * 31)].all()
    # A point that stands on a hidden pixel may be refused for it, but for no other reason.
    assert np.isin(tracks.status[inside & ~on], (Status.OK, Status.MASKED)).all()
    assert (tracks.status[inside & (there < 0.4 * 31 * 31)] == Status.MASKED).all()
    counted = tracks.valid & inside & (tracks.description != Description.QUADRATIC_SMALL)
    assert (tracks.pixels[counted] == there[counted]).all()


def test_what_a_mask_hides_does_not_change_what_it_shows(sand):
    mask, points = masks(sand.shape)["disc"], sand.points(9)
    rng, current = np.random.default_rng(4), sand.picture(SHIFT)
    first = sand.picture()
    hidden = first.copy()
    hidden[~mask] = rng.integers(0, 255, np.sum(~mask))
    plain, other = (correlate(picture, current, points, mask=mask) for picture in (first, hidden))
    assert (plain.valid == other.valid).all()
    assert plain.valid.any()
    # Slopes beside the mask are taken over it: random grey levels there may cost 0.02 px, not more.
    assert np.nanmax(np.abs(plain.displacement - other.displacement)) < 0.02
    far = cv2.dilate(mask.astype(np.uint8), np.ones((41, 41), np.uint8)) == 0
    hidden = first.copy()
    hidden[far] = rng.integers(0, 255, far.sum())
    other = correlate(hidden, current, points, mask=mask)
    assert np.nanmax(np.abs(plain.displacement - other.displacement)) < 5e-4  # where Gauss-Newton stops


def test_empty_mask_masks_every_point(sand):
    tracks = correlate(sand.picture(), sand.picture(), sand.points(40), mask=np.zeros(sand.shape, bool))
    assert (tracks.status == Status.MASKED).all()
    assert_honest(tracks)


# Light and what cameras do


@pytest.mark.parametrize(("gain", "offset"), [(0.3, 10), (0.6, 20), (1.2, -10), (0.1, 100)])
def test_changed_light_costs_only_what_rounding_costs(sand, gain, offset):
    current = rounded(sand.picture(SHIFT, kind=np.float32) * gain + offset)
    tracks = correlate(sand.picture(), current, sand.points(12))
    assert tracks.valid.all()
    assert_covered(tracks, SHIFT)
    # Rounding has the standard deviation 0.29 of a contrast of 28 gain: 0.0008 px / gain (test_sequence).
    assert np.abs(tracks.displacement - SHIFT).max() < ALIAS_PX + SIGMAS * 0.0008 / gain


def test_negative_is_refused(sand):
    tracks = correlate(sand.picture(), 255 - sand.picture(), sand.points(20))
    assert_honest(tracks)
    assert not tracks.valid.any()


@pytest.mark.parametrize("kind", ["gain", "lamp"])
@pytest.mark.parametrize("amplitude", [0.3, 0.6])
def test_gradient_of_light_stays_within_its_std(sand, kind, amplitude):
    x, _ = places(sand.shape)
    current = sand.picture(SHIFT, kind=np.float32)
    if kind == "gain":
        current = current * (1 + amplitude * (x / sand.shape[1] - 0.5))
    else:
        current = 0.5 * current + 100 * amplitude * x / sand.shape[1]
    tracks = correlate(sand.picture(), rounded(current), sand.points(12))
    assert tracks.valid.all()
    assert_covered(tracks, SHIFT)
    # A step of 0.6 over 260 px changes the light by 7 % over a subset: 0.07 of a grain's radius of 1.5 px.
    assert np.abs(tracks.displacement - SHIFT).max() < 0.1


@pytest.mark.parametrize("size", [20, 40, 80])
def test_flash_that_saturates_part_of_a_frame_gives_no_wrong_vectors(sand, size):
    x, y = places(sand.shape)
    flash = 200 * np.exp(-((x - 130) ** 2 + (y - 110) ** 2) / (2 * size**2))
    points = sand.points(9)
    tracks = correlate(sand.picture(), rounded(sand.picture(SHIFT) + flash), points)
    assert_none_wrong(tracks, SHIFT)
    clear = np.hypot(points[:, 0] - 130, points[:, 1] - 110) > 3.5 * size + 22
    if clear.any():
        assert tracks.valid[clear].all()
        assert np.nanmax(errors(tracks, SHIFT)[clear]) < 0.02


@pytest.mark.parametrize("grey", [0, 255])
def test_black_or_white_frame_gives_no_vectors(sand, grey):
    blank = np.full(sand.shape, grey, np.uint8)
    for first, current in ((sand.picture(), blank), (blank, sand.picture()), (blank, blank)):
        tracks = correlate(first, current, sand.points(30))
        assert_honest(tracks)
        assert not tracks.valid.any()


@pytest.mark.parametrize("subset", [15, 31])
def test_jpeg_of_quality_40_is_measured(sand, subset):
    first, current = jpeg(sand.picture(), 40), jpeg(sand.picture(SHIFT), 40)
    tracks = correlate(first, current, sand.points(9), subset=subset)
    assert tracks.valid.mean() > 0.99
    # Blocks of 8 px quantised alike in both frames: 6 grey levels, twice what noise of 6 would cost 31 px.
    assert_none_wrong(tracks, SHIFT, px=0.1 * 31 / subset * 1.5)
    assert_covered(tracks, SHIFT)


@pytest.mark.parametrize("which", ["reference", "current"])
@pytest.mark.parametrize("sigma", [0.5, 1.0, 1.5, 2.0, 3.0, 5.0])
def test_blur_in_one_picture_only_gives_hardly_a_wrong_vector(sand, sigma, which):
    first, current = sand.picture(), sand.picture(SHIFT)
    if which == "reference":
        first = cv2.GaussianBlur(first, (0, 0), sigma)
    else:
        current = cv2.GaussianBlur(current, (0, 0), sigma)
    tracks = correlate(first, current, sand.points(12))
    assert_honest(tracks)
    # Grains of 0.6 to 1.5 px standard deviation drown in a blur of 3 px: what is left must say so.
    silent = errors(tracks, SHIFT) > np.maximum(WRONG_PX, SIGMAS * tracks.std.max(axis=1))
    # A band fits what a blur of 3 px leaves at times: 1 in 20 of the points asked for.
    assert silent.sum() <= (0.05 if sigma == 3.0 else 0.0) * len(silent), (
        f"{silent.sum()} of {tracks.valid.sum()}: {tracks.displacement[silent][:3].round(2)}"
    )
    if sigma <= 1.5:
        assert tracks.valid.mean() > 0.95
        assert_none_wrong(tracks, SHIFT)
        assert_covered(tracks, SHIFT)


@pytest.mark.parametrize("length", [5, 9, 15])
def test_motion_blur_of_one_picture_gives_no_wrong_vectors(sand, length):
    streak = np.zeros((length, length), np.float32)
    streak[length // 2] = 1 / length
    tracks = correlate(sand.picture(), cv2.filter2D(sand.picture(SHIFT), -1, streak), sand.points(12))
    assert_none_wrong(tracks, SHIFT)


@pytest.mark.parametrize("noise", [20, 40, 60])
def test_strong_noise_is_told_by_the_std_or_refused(sand, noise):
    first, current = sand.picture(noise=noise, seed=1), sand.picture(SHIFT, noise=noise, seed=2)
    tracks = correlate(first, current, sand.points(12))
    assert_covered(tracks, SHIFT) if tracks.valid.any() else assert_honest(tracks)


def test_pixels_that_stand_still_before_the_sand_are_not_what_is_measured(sand):
    # One hot pixel in a hundred at 255: a contrast of its own of 11, beside 28 of the sand.
    hot = np.random.default_rng(3).random(sand.shape) < 0.01
    first, current = sand.picture(), sand.picture((3.3, -1.6))
    first[hot] = current[hot] = 255
    assert_none_wrong(correlate(first, current, sand.points(12)), (3.3, -1.6))


# Far and turned


def turned(angle_deg, shift=(0.0, 0.0)):
    c, s = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    gradient = np.array([[c, -s], [s, c]]) - np.eye(2)
    return (lambda p: (p - [130, 110]) @ gradient.T + shift), gradient


@pytest.mark.parametrize("angle", [-15, 15])
@pytest.mark.parametrize("shift", [(0.0, 0.0), (25.4, -14.2)])
def test_rotation_of_15_degrees_is_found_without_hints(sand, angle, shift):
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
def test_displacement_beyond_the_search_is_refused_not_guessed(sand, shift):
    for seed in range(4):
        points = np.random.default_rng(seed).uniform([90, 80], [170, 140], (20, 2))
        tracks = correlate(
            sand.picture(noise=5, seed=2 * seed + 1), sand.picture(shift, noise=5, seed=2 * seed + 2), points
        )
        assert_none_wrong(tracks, shift)


def test_blocks_that_part_by_40_px_are_both_found_and_nothing_between(sand):
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
def test_large_strain_between_frames_is_followed_or_refused(sand, normal, shear):
    gradient = np.array([[normal, shear], [0.0, -normal]])

    def motion(p):
        return (p - [130, 110]) @ gradient.T

    points = sand.points(12)
    tracks = correlate(sand.picture(), sand.picture(motion), points)
    assert_none_wrong(tracks, motion(points), px=0.1)
    assert tracks.valid.mean() > 0.9


@pytest.mark.parametrize("off", [(5.0, 5.0), (50.0, -40.0), (1e5, 1e5)])
def test_wrong_hints_of_some_points_are_mended_by_their_neighbours(sand, off):
    points = sand.points(12)
    guess = np.tile(SHIFT, (len(points), 1))
    guess[::7] += off
    tracks = correlate(sand.picture(), sand.picture(SHIFT), points, guess=guess)
    assert_none_wrong(tracks, SHIFT, px=ALIAS_PX)
    assert tracks.valid.all(), f"{[Status(s).name for s in np.unique(tracks.status)]}"


def test_wild_hints_give_no_wrong_vectors(sand):
    points, rng = sand.points(14), np.random.default_rng(5)
    for guess in (rng.normal(0, 30, points.shape), np.full(points.shape, 1e300), np.full(points.shape, -1e4)):
        assert_none_wrong(correlate(sand.picture(), sand.picture(SHIFT), points, guess=guess), SHIFT)


# The same answer, whoever asks


def hard_pair(sand):
    """Sand with a churned corner, a glare, a band and noise: every kind of retry is needed."""

    def motion(p):
        return np.where(p[:, 1:] < 110, [12.3, -1.2], [2.1, 0.4])

    first, current = sand.picture(noise=3, seed=1), sand.picture(motion, noise=3, seed=2)
    current[:70, :80] = other_sand(sand.shape, 9)[:70, :80]
    first[150:190, 180:230] = current[150:190, 180:230] = 255
    return first, current


def test_threads_do_not_change_a_bit_of_a_hard_pair(sand):
    first, current = hard_pair(sand)
    points = sand.points(7, margin=5)
    mask = np.random.default_rng(2).random(sand.shape) < 0.9
    results, before = [], cv2.getNumThreads()
    try:
        for workers, threads in ((1, 1), (2, 2), (3, 1)):
            cv2.setNumThreads(threads)
            results.append(correlate(first, current, points, mask=mask, workers=workers))
    finally:
        cv2.setNumThreads(before)
    assert len(np.unique(results[0].status)) >= 4  # OK and several reasons
    for other in results[1:]:
        for name in ("displacement", "gradient", "std", "zncc", "pixels", "description", "status"):
            assert getattr(results[0], name).tobytes() == getattr(other, name).tobytes(), name


def test_arguments_are_left_as_they_were(sand):
    first, current = (picture.astype(np.float32) for picture in hard_pair(sand))
    first[20, 20] = np.nan
    points, mask = sand.points(15), np.ones(sand.shape, bool)
    given = (first, current, points, mask, np.zeros_like(points))
    copies = [values.copy() for values in given]
    for values in given:
        values.setflags(write=False)
    correlate(first, current, points, mask=mask, guess=given[4])
    for values, copy in zip(given, copies, strict=True):
        np.testing.assert_array_equal(values, copy)


def test_vector_of_a_point_does_not_depend_on_which_others_are_asked_for(sand):
    first, current = sand.picture(noise=2, seed=1), sand.picture((7.3, 2.2), noise=2, seed=2)
    points = sand.points(12)
    together = correlate(first, current, points)
    order = np.random.default_rng(1).permutation(len(points))
    shuffled = correlate(first, current, points[order])
    some = correlate(first, current, points[::5])
    assert together.valid.all()
    assert shuffled.valid.all()
    # Noise is judged on a sample: another filter of the slopes may shift a vector by a part of its std.
    std = float(np.median(together.std))
    assert np.abs(shuffled.displacement - together.displacement[order]).max() < std
    assert np.abs(some.displacement - together.displacement[::5]).max() < std


def test_point_asked_for_twice_gets_the_same_answer_twice(sand):
    points = np.repeat(sand.points(30), 3, axis=0)
    tracks = correlate(sand.picture(noise=3, seed=1), sand.picture(SHIFT, noise=3, seed=2), points)
    assert tracks.valid.all()
    assert (tracks.displacement[0::3] == tracks.displacement[1::3]).all()
    assert (tracks.displacement[0::3] == tracks.displacement[2::3]).all()


@pytest.mark.parametrize("view", ["reversed", "fortran", "big endian", "cut out"])
def test_layout_of_the_arrays_does_not_matter(sand, view):
    first, current = sand.picture(kind=np.uint16), sand.picture(SHIFT, kind=np.uint16)
    plain = correlate(first, current, sand.points(30))

    def changed(picture):
        if view == "reversed":
            return picture[::-1].copy()[::-1]
        if view == "fortran":
            return np.asfortranarray(picture)
        if view == "cut out":
            return np.pad(picture, 7)[7:-7, 7:-7]
        return picture.astype(">u2")

    other = correlate(changed(first), changed(current), sand.points(30))
    np.testing.assert_array_equal(other.displacement, plain.displacement)


def test_tracker_comes_through_black_white_and_unrelated_frames(sand):
    points, everywhere = sand.points(30, margin=45), np.ones(sand.shape, bool)
    for hard in (
        np.zeros(sand.shape, np.uint8),
        np.full(sand.shape, 255, np.uint8),
        other_sand(sand.shape, 4),
    ):
        tracker = Tracker(Piv(), 1)
        tracker.start(sand.picture(), points, everywhere)
        lost = tracker.advance(hard, everywhere)
        assert (lost.status != Status.OK).all()
        assert np.isnan(lost.position_px).all()
        found = tracker.advance(sand.picture((2.0, 1.0)), everywhere)
        assert (found.status == Status.OK).all()
        assert np.abs(found.position_px - points - [2.0, 1.0]).max() < 0.01


# Anything at all


def random_pictures(rng):
    """Two pictures (H, W) as float, and what is true of them: a shift, or None."""
    high = 41 if rng.random() < 0.4 else 150
    h, w = (int(n) for n in rng.integers(16, high, 2))
    style = rng.choice(["sand", "same", "noise", "constant", "blank", "few", "ramp", "checker", "step"])
    x, y = places((h, w))
    shift = None
    if style in ("sand", "same"):
        grains = sand_texture(rng, (h, w), margin_px=30, grey=(105, 200))
        shift = rng.normal(0, 2, 2) if style == "sand" else np.zeros(2)
        first, current = grains.picture((h, w)), grains.moved(shift).picture((h, w))
    elif style == "noise":
        first, current = rng.uniform(0, 255, (2, h, w))
    elif style == "constant":
        first, current = np.full((h, w), rng.integers(0, 255)), np.full((h, w), rng.integers(0, 255))
    elif style == "blank":
        first, current = np.full((h, w), 128.0), rng.uniform(0, 255, (h, w))
    elif style == "few":
        first, current = np.zeros((2, h, w))
        for picture in (first, current):
            count = int(rng.integers(1, 6))
            picture[rng.integers(0, h, count), rng.integers(0, w, count)] = rng.uniform(50, 255, count)
    elif style == "ramp":
        first, current = x + 0.5 * y, x + 0.5 * y + 3
    elif style == "checker":
        first = 255.0 * ((x // 4 + y // 4) % 2)
        current = np.roll(first, 1, axis=1)
    else:
        first, current = 255.0 * (x > w // 2), 255.0 * (x > w // 2 + 1)
    return np.array(first, float), np.array(current, float), shift


def random_points(rng, shape):
    """Points inside, outside and on the border, in lines, twice, at whole and at other places."""
    h, w = shape
    count = int(rng.choice([0, 1, 2, 3, 5, 20, 100]))
    points = rng.uniform(-0.3, 1.3, (count, 2)) * [w, h]
    if rng.random() < 0.4:
        points = np.round(points) + rng.choice([0.0, 0.5])
    if rng.random() < 0.3:
        points = np.clip(points, 0, [w - 1, h - 1])
    if count > 1 and rng.random() < 0.3:
        points[:, 1] = points[0, 1]
    if count > 1 and rng.random() < 0.3:
        points[count // 2 :] = points[: count - count // 2]
    return points


def random_case(rng):
    """Pictures, points, settings and the true shift or None."""
    first, current, shift = random_pictures(rng)
    kind = rng.choice([np.uint8, np.uint16, np.float32])
    if kind == np.uint16:
        first, current = np.round(first * 200), np.round(current * 200)
    elif kind == np.uint8:
        first, current = rounded(first), rounded(current)
    first, current = first.clip(0, 65535).astype(kind), current.clip(0, 65535).astype(kind)
    if kind == np.float32 and rng.random() < 0.3:
        first[rng.random(first.shape) < rng.choice([0.001, 0.3, 1.0])] = rng.choice([np.nan, np.inf, -np.inf])
    points = random_points(rng, first.shape)
    mask = None
    if rng.random() < 0.4:
        mask = rng.random(first.shape) < rng.choice([0.0, 0.3, 0.7, 1.0])
    guess = None if rng.random() < 0.7 else rng.normal(0, rng.choice([1.0, 10.0, 1e8]), points.shape)
    settings = {
        "subset": int(rng.choice([9, 15, 31, 41, 101])),
        "order": int(rng.integers(0, 3)),
        "spline": int(rng.choice([3, 5])),
        "noise": rng.choice([None, None, 0.0, 2.0]),
        "workers": int(rng.choice([1, 2])),
    }
    return first, current, points, settings | {"mask": mask, "guess": guess}, shift


def test_random_pictures_points_and_settings_neither_crash_nor_warn_nor_lie():
    for seed in range(40):
        first, current, points, settings, shift = random_case(np.random.default_rng(seed))
        tracks = correlate(first, current, points, **settings)
        assert_honest(tracks)
        assert np.abs(tracks.displacement[tracks.valid]).max(initial=0) < max(first.shape), f"seed {seed}"
        if shift is not None:
            off = np.abs(tracks.displacement - shift) > WRONG_PX + SIGMAS * tracks.std
            assert not off.any(), f"seed {seed}"
