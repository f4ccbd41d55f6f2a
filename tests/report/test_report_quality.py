"""Quality shows checks that can fail, and none that cannot; ledger and settings can be read."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from ploughval.report.blocks import Pen
from ploughval.report.quality import provenance_chapter, quality_chapter
from ploughval.results import FrameEntry, read_results
from ploughval.scene import Scene
from ploughval.scene_faults import known_keys, table_of

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


def entry(frame, **parts):
    told = {"file": f"{frame}.png", "time_s": 10.0 + frame / 3, "u_mm": -0.00026 + frame, **parts}
    return FrameEntry(frame=frame, **told)


def ledger(results, frames, tracks=None):
    run = results.run.model_copy(update={"frames": tuple(frames)})
    chapter = quality_chapter(replace(results, run=run, tracks=tracks, blade=None, volume=None), Pen())
    return next(table for table in chapter.tables if table.caption == "All photographs")


def test_the_ledger_has_fixed_decimals_and_leaves_out_columns_that_say_nothing(results):
    table = ledger(results, [entry(0), entry(1), entry(2, time_s=None, u_mm=None)])
    assert list(table.head) == ["Frame", "File", "Time, s", "u, mm", "Status"]
    assert [[cell.text for cell in row[2:4]] for row in table.rows] == [
        ["10.000", "0.000"],
        ["10.333", "1.000"],
        ["–", "–"],
    ]


def test_the_ledger_tells_uncertain_times_notes_and_points_followed(results):
    status = np.array([[0, 0, 0, 0], [0, 0, 0, 9]], np.int8)
    tracks = xr.Dataset({"status": (("frame", "point"), status)})
    frames = [entry(0, time_std_s=0.289), entry(1, notes=("<i>shaken</i>",), status="ok")]
    table = ledger(results, frames, tracks)
    assert list(table.head)[2:] == [
        "Time ± std, s",
        "u, mm",
        "Points followed, %",
        "Status",
        "Reason and notes",
    ]
    assert table.rows[0][2].text == "10.000 ± 0.289"
    assert [row[4].text for row in table.rows] == ["100.0", "75.0"]
    assert table.rows[1][6].text == "<i>shaken</i>"


def settings_of(results, settings):
    run = results.run.model_copy(update={"settings": settings})
    chapter = provenance_chapter(replace(results, run=run))
    table = next(table for table in chapter.tables if table.caption == "Settings")
    return {row[0].text: [cell.text for cell in row[1:]] for row in table.rows}, table.footnotes


def test_settings_tell_their_unit_and_whether_they_are_the_default(results):
    told, _ = settings_of(results, {"blade": {"depth_mm": 30.0, "thickness_mm": 5.0}, "later": {"key": True}})
    assert told["blade.depth_mm"] == ["30", "no", "depth of the tip below the initial surface, mm"]
    assert told["blade.thickness_mm"][1] == "yes"
    assert told["later.key"] == ["true", "no", ""]


def test_settings_that_were_not_given_are_named_once_below(results):
    told, notes = settings_of(results, {"camera": {"lens": "", "iso": None, "points_std_mm": 0.0}})
    assert list(told) == ["camera.points_std_mm"]
    assert notes == ("Not given: camera.lens, camera.iso.",)


def test_points_in_settings_stand_in_brackets(results):
    told, _ = settings_of(results, {"model": {"initial_surface_mm": [[0.0, 30.0], [50.0, 31.5]]}})
    assert told["model.initial_surface_mm"][0] == "(0, 30), (50, 31.5)"


def test_every_setting_says_what_it_means():
    def keys(table, place=""):
        for key in known_keys(table):
            field = table.model_fields[key]
            inner = table_of(field.annotation)
            yield from (
                [(f"{place}{key}", field.description)] if inner is None else keys(inner, f"{place}{key}.")
            )

    assert [key for key, meaning in keys(Scene) if not meaning] == []
