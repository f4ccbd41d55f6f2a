"""Progress: times left that follow the pace, few lines, events that machines read, names that stay text."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ploughval.progress import Events, Lines, Pace, duration


class Clock:
    """A clock that is told the time."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def walked(make, steps, *, seconds_each, stage="photographs", total=None, test=""):
    """What a view says of a stage whose steps take the given time each."""
    said, clock = [], Clock()
    stages = make(said.append, clock)
    total = total or steps
    stages(stage, 0, total, test=test)
    for done in range(1, steps + 1):
        clock.now += seconds_each(done)
        stages(stage, done, total, test=test)
    return said


@pytest.mark.parametrize("total", [2, 7, 1000])
def test_a_steady_pace_gives_the_exact_time_left(total):
    pace = Pace(total, 5.0)
    for done in range(1, total):
        pace.step(done, total, 5.0 + 3.0 * done)
        if done >= 2 or total == 2:
            assert pace.left_s(5.0 + 3.0 * done) == pytest.approx(3.0 * (total - done))


def test_a_slow_first_step_is_left_out():
    """The first photograph compiles, 60 s; the others take 1 s each."""
    pace, now = Pace(100, 0.0), 0.0
    for done in range(1, 32):
        now += 60.0 if done == 1 else 1.0
        pace.step(done, 100, now)
        if done > 1:
            assert pace.left_s(now) == pytest.approx(100 - done)


def test_a_pace_that_changes_is_followed():
    """1 s a step for 50 steps, then 4 s: 20 steps later 1 - 0.9^20 = 88 % of the change is seen."""
    pace, now = Pace(100, 0.0), 0.0
    for done in range(1, 71):
        now += 1.0 if done <= 50 else 4.0
        pace.step(done, 100, now)
    assert pace.left_s(now) == pytest.approx(30 * (1 + 3 * (1 - 0.9**20)), rel=1e-6)


def test_no_time_left_is_named_before_two_steps():
    pace = Pace(30, 0.0)
    assert pace.left_s(1.0) is None
    pace.step(1, 30, 8.0)
    assert pace.left_s(8.0) is None


@given(st.lists(st.tuples(st.integers(1, 5), st.floats(0, 1e3)), min_size=1, max_size=60))
def test_a_time_left_is_never_negative_nor_endless(jumps):
    total, done, now = sum(jump for jump, _ in jumps) + 1, 0, 0.0
    pace = Pace(total, now)
    for jump, seconds in jumps:
        done, now = done + jump, now + seconds
        pace.step(done, total, now)
        left = pace.left_s(now)
        assert left is None or 0.0 <= left <= 1e3 * total


def test_a_stage_of_600_steps_is_at_most_eleven_lines_and_says_how_long_it_took():
    said = walked(Lines, 600, seconds_each=lambda _: 1.0)
    assert said[0] == "photographs: begun"
    assert said[1] == "photographs: 60 of 600, 9 min 0 s left"
    assert said[-1] == "photographs: took 10 min 0 s"
    assert len(said) == 11


def test_a_quick_stage_does_not_flood_the_log():
    """30 steps in 3 s: a line a second at most."""
    assert len(walked(Lines, 30, seconds_each=lambda _: 0.1)) <= 5


def test_a_stage_of_one_quick_step_is_one_line_and_of_a_long_one_two():
    assert walked(Lines, 1, seconds_each=lambda _: 0.2, stage="model") == ["model: begun"]
    said = walked(Lines, 1, seconds_each=lambda _: 75.0, stage="model")
    assert said == ["model: begun", "model: took 1 min 15 s"]


def test_the_end_of_a_stage_that_is_told_twice_is_said_once():
    said, clock = [], Clock()
    stages = Lines(said.append, clock)
    stages("photographs", 0, 1)
    for done in (1, 2, 3):
        clock.now += 5.0
        stages("photographs", done, 3)
    stages("photographs", 1, 1)
    assert said.count("photographs: took 15 s") == 1
    assert len(said) == 4


def test_a_stage_that_begins_again_is_shown_again():
    said, clock = [], Clock()
    stages = Lines(said.append, clock)
    for _ in range(2):
        stages("intervals", 0, 2)
        stages("intervals", 2, 2)
    assert said.count("intervals: begun") == 2


def test_stages_of_several_tests_say_whose_they_are_in_one_printable_line():
    said = walked(Lines, 1, seconds_each=lambda _: 11.0, test="d30\n\x1b[31m[bold]01")
    assert said == ["d30??[31m[bold]01: photographs: took 11 s"]


def test_of_one_test_among_several_only_what_takes_long_is_in_a_log():
    assert walked(Lines, 30, seconds_each=lambda _: 0.3, test="a") == []
    said = walked(Lines, 600, seconds_each=lambda _: 1.0, test="a")
    assert said[0] == "a: photographs: 60 of 600, 9 min 0 s left"
    assert said[-1] == "a: photographs: took 10 min 0 s"
    assert len(said) == 10


def test_events_hold_test_stage_steps_seconds_and_seconds_left():
    said = walked(Events, 20, seconds_each=lambda _: 2.0, test="a")
    first, last = said[0], said[-1]
    assert first == dict(
        event="progress", test="a", stage="photographs", done=0, total=20, seconds=0.0, seconds_left=None
    )
    assert last["done"] == last["total"] == 20
    assert (last["seconds"], last["seconds_left"]) == (40.0, 0.0)
    assert {**said[5]}["seconds_left"] == pytest.approx(2.0 * (20 - said[5]["done"]))
    assert len(said) <= 11
    assert json.loads(json.dumps(said)) == said


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.0, "0.0 s"), (9.96, "10 s"), (59.6, "1 min 0 s"), (3599.9, "1 h 0 min")]
)
def test_durations_never_show_sixty_of_a_unit(seconds, text):
    assert duration(seconds) == text
