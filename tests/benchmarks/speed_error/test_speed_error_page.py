"""The page of speed against error is made from tables alone, and says nothing else than they do."""

import re
from dataclasses import replace

import pandas as pd
import pytest

from ploughval.errors import ConfigError
from ploughval.run.benches import write_bench_page
from speed_error.points import ERROR, Level, Panel, Point
from speed_error.words import BUSY, against, change, dominance, shown
from speed_error_page import PAGE, README, SUBJECTS, alt_of, page_of, verdict, write_page


def rewrite(path, old, new):
    """Put other text into a table."""
    path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")


@pytest.fixture(scope="module")
def folder(tmp_path_factory, write_tables):
    return write_tables(tmp_path_factory.mktemp("tables"))


@pytest.fixture(scope="module")
def subjects(folder):
    return {name: build(folder) for name, build in SUBJECTS.items()}


@pytest.fixture(scope="module")
def written(folder):
    return write_page(folder)


def test_every_subject_marks_one_default_in_every_panel(subjects):
    for name, subject in subjects.items():
        assert subject.panels, name
        for panel in subject.panels:
            marked = {(p.time, p.error) for p in panel.points if p.default}
            assert len(marked) == 1, (name, panel.key)
            assert panel.standard.known
            assert panel.default


def test_page_readme_and_a_picture_a_subject_are_written(folder, written, subjects):
    names = {path.name for path in written}
    assert names == {PAGE, README, *(f"{subject.key}.png" for subject in subjects.values())}
    assert all(path.stat().st_size > 1000 for path in written)


def test_the_page_needs_no_other_file_and_weighs_less_than_a_megabyte(folder, written):
    page = (folder / PAGE).read_text(encoding="utf-8")
    assert len(page) < 1_000_000
    assert not re.search(r'(?:src|href)="(?!#|data:)[^"]*"', page.split("<body>")[1])


def test_the_same_tables_give_the_same_bytes(tmp_path, write_some):
    folder = write_some(tmp_path, "model-settings.csv", "compare.csv")
    before = {path.name: path.read_bytes() for path in write_page(folder)}
    assert len(before) == 4
    assert {path.name: path.read_bytes() for path in write_page(folder)} == before


def test_numbers_in_the_sentences_are_those_of_the_tables(tmp_path, write_tables):
    folder = write_tables(tmp_path)
    for name, column, build in (
        ("model-settings.csv", "switch_error_pct", SUBJECTS["model"]),
        ("sequences.csv", "p95_px", SUBJECTS["sequences"]),
        ("compare.csv", "rms_error_percent", SUBJECTS["compare"]),
        ("fit-settings.csv", "angles_deg", SUBJECTS["fit"]),
        ("force-settings.csv", "force_rms_percent", SUBJECTS["force"]),
    ):
        table = pd.read_csv(folder / name, dtype={"setting": str})
        mine = table["draws"] == 64 if "draws" in table else table["default"]
        table[column] = table[column].where(~mine, 0.0777)
        table.to_csv(folder / name, index=False)
        assert "0.0777" in build(folder).choice[0], name


def test_where_the_conclusion_flips_the_sentence_flips(tmp_path, write_tables):
    folder = write_tables(tmp_path)
    before = SUBJECTS["force"](folder).choice
    assert any("a bandwidth of 2 Hz leaves least" in text for text in before)
    rewrite(folder / "force-settings.csv", ",none,True,5000,100,1.2,", ",none,True,5000,100,0.1,")
    after = SUBJECTS["force"](folder).choice
    assert "Smoothing to a bandwidth gains nothing for this noise." in after
    assert not any("leaves least" in text for text in after)


def test_intervals_that_do_not_hold_are_named_and_others_are_not(tmp_path, write_tables):
    folder = write_tables(tmp_path)
    assert any("1 (the 95 % intervals hold 13 %)" in text for text in SUBJECTS["force"](folder).choice)
    rewrite(folder / "force-settings.csv", ",0.7,13,17,17", ",0.7,95,17,17")
    assert not any("intervals hold" in text for text in SUBJECTS["force"](folder).choice)


def panel_of(*points: Point, levels: tuple[Level, ...] = ()) -> Panel:
    return Panel("k", "title", "error, px", "CPU, ms each", points, (), levels, "default")


DEFAULT = Point("f", "1", 2.0, 1.0, default=True)


def test_a_setting_that_is_faster_and_more_exact_is_named():
    better, slower = Point("f", "2", 1.0, 0.5), Point("f", "3", 4.0, 0.5)
    assert "f 2 (0.5 at 1, default 1 at 2)" in dominance(panel_of(DEFAULT, better, slower), "Here")
    assert "none of 2 settings" in dominance(panel_of(DEFAULT, slower), "Here")


def test_differences_within_those_of_rounds_count_for_nothing():
    near = Point("f", "2", 1.99, 0.99)
    assert panel_of(DEFAULT, near).better() == ()
    assert against(near, DEFAULT) == "changes neither the error nor the time"


def test_families_set_apart_are_not_compared_with_the_default():
    less = replace(panel_of(DEFAULT, Point("other", "2", 1.0, 0.5)), apart=frozenset({"other"}))
    assert less.better() == ()
    assert less.measured == (DEFAULT,)


@pytest.mark.parametrize(
    ("ratio", "words"),
    [
        (0.5, "divides x by 2"),
        (0.9, "lowers x by 10 %"),
        (1.0, "leaves x as it is"),
        (1.25, "raises x by 25 %"),
        (3.0, "multiplies x by 3"),
    ],
)
def test_change_says_what_the_ratio_is(ratio, words):
    assert change(ratio, "x") == words


def test_a_gain_that_costs_time_says_but_and_a_gain_in_both_says_and():
    assert " but " in against(Point("f", "2", 4.0, 0.5), DEFAULT)
    assert " and " in against(Point("f", "2", 1.0, 0.5), DEFAULT)


def test_the_verdict_counts_figures_reached_by_the_defaults(subjects):
    subject = subjects["model"]
    missed = replace(
        subject, panels=(panel_of(DEFAULT, levels=(Level(ERROR, 0.5, "a"), Level(ERROR, 2.0, "b"))),)
    )
    assert verdict([missed]).startswith("The defaults reach 1 of 2 figures")


def test_a_part_that_was_not_measured_is_named_with_its_command(tmp_path, write_some):
    folder = write_some(tmp_path, "compare.csv")
    write_page(folder)
    assert "Run: ploughval bench fit" in (folder / PAGE).read_text(encoding="utf-8")
    assert "Not measured: fit (`ploughval bench fit`)" in (folder / README).read_text(encoding="utf-8")
    assert not (folder / "fit.png").exists()


def test_settings_that_look_like_markup_stay_text(tmp_path, write_tables):
    folder = write_tables(tmp_path)
    rewrite(folder / "model-settings.csv", "tolerance,0.01,", "tolerance,<b>x</b>,")
    page = page_of(folder, [SUBJECTS["model"](folder)], [], [])
    assert "<b>x</b>" not in page
    assert "&lt;b&gt;x" in page


def test_the_alternative_text_gives_the_default_and_the_most_exact(subjects):
    panel = subjects["compare"].panels[0]
    text = alt_of(panel)
    assert f"default has {shown(panel.standard.error)} at {shown(panel.standard.time)}" in text
    assert "draws: rms 256, 1 at 1.8" in text


def test_a_folder_without_tables_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="a folder with tables"):
        write_bench_page(tmp_path)


def test_what_threads_gain_is_told_by_a_quiet_machine_alone(tmp_path, write_tables):
    folder = write_tables(tmp_path)
    told = SUBJECTS["sequences"](folder).choice
    assert "Two threads take 55 ms a photograph, 2 times as fast as one." in told
    rewrite(folder / "sequences.csv", "threads,2,False,100,10,105,55,", "threads,2,False,100,10,105,400,")
    told = SUBJECTS["sequences"](folder).choice
    assert BUSY in told
    assert not any("Two threads" in sentence for sentence in told)
