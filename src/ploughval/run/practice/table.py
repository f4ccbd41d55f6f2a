"""All rows of one test."""

import pandas as pd

from ploughval.run.findings import Findings
from ploughval.run.practice.analysis import correlation_rows, strain_rows
from ploughval.run.practice.equipment import camera_rows, pattern_rows
from ploughval.run.practice.floors import floor_rows
from ploughval.run.practice.rows import to_table
from ploughval.scene import Scene


def good_practice(scene: Scene, found: Findings) -> pd.DataFrame:
    """What a report on digital image correlation should tell (Jones & Iadicola 2018, section 6).

    Parameters
    ----------
    scene : Scene
        Settings, with what they tell of the equipment.
    found : Findings
        What the steps have found.

    Returns
    -------
    DataFrame
        PRACTICE_COLUMNS, a row each: what, value and standard uncertainty in a unit or words, where it comes
        from, what the stated uncertainties predict of it, and how it was had or can be told. No row where
        the test has no photographs and no force.
    """
    return to_table(
        [
            *camera_rows(scene, found),
            *pattern_rows(scene, found),
            *correlation_rows(scene, found),
            *strain_rows(scene, found),
            *floor_rows(scene, found),
        ]
    )
