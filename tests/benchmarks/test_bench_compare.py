"""What the bench of the comparison measures with: time warping, and draws about a reference."""

import numpy as np
import pytest

import bench_compare


def test_warping_without_room_is_the_plain_difference():
    rng = np.random.default_rng(0)
    first, second = rng.normal(size=(2, 40))
    assert bench_compare.warped_rms(first, second, 0) == pytest.approx(
        np.sqrt(np.mean((first - second) ** 2))
    )


def test_warping_undoes_a_shift_within_its_band_and_not_beyond():
    steps = np.repeat([0.0, 1.0, 0.0], [20, 20, 20])
    late = np.roll(steps, 5)
    assert bench_compare.warped_rms(steps, late, 6) == 0.0
    assert bench_compare.warped_rms(steps, late, 2) > 0.1


def test_landmarks_leave_an_error_in_height_and_warping_does_not():
    table = bench_compare.alignment_table().set_index("case")
    higher = table.loc["higher by 10 %"]
    assert higher["landmarks"] == pytest.approx(higher["in_height"], rel=0.02)
    assert higher["warped_0.25_d"] < 0.5 * higher["in_height"]
    assert table.loc["stretched by 10 %", "landmarks"] < 0.25 * table.loc["stretched by 10 %", "as_it_is"]
