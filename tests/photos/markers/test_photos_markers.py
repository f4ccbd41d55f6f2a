"""Markers in drawn photographs: discs painted by exact area, so that every centre is known."""

import math

import cv2
import numpy as np
import pytest

from ploughval.photos.markers.find import find_markers
from ploughval.synth.discs import disc_cover
from ploughval.synth.sand import sand_texture

PALE, CONTRAST, NOISE = 180.0, 60.0, 4.0


def field(seed, radius, *, rows=3, columns=4, blur=0.0, disc=2.4, ring_px=0.0, dark=True):
    """Sand with markers on pale discs: picture without noise, and their centres (N, 2)."""
    rng = np.random.default_rng(seed)
    pitch = int(7 * radius + 24)
    shape = (rows * pitch, columns * pitch)
    picture = sand_texture(rng, shape).picture(shape).astype(float)
    inner = PALE - CONTRAST if dark else PALE + CONTRAST
    centres = []
    for k in range(rows * columns):
        centre = np.array([k % columns + 0.5, k // columns + 0.5]) * pitch + rng.uniform(-1, 1, 2)
        whole = disc_cover(shape, tuple(centre), disc * radius)
        cover = disc_cover(shape, tuple(centre), radius + ring_px / 2)
        if ring_px:
            cover -= disc_cover(shape, tuple(centre), radius - ring_px / 2)
        picture = picture * (1 - whole) + whole * PALE
        picture = picture * (1 - cover) + cover * inner
        centres.append(centre)
    if blur:
        picture = cv2.GaussianBlur(picture, (0, 0), blur)
    return picture, np.array(centres), rng


def expose(picture, rng, noise=NOISE):
    return np.clip(np.rint(picture + noise * rng.standard_normal(picture.shape)), 0, 255).astype(np.uint8)


def nearby(centres, rng, px):
    return centres + rng.uniform(-px, px, centres.shape)


def cover_from(picture, centre, radius, angle, share, grey):
    """A sheet of one grey with a straight edge over a share of the marker's diameter."""
    y, x = np.indices(picture.shape)
    along = (x - centre[0]) * math.cos(angle) + (y - centre[1]) * math.sin(angle)
    sheet = np.clip(along - (radius - 2 * radius * share) + 0.5, 0, 1)
    sheet[np.hypot(x - centre[0], y - centre[1]) > 3 * radius] = 0.0
    return picture * (1 - sheet) + sheet * grey


@pytest.mark.parametrize(
    ("radius", "blur", "rms_px"),
    [(4, 0.0, 0.03), (4, 1.0, 0.06), (8, 0.0, 0.025), (8, 1.0, 0.045), (16, 2.0, 0.045), (40, 2.0, 0.03)],
)
def test_dots_are_found_to_what_their_noise_allows(radius, blur, rms_px):
    # the bound of Cramer and Rao for a known blur is 0.019, 0.036, 0.013, 0.025, 0.026 and 0.016 px
    picture, centres, rng = field(radius, radius, blur=blur, rows=2 if radius > 20 else 3)
    found = find_markers(expose(picture, rng), nearby(centres, rng, 0.5 * radius), radius)
    assert found.reasons == ("",) * len(centres)
    assert np.sqrt(np.mean((found.px - centres) ** 2)) < rms_px
    np.testing.assert_allclose(found.radius_px, radius, rtol=0.06)


@pytest.mark.parametrize("dark", [True, False])
def test_dark_and_pale_markers_are_told_from_the_picture(dark):
    picture, centres, rng = field(1, 7, dark=dark, rows=2)
    found = find_markers(expose(picture, rng), nearby(centres, rng, 4.0), 7.0)
    assert found.found.all()
    np.testing.assert_allclose(found.contrast_grey, -CONTRAST if dark else CONTRAST, atol=4.0)


def test_drawn_circles_are_found_by_their_line():
    picture, centres, rng = field(2, 12, ring_px=3.0, blur=0.7, rows=2)
    found = find_markers(expose(picture, rng), nearby(centres, rng, 5.0), 12.0, kind="ring")
    assert found.found.all()
    assert np.sqrt(np.mean((found.px - centres) ** 2)) < 0.03
    np.testing.assert_allclose(found.radius_px, 12.0, atol=0.1)


def test_stated_stds_cover_the_errors():
    ratios = []
    for seed in range(6):
        picture, centres, rng = field(seed, 8, blur=0.5, rows=5, columns=6)
        found = find_markers(expose(picture, rng), nearby(centres, rng, 2.0), 8.0, reach_px=5.0)
        ratios.append((found.px - centres) / found.std_px)
    off = np.abs(np.concatenate(ratios).ravel())
    assert off.size == 360  # one std of the counted shares: 2.5 % and 1.1 %
    assert 0.62 < np.mean(off < 1) < 0.75
    assert 0.92 < np.mean(off < 2) < 0.98


def test_sixteen_bits_say_the_same_as_eight():
    picture, centres, rng = field(3, 8, rows=1)
    seen = np.clip(picture + NOISE * rng.standard_normal(picture.shape), 0, 255)
    wide = find_markers(np.rint(seen * 257).astype(np.uint16), centres, 8.0)
    narrow = find_markers(np.rint(seen).astype(np.uint8), centres, 8.0)
    np.testing.assert_allclose(
        wide.px, narrow.px, atol=0.004
    )  # 0.3 grey levels of rounding against 4 of noise


@pytest.mark.parametrize("share", [0.25, 0.5])
def test_half_covered_marker_is_found_by_the_rim_that_is_left(share):
    off, found_ones = [], 0
    for seed in range(3):
        picture, centres, rng = field(10 + seed, 9, rows=2)
        for k in (1, 6):
            picture = cover_from(picture, centres[k], 9.0, rng.uniform(0, 2 * np.pi), share, 215.0)
        found = find_markers(expose(picture, rng), nearby(centres, rng, 2.0), 9.0)
        off += [*(found.px - centres)[[1, 6]].ravel()]
        found_ones += int(found.found[[1, 6]].sum())
        assert (found.seen[[1, 6]] < 0.8).all()
    assert found_ones == 6
    assert np.sqrt(np.mean(np.square(off))) < 0.06
    assert np.abs(off).max() < 0.2


def test_patch_of_glare_on_the_rim_is_left_out():
    off = []
    for seed in range(3):
        picture, centres, rng = field(20 + seed, 9, rows=2)
        y, x = np.indices(picture.shape)
        for k in (0, 5):
            angle = rng.uniform(0, 2 * np.pi)
            spot = centres[k] + 9.0 * np.array([math.cos(angle), math.sin(angle)])
            picture = picture + 90 * np.exp(-0.5 * ((x - spot[0]) ** 2 + (y - spot[1]) ** 2) / 4.0**2)
        found = find_markers(expose(picture, rng), nearby(centres, rng, 2.0), 9.0)
        assert found.found[[0, 5]].all()
        off += [*(found.px - centres)[[0, 5]].ravel()]
    assert np.sqrt(np.mean(np.square(off))) < 0.08


def test_light_that_changes_across_a_marker_moves_nothing():
    picture, centres, rng = field(4, 8, rows=2)
    light = np.linspace(0.7, 1.3, picture.shape[1])  # some 4 % from rim to rim
    found = find_markers(expose(picture * light, rng), nearby(centres, rng, 2.0), 8.0)
    assert np.abs(np.mean((found.px - centres)[:, 0])) < 0.02
    assert np.sqrt(np.mean((found.px - centres) ** 2)) < 0.03


def test_marker_that_is_not_there_costs_only_itself_and_is_named():
    picture, centres, rng = field(5, 9, rows=2)
    asked = centres.copy()
    asked[2] += (0.0, 31.0)  # sand between markers
    asked[4] = (-30.0, 12.0)
    found = find_markers(expose(picture, rng), asked, 9.0, reach_px=10.0)
    assert list(np.flatnonzero(~found.found)) == [2, 4]
    assert "nothing round of radius 9 px within 10 px" in found.reasons[2]
    assert "outside the picture" in found.reasons[4]
    assert np.isnan(found.px[[2, 4]]).all()
    assert np.isnan(found.std_px[[2, 4]]).all()


def test_two_markers_within_reach_are_refused():
    picture, centres, rng = field(6, 7, rows=1)
    middle = (centres[0] + centres[1]) / 2
    found = find_markers(expose(picture, rng), [middle], 7.0, reach_px=45.0)
    assert "two markers within 45 px" in found.reasons[0]


def test_marker_of_another_size_is_refused_with_its_size():
    picture, centres, rng = field(7, 12, rows=1, disc=2.5)
    found = find_markers(expose(picture, rng), centres, 7.0, reach_px=8.0)
    assert not found.found.any()
    assert all("px" in reason for reason in found.reasons)


@pytest.mark.parametrize("radius", [6.0, 10.0])
def test_plain_sand_holds_no_markers(radius):
    rng = np.random.default_rng(8)
    image = expose(sand_texture(rng, (300, 300)).picture((300, 300)), rng, 2.0)
    found = find_markers(image, rng.uniform(50, 250, (12, 2)), radius)
    assert not found.found.any()


def test_noise_of_a_fifth_of_the_contrast_is_still_a_marker():
    picture, centres, rng = field(9, 8, blur=0.7, rows=2)
    found = find_markers(expose(picture, rng, 12.0), nearby(centres, rng, 2.0), 8.0)
    assert found.found.all()
    # three times the noise of the other cases: three times their 0.027 px
    assert np.sqrt(np.mean((found.px - centres) ** 2)) < 0.11


@pytest.mark.parametrize("radius", [2.0, 300.0, 1e4])
def test_markers_smaller_than_grains_or_larger_than_the_picture_are_not_found_and_named(radius):
    picture, centres, rng = field(11, 8, rows=1, columns=2)
    found = find_markers(expose(picture, rng), centres, radius)
    assert np.isnan(found.px).all()
    assert all("nothing round" in reason for reason in found.reasons)
