"""The page says what its tables say."""

import numpy as np
import pandas as pd
import pytest

from sequences.real_wedge import line_by_colour
from study_sequences_page import markdown, outside, page


@pytest.mark.parametrize(
    ("value", "bound", "expected"),
    [
        (0.5, "at most 0.5", False),
        (0.51, "at most 0.5", True),
        (float("nan"), "at most 0.5", True),
        (66.0, "65 to 71", False),
        (64.0, "65 to 71", True),
        (3.0, "at least 4", True),
        (9.0, "", False),
    ],
)
def test_bounds_in_words_are_read(value, bound, expected):
    assert outside(value, bound) is expected


def test_a_table_shows_three_figures_and_leaves_nothing_empty():
    table = pd.DataFrame({"what": ["a|b", "c"], "px": [0.123456, np.nan], "n": [12345.0, 7.0]})
    assert markdown(table).splitlines()[2:] == ["| a/b | 0.123 | 12345 |", "| c |  | 7 |"]


def test_the_page_names_the_case_that_misses_a_figure_and_leaves_out_what_is_not_there():
    cases = pd.DataFrame(
        {
            "case": ["to reach", "base", "noise 8"],
            "free surface, rms [px]": ["at most 0.5", "0.3", "0.7"],
            "points [1]": [np.nan, "100", "120"],
        }
    )
    text = page({"cases": cases})
    assert "Missed (1 of 2 bounded figures)" in text
    assert "- noise 8: free surface, rms [px] is 0.7 (at most 0.5)" in text
    assert "base: free" not in text
    assert "Spoiled photographs" not in text


def test_a_magenta_line_is_found_to_a_tenth_of_a_pixel():
    columns = np.arange(120.0)
    true = 20 + 4 * np.sin(columns / 40)
    profile = np.exp(-(((np.arange(50.0)[:, None] - true) / 1.5) ** 2) / 2)
    grey = np.full((50, 120, 3), 90.0)
    picture = np.clip(grey - profile[..., None] * [0.0, 50.0, 0.0], 0, 255).astype(np.uint8)
    found = line_by_colour(picture, np.full(120, 20.0))
    assert np.abs(found - true)[5:-5].max() < 0.1
