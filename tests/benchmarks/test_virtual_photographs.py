"""Clusters of grains on particles: homogeneous motion is carried exactly, torn sand is not stretched."""

from dataclasses import replace

import numpy as np
import pytest

from ploughval.scene import load_scene
from virtual.photographs import (
    OPTIONS,
    VirtualRun,
    bounded,
    gradients,
    make_virtual_folder,
    neighbours_of,
    put_grains,
)


def lattice(rows=20, columns=40, cell=0.625):
    y, x = np.mgrid[:rows, :columns] * cell
    return np.column_stack([x.ravel(), y.ravel() - 5.0])


def run_of(*places):
    return VirtualRun(np.arange(len(places)) * 0.5, np.stack(places), 5.0, 6.0, 25.0, 6.0)


def test_a_homogeneous_motion_is_fitted_and_carried_exactly():
    first = lattice()
    motion = np.array([[1.05, 0.2], [-0.1, 0.9]])
    now = first @ motion.T + [3.0, -1.0]
    found = gradients(first, now, neighbours_of(first), np.arange(len(first)))
    np.testing.assert_allclose(found, np.broadcast_to(motion, found.shape), atol=1e-9)
    clusters = put_grains(np.random.default_rng(1), run_of(first, now), OPTIONS)
    begin = clusters.places(first, first)
    np.testing.assert_allclose(clusters.places(first, now), begin @ motion.T + [3.0, -1.0], atol=1e-9)
    # the grains stand for the whole area of the particles' cells
    area_px = len(first) * (0.625 / OPTIONS.mm_per_px) ** 2
    assert clusters.grains.areas_px.sum() == pytest.approx(area_px, rel=0.02)  # 8000 grains of uneven size


def test_turns_are_kept_and_stretches_bounded():
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    assert np.allclose(bounded(turn[None])[0], turn)
    stretch = np.linalg.svd(bounded((turn @ np.diag([9.0, 0.05]))[None])[0], compute_uv=False)
    np.testing.assert_allclose(stretch, [1.6, 0.6])


def test_sand_beside_a_tear_keeps_the_motion_of_its_own_side():
    first = lattice()
    now = first.copy()
    now[first[:, 0] > 12.0] += [0.0, 8.0]
    found = gradients(first, now, neighbours_of(first), np.arange(len(first)))
    beside = np.abs(first[:, 0] - 12.0) < 0.7
    np.testing.assert_allclose(found[beside], np.broadcast_to(np.eye(2), found[beside].shape), atol=1e-9)


def test_frames_between_lie_on_straight_ways():
    first = lattice()
    run = run_of(first, np.add(first, [0.6, 0.3])).between(3)
    np.testing.assert_allclose(run.u_mm, [0, 1 / 6, 1 / 3, 0.5])
    np.testing.assert_allclose(run.places_mm[1], np.add(first, [0.2, 0.1]))


def test_a_folder_of_photographs_is_accepted(tmp_path):
    first = lattice()
    view = make_virtual_folder(
        tmp_path, run_of(first, np.add(first, [0.6, 0.3])), replace(OPTIONS, layers_mm=(1.0,))
    )
    scene = load_scene(tmp_path)
    assert scene.camera.tip_px == view.tip_px
    assert len(scene.matches(scene.camera.photos)) == 2
    assert scene.loadcells is None
