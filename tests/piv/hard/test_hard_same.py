"""The same answer, whoever asks, and an honest one whatever is asked."""

import cv2
import numpy as np
import pytest

from ploughval.axes import Status
from ploughval.piv import Tracker, correlate
from ploughval.scene import Piv
from ploughval.synth.sand import sand_texture

WRONG_PX = 0.5  # a vector that errs by more is wrong: a hundred times what clean sand gives
SIGMAS = 6.0  # the largest of some hundred normal errors is 3.5; those of textures scatter more
SHIFT = (1.3, -0.6)


# The same answer, whoever asks


@pytest.fixture
def hard_pair(sand, other_sand):
    """Sand with a churned corner, a glare, a band and noise: every kind of retry is needed."""

    def motion(p):
        return np.where(p[:, 1:] < 110, [12.3, -1.2], [2.1, 0.4])

    first, current = sand.picture(noise=3, seed=1), sand.picture(motion, noise=3, seed=2)
    current[:70, :80] = other_sand(sand.shape, 9)[:70, :80]
    first[150:190, 180:230] = current[150:190, 180:230] = 255
    return first, current


def test_threads_do_not_change_a_bit_of_a_hard_pair(sand, hard_pair):
    first, current = hard_pair
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


def test_arguments_are_left_as_they_were(sand, hard_pair):
    first, current = (picture.astype(np.float32) for picture in hard_pair)
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


def test_tracker_comes_through_black_white_and_unrelated_frames(sand, other_sand):
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
    x, y = np.meshgrid(np.arange(w), np.arange(h))
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
        first, current = (np.round(picture.clip(0, 255)) for picture in (first, current))
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


def test_random_pictures_points_and_settings_neither_crash_nor_warn_nor_lie(assert_honest):
    for seed in range(40):
        first, current, points, settings, shift = random_case(np.random.default_rng(seed))
        tracks = correlate(first, current, points, **settings)
        assert_honest(tracks)
        assert np.abs(tracks.displacement[tracks.valid]).max(initial=0) < max(first.shape), f"seed {seed}"
        if shift is not None:
            off = np.abs(tracks.displacement - shift) > WRONG_PX + SIGMAS * tracks.std
            assert not off.any(), f"seed {seed}"
