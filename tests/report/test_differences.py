"""Colours of measured layers, the map of distances, the mound and the band pairs on the page."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from ploughval.compare.bands.observed import QUANTITIES
from ploughval.compare.bands.pairs import PAIR_COLUMNS
from ploughval.compare.lines.distances import DISTANCE_COLUMNS
from ploughval.compare.mound.history import MOUND_COLUMNS
from ploughval.report.band_pairs import pair_parts
from ploughval.report.blocks import Cell, Pen, travel_cell
from ploughval.report.differences import differences_at, distance_parts
from ploughval.report.figures.differences import (
    NEUTRAL,
    STEPS,
    ColouredLine,
    Differences,
    coarsened,
    distance_map_figure,
    draw_differences,
)
from ploughval.report.figures.mound import mound_figure
from ploughval.report.mound import mound_chapter
from ploughval.report.stages import layers_chapter
from ploughval.results import read_results


@pytest.fixture
def folder(own_folder):
    return own_folder


@pytest.fixture
def results(folder):
    return read_results(folder)


def drawn(differences):
    axes = Figure().subplots()
    draw_differences(axes, differences, on_photo=False)
    return {
        to_hex(item.get_colors()[0]): (item.get_segments(), item.get_linewidths()[0])
        for item in axes.collections
        if isinstance(item, LineCollection)
    }


def coloured(distance, credible=True):
    d = np.asarray(distance, dtype=float)
    points = np.column_stack([np.arange(d.size, dtype=float), np.zeros(d.size)])
    return ColouredLine(points, d, np.full(d.size, credible))


def write(folder, name, columns, rows):
    pd.DataFrame(rows, columns=list(columns)).to_csv(folder / name, index=False)


def distance_rows(results, deviation):
    """A file of distances whose numbers are those of the fixture's layers, lifted as it lifts them."""
    frames = results.layers.drop_duplicates("frame")[["frame", "u_mm"]]
    rows = []
    for frame, u in frames.itertuples(index=False, name=None):
        for layer in (5.0, 15.0, 25.0):
            row = dict.fromkeys(DISTANCE_COLUMNS, 0.0)
            row |= {"frame": frame, "u_mm": u, "layer": layer, "source": "tracks", "points": 50}
            row |= {"rms_mm": 0.01 * u, "validation_std_mm": deviation, "within": 1.0}
            rows.append(row)
    return rows


def test_each_run_has_the_colour_of_its_distance_and_grey_is_what_is_not_credible():
    far_below, near_above = drawn(Differences([coloured([-4.0] * 5), coloured([0.2] * 5)], 4.0)).items()
    assert {far_below[0], near_above[0]} == {STEPS[0], STEPS[4]}
    grey = drawn(Differences([coloured([3.0] * 5, credible=False)], 4.0))
    assert list(grey) == [NEUTRAL]
    alone = drawn(Differences([coloured([np.nan] * 5)], 4.0))
    assert alone[NEUTRAL][1] < grey[NEUTRAL][1]  # thin: there is no predicted line


def test_runs_of_one_colour_are_one_piece_and_tears_stay_open():
    line = coloured([3.9] * 10 + [np.nan] + [3.9] * 10)
    line.points_mm[10] = np.nan
    pieces, _ = drawn(Differences([line], 4.0))[STEPS[-1]]
    assert [len(piece) for piece in pieces] == [10, 10]
    assert [piece[-1][0] for piece in pieces] == [9.0, 20.0]


def test_colours_grow_darker_either_way_so_that_a_grey_print_still_tells():
    light = [int(c[1:3], 16) * 0.299 + int(c[3:5], 16) * 0.587 + int(c[5:], 16) * 0.114 for c in STEPS]
    assert (np.diff(light[:4]) > 20).all()
    assert (np.diff(light[4:]) < -15).all()


def test_long_lines_are_thinned_to_means_that_keep_their_gaps():
    line = np.column_stack([np.linspace(0, 100, 6001), np.linspace(0, 10, 6001)])
    line[3000] = np.nan
    short = coarsened(line)
    assert len(short) <= 1200
    assert np.isnan(short).all(axis=1).sum() == 1
    np.testing.assert_allclose(
        short[:, 1][np.isfinite(short[:, 1])], 0.1 * short[:, 0][np.isfinite(short[:, 0])]
    )


def test_stages_share_a_scale_and_distances_are_those_of_the_lines(results):
    frames = [4, 8, 12]
    found = differences_at(results, frames)
    assert sorted(found) == frames
    assert len({one.scale_mm for one in found.values()}) == 1
    # The fixture's predicted layers lie higher by a constant wherever the block has moved.
    lift = {}
    for frame in frames:
        cut = [t[t["frame"] == frame].set_index(["layer", "x_mm"])["y_mm"]
               for t in (results.layers, results.model_layers)]  # fmt: skip
        lift[frame] = float((cut[0] - cut[1]).abs().max())
        seen = max(float(np.nanmax(np.abs(line.distance_mm))) for line in found[frame].lines)
        assert seen == pytest.approx(lift[frame], rel=0.3, abs=1e-9)
    assert max(lift.values()) > 0


def test_what_lies_within_twice_its_uncertainty_is_not_credible(results, folder):
    write(folder, "layer_distances.csv", DISTANCE_COLUMNS, distance_rows(results, deviation=100.0))
    found = differences_at(read_results(folder), [8])
    assert not any(line.credible.any() for line in found[8].lines)


def test_the_map_marks_what_is_further_off_than_its_uncertainty():
    table = pd.DataFrame(
        [(u, layer, 0.1 * u, 0.2) for u in (1.0, 2.0, 5.0, 9.0) for layer in (5.0, 10.0)],
        columns=["u_mm", "layer", "rms_mm", "validation_std_mm"],
    )
    axes = distance_map_figure(table).axes[0]
    crosses = axes.lines[0].get_xydata()
    # 0.1 u > 0.4 from u = 5 on, in both layers.
    assert sorted(map(tuple, crosses)) == [(5.0, 0.0), (5.0, 1.0), (9.0, 0.0), (9.0, 1.0)]


def test_the_layers_chapter_has_its_map_and_table_where_distances_are_known(results, folder):
    assert distance_parts(results, Pen()) == ([], [])
    write(folder, "layer_distances.csv", DISTANCE_COLUMNS, distance_rows(results, deviation=0.05))
    chapter = layers_chapter(read_results(folder), Pen())
    assert chapter is not None
    assert len(chapter.drawings) == 1
    assert "coloured by their distance" in chapter.lead
    (table,) = chapter.tables
    assert [row[0].text for row in table.rows] == ["5", "15", "25"]
    assert "0.6 mm in layer" in chapter.drawings[0].caption.replace("0.600", "0.6")


def mound_table():
    rows = []
    for source, factor in (("experiment", 1.0), ("model", 1.1)):
        for k in range(5):
            u = 10.0 * k
            crest, slope = 0.4 * u * factor, 32.0 * factor
            values = (crest, 0.1, u + 10, 2.0, crest, 0.1, 60.0, 0.3, 30.0, 1.0, slope, 1.0, 30 * u, 5.0)
            rows.append((source, k, u, *(values if k else (np.nan,) * 14)))
    return rows


def test_the_mound_is_drawn_for_both_sides_with_the_slope_of_repose(results, folder):
    assert mound_chapter(results, Pen()) is None
    write(folder, "mound.csv", MOUND_COLUMNS, mound_table())
    chapter = mound_chapter(read_results(folder), Pen())
    assert chapter is not None
    assert len(chapter.tables[0].rows) == 10
    assert [cell.text for cell in chapter.tables[0].rows[0][2:]] == ["–"] * 7
    figure = mound_figure(pd.DataFrame(mound_table(), columns=list(MOUND_COLUMNS)), repose_deg=32.0)
    crest, _, _, _, slope, _ = figure.axes
    np.testing.assert_allclose(crest.lines[0].get_ydata()[1:], 0.44 * np.arange(10.0, 50.0, 10.0))
    assert any(np.allclose(line.get_ydata(), 32.0) and line.get_linestyle() == ":" for line in slope.lines)


def pair_row(experiment, model, **values):
    row = dict.fromkeys(PAIR_COLUMNS, np.nan) | {"band_experiment": experiment, "band_model": model}
    return row | {"joined_experiment": 1, "complete_experiment": 1, "complete_model": 1} | values


def test_bands_stand_side_by_side_with_what_was_not_seen(results, folder):
    assert pair_parts(results, Pen())[:2] == ([], [])
    whole = {f"{name}_{end}": 1.5 for name in QUANTITIES for end in ("difference", "validation_std")}
    cut = whole | {"life_mm_difference": np.nan, "complete_experiment": 0, "joined_experiment": 2}
    rows = [
        pair_row(0, 0, u_start_mm_experiment=0.0, **whole),
        pair_row(1, 1, u_start_mm_experiment=20.0, **cut),
        pair_row(2, np.nan, u_start_mm_experiment=44.0),
        pair_row(np.nan, 2, u_start_mm_model=50.0),
    ]
    write(folder, "band_pairs.csv", PAIR_COLUMNS, rows)
    drawings, (table,), notes = pair_parts(read_results(folder), Pen())
    assert len(drawings) == 1
    assert notes == []
    assert [row[-1].text for row in table.rows] == [
        "", "end not seen, 2 pieces", "measured alone", "predicted alone",
    ]  # fmt: skip
    assert table.rows[0][4].text == "1.5 ± 1.5"
    assert table.rows[1][4].text == "–"
    assert table.rows[3][2].text == "50.00"  # to the hundredth of a millimetre


def test_a_band_that_starts_at_rest_is_not_told_to_a_ten_thousandth_of_a_millimetre():
    assert travel_cell(-0.0002645) == Cell("0.00", -0.0002645)
    assert travel_cell(float("nan")).text == "–"
