"""Distances between lines whose normal distance is known."""

import numpy as np
import pandas as pd
import pytest

from ploughval.compare.lines.distances import line_distances, polyline_distance

TILT = np.radians(25.0)


def layer(xy, *, frame=0, height=5.0, source="model", std=0.1):
    table = pd.DataFrame(xy, columns=["x_mm", "y_mm"])
    return table.assign(frame=frame, u_mm=2.0 * frame, layer=height, source=source, std_mm=std)


def tilted(n=30, shift=0.0):
    """A straight line at 25 degrees, moved along its normal."""
    s = np.linspace(0, 100, n)
    line = np.stack([s * np.cos(TILT), s * np.sin(TILT)], axis=1)
    return line + shift * np.array([-np.sin(TILT), np.cos(TILT)])


def test_a_line_moved_along_its_normal_is_that_far_away():
    distance = polyline_distance(tilted(47, shift=0.37), tilted())
    np.testing.assert_allclose(distance, 0.37, rtol=1e-12)


def test_distance_to_a_corner_is_round():
    corner = np.array([[-10.0, 0.0], [0.0, 0.0], [0.0, -10.0]])
    distance = polyline_distance(np.array([[3.0, 4.0], [-2.0, 1.0], [2.0, -3.0]]), corner)
    np.testing.assert_allclose(distance, [5.0, 1.0, 2.0], rtol=1e-14)


def test_points_beyond_the_outer_ends_have_no_normal():
    line = np.array([[0.0, 0.0], [10.0, 0.0]])
    distance = polyline_distance(np.array([[-1.0, 1.0], [0.0, 1.0], [10.0, 2.0], [10.5, 0.0]]), line)
    np.testing.assert_array_equal(distance, [np.nan, 1.0, 2.0, np.nan])


def test_a_torn_line_is_not_bridged():
    torn = np.array([[0.0, 0.0], [4.0, 0.0], [np.nan, np.nan], [6.0, 3.0], [10.0, 3.0]])
    # Straight across the tear (5, 1.5) would lie on the line; its nearest torn end is sqrt(1 + 2.25) away.
    assert polyline_distance(np.array([[5.0, 1.5]]), torn) == pytest.approx([np.sqrt(3.25)])


def test_a_vertex_alone_between_tears_counts():
    line = np.array(
        [[0.0, 0.0], [1.0, 0.0], [np.nan, np.nan], [5.0, 2.0], [np.nan, np.nan], [8.0, 0.0], [9.0, 0.0]]
    )
    assert polyline_distance(np.array([[5.0, 2.5]]), line) == pytest.approx([0.5])


def test_a_line_without_vertices_measures_nothing():
    assert np.isnan(polyline_distance(np.zeros((3, 2)), np.full((4, 2), np.nan))).all()


def test_summaries_are_per_frame_and_layer():
    measured = pd.concat(
        [layer(tilted(shift=0.2), frame=k, source="tracks") for k in (0, 1)]
        + [layer(tilted(shift=-0.5), frame=1, height=10.0, source="dye")]
    )
    model = pd.concat([layer(tilted(), frame=k, height=h) for k in (0, 1) for h in (5.0, 10.0)])
    found = line_distances(measured, model)
    assert found.table[["frame", "layer", "source"]].to_numpy().tolist() == [
        [0, 5.0, "tracks"], [1, 5.0, "tracks"], [1, 10.0, "dye"],
    ]  # fmt: skip
    np.testing.assert_allclose(found.table["rms_mm"], [0.2, 0.2, 0.5], rtol=1e-10)
    np.testing.assert_allclose(found.table["median_mm"], [0.2, 0.2, 0.5], rtol=1e-10)
    np.testing.assert_allclose(found.table["p95_mm"], [0.2, 0.2, 0.5], rtol=1e-10)
    assert found.table["u_mm"].tolist() == [0.0, 2.0, 2.0]
    assert found.distance_mm.size == 90


def test_tracks_go_before_dye_and_dye_stands_in():
    both = pd.concat([layer(tilted(shift=0.1), source="tracks"), layer(tilted(shift=0.9), source="dye")])
    assert line_distances(both, layer(tilted())).table["rms_mm"].item() == pytest.approx(0.1)
    lost = both.assign(x_mm=both["x_mm"].where(both["source"] == "dye"))
    assert line_distances(lost, layer(tilted())).table["rms_mm"].item() == pytest.approx(0.9)


def test_many_points_are_thinned_without_bias():
    many = tilted(5000)
    wave = many + 0.3 * np.sin(np.linspace(0, 400, 5000))[:, None] * np.array([-np.sin(TILT), np.cos(TILT)])
    found = line_distances(layer(wave, source="dye"), layer(tilted()))
    assert found.table["points"].item() == 300
    # rms of a sine over 64 periods, sampled at 300 places.
    assert found.table["rms_mm"].item() == pytest.approx(0.3 / np.sqrt(2), rel=0.02)
