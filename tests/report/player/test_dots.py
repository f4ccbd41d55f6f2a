"""Dots are tracked points: where they are, how far they moved, how much the sand sheared."""

import numpy as np
import pytest
import xarray as xr

from ploughval.report.player.coding import unpack
from ploughval.report.player.dots import MOST_DOTS, even_choice, frame_dots
from ploughval.report.player.frames import moments
from ploughval.report.stages import view
from ploughval.results import read_results

DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"


def places_of(dots):
    """Places (F, N, 2) in mm as the script reads them, NaN where a dot is lost."""
    last = np.array(dots.start).reshape(-1, 2).copy()
    found = np.full((len(dots.frames), dots.count, 2), np.nan)
    for k, frame in enumerate(dots.frames):
        numbers = iter(unpack(frame.places))
        for dot in range(dots.count if frame.places else 0):
            mark = next(numbers)
            if mark == 0:
                continue
            if mark > 1:
                folded = np.array([mark - 2, next(numbers)])
                last[dot] += (folded >> 1) ^ -(folded & 1)
            found[k, dot] = last[dot] * dots.quantum_mm
    return found


def values_of(text, top):
    codes = np.array([DIGITS.index(letter) for letter in text])
    return np.where(codes > 0, (codes - 1) / 62 * top, np.nan)


def tracks_with(folder, change):
    with xr.open_dataset(folder / "tracks.nc", engine="h5netcdf") as stored:
        tracks = stored.load()
    change(tracks)
    tracks.to_netcdf(folder / "tracks.nc", engine="h5netcdf")


def dots_of(folder):
    results = read_results(folder)
    extent = view(results)
    return results, frame_dots(results, moments(results), extent), extent


def chosen_of(results, dots, extent):
    start = np.column_stack([results.tracks["x0_mm"], results.tracks["y0_mm"]])
    return even_choice(start, extent, MOST_DOTS)


def test_places_are_those_of_the_tracks_to_half_a_quantum(result_folder):
    results, dots, extent = dots_of(result_folder)
    chosen = chosen_of(results, dots, extent)
    assert dots.count == len(chosen) > 100
    true = np.stack([results.tracks["x_mm"], results.tracks["y_mm"]], axis=-1)[:, chosen]
    assert dots.quantum_mm <= 0.05
    assert np.abs(places_of(dots) - true).max() <= 0.51 * dots.quantum_mm


def test_a_lost_dot_is_missing_and_comes_back_at_its_place(own_folder):
    def lose(tracks):
        tracks["x_mm"][3:5, 7], tracks["y_mm"][3:5, 7] = np.nan, np.nan
        tracks["x_mm"][6, :], tracks["y_mm"][6, :] = np.nan, np.nan

    tracks_with(own_folder, lose)
    results, dots, extent = dots_of(own_folder)
    chosen = chosen_of(results, dots, extent).tolist()
    found = places_of(dots)
    assert np.isnan(found[3:5, chosen.index(7)]).all()
    assert np.isfinite(found[5, chosen.index(7)]).all()
    assert np.isnan(found[6]).all()
    true = np.stack([results.tracks["x_mm"], results.tracks["y_mm"]], axis=-1)[:, chosen]
    assert np.nanmax(np.abs(found - true)) <= 0.51 * dots.quantum_mm


def test_motion_is_that_of_the_increment_over_the_blade_s(result_folder):
    results, dots, extent = dots_of(result_folder)
    chosen = chosen_of(results, dots, extent)
    x0, y0 = results.tracks["x0_mm"].to_numpy()[chosen], results.tracks["y0_mm"].to_numpy()[chosen]
    moving = y0 > 30.0 * x0 / 150.0
    motion = values_of(dots.frames[8].motion, dots.motion_top)
    expected = np.where(moving, 1 / np.cos(np.arctan2(30.0, 150.0)), 0.0)
    assert motion == pytest.approx(expected, abs=0.51 * dots.motion_top / 62)
    assert np.isnan(values_of(dots.frames[0].motion, 1.0)).all()


def test_shear_is_that_of_a_known_simple_shear(own_folder):
    """x moves by 0.02 y between frames 2 and 3: the maximum shear strain of that is 0.02."""

    def shear(tracks):
        tracks["x_mm"][:] = tracks["x0_mm"].to_numpy()
        tracks["y_mm"][:] = tracks["y0_mm"].to_numpy()
        tracks["x_mm"][3:] = tracks["x0_mm"].to_numpy() + 0.02 * tracks["y0_mm"].to_numpy()

    tracks_with(own_folder, shear)
    _, dots, _ = dots_of(own_folder)
    assert values_of(dots.frames[3].shear, dots.shear_top) == pytest.approx(0.02, abs=1e-3)
    assert values_of(dots.frames[2].shear, dots.shear_top) == pytest.approx(0.0, abs=1e-3)


def test_many_points_are_thinned_evenly():
    rng = np.random.default_rng(8)
    start = rng.uniform([0, -9], [200, 30], (20_000, 2))
    chosen = even_choice(start, (-8.0, 150.0, -9.0, 60.0), 500)
    assert 350 <= len(chosen) <= 500
    assert len(set(chosen.tolist())) == len(chosen)
    x = start[chosen, 0]
    assert x.max() <= 150.0
    counts, _ = np.histogram(x, bins=5, range=(0, 150))
    assert counts.min() > 0.6 * counts.max()
