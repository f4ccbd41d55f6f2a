"""Beside a shear band, and inside one, subsets do not average the two sides."""

import numpy as np
import pytest

from ploughval.axes import Status
from ploughval.piv import Description, correlate

ANGLE = np.deg2rad(25)
ALONG = np.array([np.cos(ANGLE), -np.sin(ANGLE)])
ACROSS = np.array([-np.sin(ANGLE), -np.cos(ANGLE)])
JUMP = 5.4


def side(points):
    """Distance from a line through the picture's middle, px, positive above it."""
    return (points - [130, 110]) @ ACROSS


def band(width):
    """Block above the line, moving along it; the jump is spread over ``width`` px (0: a cut)."""

    def motion(p):
        s = side(p)
        share = (1 + np.tanh(s / (width / 2))) / 2 if width else (s > 0).astype(float)
        return JUMP * share[:, None] * ALONG

    return motion


def measured(sand, width, spacing=8):
    points = sand.points(spacing, margin=28)
    motion = band(width)
    tracks = correlate(sand.picture(noise=1, seed=1), sand.picture(motion, noise=1, seed=2), points)
    return tracks, tracks.displacement - motion(points), np.abs(side(points))


def test_points_a_quarter_of_a_subset_from_a_cut_do_not_average_its_two_sides(sand):
    tracks, error, distance = measured(sand, 0)
    near = (distance > 8) & (distance < 15.5)
    assert near.sum() > 40
    assert tracks.valid[near].mean() > 0.97
    # Half a subset at noise 1 allows 0.005 px; a whole affine subset errs by a pixel here.
    assert np.nanmedian(np.abs(error[near])) < 0.01
    assert np.sqrt(np.nanmean(error[near] ** 2)) < 0.04
    assert (tracks.description[near] != Description.PLAIN).mean() > 0.9


@pytest.mark.parametrize(("width", "most_px"), [(12, 0.05), (4, 0.10)])
def test_points_inside_a_band_follow_its_profile(sand, width, most_px):
    # The motion changes by up to 5.4 / width px a px: 0.05 px are 0.11 px of the band's place at 12 px, and
    # 0.10 px are 0.07 px of it at 4 px.
    tracks, error, distance = measured(sand, width)
    near = distance < 15.5
    assert tracks.valid[near].mean() > 0.99
    assert np.sqrt(np.nanmean(error[near] ** 2)) < most_px


def test_far_from_the_band_nothing_changes(sand):
    tracks, error, distance = measured(sand, 12)
    far = distance > 26
    assert tracks.valid[far].all()
    assert np.sqrt(np.mean(error[far] ** 2)) < 0.006


@pytest.mark.parametrize("rows", [(60, 160)])
def test_churned_sand_gets_no_vectors(sand, rows):
    current = sand.picture((3.0, 0.0))
    churned = np.random.default_rng(3).permutation(current[rows[0] : rows[1]].ravel())
    current[rows[0] : rows[1]] = churned.reshape(-1, current.shape[1])
    points = sand.points(12, margin=24)
    tracks = correlate(sand.picture(), current, points)
    inside = (points[:, 1] > rows[0] + 8) & (points[:, 1] < rows[1] - 8)
    assert not tracks.valid[inside].any()
    refused = [Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.OUTLIER]
    assert np.isin(tracks.status[inside], refused).all()
    outside = (points[:, 1] < rows[0] - 16) | (points[:, 1] > rows[1] + 16)
    assert tracks.valid[outside].all()
