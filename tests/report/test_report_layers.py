"""The chapter on layers speaks of the lines that it shows."""

from dataclasses import replace

from ploughval.report.blocks import Pen
from ploughval.report.stages import layers_chapter
from ploughval.results import read_results


def test_lines_that_are_predicted_alone_are_said_to_be(result_folder):
    results = replace(read_results(result_folder), layers=None)
    lead = layers_chapter(results, Pen()).lead
    assert "none was measured" in lead
    assert "dyed" not in lead
    assert "distance along the normal" in layers_chapter(read_results(result_folder), Pen()).lead
