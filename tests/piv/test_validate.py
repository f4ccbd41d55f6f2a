"""Vectors that differ from their neighbours by more than noise are found, and no others."""

import numpy as np

from ploughval.piv.validate import neighbours_of, outliers


def grid(n=12, spacing=10.0):
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    return np.stack([x.ravel(), y.ravel()], axis=1) * spacing


def test_lone_wrong_vectors_are_found_and_no_others():
    points = grid()
    moved = points * 0.02 + np.random.default_rng(3).normal(0, 0.02, points.shape)
    wrong = np.array([15, 70, 101])
    moved[wrong] += [2.0, -1.5]
    assert np.flatnonzero(outliers(points, moved)).tolist() == wrong.tolist()


def test_jump_at_a_shear_band_is_not_an_outlier():
    points = grid()
    for angle in np.deg2rad([0, 25, 45, 60]):
        side = (points - 55) @ [np.sin(angle), np.cos(angle)] > 0.1
        moved = np.where(side[:, None], [6.0, -2.0], [0.0, 0.0])
        moved = moved + np.random.default_rng(4).normal(0, 0.01, moved.shape)
        assert not outliers(points, moved).any()


def test_missing_vectors_are_neither_tested_nor_used():
    points = grid()
    moved = np.zeros_like(points)
    moved[::2] = np.nan
    moved[61] = [3.0, 0.0]
    assert np.flatnonzero(outliers(points, moved)).tolist() == [61]


def test_neighbours_are_the_nearest_and_never_oneself():
    points = grid(5)
    near = neighbours_of(points, 4)
    distance = np.linalg.norm(points[near[12]] - points[12], axis=1)
    assert distance.tolist() == [10.0] * 4
    assert (neighbours_of(points[:1], 3) == 1).all()
