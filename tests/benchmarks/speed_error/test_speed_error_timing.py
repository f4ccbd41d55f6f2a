"""A time is the median of rounds of a call that is repeated until it takes long enough."""

from types import SimpleNamespace

import pytest

from speed_error import timing
from speed_error.timing import Seconds, timed


@pytest.fixture
def clock(monkeypatch):
    """A clock that only calls move: each takes the next of the given seconds, and half of it of processor."""
    state = SimpleNamespace(now=0.0, steps=[], calls=0)
    kept = SimpleNamespace(perf_counter=lambda: state.now, process_time=lambda: 0.5 * state.now)
    monkeypatch.setattr(timing, "time", kept)
    return state


def call(clock):
    clock.now += clock.steps[min(clock.calls, len(clock.steps) - 1)]
    clock.calls += 1
    return clock.calls


def test_the_median_of_the_rounds_counts_for_processor_and_clock(clock):
    clock.steps = [9.0, 1.0, 2.0]
    found, seconds = timed(lambda: call(clock), 3)
    assert found == 3
    assert seconds == pytest.approx(Seconds(1.0, 2.0))


def test_short_calls_are_repeated_until_a_round_is_long_enough(clock):
    clock.steps = [0.001]
    _, seconds = timed(lambda: call(clock), 2, least_s=0.01)
    assert clock.calls == 1 + 2 * 10
    assert seconds == pytest.approx(Seconds(0.0005, 0.001))
