"""What many tests need, from what one takes."""

from dataclasses import replace

import pytest

from size_many import Size, many, scaled

SHORT = Size("12 Mpx", 20, True, 100.0, 14.0, 10.0, 8.0, 30.0, 0.8)
LONG = replace(
    SHORT, frames=60, in_MB=300.0, out_MB=34.0, store_MB=30.0, state_MB=16.0, cpu_s=70.0, memory_GB=0.9
)


def test_a_longer_test_lies_on_the_line_through_two_and_is_not_called_measured():
    told = scaled(SHORT, LONG, 100)
    assert (told.in_MB, told.out_MB, told.store_MB, told.cpu_s) == pytest.approx((500, 54, 50, 110))
    assert told.memory_GB == LONG.memory_GB
    assert not told.measured
    assert scaled(SHORT, LONG, 60) == replace(LONG, measured=False)


def test_many_tests_take_their_number_times_one():
    row = many([LONG], 3600).iloc[0]
    assert row["core_hours"] == 70
    assert row["in_TB"] == pytest.approx(1.08)
    assert row["out_and_store_TB"] == pytest.approx(0.23, abs=1e-3)
    assert row["transfer_h"] == pytest.approx(3600 * 364e6 * 8 / 1e9 / 3600, abs=0.05)
    assert row["cores_that_fill_the_line"] == pytest.approx(70 / (364e6 * 8 / 1e9), abs=0.05)
