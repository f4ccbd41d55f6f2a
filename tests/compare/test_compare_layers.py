"""Distances between lines whose normal distance is known, and what makes them credible."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest

from ploughval.compare.case import Case
from ploughval.compare.ensemble import Ensemble
from ploughval.compare.inputs import Input
from ploughval.compare.lines.distances import DISTANCE_COLUMNS, beside_face, compare_lines
from ploughval.compare.lines.effective import effective_number
from ploughval.compare.lines.lines import measured_lines, model_lines
from ploughval.compare.lines.metrics import layer_metrics, surface_metrics
from ploughval.compare.lines.nearest import nearest_on_line
from ploughval.scene import Scene

TILT = np.radians(25.0)
ALONG, NORMAL = np.array([np.cos(TILT), np.sin(TILT)]), np.array([-np.sin(TILT), np.cos(TILT)])
TEAR = np.full((1, 2), np.nan)


def layer(xy, *, frame=0, height=5.0, source="tracks", std=0.1):
    table = pd.DataFrame(np.asarray(xy, dtype=float), columns=["x_mm", "y_mm"])
    return table.assign(frame=frame, u_mm=2.0 * frame, layer=height, source=source, std_mm=std)


def tilted(n=30, shift=0.0, start=0.0, end=100.0):
    """A straight line at 25 degrees, moved along its normal."""
    return np.linspace(start, end, n)[:, None] * ALONG + shift * NORMAL


def plain_search(points, line):
    """Signed distance without pieces or tears: all segments, numpy alone."""
    start, end = line[:-1], line[1:]
    along = end - start
    share = np.clip(np.einsum("nmk,mk->nm", points[:, None] - start, along) / (along**2).sum(1), 0, 1)
    gap = points[:, None] - start - share[..., None] * along
    return np.hypot(gap[..., 0], gap[..., 1]).min(axis=1)


def compared(measured, model):
    return compare_lines(list(measured_lines(measured)), model_lines(model))


@dataclass
class StandIn:
    """A model with level layers, lifted, and a level surface."""

    lift_mm: float = 0.0

    @property
    def force(self):
        return pd.DataFrame({"u_mm": [0.0, 60.0]})

    def layers(self, heights_mm, u_mm, frames):
        parts = [
            layer([[u, h + self.lift_mm], [400.0, h + self.lift_mm]], frame=k, height=h, source="model")
            for k, u in zip(frames, u_mm, strict=True)
            for h in heights_mm
        ]
        return pd.concat(parts, ignore_index=True)

    def surface(self, u_mm):
        return np.array([[u_mm, 30.0 + self.lift_mm], [400.0, 30.0 + self.lift_mm]])


def case(drawn=()):
    soil = {"unit_weight_kN_m3": 16.0, "peak_friction_deg": 50.0, "residual_friction_deg": 32.0}
    scene = Scene.model_validate(
        {"test": {"name": "t"}, "blade": {"depth_mm": 30.0, "width_mm": 218}, "soil": soil}
    )
    inputs = (Input("peak_friction_deg", 50.0, 1.0, 0.0),) if drawn else ()
    runs = tuple(StandIn(lift) for lift in drawn)
    model = StandIn()
    return Case(scene, model, Ensemble(inputs, np.arange(float(len(drawn)))[:, None], runs, model))


def level(lift, frames=12, heights=(5.0, 15.0), rng=None, noise=0.0):
    """Level layers from the blade's face on, every 2 mm of travel."""
    parts = []
    for k in range(frames):
        for h in heights:
            x = np.arange(2.0 * k + 0.5, 150.0, 1.5)
            y = h + lift + (np.zeros(x.size) if rng is None else rng.normal(0, noise, x.size))
            parts.append(layer(np.column_stack([x, y]), frame=k, height=h, std=max(noise, 0.05)))
    return pd.concat(parts, ignore_index=True)


def by_name(metrics):
    return {metric.name: metric for metric in metrics}


def test_a_line_moved_along_its_normal_is_that_far_away_with_its_sign():
    for shift in (0.37, -0.37):
        found = nearest_on_line(tilted(47, shift=shift), tilted())
        np.testing.assert_allclose(found.distance_mm, shift, rtol=1e-12)


def test_the_compiled_search_is_the_plain_one():
    rng = np.random.default_rng(4)
    line = np.column_stack([np.sort(rng.uniform(0, 100, 60)), rng.uniform(0, 9, 60)])
    points = rng.uniform([-5, -5], [105, 14], (400, 2))
    np.testing.assert_allclose(
        np.abs(nearest_on_line(points, line).distance_mm), plain_search(points, line), atol=1e-12
    )


def test_the_sign_at_a_corner_is_that_of_both_its_sides():
    roof = np.array([[-10.0, -10.0], [0.0, 0.0], [10.0, -10.0]])
    found = nearest_on_line(np.array([[0.0, 1.0], [0.5, 2.0], [0.0, -1.0]]), roof)
    np.testing.assert_allclose(found.distance_mm, [1.0, np.hypot(0.5, 2), -np.sqrt(0.5)])
    valley = np.array([[-10.0, 10.0], [0.0, 0.0], [10.0, 10.0]])
    below = nearest_on_line(np.array([[0.3, -2.0], [0.0, 1.0]]), valley)
    np.testing.assert_allclose(below.distance_mm, [-np.hypot(0.3, 2), np.sqrt(0.5)])


def test_sand_sheared_past_upright_keeps_its_upper_side():
    # A layer dragged upwards and back: it runs up to the left; its upper side is the one on its left.
    line = np.array([[0.0, 0.0], [-1.0, 10.0]])
    left, right = nearest_on_line(np.array([[-1.5, 5.0], [0.5, 5.0]]), line).distance_mm
    assert left > 0 > right


def test_points_beyond_the_outer_ends_have_no_normal():
    line = np.array([[0.0, 0.0], [10.0, 0.0]])
    found = nearest_on_line(np.array([[-1.0, 1.0], [0.0, 1.0], [10.0, 2.0], [10.5, 0.0]]), line)
    np.testing.assert_array_equal(found.beyond, [True, False, False, True])
    np.testing.assert_array_equal(found.distance_mm[1:3], [1.0, 2.0])


def test_a_torn_line_is_not_bridged():
    torn = np.array([[0.0, 0.0], [4.0, 0.0], [np.nan, np.nan], [6.0, 3.0], [10.0, 3.0]])
    # Straight across the tear (5, 1.5) would lie on the line; its nearest torn end is sqrt(1 + 2.25) away.
    found = nearest_on_line(np.array([[5.0, 1.5], [5.0, 0.4]]), torn)
    assert abs(found.distance_mm[0]) == pytest.approx(np.sqrt(3.25))
    np.testing.assert_allclose(found.past_tear_mm, [1.0, 1.0])
    assert not found.beyond.any()


def test_a_vertex_alone_between_tears_counts():
    line = np.array(
        [[0.0, 0.0], [1.0, 0.0], [np.nan, np.nan], [5.0, 2.0], [np.nan, np.nan], [8.0, 0.0], [9.0, 0.0]]
    )
    found = nearest_on_line(np.array([[5.0, 2.5], [5.0, 1.5]]), line)
    np.testing.assert_allclose(found.distance_mm, [0.5, -0.5])


def test_a_line_without_vertices_measures_nothing():
    found = nearest_on_line(np.zeros((3, 2)), np.full((4, 2), np.nan))
    assert np.isnan(found.distance_mm).all()
    assert found.beyond.all()


def test_a_larger_slip_shows_as_extra_line_and_as_distance():
    lower = np.column_stack([np.arange(40.0, 100.5, 0.5), np.full(121, 5.0)])

    def upper(slip):
        """The thrust block's piece: carried 3 mm up and by the slip over the lower piece."""
        x = np.arange(0.0, 40.5, 0.5) + slip
        return np.column_stack([x, np.full(x.size, 8.0)])

    model = layer(np.vstack([upper(2.0), TEAR, lower]), source="model")
    further = compared(layer(np.vstack([upper(9.0), TEAR, lower])), model)[0]
    # 7 mm of the upper measured piece hang past the model's torn end. Its first 3 mm are nearest to that
    # end (less the half millimetre that points are apart); the rest lies 3 mm above the lower piece.
    assert further.extra_mm == pytest.approx(2.5, abs=0.5)
    assert np.nanmax(further.distance_mm) == pytest.approx(3.0)
    assert further.missing_mm == 0.0
    assert compared(model.assign(source="tracks"), model)[0].extra_mm == 0.0
    gap = np.column_stack([np.append(np.arange(0.0, 30.5, 0.5), np.nan), np.append(np.full(61, 5.0), np.nan)])
    short = compared(
        layer(np.vstack([gap, lower])), layer(np.vstack([gap[:51], TEAR, lower]), source="model")
    )
    # The model's first piece ends at 25 mm, the measured one at 30: 5 mm of it have no partner.
    assert short[0].extra_mm == pytest.approx(4.75, abs=0.51)
    assert short[0].missing_mm == 0.0


def test_both_ways_see_what_one_way_hides():
    # A spike of the model 1.5 mm wide and 4 mm high: measured points pass its foot, none its top.
    spike = tilted(201)
    spike[99:102] += 4.0 * NORMAL
    one = compared(layer(tilted(201)), layer(spike, source="model"))[0]
    assert np.abs(one.distance_mm).max() < 1.0
    assert one.reverse_mm.max() == pytest.approx(4.0)
    # Its three upper vertices stand for the 1 mm of its top and half of either flank.
    assert one.missing_mm == pytest.approx(1.0 + np.hypot(4.0, 0.5), abs=0.01)


def test_summaries_are_per_frame_and_layer():
    measured = pd.concat(
        [layer(tilted(shift=0.2), frame=k) for k in (0, 1)]
        + [layer(tilted(shift=-0.5), frame=1, height=10.0, source="dye")]
    )
    model = pd.concat([layer(tilted(), frame=k, height=h) for k in (0, 1) for h in (5.0, 10.0)])
    found = compared(measured, model)
    assert [(one.line.key, one.line.source) for one in found] == [
        ((0, 5.0), "tracks"), ((1, 5.0), "tracks"), ((1, 10.0), "dye"),
    ]  # fmt: skip
    assert [float(np.nanmean(one.distance_mm)) for one in found] == pytest.approx([0.2, 0.2, -0.5])
    assert [one.line.u_mm for one in found] == [0.0, 2.0, 2.0]


def test_tracks_go_before_dye_and_dye_stands_in():
    both = pd.concat([layer(tilted(shift=0.1)), layer(tilted(shift=0.9), source="dye")])
    assert compared(both, layer(tilted()))[0].distance_mm[5] == pytest.approx(0.1)
    lost = both.assign(x_mm=both["x_mm"].where(both["source"] == "dye"))
    assert compared(lost, layer(tilted()))[0].distance_mm[5] == pytest.approx(0.9)


def test_many_points_are_thinned_without_bias():
    wave = tilted(5000) + 0.3 * np.sin(np.linspace(0, 400, 5000))[:, None] * NORMAL
    one = compared(layer(wave, source="dye"), layer(tilted()))[0]
    assert one.distance_mm.size == 300
    # rms of a sine over 64 periods, sampled at 300 places; the points stand for the whole length.
    assert np.sqrt(np.nanmean(one.distance_mm**2)) == pytest.approx(0.3 / np.sqrt(2), rel=0.02)
    assert one.line.length_mm.sum() == pytest.approx(np.hypot(*np.diff(wave, axis=0).T).sum())


def test_the_effective_number_of_a_moving_average_is_that_of_its_windows():
    """Means over windows of L independent values: n / L independent ones; the median of 400 within 30 %."""
    rng = np.random.default_rng(11)
    for length in (1, 5, 12):
        kernel = np.ones(length) / length
        counts = [
            effective_number(np.convolve(rng.standard_normal(300 + length - 1), kernel, "valid"))
            for _ in range(400)
        ]
        assert np.median(counts) == pytest.approx(300 / length, rel=0.3)
    assert effective_number(np.full(50, 0.3)) == 1.0
    assert effective_number(np.empty(0)) == 0.0


def test_lifted_layers_are_that_far_off_and_above():
    metrics, table = layer_metrics(case(), level(0.1))
    named = by_name(metrics)
    assert named["layers_mean_mm"].error == pytest.approx(-0.1)  # the model lies below
    assert table is not None
    assert tuple(table.columns) == DISTANCE_COLUMNS
    np.testing.assert_allclose(table["mean_mm"], 0.1)
    np.testing.assert_allclose(table[["rms_mm", "median_mm", "p95_mm", "face_rms_mm"]], 0.1)
    for name in ("rms", "median", "p95", "face_rms", "away_rms", "hausdorff95"):
        assert named[f"layers_{name}_mm"].error == pytest.approx(0.1, rel=1e-9), name
    # 0.1 mm within twice 0.05 mm of measurement and 0.03 mm of the model (a thousandth of the depth).
    assert named["layers_rms_mm"].validation_std == pytest.approx(np.hypot(0.05, 0.03))
    assert named["layers_rms_mm"].agrees is True
    assert table["within"].eq(1.0).all()
    # All points are off alike: they say it once a frame and layer. Half of the variance is common to the two
    # layers, the other half is not.
    assert named["layers_mean_mm"].experiment_std == pytest.approx(0.05 * np.sqrt(0.5 + 0.5 / 2))
    assert named["layers_extra_mm"].error == named["layers_missing_mm"].error == 0.0


def test_independent_noise_averages_out_and_stays_within_its_uncertainty():
    metrics, table = layer_metrics(case(), level(0.0, rng=np.random.default_rng(3), noise=0.2))
    mean = by_name(metrics)["layers_mean_mm"]
    # Some 90 points a line: only what they have in common is left, half of the variance.
    assert mean.experiment_std == pytest.approx(0.2 * np.sqrt(0.5), rel=0.02)
    assert abs(mean.error) < 0.2 / 10
    assert table is not None
    assert table["within"].mean() == pytest.approx(0.95, abs=0.02)


def test_inputs_and_calibration_are_parts_of_every_points_uncertainty():
    table = level(0.0).assign(calibration_std_mm=0.4)
    metrics, distances = layer_metrics(case(drawn=(-0.3, 0.3)), table)
    named = by_name(metrics)
    assert named["layers_rms_mm"].input_std == pytest.approx(0.3)
    assert named["layers_mean_mm"].input_std == pytest.approx(0.3)
    assert named["layers_mean_mm"].dominant_input == "peak_friction_deg"
    assert named["layers_mean_mm"].experiment_std == pytest.approx(
        np.hypot(0.4, 0.05 * np.sqrt(0.75)), rel=0.01
    )
    assert named["layers_rms_mm"].experiment_std == pytest.approx(np.hypot(0.05, 0.4))
    assert distances is not None
    np.testing.assert_allclose(distances["input_std_mm"], 0.3)
    np.testing.assert_allclose(distances["validation_std_mm"], np.sqrt(0.05**2 + 0.4**2 + 0.3**2 + 0.03**2))


def test_sand_that_shears_beside_the_blade_shows_in_its_zone_alone():
    table = level(0.0)
    beside = table["x_mm"] - table["u_mm"] <= 7.5
    metrics, _ = layer_metrics(case(), table.assign(y_mm=table["y_mm"] + 2.0 * beside))
    named = by_name(metrics)
    assert named["layers_face_rms_mm"].error == pytest.approx(2.0)
    assert named["layers_face_rms_mm"].agrees is False
    assert named["layers_away_rms_mm"].error == pytest.approx(0.0, abs=1e-12)


def test_the_zone_beside_the_blade_leans_with_its_face():
    """A point 20 mm above the tip and 10 mm ahead of it: 6.5 mm before a face that leans by 10 degrees."""
    (line,) = measured_lines(layer([[9.0, 20.0], [10.0, 20.0], [40.0, 20.0]]))
    (one,) = compare_lines([line], {line.key: np.array([[0.0, 20.0], [50.0, 20.0]])})
    assert beside_face(one, 30.0).tolist() == [False, False, False]
    assert beside_face(one, 30.0, np.tan(np.radians(10.0))).tolist() == [True, True, False]


def test_a_surface_is_judged_where_its_uncertainty_is_known():
    rows = level(0.1, heights=(30.0,))
    unknown = by_name(surface_metrics(case(), rows[["frame", "u_mm", "x_mm", "y_mm"]]))
    assert unknown["surface_rms_mm"].error == pytest.approx(0.1)
    assert unknown["surface_rms_mm"].agrees is None
    known = by_name(surface_metrics(case(), rows[["frame", "u_mm", "x_mm", "y_mm", "std_mm"]]))
    assert known["surface_rms_mm"].agrees is True
    assert "surface_face_rms_mm" not in known


def test_a_frame_past_the_models_end_is_left_out_and_none_is_no_metric():
    late = level(0.0).assign(u_mm=80.0)
    assert layer_metrics(case(), late) == ([], None)
    assert surface_metrics(case(), late) == []
