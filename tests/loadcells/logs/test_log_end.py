"""A log that ends as the blade still moves is told from one that ends at rest."""

import re

import numpy as np
import pytest

from ploughval.loadcells import read_log
from ploughval.loadcells.logs.ends import stops_early
from ploughval.scene import LogColumns


def travel(rate_hz, rest_after_s, noise_mm=0.002, way=1.0):
    t = np.arange(int((40 + rest_after_s) * rate_hz)) / rate_hz
    u = way * np.clip(t - 10, 0, 30)
    return t, u + np.random.default_rng(0).normal(0, noise_mm, t.size)


@pytest.mark.parametrize("rate_hz", [5, 100, 2000])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_an_end_in_motion_is_said_with_place_and_speed(rate_hz, way):
    notes = stops_early(*travel(rate_hz, 0, way=way))
    assert len(notes) == 1
    end = 40 - 1 / rate_hz
    assert f"the log ends at {end:.7g} s" in notes[0]
    told = re.search(r"still moves at (.*) mm/s: what came after has no force", notes[0])
    # Noise of 0.002 mm in 100 rows over 0.4 s: 0.002 mm/s of the slope fitted, three times that here.
    assert float(told[1]) == pytest.approx(way, abs=0.006)


@pytest.mark.parametrize("rate_hz", [5, 100, 2000])
@pytest.mark.parametrize("rest_after_s", [3, 30])
def test_an_end_at_rest_or_without_motion_is_not(rate_hz, rest_after_s):
    t, u = travel(rate_hz, rest_after_s)
    assert stops_early(t, u) == []
    assert stops_early(t, np.random.default_rng(1).normal(0, 0.002, t.size)) == []


def test_rows_without_displacement_do_not_hide_the_end():
    t, u = travel(100, 0)
    u[::3] = np.nan
    u[-5:] = np.nan
    assert len(stops_early(t, u)) == 1


def test_the_end_is_a_note_of_the_log_and_no_fault(tmp_path):
    t, u = travel(20, 0)
    rows = np.column_stack([t, u, 1 + 0.1 * u, 2 + 0.05 * u])
    path = tmp_path / "log.csv"
    header = "time_s,displacement_mm,moment_upper_Nm,moment_lower_Nm"
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.5f")
    log = read_log(path, LogColumns())
    assert log.faults == ()
    assert len(log.notes) == 1


def test_last_rows_at_one_time_have_no_speed():
    """Found by spoiling sound files: times that differ by 1e-317 s, of which no line can be fitted."""
    t, u = travel(100, 0)
    t[-60:] = t[-60] + np.arange(60) * 5e-324
    assert stops_early(t, u) == []
