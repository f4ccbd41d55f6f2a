"""Lines of a frame are those of the tables, within what the eye can see."""

import numpy as np
import pandas as pd
import pytest

from ploughval.report.player.coding import unpack_lines
from ploughval.report.player.frames import moments
from ploughval.report.player.lines import TOLERANCE_MM, frame_lines, tolerance_mm
from ploughval.report.stages import view
from ploughval.results import read_results


def distance_from_lines(points, lines):
    """Distance (N,) of points from the nearest of several drawn lines."""
    best = np.full(len(points), np.inf)
    for line in lines:
        start, along = (line[:-1], np.diff(line, axis=0)) if len(line) > 1 else (line, np.zeros((1, 2)))
        length = np.maximum((along**2).sum(axis=1), 1e-300)
        offset = points[:, None] - start[None]
        share = np.clip((offset * along).sum(axis=-1) / length, 0, 1)
        away = np.hypot(*np.moveaxis(offset - share[..., None] * along, -1, 0)).min(axis=1)
        best = np.minimum(best, away)
    return best


@pytest.fixture(scope="module")
def results(result_folder):
    return read_results(result_folder)


@pytest.fixture(scope="module")
def shown(results):
    extent = view(results)
    every = moments(results)
    return extent, every, frame_lines(results, every, extent)


def test_layers_of_every_frame_are_within_the_tolerance_of_the_table(results, shown):
    extent, every, lines = shown
    checked = 0
    for table, key in ((results.layers, "layers"), (results.model_layers, "model_layers")):
        for moment, frame in zip(every, lines.frames, strict=True):
            drawn = unpack_lines(getattr(frame, key), lines.tolerance_mm)
            rows = table[(table["frame"] == moment.frame) & table["x_mm"].between(*extent[:2])]
            for (source, height), part in rows.groupby(["source", "layer"]):
                own = [points for tag, points in drawn if lines.layers[tag] == (source, height)]
                points = part[["x_mm", "y_mm"]].to_numpy(float)
                assert distance_from_lines(points, own).max() <= lines.tolerance_mm
                checked += len(points)
    assert checked > 2000


def test_nothing_is_drawn_that_is_not_in_the_table(results, shown):
    _, every, lines = shown
    for moment, frame in zip(every, lines.frames, strict=True):
        rows = results.layers[results.layers["frame"] == moment.frame]
        for tag, points in unpack_lines(frame.layers, lines.tolerance_mm):
            source, height = lines.layers[tag]
            own = rows[(rows["source"] == source) & (rows["layer"] == height)][["x_mm", "y_mm"]].to_numpy(
                float
            )
            # Corners of the drawn line are rows of the table, rounded.
            nearest = np.hypot(*np.moveaxis(points[:, None] - own[None], -1, 0)).min(axis=1)
            assert nearest.max() <= 0.25 * lines.tolerance_mm


def test_surfaces_are_within_the_tolerance_of_the_table(results, shown):
    extent, every, lines = shown
    for moment, frame in zip(every, lines.frames, strict=True):
        rows = results.surface[(results.surface["frame"] == moment.frame)]
        points = rows[rows["x_mm"].between(*extent[:2])][["x_mm", "y_mm"]].to_numpy(float)
        drawn = [line for _, line in unpack_lines(frame.surface, lines.tolerance_mm)]
        if len(points):
            assert distance_from_lines(points, drawn).max() <= lines.tolerance_mm
        else:
            assert not drawn


def test_the_tolerance_is_0p02_mm_or_a_tenth_of_a_shown_pixel():
    assert tolerance_mm((0.0, 100.0, 0.0, 40.0)) == TOLERANCE_MM == 0.02
    assert tolerance_mm((0.0, 900.0, 0.0, 40.0)) == pytest.approx(0.1)


def test_the_lost_frame_has_no_line_and_the_others_have_all_layers(shown):
    _, every, lines = shown
    lost = [k for k, moment in enumerate(every) if moment.reason]
    assert [every[k].frame for k in lost] == [5]
    for k, frame in enumerate(lines.frames):
        tags = {tag for tag, _ in unpack_lines(frame.layers, lines.tolerance_mm)}
        assert len(tags) == (0 if k in lost else 3)


def test_a_torn_layer_stays_torn(own_folder):
    layers = pd.read_csv(own_folder / "layers.csv")
    torn = (layers["frame"] == 4) & layers["x_mm"].between(60, 70)
    layers.loc[torn, ["x_mm", "y_mm"]] = np.nan
    layers.to_csv(own_folder / "layers.csv", index=False)
    results = read_results(own_folder)
    lines = frame_lines(results, moments(results), view(results))
    drawn = unpack_lines(lines.frames[4].layers, lines.tolerance_mm)
    assert len(drawn) == 6
    for _, points in drawn:
        assert not ((points[:, 0] > 60) & (points[:, 0] < 70)).any()


def test_bands_run_from_the_tip_to_the_outcrop_of_the_increment(results, shown):
    _, every, lines = shown
    row = results.increments.set_index("frame").loc[8]
    ((x, y),) = lines.frames[8].band_mm
    middle = (results.increments["u_mm"] + results.increments["du_mm"] / 2 - every[8].u_mm).abs().argmin()
    assert x == results.increments["outcrop_x_mm"].iloc[middle]
    assert y > 0
    assert abs(x - row["outcrop_x_mm"]) < 5
    assert every[5].reason
    assert len(lines.frames[5].band_mm) == 0
