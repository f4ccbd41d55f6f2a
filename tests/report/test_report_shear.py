"""Shear maps against simple shear and a rigid slip, and the chapter that shows them."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from matplotlib.patches import Circle

from ploughval.piv.strain import StrainMeasure
from ploughval.report import shear
from ploughval.report.blocks import Pen
from ploughval.report.chapters import bands_chapter
from ploughval.report.figures import kinematics_figure, shear_figure
from ploughval.report.figures.shear import Band, ShearMap, highest
from ploughval.results import read_results

EXTENT = (-8.0, 120.0, -10.0, 45.0)


@pytest.fixture(scope="module")
def results(result_folder):
    return read_results(result_folder)


def tracks_of(frames, u):
    """Tracks from places (F, N, 2)."""
    frames = np.asarray(frames, float)
    return xr.Dataset(
        {
            "x0_mm": ("point", frames[0, :, 0]),
            "y0_mm": ("point", frames[0, :, 1]),
            "x_mm": (("frame", "point"), frames[..., 0]),
            "y_mm": (("frame", "point"), frames[..., 1]),
            "std_mm": (("frame", "point"), np.full(frames.shape[:2], 0.01)),
            "u_mm": ("frame", np.asarray(u, float)),
        },
        coords={"frame": np.arange(len(u))},
    )


def grid():
    return np.stack(np.meshgrid(np.arange(1.0, 118.0, 2.0), np.arange(-8.0, 30.0, 2.0)), axis=-1).reshape(
        -1, 2
    )


def test_simple_shear_is_its_amount_everywhere_and_nothing_beyond_the_points():
    start = grid()
    moved = start + np.column_stack([0.04 * start[:, 1], np.zeros(len(start))])
    tracks = tracks_of([start, moved], [0.0, 0.0])
    pair = shear._increment(tracks, 0, 1)
    found = shear.shear_map(pair, StrainMeasure.SMALL, extent=EXTENT, gauge=9.0, u_mm=0.0, surface=None)
    known = np.isfinite(found.values)
    # small strain at the later places: 0.04 to first order, as this shear leaves heights as they are
    np.testing.assert_allclose(found.values[known], 0.04, atol=1e-6)
    y = np.linspace(found.extent[2], found.extent[3], len(found.values) + 1)[:-1]
    assert not known[y > 34.0].any()
    assert known[(y > -6.0) & (y < 26.0)].mean() > 0.85


def test_a_slip_is_spread_over_the_gauge_and_its_integral_across_is_the_slip():
    """Slip 1.5 mm on a level plane; points 2 mm apart leave a tenth of it uncertain in a gauge of 8 mm."""
    start = grid()
    moved = start + np.outer(start[:, 1] > 11.0, [1.5, 0.0])
    pair = shear._increment(tracks_of([start, moved], [0.0, 0.0]), 0, 1)
    for gauge in (8.0, 14.0):
        found = shear.shear_map(pair, StrainMeasure.SMALL, extent=EXTENT, gauge=gauge, u_mm=0.0, surface=None)
        step = (found.extent[3] - found.extent[2]) / len(found.values)
        columns = found.values[:, found.values.shape[1] // 3 : found.values.shape[1] // 2]
        across = np.nansum(columns, axis=0) * step
        assert np.median(across) == pytest.approx(1.5, rel=0.1)


def test_total_strain_uses_neighbours_of_the_start_and_is_drawn_where_the_points_are_now():
    start = grid()
    moved = start + np.outer(start[:, 1] > 11.0, [30.0, 0.0])
    pair = shear._total(tracks_of([start, moved], [0.0, 0.0]), 1)
    found = shear.shear_map(pair, StrainMeasure.HENCKY, extent=EXTENT, gauge=9.0, u_mm=0.0, surface=None)
    y = np.linspace(found.extent[2], found.extent[3], len(found.values) + 1)[:-1]
    x = np.linspace(found.extent[0], found.extent[1], found.values.shape[1] + 1)[:-1]
    upper = found.values[y > 22.0]
    assert not np.isfinite(upper[:, x < 28.0]).any()  # the upper block has left this place
    assert np.nanmax(upper) < 1e-9  # and is rigid
    assert np.nanmax(found.values) > 1.0


def test_rotation_makes_no_total_shear():
    start = grid()
    c, s = np.cos(0.3), np.sin(0.3)
    pair = shear._total(tracks_of([start, start @ [[c, s], [-s, c]]], [0.0, 0.0]), 1)
    found = shear.shear_map(pair, StrainMeasure.HENCKY, extent=EXTENT, gauge=9.0, u_mm=-50.0, surface=None)
    assert np.nanmax(found.values) < 1e-9


def test_the_chapter_shows_a_map_a_stage_and_says_its_gauge(results):
    chapter = shear.shear_chapter(results, Pen("s"))
    assert chapter is not None
    assert len(chapter.grid) >= 1
    assert f"{shear.gauge_mm(results):.3g}" in chapter.lead
    assert "noise floors" in chapter.grid[0].caption


class Kept(Pen):
    """A pen that keeps its figures."""

    def draw(self, figure, alt, caption, *, name, data=()):
        self.figures = [*getattr(self, "figures", []), figure]
        return Pen.draw(self, figure, alt, caption, name=name, data=data)


def test_all_stages_have_the_colours_of_one_scale_a_kind(results):
    pen = Kept("s")
    shear.shear_chapter(results, pen)
    scales = {tuple(axes.images[0].get_clim() for axes in figure.axes[:2]) for figure in pen.figures}
    assert len(pen.figures) > 1
    assert len(scales) == 1


def test_the_scale_of_several_maps_holds_99_per_cent_of_all_their_nodes():
    a, b = (ShearMap(np.array(v), EXTENT, 0.0, 1.0) for v in ([[0.0, np.nan]], [[1.0, 2.0]]))
    assert highest([a, b]) == pytest.approx(np.quantile([0.0, 1.0, 2.0], 0.99))
    assert np.isnan(highest([]))


def test_the_figure_draws_the_gauge_to_scale():
    plain = ShearMap(np.zeros((3, 3)), EXTENT, 0.001, 7.5)
    figure = shear_figure((plain, plain), u_mm=(0.0, 1.0), extent=EXTENT)
    circles = [patch for axes in figure.axes for patch in axes.patches if isinstance(patch, Circle)]
    assert [2 * circle.radius for circle in circles] == [7.5, 7.5]


def test_without_tracks_there_is_no_map(results):
    from dataclasses import replace

    assert shear.shear_chapter(replace(results, tracks=None), Pen("s")).grid == ()


def test_the_figure_draws_the_measured_band_from_tip_to_outcrop():
    start = grid()
    pair = shear._increment(tracks_of([start, start], [0.0, 1.0]), 0, 1)
    plain = shear.shear_map(pair, StrainMeasure.SMALL, extent=EXTENT, gauge=9.0, u_mm=1.0, surface=None)
    figure = shear_figure((plain, plain), u_mm=(0.0, 1.0), extent=EXTENT, band=Band(0.5, 30.0, 52.5))
    x, y = figure.axes[0].lines[0].get_data()
    np.testing.assert_allclose(x, [0.5, 52.5])
    np.testing.assert_allclose(y, [0.0, 52.0 * np.tan(np.radians(30.0))])


def test_block_velocity_is_drawn_beside_one_and_tan_beta(results):
    figure = kinematics_figure(results.increments)
    along, up = figure.axes
    assert along.lines[0].get_ydata()[0] == 1.0
    np.testing.assert_allclose(up.lines[0].get_ydata(), np.tan(np.radians(results.increments["beta_deg"])))


def test_the_bands_chapter_counts_mechanisms_and_names_where_one_band_was_not_enough(results):
    from dataclasses import replace

    table = results.increments.copy()
    table.loc[table.index[3], ["mechanism", "evidence"]] = ["two_bands", 42.0]
    chapter = bands_chapter(replace(results, increments=pd.DataFrame(table)), Pen("b"))
    rows = next(t for t in chapter.tables if t.caption.startswith("One band")).rows
    assert [row[0].text for row in rows] == ["one band is enough", "two bands through the tip"]
    assert [row[1].value for row in rows] == [len(table) - 1, 1]
    assert rows[1][3].text == f"{table['u_mm'].iloc[3]:.1f}"
