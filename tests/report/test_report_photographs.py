"""Photographs of a run are shown as long as the settings are those of the run."""

import pytest

from ploughval.report.photographs import same_pictures, unchanged

THEN = {"blade": {"depth_mm": 30.0}, "camera": {"tip_px": [30.0, 100.0], "lens_k1": None}}


def now(**camera):
    return {"blade": {"depth_mm": 30.0}, "camera": {**THEN["camera"], **camera}}


def test_settings_that_newer_versions_know_and_nobody_gave_change_nothing():
    assert unchanged(now(make="", iso=None, marks=[]), THEN)


@pytest.mark.parametrize("camera", [{"make": "A"}, {"iso": 100}, {"tip_px": [31.0, 100.0]}, {"lens_k1": 0.1}])
def test_a_setting_that_was_given_since_or_differs_is_a_change(camera):
    assert not unchanged(now(**camera), THEN)


def test_a_table_that_is_gone_is_a_change():
    assert not unchanged({"blade": {"depth_mm": 30.0}}, THEN)


def test_another_name_or_note_leaves_the_photographs():
    assert same_pictures(now() | {"test": {"name": "a", "notes": "wet"}}, THEN | {"test": {"name": "b"}})


def test_another_camera_does_not():
    assert not same_pictures(now(tip_px=[31.0, 100.0]), THEN)
