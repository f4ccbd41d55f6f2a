"""Plot functions: Figures whose data are the tables they were given, and that leave no trace behind."""

import re

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from ploughval.axes import Region
from ploughval.report import figures
from ploughval.report.figures.field import increment
from ploughval.report.figures.series import History
from ploughval.report.figures.style import THEMED, to_svg
from ploughval.report.grey import eight_bit
from ploughval.report.photographs import WorldGrid, shrunk
from ploughval.report.stages import outcrops, stage_frames, view
from ploughval.report.thinning import thin
from ploughval.results import read_results


@pytest.fixture(scope="module")
def results(result_folder):
    return read_results(result_folder)


def line(axes, label):
    return next(item for item in axes.lines if item.get_label() == label)


def test_force_figure_draws_both_histories_divided_by_the_same_force(results):
    figure = figures.force_figure(results.force, results.model_force, depth_mm=30.0, P0_N=12.0)
    axes = figure.axes[0]
    for label, table in (("measured", results.force), ("predicted", results.model_force)):
        x, y = line(axes, label).get_data()
        np.testing.assert_allclose(x, table["u_mm"] / 30.0, rtol=1e-12)
        np.testing.assert_allclose(y, table["force_N"] / 12.0, rtol=1e-12)
    edge = axes.collections[0].get_paths()[0].vertices[:, 1]
    highest = (results.force["force_N"] + 2 * results.force["force_std_N"]).max() / 12.0
    assert edge.max() == pytest.approx(highest, rel=1e-12)


def test_band_starts_stand_where_the_bands_start(results):
    figure = figures.force_figure(
        results.force, None, depth_mm=30.0, P0_N=12.0, bands=results.bands, model_bands=results.model_bands
    )
    axes = figure.axes[0]
    np.testing.assert_allclose(line(axes, "band starts, measured").get_xdata(), [0.0, 40.0 / 30.0])
    np.testing.assert_allclose(line(axes, "band starts, predicted").get_xdata(), [4.0 / 30.0, 44.0 / 30.0])


def test_thinned_history_keeps_extremes_and_order():
    u = np.linspace(0, 10, 100_001)
    table = pd.DataFrame({"u_mm": u, "force_N": np.sin(40 * u)})
    table.loc[61_234, "force_N"] = 9.0
    table.loc[61_300, "force_N"] = -9.0
    kept = thin(table, "force_N")
    assert len(kept) <= 1002
    assert kept["force_N"].max() == 9.0
    assert kept["force_N"].min() == -9.0
    assert kept["u_mm"].is_monotonic_increasing
    assert kept["u_mm"].iloc[[0, -1]].tolist() == [0.0, 10.0]


def test_band_bars_hold_outcrop_and_increments_with_two_standard_deviations(results):
    figure = figures.bands_figure(results.bands, results.increments, model_force=results.model_force)
    above, below = figure.axes
    spread = above.collections[0].get_paths()[0].vertices[:, 1]
    assert (spread.min(), spread.max()) == pytest.approx((150 - 1.6, 150 + 1.6))
    own = results.increments[results.increments["band"] == 1]
    middle = below.collections[0].get_paths()[0].vertices
    assert middle[:, 1].max() == pytest.approx(own["beta_deg"].max() + 2 * 0.5, abs=1e-9)
    assert middle[:, 0].max() == (own["u_mm"] + own["du_mm"] / 2).max()
    points = above.containers[0].lines[0]
    np.testing.assert_allclose(points.get_ydata(orig=False), results.increments["outcrop_x_mm"])
    half_way = results.increments["u_mm"] + results.increments["du_mm"] / 2
    np.testing.assert_allclose(points.get_xdata(orig=False), half_way)


def test_layers_figure_puts_prediction_above_measurement_on_the_same_axes(results):
    frame = stage_frames(results)[-1]
    cut = lambda table: table[table["frame"] == frame]  # noqa: E731
    predicted = figures.Side(cut(results.model_layers))
    measured = figures.Side(cut(results.layers), cut(results.surface))
    extent = view(results)
    figure = figures.layers_figure(predicted, measured, u_mm=60.0, depth_mm=30.0, extent=extent)
    top, bottom = figure.axes
    assert top.get_xlim() == bottom.get_xlim() == extent[:2]
    assert top.get_ylim() == bottom.get_ylim() == extent[2:]
    drawn = {tuple(item.get_ydata()) for item in top.lines}
    for _, rows in cut(results.model_layers).groupby("layer"):
        assert tuple(rows["y_mm"]) in drawn
    drawn = {tuple(item.get_ydata()) for item in bottom.lines}
    for table in (results.layers, results.model_layers):
        for _, rows in cut(table).groupby("layer"):
            assert tuple(rows["y_mm"]) in drawn


def test_long_lines_are_drawn_as_means_that_keep_their_gaps(results):
    x = np.linspace(0, 100, 6001)
    y = np.where((x > 40) & (x < 50), np.nan, 5 + 0.1 * x)
    rows = pd.DataFrame({"source": "dye", "layer": 5.0, "x_mm": x, "y_mm": y})
    figure = figures.layers_figure(
        figures.Side(), figures.Side(rows), u_mm=0.0, depth_mm=30.0, extent=(-5.0, 100.0, -8.0, 60.0)
    )
    drawn_x, drawn_y = figure.axes[0].lines[0].get_data()
    assert len(drawn_x) <= 1200
    gap = np.isnan(drawn_y)
    np.testing.assert_allclose(drawn_y[~gap], 5 + 0.1 * drawn_x[~gap])  # means of a straight line lie on it
    assert drawn_x[gap].min() == pytest.approx(40, abs=0.1)
    assert drawn_x[gap].max() == pytest.approx(50, abs=0.1)


def test_active_band_runs_from_the_tip_to_its_outcrop(results):
    ends = outcrops(results.bands, 30.0)
    measured = figures.Side(results.layers[results.layers["frame"] == 6], None, ends)
    figure = figures.layers_figure(
        figures.Side(), measured, u_mm=30.0, depth_mm=30.0, extent=(-5.0, 200.0, -8.0, 60.0)
    )
    drawn = [item.get_xydata() for item in figure.axes[0].lines if len(item.get_xydata()) == 2]
    assert len(drawn) == 1
    np.testing.assert_allclose(drawn[0], [[30.0, 0.0], [150.0, 30.0]], atol=1e-9)


def test_outcrop_lies_on_the_surface_or_on_the_modelled_inclination(results):
    heap = pd.DataFrame({"x_mm": [30.0, 130.0, 170.0, 220.0], "y_mm": [60.0, 50.0, 30.0, 30.0]})
    np.testing.assert_allclose(outcrops(results.bands, 30.0, surface=heap), [[150.0, 40.0]])
    creeping = pd.DataFrame(
        {
            "u_mm": [0.0, 30.0],
            "beta_deg": [11.3, np.degrees(np.arctan2(36, 120))],
            "outcrop_x_mm": [130, 150.0],
        }
    )
    np.testing.assert_allclose(outcrops(results.bands, 30.0, history=creeping), [[150.0, 36.0]])
    # an increment's line is that of its middle
    halves = creeping.assign(u_mm=[0.0, 28.0], du_mm=4.0)
    np.testing.assert_allclose(outcrops(results.bands, 30.0, history=halves), [[150.0, 36.0]])
    # at the switch both bands slip; after the end of the travel none does
    assert len(outcrops(results.bands, 40.0)) == 2
    assert len(outcrops(results.bands, 61.0)) == 0


def test_volume_figure_draws_ratios_with_twice_their_std_and_leaves_gaps_out():
    volume = pd.DataFrame(
        {
            "u_mm": [1.0, 2.0, 3.0],
            "swept_mm2": [30.0, 60.0, 90.0],
            "std_mm2": 1.5,
            "ratio": [1.1, np.nan, 0.9],
        }
    )
    container = figures.volume_figure(volume).axes[0].containers[0]
    np.testing.assert_allclose(container.lines[0].get_xydata(), [[1.0, 1.1], [3.0, 0.9]])
    bars = container.lines[2][0].get_segments()
    np.testing.assert_allclose([np.ptp(bar[:, 1]) / 2 for bar in bars], [2 * 1.5 / 30, 2 * 1.5 / 90])


def test_field_figure_colours_points_by_displacement_per_millimetre_of_blade(results):
    tracks = results.tracks
    position, moved = increment(tracks, 2, 4)
    beta = np.arctan2(30.0, 150.0)
    figure = figures.field_figure(tracks, 2, 4, extent=view(results))
    shown = figure.axes[0].collections[0]
    np.testing.assert_allclose(shown.get_offsets(), position)
    rate = np.unique(np.round(shown.get_array(), 9))
    np.testing.assert_allclose(rate, [0.0, 1 / np.cos(beta)], atol=1e-9)
    assert np.hypot(*moved.T).max() == pytest.approx(10.0 / np.cos(beta))


def test_field_leaves_out_points_lost_in_either_row(results):
    tracks = results.tracks.copy(deep=True)
    tracks["x_mm"][4, 7] = np.nan
    tracks["y_mm"][4, 7] = np.nan
    assert len(increment(tracks, 2, 4)[0]) == tracks.sizes["point"] - 1


def test_mobilised_figure_draws_each_band_its_curve_and_the_softening_lines(results):
    frames = results.mobilised
    curve = frames.assign(phi_deg=frames["phi_deg"] + 1.0)
    assumed = figures.SofteningLine(50.0, 32.0, 1.0)
    read = figures.SofteningLine(49.0, 31.5, 0.5)
    figure = figures.mobilised_figure(frames, curve, read=read, assumed=assumed)
    for axes, far in zip(figure.axes, (2.5,), strict=True):
        marks = [line for line in axes.get_lines() if line.get_marker() not in ("None", "")]
        drawn = [line for line in axes.get_lines() if line.get_marker() in ("None", "")]
        for mark, line, (_, rows) in zip(marks, drawn[:2], frames.groupby("band"), strict=True):
            np.testing.assert_array_equal(mark.get_ydata(), rows["phi_deg"])
            np.testing.assert_array_equal(line.get_ydata(), rows["phi_deg"] + 1.0)
        assert [line.get_ydata()[:2].tolist() for line in drawn[2:]] == [[49.0, 31.5], [50.0, 32.0]]
        assert [line.get_xdata()[1] for line in drawn[2:]] == [0.5, 1.0]
        assert axes.get_xlim()[1] >= far


def test_mobilised_figure_shows_the_first_slip_apart_where_there_is_much_more(results):
    frames = results.mobilised
    curve = frames.assign(slip_mm=20.0 * frames["slip_mm"])
    figure = figures.mobilised_figure(frames, curve, assumed=figures.SofteningLine(50.0, 32.0, 1.0))
    near, far = (axes.get_xlim()[1] for axes in figure.axes)
    assert near < 5.0 < 50.0 <= far


def test_mobilised_figure_of_frames_alone_leaves_out_lines_that_are_not_known(results):
    unknown = figures.SofteningLine(float("nan"), 32.0, 1.0)
    figure = figures.mobilised_figure(results.mobilised, read=unknown)
    labels = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert labels == ["band 1", "band 2"]


def test_budget_bars_are_the_shares_of_sources_in_both_results_with_the_cells_added_up(results):
    force, arm = figures.budget_figure(results.budget).axes
    widths = [sorted(patch.get_width() for patch in axes.patches) for axes in (force, arm)]
    np.testing.assert_allclose(widths[0], [5, 10, 20, 65])
    np.testing.assert_allclose(widths[1], [5, 10, 15, 70])


def test_other_figures_hold_their_data(results):
    gap = figures.blade_figure(results.blade).axes[0].containers[0].lines[0].get_ydata(orig=False)
    np.testing.assert_allclose(gap, 0.02, atol=1e-12)
    arm = line(figures.arm_figure(results.force, depth_mm=30.0).axes[0], "measured").get_ydata()
    np.testing.assert_allclose(arm, results.force["arm_mm"])
    history = History("a", 30.0, 12.0, results.force, None)
    y = figures.forces_figure([history]).axes[0].lines[0].get_ydata(orig=False)
    np.testing.assert_allclose(y, results.force["force_N"] / 12.0)
    axes = figures.agreement_figure(["near", "far"], [1.5, 25.0]).axes[0]
    assert [list(item.get_xdata()) for item in axes.lines[1:] if len(item.get_xdata())] == [[1.5], [8.0]]


class Turned:
    """A calibration that mirrors, turns and scales: px = origin + A mm."""

    matrix = np.array([[-6.0, 1.2], [-1.2, -6.0]])
    origin = np.array([520.0, 330.0])

    def to_px(self, mm):
        return self.origin + np.asarray(mm) @ self.matrix.T


def test_a_picture_of_the_world_undoes_mirror_and_turn():
    # Greys are linear in world x, so every pixel of the picture must hold its own x (rounding: half a level
    # from the 8-bit source, half from the resampled result).
    calibration = Turned()
    rows, columns = np.mgrid[0:400, 0:600]
    world = (np.stack([columns, rows], axis=-1) - calibration.origin) @ np.linalg.inv(calibration.matrix).T
    image = np.round(60 + world[..., 0]).astype(np.uint8)
    extent = (5.0, 55.0, 2.0, 32.0)
    grid = WorldGrid.of(calibration, image.shape, extent, 200)
    picture = grid.picture(shrunk(eight_bit(image), grid.factor))
    low, high = np.percentile(image[::4, ::4], (0.5, 99.5))
    x = 5.0 + (np.arange(200) + 0.5) * 50.0 / 200
    expected = np.clip((60 + x - low) / (high - low), 0, 1) * 255
    assert picture.grey.shape == (120, 200)
    assert np.abs(picture.grey - expected).max() <= 255 / (high - low) + 2


def test_a_picture_of_the_world_is_cut_to_what_the_photograph_shows():
    class Plain:
        def to_px(self, mm):
            return np.asarray(mm) * [10.0, -10.0] + [99.5, 299.5]

    # The photograph holds x from -10 to 30 mm and y from -10 to 30 mm.
    grid = WorldGrid.of(Plain(), (400, 400), (-20.0, 60.0, -20.0, 60.0), 80)
    picture = grid.picture(shrunk(np.full((400, 400), 90, np.uint8), grid.factor))
    assert picture.extent == pytest.approx((-10.0, 30.0, -10.0, 30.0))
    assert picture.grey.shape == (40, 40)


def test_sixteen_bit_greys_are_stretched_not_cut():
    ramp = np.tile(np.linspace(1000, 41000, 400).astype(np.uint16), (40, 1))
    grey = eight_bit(ramp)
    assert grey.dtype == np.uint8
    assert grey.min() == 0
    assert grey.max() == 255
    assert (np.diff(grey[0].astype(int)) >= 0).all()


def test_preview_shows_regions_points_layers_and_tip_where_they_are():
    image = np.random.default_rng(0).integers(0, 255, (300, 400), dtype=np.uint8)
    calibration, points = Turned(), np.array([[100.0, 200.0], [150.0, 220.0]])
    regions = np.full(image.shape, Region.AIR, np.uint8)
    regions[150:] = Region.SAND
    regions[:150, :20] = Region.BLADE
    shown = figures.Shown(
        image,
        calibration,
        regions,
        points,
        layers_mm=[5.0, 10.0],
        surface_mm=np.array([[0.0, 30.0], [40.0, 30.0]]),
        extent_x_mm=40.0,
    )
    axes = figures.preview_figure(shown).axes[0]
    np.testing.assert_allclose(line(axes, "2 points to track").get_xydata(), points)
    np.testing.assert_allclose(line(axes, "tip of the blade").get_xydata(), [calibration.origin])
    layer = line(axes, "layers, mm above the tip").get_xydata()
    np.testing.assert_allclose(layer[[0, -1]], calibration.to_px([[0.0, 5.0], [40.0, 5.0]]))
    outline = np.vstack([path.vertices for path in axes.collections[0].get_paths()])
    np.testing.assert_allclose(outline[:, 1], 149.5)
    tint = np.asarray(axes.images[1].get_array())
    assert tint[200, 100, 3] == 0, "sand is left as it is"
    assert tint[10, 5].tolist() != tint[10, 100].tolist(), "the blade is not air"


def test_preview_shows_lost_points_residuals_and_markers_that_were_not_found():
    image = np.zeros((300, 400), np.uint8)
    shown = figures.Shown(
        image,
        points_px=np.array([[100.0, 200.0], [150.0, 220.0], [200.0, 220.0]]),
        tracked_px=np.array([[100.0, 200.0], [150.0, 220.0]]),
        moved_px=np.array([[2.0, 1.0], [np.nan, np.nan]]),
        fitted_px=np.array([[10.0, 20.0], [300.0, 20.0]]),
        residual_px=np.array([[0.1, 0.0], [0.0, 0.2]]),
        markers_px=np.array([[50.0, 60.0]]),
        missing_px=np.array([[350.0, 60.0]]),
    )
    axes = figures.preview_figure(shown).axes[0]
    np.testing.assert_allclose(line(axes, "1 of 2 lost at once").get_xydata(), [[150.0, 220.0]])
    np.testing.assert_allclose(line(axes, "2 points of the calibration").get_xydata(), shown.fitted_px)
    np.testing.assert_allclose(line(axes, "markers found: 1").get_xydata(), shown.markers_px)
    np.testing.assert_allclose(line(axes, "markers not found: 1").get_xydata(), shown.missing_px)
    moved, residuals = axes.collections
    np.testing.assert_allclose([moved.U[0] / moved.V[0]], [2.0])
    np.testing.assert_allclose(residuals.V[1] / residuals.U[0], 2.0)


def test_svg_is_self_contained_prefixed_themed_and_repeatable(results):
    svg = [
        to_svg(figures.arm_figure(results.force, depth_mm=30.0), "k7", 'a "quoted" <alt>') for _ in range(2)
    ]
    assert svg[0] == svg[1]
    assert "http" not in svg[0]
    assert 'aria-label="a &quot;quoted&quot; &lt;alt&gt;"' in svg[0]
    assert all(name.startswith("k7-") for name in re.findall(r'\bid="([^"]+)"', svg[0]))
    assert "var(--measured)" in svg[0]
    assert not any(colour in svg[0] for colour in THEMED)


def test_plotting_leaves_matplotlib_as_it_was(results):
    before = dict(mpl.rcParams)
    figure = figures.force_figure(results.force, results.model_force)
    to_svg(figure, "a", "b")
    assert isinstance(figure, Figure)
    assert dict(mpl.rcParams) == before


def test_stages_are_spread_over_the_travel_and_end_with_it(results):
    # 13 frames 5 mm apart, frame 5 without layers: quarters of 60 mm are frames 3, 6, 9 and 12
    assert stage_frames(results) == [3, 6, 9, 12]
