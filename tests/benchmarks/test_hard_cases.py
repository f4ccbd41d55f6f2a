"""Verdicts on hard cases: what is wrong is called wrong, and only the right words help."""

import logging
import warnings

import numpy as np
import pandas as pd
import pytest

from hard.cases import Fate, Happened, HardCase, Part, attempt
from hard.correlation import PART as CORRELATION
from hard.forces import PART as FORCES
from hard.model import PART as MODEL
from hard.page import counts_of, kept, verdict, write_page, write_readme
from hard.tracers import PART as TRACERS
from ploughval.errors import DataError
from study_hard_cases import table_of


def case(run, *, limit=1.0, says=r"(?!)"):
    return HardCase("a case", "something", "within 1 px", run, limit, "px", says)


def fate(error, *, told=(), broken=(), says=r"(?!)"):
    return attempt(case(lambda: Happened(error, "", told, broken), says=says)).fate


def test_an_error_within_the_limit_holds_whatever_is_said():
    assert fate(0.99) == Fate.HOLDS
    assert fate(-0.99, told=("a gap",)) == Fate.HOLDS


@pytest.mark.parametrize("error", [1.01, -5.0, float("inf"), float("nan")])
def test_a_larger_error_or_none_without_a_word_is_wrong_and_silent(error):
    assert fate(error) == Fate.WRONG
    assert fate(error, says="gap") == Fate.WRONG


def test_a_larger_error_that_is_owned_up_to_is_degraded():
    assert fate(3.0, told=("one Gap in time",), says="gap") == Fate.DEGRADED


def test_words_on_something_else_do_not_help():
    assert fate(3.0, told=("the log ends in motion",), says="gap") == Fate.WRONG
    assert fate(3.0, told=("anything",)) == Fate.WRONG


def test_a_demand_that_is_broken_counts_even_where_the_error_is_small():
    assert fate(0.0, broken=("not finite",)) == Fate.WRONG
    assert fate(0.0, broken=("half is measured",), told=("edge: 3 points",), says="points") == Fate.DEGRADED


def refuse(text):
    def run():
        raise DataError(text)

    return run


def test_a_refusal_needs_words_and_any_other_error_is_wrong():
    assert attempt(case(refuse("no rows"))).fate == Fate.REFUSED
    assert attempt(case(refuse(""))).fate == Fate.WRONG
    found = attempt(case(lambda: 1 / 0))
    assert found.fate == Fate.WRONG
    assert "ZeroDivisionError" in found.happened.what


def test_what_is_logged_and_warned_of_counts_as_said():
    def logs():
        logging.getLogger("ploughval.any.room").warning("the outcrop is hidden")
        return Happened(9.0, "")

    def warns():
        warnings.warn("overflow in a divide", RuntimeWarning, stacklevel=1)
        return Happened(9.0, "")

    assert attempt(case(logs, says="outcrop is hidden")).fate == Fate.DEGRADED
    assert attempt(case(warns, says="overflow")).fate == Fate.DEGRADED
    assert attempt(case(logs, says="overflow")).fate == Fate.WRONG


def one_of(part, name):
    (found,) = [c for c in part.cases() if c.name == name]
    return found


@pytest.mark.parametrize(
    ("part", "name", "expected"),
    [
        (MODEL, "mobilization length 0", Fate.HOLDS),
        (MODEL, "end of the box", Fate.HOLDS),
        (MODEL, "blade flatter than repose", Fate.REFUSED),
        (FORCES, "spikes", Fate.HOLDS),
        (FORCES, "transducer stuck", Fate.HOLDS),
        (FORCES, "no empty runs", Fate.DEGRADED),
        (CORRELATION, "picture of 20 x 20 px", Fate.HOLDS),
        (TRACERS, "no motion", Fate.HOLDS),
        (TRACERS, "band that leaves the picture", Fate.DEGRADED),
    ],
)
def test_cheap_cases_come_to_what_the_committed_tables_have(part, name, expected):
    assert attempt(one_of(part, name)).fate == expected


def test_a_force_that_is_off_beyond_what_it_states_is_found_wrong():
    """The same log with its friction left in: were nothing said of the empty runs, it would be silent."""
    asked = one_of(FORCES, "no empty runs")
    mute = HardCase(asked.name, asked.done, asked.must, asked.run, asked.limit, asked.unit)
    found = attempt(mute)
    assert found.happened.error > 90.0  # nearly every row is off by the 3 N of friction
    assert found.fate == Fate.WRONG


def test_area_that_is_lost_is_seen():
    from hard.model import area_closure, run_march, scene_law, scene_of

    scene = scene_of()
    marched = run_march(scene, scene_law(scene, scene.soil), 30.0, 0.3, store=True)
    assert area_closure(marched, 0.0) < 1e-12
    lost = marched._replace(pool=marched.pool * np.array([[1.0], [1.0 - 1e-9]]))
    wide = marched.pool.copy()
    wide[1, marched.ends[5, 1] :] += 1e-6  # 1e-6 mm over all of the sand from the sixth increment on
    assert area_closure(lost, 0.0) < 1e-9  # all surfaces alike: nothing goes missing between them
    assert area_closure(marched._replace(pool=wide), 0.0) > 1e-9


@pytest.fixture
def small():
    """A part of three cases that hold, are refused, and are wrong."""
    cases = [
        HardCase("good", "nothing", "0", lambda: Happened(0.0, "fine", shown=[1.0, 2.0]), 1.0, "px"),
        HardCase("bad", "<b>all</b>", "0", lambda: Happened(7.0, "off", shown=[2.0, 1.0]), 1.0, "px"),
        HardCase("no", "refused", "0", refuse("there is <i>nothing</i>"), 1.0, "px"),
    ]

    def draw(canvas, case, shown):
        canvas.subplots().plot(shown)

    return Part("model", "Model", "Three cases.", lambda: cases, draw)


def test_the_page_shows_every_case_lists_what_is_wrong_and_takes_names_as_text(small, tmp_path):
    done = {"model": [attempt(c) for c in small.cases()]}
    tables = {"model": table_of(done["model"])}
    write_page({"model": small}, tables, done, tmp_path / "index.html")
    page = (tmp_path / "index.html").read_text()
    assert page.count("<figure") == 2
    assert "&lt;b&gt;all&lt;/b&gt;" in page
    assert "<b>all</b>" not in page
    assert "Of 3 hard cases 1 holds, 1 is refused" in page
    assert "Model, bad" in page
    write_readme({"model": small}, tables, tmp_path / "README.md")
    assert "- Model, bad (<b>all</b>): off" in (tmp_path / "README.md").read_text()


def test_parts_that_are_not_run_again_keep_their_chapter(small, tmp_path):
    done = {"model": [attempt(c) for c in small.cases()]}
    tables = {"model": table_of(done["model"])}
    path = tmp_path / "index.html"
    write_page({"model": small}, tables, done, path)
    first = path.read_text()
    write_page({"model": small}, tables, {}, path)
    assert path.read_text() == first
    assert kept("<p>", '<section id="model">x</section>', "model") == "<p>"


def test_counts_name_every_fate_and_the_sentence_adds_up():
    table = pd.DataFrame({"verdict": [Fate.HOLDS.value] * 3 + [Fate.WRONG.value]})
    counts = counts_of({"a": table})
    assert counts.tolist() == [3, 0, 0, 1]
    assert verdict(counts).endswith("1 is wrong and silent.")
    assert verdict(counts_of({"a": table[:3]})).endswith("none is wrong and silent.")
