"""A clock of whole seconds confines the times of a steady series, and no more than it can."""

import numpy as np
import pytest

from ploughval.photos.series.whole_seconds import JITTER, steady_times


@pytest.mark.parametrize("interval_s", [0.5, 0.5013, 1 / 3, 0.93, 2.4])
@pytest.mark.parametrize("jitter", [0.0, JITTER])
def test_times_of_a_steady_series_lie_within_what_is_stated(interval_s, jitter):
    ratios, generator = [], np.random.default_rng(8)
    for start_s in generator.uniform(0, 1, 7):
        truth = 1e9 + start_s + interval_s * (np.arange(60) + generator.uniform(-jitter, jitter, 60))
        steady = steady_times(np.floor(truth), np.arange(60))
        assert steady.least_s <= interval_s + 1e-9
        assert interval_s - 1e-9 <= steady.most_s
        ratios.append((steady.time_s - truth) / steady.std_s)
    # two rectangular distributions, of the line and of the photographs about it, never leave sqrt(6) standard
    # deviations; what several bounds leave open together is peaked in its middle: less
    assert np.abs(ratios).max() <= np.sqrt(6) + 0.01
    assert np.mean(np.abs(ratios) <= 2) >= 0.95
    assert (0.3 if jitter else 0.0) <= np.sqrt(np.mean(np.square(ratios))) <= 1.1


def test_half_a_second_leaves_a_quarter_open_each_way():
    # 0.5 s: the start may lie anywhere in half a second, whatever the number of photographs
    steady = steady_times(np.repeat(np.arange(200.0), 2), np.arange(400))
    assert steady.interval_s == pytest.approx(0.5, abs=1e-3)
    half_s = 0.25 + 0.5 * JITTER
    np.testing.assert_allclose(steady.std_s[200], np.hypot(half_s, 0.5 * JITTER) / np.sqrt(3), rtol=0.02)


def test_lost_photographs_leave_their_numbers_open():
    truth = 0.2 + 0.5 * np.arange(40)
    kept = np.delete(np.arange(40), [7, 8, 21])
    steady = steady_times(np.floor(truth[kept]), kept)
    assert np.abs(steady.time_s - truth[kept]).max() < 0.28


@pytest.mark.parametrize(
    "stamps",
    [
        [0, 0, 1, 1, 2, 2, 7, 7, 8, 8],  # a pause
        [0, 1, 2, 3, 3, 3, 3, 4, 5, 6],  # a clock that stands still
        [0, 0, 1, 1],  # too few to tell
    ],
)
def test_a_series_that_no_constant_interval_explains_is_left(stamps):
    assert steady_times(np.array(stamps, float), np.arange(len(stamps))) is None
