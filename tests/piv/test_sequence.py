"""Points through a series: followed past skipped and spoiled frames, and given up with a reason."""

import cv2
import numpy as np
import pytest

from ploughval.axes import Status
from ploughval.errors import CorrelationError
from ploughval.piv import CameraMovement, Tracker
from ploughval.scene import Piv

STEP = 5.0


def all_sand(sand):
    return np.ones(sand.shape, bool)


def test_points_are_followed_through_a_skipped_frame(sand):
    points = sand.points(20, margin=45)
    tracker = Tracker(Piv(), 1)
    tracker.start(sand.picture(noise=1, seed=0), points, all_sand(sand))
    for frame in range(1, 6):
        if frame == 3:
            skipped = tracker.skip()
            assert (skipped.status == Status.FRAME_MISSING).all()
            assert np.isnan(skipped.position_px).all()
            continue
        shift = np.array([STEP * frame, -0.7 * frame])
        found = tracker.advance(sand.picture(shift, noise=1, seed=frame), all_sand(sand))
        assert (found.status == Status.OK).all()
        error = found.position_px - points - shift
        assert np.sqrt(np.mean(error**2)) < 0.006  # noise 1 of contrast 28 allows about 0.003
        assert np.all(found.std_px < 0.02)


def test_still_sand_stays_where_it_is_beside_a_moving_block(sand):
    def motion(frame):
        return lambda p: np.where(p[:, 1:] < 110, [STEP * frame, 0.0], [0.0, 0.0])

    points = sand.points(14, margin=36)
    points = points[np.abs(points[:, 1] - 110) > 18]
    tracker = Tracker(Piv(), 1)
    tracker.start(sand.picture(), points, all_sand(sand))
    for frame in range(1, 5):
        found = tracker.advance(sand.picture(motion(frame), noise=1, seed=frame), all_sand(sand))
    inside = points[:, 0] + 4 * STEP < sand.shape[1] - 20
    truth = points + motion(4)(points)
    assert (found.status[inside] == Status.OK).all()
    assert np.abs(found.position_px - truth)[inside].max() < 0.03


def test_points_that_leave_the_picture_say_so_from_then_on(sand):
    points = np.array([[235.0, 100.0], [60.0, 100.0], [60.0, 60.0], [60.0, 140.0]])
    tracker = Tracker(Piv(), 1)
    tracker.start(sand.picture(), points, all_sand(sand))
    seen = [int(tracker.advance(sand.picture((8.0 * f, 0)), all_sand(sand)).status[0]) for f in range(1, 7)]
    first = seen.index(Status.OUT_OF_PICTURE)
    assert first in (2, 3)  # 235 + 8 f passes 259 after the third step
    assert set(seen[first:]) == {Status.OUT_OF_PICTURE}


def test_sand_that_is_no_longer_sand_is_masked_and_churned_sand_by_the_surface_has_avalanched(sand):
    points = np.array([[60.0, 60.0], [200.0, 60.0], [60.0, 170.0], [130.0, 170.0], [200.0, 170.0]])
    mask = all_sand(sand)
    mask[:35] = False
    tracker = Tracker(Piv(), 1)
    tracker.start(sand.picture(), points, mask)
    assert (tracker.advance(sand.picture((0.4, 0)), mask).status == Status.OK).all()
    churned, bladed = sand.picture((0.8, 0)), mask.copy()
    churned[35:90, :140] = np.random.default_rng(8).permutation(churned[35:90, :140].ravel()).reshape(55, 140)
    bladed[30:95, 170:230] = False
    found = tracker.advance(churned, bladed)
    assert found.status.tolist() == [Status.AVALANCHED, Status.MASKED, Status.OK, Status.OK, Status.OK]
    assert np.isnan(found.position_px[:2]).all()


def test_sand_by_the_surface_that_an_avalanche_ran_over_is_buried_and_stays_so(sand):
    points = np.array([[60.0, 60.0], [200.0, 60.0], [60.0, 170.0], [130.0, 170.0], [200.0, 170.0]])
    mask, heaped = all_sand(sand), all_sand(sand)
    mask[:35] = False
    tracker = Tracker(Piv(), 1)
    tracker.start(sand.picture(), points, mask)
    assert (tracker.advance(sand.picture((0.4, 0)), mask).status == Status.OK).all()
    churned = sand.picture((0.8, 0))
    churned[:90, :140] = np.random.default_rng(8).permutation(churned[:90, :140].ravel()).reshape(90, 140)
    heaped[:5] = False
    seen = [tracker.advance(churned, heaped).status.tolist() for _ in range(6)]
    for status in seen:
        assert status == [Status.BURIED, Status.OK, Status.OK, Status.OK, Status.OK]


def test_hopeless_picture_in_the_middle_costs_nothing_but_itself(sand):
    """Five of them would have given every point up; the block moves on by 5 px a frame all the while."""
    points = sand.points(20, margin=50)
    tracker = Tracker(Piv(), 1)
    tracker.start(sand.picture(), points, all_sand(sand))
    tracker.advance(sand.picture((STEP, 0)), all_sand(sand))
    for frame in (2, 3):
        noise = np.random.default_rng(frame).integers(0, 255, sand.shape).astype(np.uint8)
        assert (tracker.advance(noise, all_sand(sand)).status != Status.OK).all()
    found = tracker.advance(sand.picture((4 * STEP, 0)), all_sand(sand))
    assert (found.status == Status.OK).all()
    assert np.abs(found.position_px - points - [4 * STEP, 0]).max() < 0.01


def test_picture_out_of_focus_renews_no_reference(sand):
    points = sand.points(20, margin=45)
    tracker = Tracker(Piv(), 1)
    tracker.start(sand.picture(), points, all_sand(sand))
    for frame in range(1, 5):
        picture = sand.picture((1.5 * frame, 0), noise=1, seed=frame)
        picture = cv2.GaussianBlur(picture, (0, 0), 2.5) if frame == 2 else picture
        found = tracker.advance(picture, all_sand(sand))
        assert (found.status == Status.OK).mean() > 0.9
    assert tracker.reference_frames == (0,)
    assert np.abs(found.position_px - points - [6.0, 0]).max() < 0.03


def test_camera_that_was_knocked_is_taken_off_and_does_not_lead_points_astray(sand):
    points, knock = sand.points(20, margin=45), np.array([2.4, -1.8])
    tracker = Tracker(Piv(), 1)
    tracker.start(sand.picture(), points, all_sand(sand))
    for frame in range(1, 5):
        shift = knock if frame > 2 else np.zeros(2)
        camera = CameraMovement(shift, 0.003, np.zeros(2), 0.0, 0.99)
        picture = sand.picture(np.array([3.0 * frame, 0.0]) + shift, noise=1, seed=frame)
        found = tracker.advance(picture, all_sand(sand), camera)
        assert (found.status == Status.OK).all()
        error = found.position_px - points - [3.0 * frame, 0.0]
        assert np.sqrt(np.mean(error**2)) < 0.006
    assert np.all(found.std_px > 0.003)


def test_transient_failure_is_taken_up_again(sand):
    points = sand.points(40, margin=50)
    tracker = Tracker(Piv(), 1)
    tracker.start(sand.picture(), points, all_sand(sand))
    noise = np.random.default_rng(9).integers(0, 255, sand.shape).astype(np.uint8)
    lost = tracker.advance(noise, all_sand(sand))
    assert (lost.status != Status.OK).all()
    found = tracker.advance(sand.picture((2.0, 1.0)), all_sand(sand))
    assert (found.status == Status.OK).all()
    assert np.abs(found.position_px - points - [2.0, 1.0]).max() < 0.01


def test_reference_is_renewed_where_sand_decorrelates_and_the_std_grows(sand):
    # Grains jostle by 0.35 px a frame about the mean motion: correlation with frame 0 fades.
    rng = np.random.default_rng(10)
    jostle = np.zeros_like(sand.grains.positions_px)
    points = sand.points(25, margin=40)
    tracker = Tracker(Piv(), 1)
    tracker.start(sand.picture(), points, all_sand(sand))
    spread = []
    for frame in range(1, 9):
        jostle = jostle + rng.normal(0, 0.35, jostle.shape)
        moved = jostle + np.array([1.5 * frame, 0.0])
        found = tracker.advance(sand.picture(moved), all_sand(sand))
        spread.append(np.median(found.std_px[found.status == Status.OK]))
    assert np.mean(found.status == Status.OK) > 0.95
    assert len(tracker.reference_frames) <= 3
    assert max(tracker.reference_frames) > 0
    error = (found.position_px - points - [12.0, 0.0])[found.status == Status.OK]
    # The contrast is in the 60 dyed grains of a subset: their mean wanders by 0.35 sqrt(8 / 60) = 0.13 px.
    assert np.sqrt(np.mean(error**2)) < 0.2
    assert spread[-1] > spread[0]


def test_thread_count_does_not_change_a_bit(sand):
    results = []
    for workers in (1, 2):
        tracker = Tracker(Piv(), workers)
        tracker.start(sand.picture(), sand.points(12), all_sand(sand))
        results.append(tracker.advance(sand.picture((3.3, 0.4), noise=3, seed=1), all_sand(sand)))
    assert results[0].position_px.tobytes() == results[1].position_px.tobytes()
    assert results[0].std_px.tobytes() == results[1].std_px.tobytes()


def test_advance_before_start_and_pictures_of_another_size_are_refused(sand):
    tracker = Tracker(Piv(), 1)
    with pytest.raises(CorrelationError, match="start"):
        tracker.advance(sand.picture(), all_sand(sand))
    tracker.start(sand.picture(), [[100.0, 100.0]], all_sand(sand))
    with pytest.raises(CorrelationError, match="first frame"):
        tracker.advance(np.zeros((100, 100), np.uint8), np.ones((100, 100), bool))


def test_second_start_forgets_the_noise_of_the_series_before(sand):
    points, everywhere = sand.points(20, margin=40), np.ones(sand.shape, bool)

    def last(tracker, noise, seed):
        tracker.start(sand.picture(noise=noise, seed=seed), points, everywhere)
        return tracker.advance(sand.picture((1.3, 0.4), noise=noise, seed=seed + 1), everywhere)

    used, fresh = Tracker(Piv()), Tracker(Piv())
    last(used, 20, 1)
    again, alone = last(used, 1, 5), last(fresh, 1, 5)
    assert again.position_px.tobytes() == alone.position_px.tobytes()
    assert again.std_px.tobytes() == alone.std_px.tobytes()


def test_noise_is_judged_by_the_first_pair_that_correlates(sand):
    points, everywhere = sand.points(20, margin=40), np.ones(sand.shape, bool)
    tracker, alone = Tracker(Piv()), Tracker(Piv())
    dark = np.full(sand.shape, 90, np.uint8)
    frames = [sand.picture((1.3 * k, 0.4 * k), noise=8, seed=k) for k in range(3)]
    for follower in (tracker, alone):
        follower.start(frames[0], points, everywhere)
    tracker.advance(dark, everywhere)
    late = tracker.advance(frames[1], everywhere)
    soon = alone.advance(frames[1], everywhere)
    assert (late.status == Status.OK).mean() > 0.95
    # The same noise is found, though the flow was computed from the dark frame.
    assert np.nanmedian(late.std_px) == pytest.approx(np.nanmedian(soon.std_px), rel=0.05)
