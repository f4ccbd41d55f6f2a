"""Depths, subsets, sizes, borders, holes and masks: what is there is used, and what is not does no harm."""

from itertools import product

import cv2
import numpy as np
import pytest

from ploughval.axes import Status
from ploughval.errors import CorrelationError
from ploughval.piv import Description, correlate
from ploughval.synth.sand import sand_texture

ALIAS_PX = 0.006  # of clean 8 bit sand: grains down to 0.6 px standard deviation alias
SHIFT = (1.3, -0.6)


# Depth, subsets, sizes


@pytest.mark.parametrize(
    ("first", "second"),
    list(product([np.uint8, np.uint16, np.float32], repeat=2)),
    ids=lambda kind: kind.__name__,
)
def test_depth_of_either_picture_changes_neither_vectors_nor_their_std(
    sand, first, second, assert_honest, assert_covered
):
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
def test_subsets_of_9_to_101_px_measure_clean_sand(
    sand, subset, order, noise, assert_none_wrong, assert_covered
):
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
def test_narrow_pictures_are_measured_where_a_subset_fits(shape, subset, assert_none_wrong, rounded, places):
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


def test_points_outside_the_picture_or_in_its_corners_are_at_the_edge_and_do_no_harm(sand, assert_honest):
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


def test_border_of_the_picture_counts_only_the_pixels_there_are(sand, assert_honest):
    picture = sand.picture()
    points = np.array([[0, 110], [3, 110], [5, 3], [259, 110], [256, 100], [15, 15], [14, 15]], float)
    tracks = correlate(picture, picture, points)
    assert_honest(tracks)
    # 31 x 31 cut at the border; (5, 3): 21 x 19 are 0.415 of it, more than the 0.4 that are needed.
    whole = [16 * 31, 19 * 31, 21 * 19, 16 * 31, 19 * 31, 31 * 31, 30 * 31]
    assert tracks.valid.all()
    assert tracks.pixels.tolist() == whole


def test_points_on_the_border_are_measured_from_what_is_left_of_their_subsets(
    sand, assert_none_wrong, assert_covered
):
    x, y = np.meshgrid([0, 1, 2, 4, 8, 12, 130, 250, 259], [0, 1, 3, 6, 10, 110, 200, 215, 219])
    points = np.stack([x.ravel(), y.ravel()], axis=1).astype(float)
    for shift in (SHIFT, (-2.4, 3.3), (8.3, -9.2)):
        tracks = correlate(sand.picture(), sand.picture(shift), points)
        assert_none_wrong(tracks, shift, px=0.25)
        assert_covered(tracks, shift)
        assert tracks.valid.mean() > 0.35  # up to half of them have left the picture
        assert (tracks.status[~tracks.valid] == Status.EDGE).all()


@pytest.mark.parametrize("where", ["reference", "current", "both"])
def test_hole_of_nan_is_left_out_and_the_sand_around_it_measured(sand, where, assert_none_wrong):
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


def test_single_dead_pixels_of_nan_cost_nothing_but_pixels(sand, assert_none_wrong):
    first, current = sand.picture(kind=np.float32), sand.picture(SHIFT, kind=np.float32)
    rng, points = np.random.default_rng(1), sand.points(12)
    for picture in (first, current):
        picture[rng.random(sand.shape) < 0.001] = np.nan
    tracks = correlate(first, current, points)
    assert tracks.valid.all()
    assert_none_wrong(tracks, SHIFT, px=0.01)
    assert (tracks.pixels < 31 * 31).any()


@pytest.mark.parametrize("where", ["reference", "current", "both"])
def test_picture_of_nan_gives_no_vectors(sand, where, assert_honest):
    nothing, picture = np.full(sand.shape, np.nan, np.float32), sand.picture(kind=np.float32)
    first = picture if where == "current" else nothing
    current = picture if where == "reference" else nothing
    tracks = correlate(first, current, sand.points(30))
    assert_honest(tracks)
    assert not tracks.valid.any()


def masks(shape):
    x, y = np.meshgrid(np.arange(shape[1]), np.arange(shape[0]))
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
def test_subset_uses_the_pixels_of_any_mask_and_says_how_many(sand, name, assert_none_wrong):
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


def test_empty_mask_masks_every_point(sand, assert_honest):
    tracks = correlate(sand.picture(), sand.picture(), sand.points(40), mask=np.zeros(sand.shape, bool))
    assert (tracks.status == Status.MASKED).all()
    assert_honest(tracks)
