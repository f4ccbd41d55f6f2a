"""Vectors between two exact pictures: shift, stretch, turn and curvature are recovered, the rest refused."""

import numpy as np
import pytest

from ploughval.axes import Status
from ploughval.errors import CorrelationError
from ploughval.piv import Description, correlate


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("shift", [(0.25, -0.5), (0.8, 0.1)])
@pytest.mark.parametrize("spline", [3, 5])
def test_subpixel_shift_is_recovered(sand, shift, spline):
    # Grains down to 0.6 px standard deviation alias, which no interpolation undoes: 0.0015 and 0.005 px.
    points = sand.points(10)
    tracks = correlate(sand.picture(), sand.picture(shift), points, spline=spline)
    assert tracks.valid.all()
    bias = np.abs((tracks.displacement - shift).mean(axis=0))
    assert (bias < (0.0015 if spline == 5 else 0.005)).all()
    assert rms(tracks.displacement - shift) < (0.003 if spline == 5 else 0.007)


@pytest.mark.parametrize("kind", [np.uint16, np.float32])
def test_deep_pictures_keep_their_depth(sand, kind):
    shift = (0.3, 0.4)
    tracks = correlate(sand.picture(kind=kind), sand.picture(shift, kind=kind), sand.points(20))
    # Without 8 bit rounding only the aliasing bias is left.
    assert tracks.valid.all()
    assert np.std(tracks.displacement - shift) < 0.0012


def test_affine_motion_and_its_gradient_are_recovered(sand):
    gradient = np.array([[0.02, 0.03 - 0.026], [0.026, 0.0]])

    def motion(p):
        return (p - 120) @ gradient.T

    points = sand.points(12, margin=30)
    tracks = correlate(sand.picture(), sand.picture(motion), points)
    assert tracks.valid.all()
    assert rms(tracks.displacement - motion(points)) < 0.0025  # rounding to 8 bit alone gives about 0.0012
    assert rms(tracks.gradient - gradient) < 5e-4


def test_point_between_pixels_gets_the_displacement_at_its_own_place(sand):
    def motion(p):
        return (p - 120) * [0.05, 0.0]

    points = sand.points(25, margin=40) + np.array([0.45, -0.35])
    tracks = correlate(sand.picture(), sand.picture(motion), points)
    # Taking the centre pixel's displacement would be wrong by 0.05 * 0.45 = 0.022 px.
    assert np.abs(tracks.displacement - motion(points)).max() < 0.01


def test_curvature_that_affine_subsets_average_is_followed(sand):
    def motion(p):
        return np.stack([2e-3 * (p[:, 0] - 130) ** 2 / 2, 0 * p[:, 0]], axis=1)

    points = sand.points(20, margin=50)
    first, current = sand.picture(), sand.picture(motion)
    affine = correlate(first, current, points, shape="fixed").displacement - motion(points)
    quadratic = correlate(first, current, points, order=2, shape="fixed").displacement - motion(points)
    adaptive = correlate(first, current, points)
    # Closed form of the affine bias: c/2 <x^2> = 1e-3 * (31^2 - 1) / 12 = 0.08 px.
    assert affine[:, 0].mean() == pytest.approx(0.08, rel=0.15)
    assert abs(quadratic[:, 0].mean()) < 0.004
    assert abs((adaptive.displacement - motion(points))[:, 0].mean()) < 0.004
    assert np.isin(adaptive.description, (Description.QUADRATIC, Description.QUADRATIC_SMALL)).mean() > 0.9


@pytest.mark.parametrize(("order", "periods"), [(1, 4.0), (2, 1.3)])
def test_nine_tenths_of_a_wave_are_kept_at_the_period_that_the_order_of_the_subset_sets(sand, order, periods):
    # docs/theory-correlation.md, section 6
    wave = 2 * np.pi / (periods * 31)

    def motion(where):
        return np.stack([np.zeros(len(where)), 0.5 * np.sin(wave * where[:, 0])], axis=1)

    points = sand.points(5, margin=20)
    tracks = correlate(sand.picture(), sand.picture(motion), points, order=order, shape="fixed")
    truth = motion(points)[tracks.valid, 1]
    kept = tracks.displacement[tracks.valid, 1] @ truth / (truth @ truth)
    assert kept == pytest.approx(0.9, abs=0.025)


@pytest.mark.parametrize("shift", [(17.3, -3.2), (-60.4, 20.7)])
def test_displacement_far_beyond_the_subset_needs_no_hint(sand, shift):
    points = sand.points(10)
    arrived = points + shift
    points = points[((arrived > 16) & (arrived < np.array(sand.shape[::-1]) - 17)).all(axis=1)]
    tracks = correlate(sand.picture(), sand.picture(shift), points)
    assert tracks.valid.all()
    assert rms(tracks.displacement - shift) < 0.004


def test_identical_pictures_do_not_move(sand):
    picture = sand.picture()
    tracks = correlate(picture, picture, sand.points(15))
    assert tracks.valid.all()
    assert np.abs(tracks.displacement).max() < 1e-4
    assert tracks.zncc.min() > 0.999999


def test_unrelated_pictures_give_no_vectors(sand):
    rng = np.random.default_rng(5)
    other = sand.picture()[rng.permutation(sand.shape[0])][:, ::-1]
    tracks = correlate(sand.picture(), np.ascontiguousarray(other), sand.points(25))
    assert tracks.valid.mean() < 0.02
    assert np.isnan(tracks.displacement[~tracks.valid]).all()
    assert np.isnan(tracks.std[~tracks.valid]).all()


def test_flat_picture_is_flat():
    flat = np.full((80, 90), 128, np.uint8)
    tracks = correlate(flat, flat, [[40.0, 40.0], [50.0, 30.0]])
    assert (tracks.status == Status.FLAT).all()


def test_masked_pixels_do_not_pull_on_the_vectors(sand):
    shift = np.array([1.4, -0.3])
    first, current = sand.picture(), sand.picture(shift)
    mask = np.ones(sand.shape, bool)
    mask[:100] = False
    rng = np.random.default_rng(1)
    still = rng.integers(0, 255, (100, sand.shape[1]), np.uint8)
    first[:100], current[:97] = still, still[:97]  # what is masked stands still
    points = np.array([[x, y] for x in (60.0, 130.0, 200.0) for y in (50.0, 104.0, 112.0)])
    tracks = correlate(first, current, points, mask=mask, guess=np.tile([1.0, 0.0], (9, 1)))
    covered = points[:, 1] == 50
    assert (tracks.status[covered] == Status.MASKED).all()
    assert tracks.valid[~covered].all()
    assert np.abs(tracks.displacement[~covered] - shift).max() < 0.02


def test_subset_beyond_the_edge_says_edge_and_one_that_reaches_over_it_is_measured(sand):
    shift = (0.3, 0.2)
    tracks = correlate(sand.picture(), sand.picture(shift), [[-9.0, 50.0], [6.0, 60.0], [120.0, 110.0]])
    assert tracks.status.tolist() == [Status.EDGE, Status.OK, Status.OK]
    assert np.abs(tracks.displacement[1:] - shift).max() < 0.02


def test_thread_count_does_not_change_a_bit(sand):
    first, current, points = (
        sand.picture(noise=2, seed=1),
        sand.picture((3.3, 1.2), noise=2, seed=2),
        sand.points(9),
    )
    one, two = (correlate(first, current, points, workers=w) for w in (1, 2))
    for name in ("displacement", "gradient", "std", "zncc", "status"):
        assert getattr(one, name).tobytes() == getattr(two, name).tobytes()


@pytest.mark.parametrize("transform", ["mirror", "transpose", "gain"])
def test_displacement_follows_mirror_transposition_and_ignores_gain(sand, transform):
    shift = np.array([1.3, -0.6])
    first, current = sand.picture(kind=np.float32), sand.picture(shift, kind=np.float32)
    points = sand.points(30)
    plain = correlate(first, current, points).displacement
    if transform == "mirror":
        width = sand.shape[1]
        turned = np.stack([width - 1 - points[:, 0], points[:, 1]], axis=1)
        other = correlate(first[:, ::-1], current[:, ::-1], turned).displacement * [-1, 1]
    elif transform == "transpose":
        other = correlate(first.T, current.T, points[:, ::-1]).displacement[:, ::-1]
    else:
        other = correlate(first, current * np.float32(0.7) + 20, points).displacement
    # Gauss-Newton stops within 3e-4 px of its limit.
    assert np.abs(other - plain).max() < 5e-4


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"points": [[1.0, 2.0, 3.0]]}, "expected \\(N, 2\\)"),
        ({"points": [[np.nan, 2.0]]}, "finite"),
        ({"subset": 30}, "odd"),
        ({"order": 3}, "order is 3"),
        ({"spline": 4}, "spline is 4"),
        ({"current": np.zeros((50, 60), np.uint8)}, "one shape"),
        ({"current": np.zeros((220, 260, 3), np.uint8)}, "grey picture"),
        ({"mask": np.ones((5, 5), bool)}, "mask is"),
        ({"guess": [[0.0, 0.0]]}, "guess has"),
        ({"noise": -3.0}, "noise is -3.0"),
        ({"noise": np.nan}, "noise is nan"),
        ({"workers": 0}, "workers is 0"),
        ({"shape": "free"}, "shape is 'free'"),
    ],
)
def test_bad_input_is_refused_in_words(sand, change, text):
    given = {
        "reference": sand.picture(),
        "current": sand.picture(),
        "points": [[50.0, 50.0], [60.0, 60.0]],
    } | change
    with pytest.raises(CorrelationError, match=text):
        correlate(given.pop("reference"), given.pop("current"), given.pop("points"), **given)


@pytest.mark.parametrize("kind", [bool, float, np.int64])
def test_mask_may_be_of_any_type_and_every_number_but_zero_is_usable(sand, kind):
    mask = np.zeros(sand.shape, kind)
    mask[60:] = {bool: True, float: 0.5, np.int64: 256}[kind]
    tracks = correlate(sand.picture(), sand.picture((1.2, 0.4)), [[100.0, 40.0], [100.0, 120.0]], mask=mask)
    assert tracks.status.tolist() == [Status.MASKED, Status.OK]


@pytest.mark.parametrize("mask", [None, np.ones((220, 260), bool)])
def test_points_outside_the_picture_are_edge_with_and_without_a_mask(sand, mask):
    tracks = correlate(
        sand.picture(), sand.picture((0.3, 0.2)), [[-3.0, 100.0], [100.0, 222.0], [100.0, 100.0]], mask=mask
    )
    assert tracks.status.tolist() == [Status.EDGE, Status.EDGE, Status.OK]


def test_stretched_subset_that_reaches_over_the_border_reads_its_pixels_rightly(sand):
    def motion(p):
        return (p - [130, 110]) * [0.05, 0.04]

    points = np.array([[x, y] for x in range(14, 22) for y in range(60, 160, 6)], float)
    tracks = correlate(sand.picture(kind=np.float32), sand.picture(motion, kind=np.float32), points)
    assert tracks.valid.all()
    # Rigid grains under 5 % of stretch leave some hundredths of a px; a wrong cell of the spline left more.
    assert rms(tracks.displacement - motion(points)) < 0.04


def test_wrong_hints_beside_a_moving_block_are_mended(sand):
    def motion(p):
        return np.where(p[:, 1:] < 110, [50.0, 0.0], [0.0, 0.0])

    points = sand.points(12, margin=30)
    points = points[np.abs(points[:, 1] - 110) > 16]
    guess = motion(points)
    guess[points[:, 1] > 110] = [25.0, 9.0]
    tracks = correlate(sand.picture(), sand.picture(motion), points, guess=guess)
    still = points[:, 1] > 110
    assert tracks.valid[still].all()
    assert np.abs(tracks.displacement[still]).max() < 0.01


def test_no_points_give_no_vectors(sand):
    tracks = correlate(sand.picture(), sand.picture(), np.zeros((0, 2)))
    assert tracks.displacement.shape == (0, 2)
    assert tracks.gradient.shape == (0, 2, 2)
