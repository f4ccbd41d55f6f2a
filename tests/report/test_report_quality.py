"""The chapter on quality shows checks that can fail, and none that cannot."""

from dataclasses import replace

import pandas as pd
import pytest

from ploughval.report.blocks import Pen
from ploughval.report.quality import quality_chapter
from ploughval.report.results import read_results

SAID = "against the displacement used"


@pytest.fixture(scope="module")
def results(result_folder):
    return read_results(result_folder)


def blade(off_mm):
    u = pd.Series([0.0, 5.0, 10.0])
    columns = dict(frame=[0, 1, 2], time_s=[0.0, 1.0, 2.0], u_mm=u, blade_x_mm=u + off_mm, blade_std_mm=0.02)
    return pd.DataFrame(columns)


def drawn(results, off_mm):
    chapter = quality_chapter(replace(results, blade=blade(off_mm)), Pen())
    return any(SAID in drawing.caption for drawing in chapter.drawings)


def test_the_blade_seen_is_drawn_against_another_source_of_the_displacement(results):
    assert drawn(results, 0.03)


def test_the_blade_seen_is_not_compared_with_itself(results):
    assert not drawn(results, 0.0)
