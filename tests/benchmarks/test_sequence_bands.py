"""Scores of shear bands: pairs, counts, errors in frame intervals, and the truth of an increment."""

import numpy as np
import pandas as pd
import pytest

from sequences.bands import increment_errors, match, true_increments
from sequences.errors import geometry_errors


def test_the_true_bands_are_found_without_error(made):
    made.write_table("bands", made.truth.bands)
    found = {row.quantity: row for row in geometry_errors(made.folder, made.results)}
    assert found["bands true"].value == found["bands found"].value == 2
    for name in ("bands missed", "bands invented", "bands, largest error of beta"):
        assert found[name].value == 0.0
        assert found[name].reached


def test_missed_invented_and_doubled_bands_are_counted(made):
    true = made.truth.bands
    assert match(true.iloc[:1], made.truth).missed == 1
    assert match(true.iloc[:0], made.truth).missed == 2
    assert match(pd.concat([true, true.iloc[1:]]), made.truth).invented == 1
    away = true.assign(outcrop_x_mm=true["outcrop_x_mm"] + 20.0)  # more than half a depth
    assert (match(away, made.truth).missed, match(away, made.truth).invented) == (2, 2)
    before = true.iloc[1:].assign(u_start_mm=0.0, u_end_mm=2.0)  # at the right place, long before
    assert match(before, made.truth).invented == 1


def test_errors_of_start_are_in_frame_intervals(made):
    made.write_table("bands", made.truth.bands.assign(u_start_mm=made.truth.bands["u_start_mm"] + 3.0))
    found = {row.quantity: row.value for row in geometry_errors(made.folder, made.results)}
    assert found["bands, largest error of start"] == pytest.approx(3.0 / 2.0)  # 22 mm in 11 intervals


def test_the_true_increment_is_the_chord_of_the_motion(made):
    frames_u = made.truth.blade["u_mm"].to_numpy()
    increments = pd.DataFrame({"u_mm": frames_u[:-1], "du_mm": np.diff(frames_u)})
    true = true_increments(increments, made.truth)
    switch = made.truth.bands["u_start_mm"].iloc[1]
    across = (frames_u[:-1] < switch) & (frames_u[1:] > switch)
    assert np.array_equal(true["beta_deg"].isna(), across)
    # sand before the first band's outcrop and above it, near the face: it rises by du tan(beta)
    place = made.truth.positions([[30.0, 27.0]])[:, 0]
    steps = np.diff(place, axis=0)[:5]
    rose = np.degrees(np.arctan2(steps[:, 1], steps[:, 0]))
    np.testing.assert_allclose(true["beta_deg"][:5], rose, atol=1e-6)
    assert true["outcrop_x_mm"].iloc[0] == pytest.approx(made.truth.bands["outcrop_x_mm"].iloc[0])


def test_deviations_of_increments_are_judged_against_the_truth(made):
    frames_u = made.truth.blade["u_mm"].to_numpy()
    increments = pd.DataFrame({"frame": np.arange(11), "u_mm": frames_u[:-1], "du_mm": np.diff(frames_u)})
    true = true_increments(increments, made.truth)
    increments = increments.assign(
        beta_deg=true["beta_deg"] + 0.15,
        beta_std_deg=0.1,
        outcrop_x_mm=true["outcrop_x_mm"] + 0.3,
        outcrop_std_mm=0.1,
        band=0,
    )
    found = {row.quantity: row.value for row in increment_errors(increments, made.truth)}
    assert found["beta of increments, median |e|"] == pytest.approx(0.15)
    assert found["beta of increments within one std"] == 0.0
    assert found["beta of increments within two std"] == 100.0
    assert found["outcrop of increments within two std"] == 0.0
