"""Light and what cameras do: changed light, flashes, blur, compression and noise."""

import cv2
import numpy as np
import pytest

from ploughval.piv import correlate

WRONG_PX = 0.5  # a vector that errs by more is wrong: a hundred times what clean sand gives
SIGMAS = 6.0  # the largest of some hundred normal errors is 3.5; those of textures scatter more
ALIAS_PX = 0.006  # of clean 8 bit sand: grains down to 0.6 px standard deviation alias
SHIFT = (1.3, -0.6)


@pytest.mark.parametrize(("gain", "offset"), [(0.3, 10), (0.6, 20), (1.2, -10), (0.1, 100)])
def test_changed_light_costs_only_what_rounding_costs(sand, gain, offset, assert_covered, rounded):
    current = rounded(sand.picture(SHIFT, kind=np.float32) * gain + offset)
    tracks = correlate(sand.picture(), current, sand.points(12))
    assert tracks.valid.all()
    assert_covered(tracks, SHIFT)
    # Rounding has the standard deviation 0.29 of a contrast of 28 gain: 0.0008 px / gain (test_sequence).
    assert np.abs(tracks.displacement - SHIFT).max() < ALIAS_PX + SIGMAS * 0.0008 / gain


def test_negative_is_refused(sand, assert_honest):
    tracks = correlate(sand.picture(), 255 - sand.picture(), sand.points(20))
    assert_honest(tracks)
    assert not tracks.valid.any()


@pytest.mark.parametrize("kind", ["gain", "lamp"])
@pytest.mark.parametrize("amplitude", [0.3, 0.6])
def test_gradient_of_light_stays_within_its_std(sand, kind, amplitude, assert_covered, rounded, places):
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
def test_flash_that_saturates_part_of_a_frame_gives_no_wrong_vectors(
    sand, size, errors, assert_none_wrong, rounded, places
):
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
def test_black_or_white_frame_gives_no_vectors(sand, grey, assert_honest):
    blank = np.full(sand.shape, grey, np.uint8)
    for first, current in ((sand.picture(), blank), (blank, sand.picture()), (blank, blank)):
        tracks = correlate(first, current, sand.points(30))
        assert_honest(tracks)
        assert not tracks.valid.any()


def jpeg(picture, quality):
    return cv2.imdecode(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], 0)


@pytest.mark.parametrize("subset", [15, 31])
def test_jpeg_of_quality_40_is_measured(sand, subset, assert_none_wrong, assert_covered):
    first, current = jpeg(sand.picture(), 40), jpeg(sand.picture(SHIFT), 40)
    tracks = correlate(first, current, sand.points(9), subset=subset)
    assert tracks.valid.mean() > 0.99
    # Blocks of 8 px quantised alike in both frames: 6 grey levels, twice what noise of 6 would cost 31 px.
    assert_none_wrong(tracks, SHIFT, px=0.1 * 31 / subset * 1.5)
    assert_covered(tracks, SHIFT)


@pytest.mark.parametrize("which", ["reference", "current"])
@pytest.mark.parametrize("sigma", [0.5, 1.0, 1.5, 2.0, 3.0, 5.0])
def test_blur_in_one_picture_only_gives_hardly_a_wrong_vector(
    sand, sigma, which, assert_honest, errors, assert_none_wrong, assert_covered
):
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
def test_motion_blur_of_one_picture_gives_no_wrong_vectors(sand, length, assert_none_wrong):
    streak = np.zeros((length, length), np.float32)
    streak[length // 2] = 1 / length
    tracks = correlate(sand.picture(), cv2.filter2D(sand.picture(SHIFT), -1, streak), sand.points(12))
    assert_none_wrong(tracks, SHIFT)


@pytest.mark.parametrize("noise", [20, 40, 60])
def test_strong_noise_is_told_by_the_std_or_refused(sand, noise, assert_honest, assert_covered):
    first, current = sand.picture(noise=noise, seed=1), sand.picture(SHIFT, noise=noise, seed=2)
    tracks = correlate(first, current, sand.points(12))
    assert_covered(tracks, SHIFT) if tracks.valid.any() else assert_honest(tracks)


def test_pixels_that_stand_still_before_the_sand_are_not_what_is_measured(sand, assert_none_wrong):
    # One hot pixel in a hundred at 255: a contrast of its own of 11, beside 28 of the sand.
    hot = np.random.default_rng(3).random(sand.shape) < 0.01
    first, current = sand.picture(), sand.picture((3.3, -1.6))
    first[hot] = current[hot] = 255
    assert_none_wrong(correlate(first, current, sand.points(12)), (3.3, -1.6))
