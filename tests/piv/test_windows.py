"""Windows that follow sand past a sweeping band, or refuse."""

import cv2
import numpy as np
import pytest

from ploughval.axes import Status
from ploughval.piv import Tracker
from ploughval.piv.guess import Greys
from ploughval.piv.windows import margin_of, rank_windows, shapes_of
from ploughval.scene import Piv

FRAMES, STEP, PARTS = 6, 4.0, 16
TIP, OUTCROP = np.array([35.0, 190.0]), np.array([235.0, 60.0])


def swept(points, frame):
    """Places after a blade's advance by STEP px a frame: the line from its tip to a fixed outcrop turns, and
    what is above it moves along it."""
    place = np.array(points, float)
    for part in range(frame * PARTS):
        tip = TIP + np.array([STEP * part / PARTS, 0.0])
        along = (OUTCROP - tip) / (OUTCROP - tip)[0]
        above = place[:, 1] < tip[1] + (place[:, 0] - tip[0]) * along[1]
        place[above] += STEP / PARTS * along
    return place


def departs(points, frame, radius):
    """Farthest that sand in a ring about each point has departed from the point's own motion, px."""
    own = swept(points, frame) - points
    angles = np.arange(16) * np.pi / 8
    rings = points[:, None] + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    moved = swept(rings.reshape(-1, 2), frame).reshape(rings.shape) - rings
    return np.linalg.norm(moved - own[:, None], axis=2).max(axis=1)


def follow(sand, workers=1):
    points = sand.points(9, margin=34)
    everywhere = np.ones(sand.shape, bool)
    tracker = Tracker(Piv(), workers)
    tracker.start(sand.picture(noise=2, seed=0), points, everywhere)
    found = [
        tracker.advance(sand.picture(lambda p, f=f: swept(p, f) - p, noise=2, seed=f), everywhere)
        for f in range(1, FRAMES + 1)
    ]
    return points, found


@pytest.fixture(scope="module")
def followed(sand):
    return follow(sand)


def test_sand_that_is_whole_about_its_point_is_followed_past_a_sweeping_band(followed):
    points, found = followed
    whole = np.stack([departs(points, f, 5.0) < 0.25 for f in range(1, FRAMES + 1)])
    beside = np.stack([departs(points, f, 15.0) > 0.5 for f in range(1, FRAMES + 1)]) & whole
    valid = np.stack([p.status == Status.OK for p in found])
    truth = np.stack([swept(points, f) for f in range(1, FRAMES + 1)])
    error = np.linalg.norm(np.stack([p.position_px for p in found]) - truth, axis=2)
    assert beside.sum() > 200
    assert valid[whole].mean() > 0.97
    assert valid[beside].mean() > 0.9
    # Noise 2 on both pictures and contrast 28 allow a window of 13 px 0.02 px.
    assert np.median(error[valid & beside]) < 0.03
    assert np.quantile(error[valid & beside], 0.95) < 0.1


def test_sand_that_a_band_has_sheared_is_refused_rather_than_misplaced(followed):
    points, found = followed
    truth = np.stack([swept(points, f) for f in range(1, FRAMES + 1)])
    error = np.linalg.norm(np.stack([p.position_px for p in found]) - truth, axis=2)
    sheared = departs(points, FRAMES, 2.0) > 2.0
    status = found[-1].status[sheared]
    assert sheared.sum() >= 20
    # Those that stay have sand on one side of them that moves as they do, but for few whose grain hides it.
    assert np.mean(status == Status.OK) < 0.3
    assert np.mean(error[-1][sheared] > 0.5) < 0.15
    assert np.isin(status, (Status.OK, Status.SHEARED, Status.LOST, Status.OUTLIER, Status.MASKED)).all()
    # A grain of 4 px hides on which side of a band a point within its radius stands: few, and only there.
    assert np.nanmax(error[:, departs(points, FRAMES, 5.0) < 0.25]) < 0.5
    assert np.mean(error[np.isfinite(error)] > 0.5) < 0.01


def test_std_covers_the_errors_of_small_windows(followed):
    points, found = followed
    truth = np.stack([swept(points, f) for f in range(1, FRAMES + 1)])
    error = np.abs(np.stack([p.position_px for p in found]) - truth)
    std = np.stack([p.std_px for p in found])
    beside = np.stack(
        [(departs(points, f, 15.0) > 0.5) & (departs(points, f, 5.0) < 0.25) for f in range(1, 7)]
    )
    inside = error[beside] < std[beside][:, None]
    seen = np.isfinite(error[beside])
    # 68 % for Gaussian errors; what the grains hide beside a band costs some of it.
    assert 0.5 < inside[seen].mean() < 0.85


@pytest.mark.parametrize(("threads", "workers"), [(1, 1), (2, 2), (3, 1)])
def test_neither_threads_of_opencv_nor_workers_change_a_bit(sand, followed, threads, workers):
    before = cv2.getNumThreads()
    cv2.setNumThreads(threads)
    try:
        _, again = follow(sand, workers)
        assert cv2.getNumThreads() == threads
    finally:
        cv2.setNumThreads(before)
    for one, other in zip(followed[1], again, strict=True):
        assert one.position_px.tobytes() == other.position_px.tobytes()
        assert one.std_px.tobytes() == other.std_px.tobytes()
        assert one.status.tobytes() == other.status.tobytes()


@pytest.mark.parametrize("margin", [2, 4, 6])
def test_every_window_holds_its_point_with_a_margin(margin):
    shapes = shapes_of(31, margin)
    reach = shapes.sides[:, None] // 2 - np.abs(shapes.shifts)
    assert reach.min() == min(margin, 5)  # the small ones, of 13 px, are shifted by one pixel at least
    assert (shapes.sides % 2 == 1).all()
    assert not shapes.shifts[shapes.sides == 13][0].any()


def test_margin_grows_with_what_a_band_sweeps_over_between_two_frames():
    still, moving = np.zeros((60, 2)), np.tile([12.0, 5.0], (40, 1))
    assert margin_of(still) == 2.0
    assert margin_of(np.concatenate([still, moving])) == pytest.approx(0.3 * 13.0 + 1.0)
    assert margin_of(np.concatenate([still, 9 * moving])) == 6.0
    assert margin_of(np.full((3, 2), np.nan)) == 2.0


@pytest.mark.parametrize("subset", [31, 61])
def test_rank_is_the_correlation_of_the_window_at_whole_pixels(sand, subset):
    reference, current = sand.picture(), sand.picture((3.0, -2.0), noise=4, seed=2)
    point, moved = np.array([[120.0, 100.0]]), np.array([[[3.0, -2.0], [np.nan, np.nan]]])
    shapes = shapes_of(subset, 2)
    ranks = rank_windows(Greys(reference, current), point, moved, shapes)
    for number, (side, (x, y)) in enumerate(zip(shapes.sides, shapes.shifts, strict=True)):
        rows = slice(100 + y - side // 2, 100 + y + side // 2 + 1)
        columns = slice(120 + x - side // 2, 120 + x + side // 2 + 1)
        there = np.roll(current, (2, -3), axis=(0, 1))[rows, columns]
        expected = np.corrcoef(reference[rows, columns].ravel(), there.ravel())[0, 1]
        assert ranks[0, 0, number] == pytest.approx(expected, abs=1e-9)
    assert (ranks[0, 1] == -1).all()


def test_many_points_are_ranked_as_each_by_itself(sand):
    reference, current = sand.picture(), sand.picture((3.0, -2.0), noise=4, seed=2)
    height, width = reference.shape
    rng = np.random.default_rng(5)
    points = rng.uniform(25, [width - 25, height - 25], (1100, 2))
    moved = np.tile([[3.0, -2.0]], (1100, 1, 1))
    shapes, greys = shapes_of(31, 2), Greys(reference, current)
    ranks = rank_windows(greys, points, moved, shapes)
    for k in (0, 1023, 1024, 1099):  # about where the points are parted
        np.testing.assert_array_equal(
            ranks[k], rank_windows(greys, points[k : k + 1], moved[k : k + 1], shapes)[0]
        )
    assert rank_windows(greys, points[:0], moved[:0], shapes).shape == (0, 1, len(shapes.sides))
