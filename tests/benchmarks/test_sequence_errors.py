"""Scores of whole sequences: known errors must come back as they were put in."""

import numpy as np
import pandas as pd
import pytest

from sequences.errors import errors_of, geometry_errors, true_lines
from sequences.fates import confusion, torn_apart
from sequences.rows import Row, missed, side_by_side


def values(rows):
    return {row.quantity: row.value for row in rows}


def test_a_figure_is_reached_within_its_bounds_and_nothing_is_not_reached():
    assert Row("a", 0.5, "px", most=0.5).reached is True
    assert Row("a", 0.6, "px", most=0.5).reached is False
    assert Row("a", 60.0, "%", 65, 71).reached is False
    assert Row("a", float("nan"), "px", most=0.5).reached is False
    assert Row("a", 3.0, "1").reached is None
    rows = [Row("a", 0.6, "px", most=0.5), Row("b", 1.0, "s")]
    assert missed(rows) == ["a [px] = 0.6 (at most 0.5)"]
    table = side_by_side({"one": rows, "two": rows[1:]})
    assert table.loc["a [px]", "to reach"] == "at most 0.5"
    assert np.isnan(table.loc["a [px]", "two"])


def test_a_constant_error_of_the_tracks_is_its_length(made):
    made.write_tracks(np.array([0.03, -0.04]), std_px=0.035)
    found = values(geometry_errors(made.folder, made.results))
    assert found["tracks, median"] == pytest.approx(0.05, abs=1e-6)
    assert found["last frame, moved, 95 %"] == pytest.approx(0.05, abs=1e-6)
    assert found["largest error of a valid point"] == pytest.approx(0.05, abs=1e-6)
    assert found["moved points wrong by more than 1 px"] == 0.0
    assert found["standing sand that is tracked"] == 100.0
    assert found["avalanched sand called valid"] == 0.0
    # one component of each point lies within one standard deviation, both within two
    assert found["track errors within one std"] == pytest.approx(50.0)
    assert found["track errors within two std"] == pytest.approx(100.0)


def test_normal_errors_are_covered_as_a_normal_law_says(made):
    shape = (len(made.truth.blade), len(made.start_mm()), 2)
    made.write_tracks(np.random.default_rng(1).normal(0, 0.02, shape), std_px=0.02)
    found = values(geometry_errors(made.folder, made.results))
    # 68.27 and 95.45 %; some 16 000 independent components: standard error 0.4 and 0.2 %
    assert found["track errors within one std"] == pytest.approx(68.27, abs=1.5)
    assert found["track errors within two std"] == pytest.approx(95.45, abs=0.8)


def test_a_surface_that_lies_half_a_pixel_high_has_that_error(made):
    line = made.truth.surface.assign(y_mm=made.truth.surface["y_mm"] + 0.5 * made.scale)
    line["std_mm"] = 0.3 * made.scale
    made.write_table("surface", line)
    found = values(errors_of(made.folder, made.results))
    assert found["free surface, rms"] == pytest.approx(0.5, abs=1e-3)  # tables are rounded to 1 um
    assert found["surface errors within one std"] == 0.0
    assert found["surface errors within two std"] == 100.0
    assert found["blade face, rms"] == pytest.approx(0.0, abs=1e-9)


def test_layers_are_scored_by_distance_and_by_what_is_found_of_them(made):
    whole = made.truth.layers.dropna()
    rows = [
        whole.assign(source="dye", y_mm=whole["y_mm"] + 0.4 * made.scale),
        whole[whole["x_mm"] > 60].assign(source="tracks"),
    ]
    made.write_table("layers", pd.concat(rows))
    made.write_table("surface", made.truth.surface)
    found = values(geometry_errors(made.folder, made.results))
    # most of a layer is level: there the distance is the height; the samples are 0.15 px apart
    assert found["layers (dye), median"] == pytest.approx(0.4, abs=0.02)
    assert found["layers (tracks), median"] < 0.1
    assert found["layers (dye), share found"] > 97.0
    # of some 110 mm of standing layers what lies beyond 60 mm
    assert 35.0 < found["layers (tracks), share found"] < 75.0


def test_a_true_line_is_a_layer_at_rest_before_motion(made):
    first = true_lines(made.truth, 10.0, 0.5)[0]
    assert np.all(first[:, 1] == 10.0)
    assert np.diff(first[:, 0]).max() == pytest.approx(0.5)


def test_sand_is_torn_where_its_neighbours_leave_it():
    class Points:
        start_mm = np.array([[0.0, 0.0], [5.0, 0.0]])
        status = np.zeros((2, 2), np.int8)

    def slid(points):
        """The right half moves up by 2 mm in the second frame."""
        moved = points + np.where(points[:, :1] > 0.5, [[0.0, 2.0]], [[0.0, 0.0]])
        return np.stack([points, moved])

    points = Points()
    points.true_mm = slid(points.start_mm)
    torn = torn_apart(points, slid, reach_mm=1.0, torn_mm=0.3)
    assert torn.tolist() == [[False, False], [True, False]]


def test_true_fates_are_counted_against_the_status_said(made):
    made.write_tracks(np.zeros(2), std_px=0.01)
    table = confusion(made.folder, made.results)
    gone = int(np.isnan(made.truth.positions(made.start_mm())[1:, :, 0]).sum())
    assert gone > 0
    assert table.loc["avalanched or swept", "avalanched"] == gone
    assert table.loc["standing", "ok"] > 0
    assert table.to_numpy().sum() == 11 * len(made.start_mm())
