"""Painted discs: their cover is an area."""

import math

import numpy as np
import pytest

from ploughval.synth.discs import disc_cover


@pytest.mark.parametrize(("centre", "radius"), [((4.2, 3.9), 2.5), ((10.5, 12.3), 4.0), ((20.1, 17.7), 9.3)])
def test_cover_adds_up_to_the_area_and_its_middle_is_the_centre(centre, radius):
    cover = disc_cover((30, 32), centre, radius)
    y, x = np.indices(cover.shape)
    assert cover.sum() == pytest.approx(math.pi * radius**2, rel=1e-12)
    # pixels are flat: the middle of the covered part of a pixel is not the pixel's, but the odd parts cancel
    assert (cover * x).sum() / cover.sum() == pytest.approx(centre[0], abs=0.03)
    assert (cover * y).sum() / cover.sum() == pytest.approx(centre[1], abs=0.03)


def test_cover_of_each_pixel_agrees_with_counting_points():
    cover, fine = disc_cover((12, 14), (6.3, 4.8), 3.7), 200
    y, x = (np.indices((12 * fine, 14 * fine)) + 0.5) / fine - 0.5
    inside = (x - 6.3) ** 2 + (y - 4.8) ** 2 < 3.7**2
    counted = inside.reshape(12, fine, 14, fine).mean(axis=(1, 3))
    np.testing.assert_allclose(cover, counted, atol=3e-4)


def test_disc_beyond_the_border_is_cut_off():
    whole = disc_cover((30, 30), (15.2, 14.9), 6.0)
    cut = disc_cover((30, 30), (0.2, 14.9), 6.0)
    np.testing.assert_allclose(cut[:, :14], whole[:, 15:29], atol=1e-12)
    assert not disc_cover((30, 30), (-20.0, 5.0), 6.0).any()
