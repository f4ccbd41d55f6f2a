"""The chapter on force says in words what its rows are, and shows no table of nothing."""

from dataclasses import replace

import pytest

from ploughval.report.blocks import Pen
from ploughval.report.force import force_chapter
from ploughval.results import read_results


@pytest.fixture(scope="module")
def results(result_folder):
    return read_results(result_folder)


def captions(results):
    return [table.caption for table in force_chapter(results, Pen()).tables]


def test_rows_without_a_line_of_action_are_told_in_words(results):
    chapter = force_chapter(results, Pen())
    # the made log has five such rows
    (said,) = [note for note in chapter.notes if "line of action" in note]
    assert ": 5 with a force too small for a line of action" in said
    assert "arm" not in said


def test_peaks_are_listed_where_there_are_any(results):
    assert "Peaks and troughs" in captions(results)
    assert "Peaks and troughs" not in captions(replace(results, peaks=results.peaks.iloc[:0]))
