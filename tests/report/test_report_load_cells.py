"""The chapter of the load cells."""

from dataclasses import replace

import pytest

from ploughval.report.blocks import Pen
from ploughval.report.force import force_chapter
from ploughval.report.load_cells import load_cells_chapter
from ploughval.results import read_results


@pytest.fixture
def results(result_folder):
    return read_results(result_folder)


def texts(table):
    return {row[0].text: row[1].text for row in table.rows}


def test_zeros_friction_and_contact_are_stated_with_their_uncertainty(results):
    chapter = load_cells_chapter(results, Pen())
    how = texts(chapter.tables[0])
    assert how["Zero of the upper, lower cell, N m"] == "0.1370 ± 0.0012, −0.07990 ± 0.00090"
    assert how["Contact with the sand after a travel of, mm"] == "0.880 ± 0.021"
    assert (
        how["Friction that was taken off"] == "1.62 N on average; the mean: a run left out says <so> (3 runs)"
    )
    assert how["Smoothed"] == "no"
    assert how["Drift of the zeros that was taken off, N m"] == "none"


def test_what_the_budget_adds_up_to_is_stated(results):
    how = texts(load_cells_chapter(results, Pen()).tables[0])
    assert how["Mean force of the travel, one sample of it, N"] == "12.300 ± 0.050"
    assert how["Line of action at that force, mm"] == "10.10 ± 0.80"


def test_what_is_taken_as_exact_is_named(results):
    budget = results.budget.assign(std=0.1)
    assert "exact" not in load_cells_chapter(replace(results, budget=budget), Pen()).drawings[0].caption
    last = budget["source"].iloc[-1]
    budget.loc[budget["source"] == last, "std"] = 0.0
    caption = load_cells_chapter(replace(results, budget=budget), Pen()).drawings[0].caption
    assert caption.endswith(f"Taken as exact: {last}.")


def test_the_budget_names_the_largest_source_of_force_and_line_of_action(results):
    drawing = load_cells_chapter(results, Pen()).drawings[0]
    assert "force: noise, 65%" in drawing.svg
    assert "line of action: noise, 70%" in drawing.svg
    assert "offsets" not in drawing.caption  # the shares of whole sources are positive


def test_friction_off_the_force_alone_is_said_with_the_friction_and_with_the_line_of_action(results):
    run = results.run.model_copy(update={"settings": {"loadcells": {"compensation": "force_only"}}})
    results = replace(results, run=run)
    how = texts(load_cells_chapter(results, Pen()).tables[0])
    assert how["Friction that was taken off"].endswith("that of sand and friction together")
    captions = [drawing.caption for drawing in force_chapter(results, Pen()).drawings]
    assert any("Line of action of sand and friction together" in caption for caption in captions)


def test_no_share_of_the_budget_reads_as_minus_nothing(results):
    budget = results.budget.assign(share=[-0.0, *results.budget["share"][1:]])
    table = load_cells_chapter(replace(results, budget=budget), Pen()).tables[1]
    shares = [cell.text for row in table.rows for cell in row]
    assert "0.0 %" in shares
    assert "−0.0 %" not in shares


def test_without_empty_runs_and_smoothed_it_says_so(results):
    entry = results.run.loadcells.model_copy(
        update={"friction": None, "bandwidth_Hz": 2.5, "drift_Nm": (0.1, 0.02)}
    )
    run = results.run.model_copy(update={"loadcells": entry})
    how = texts(load_cells_chapter(replace(results, run=run), Pen()).tables[0])
    assert how["Friction that was taken off"] == "none: no empty-box run was used"
    assert how["Smoothed"] == "to 2.50 Hz"
    assert how["Drift of the zeros that was taken off, N m"] == "0.100, 0.0200"


def test_without_load_cells_there_is_no_chapter(results):
    run = results.run.model_copy(update={"loadcells": None})
    assert load_cells_chapter(replace(results, run=run, budget=None), Pen()) is None
