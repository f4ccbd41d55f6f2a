"""Bands of made tests against their exact motion: found once, none invented, with honest stds."""

import itertools

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import INCREMENT_COLUMNS, Status
from ploughval.tracers import find_bands

# frames, scale (mm/px) and noise (px) that together span what laboratories photograph
CASES = [
    (soil, frames, scale, noise)
    for soil in ((50.0, 32.0), (36.0, 32.0), (40.0, 33.0))
    for frames, scale, noise in ((20, 0.25, 0.1), (31, 0.0625, 0.02), (44, 0.25, 0.02), (60, 0.12, 0.05))
]


def find(test):
    return find_bands(test.tracks, test.surface, test.scene)


def errors(test, found):
    """Errors of every increment without a switch, in stated standard deviations."""
    rows = []
    for _, row in found.increments.dropna(subset=["beta_deg"]).iterrows():
        first = int(row["frame"])
        last = int(np.flatnonzero(test.frames_u > row["u_mm"] + row["du_mm"] - 0.01)[0])
        outcrop, beta, share = test.truth(first, last)
        velocity = test.velocity(first, last)
        rows.append(
            {
                "share": share,
                "mechanism": str(row["mechanism"]),
                "beta": (row["beta_deg"] - beta) / row["beta_std_deg"],
                "outcrop": (row["outcrop_x_mm"] - outcrop) / row["outcrop_std_mm"],
                "velocity_x": (row["velocity_x"] - velocity[0]) / row["velocity_x_std"],
                "velocity_y": (row["velocity_y"] - velocity[1]) / row["velocity_y_std"],
            }
        )
    return pd.DataFrame(rows)


@pytest.fixture(scope="module")
def runs(made):
    tests = [
        made(soil, frames=frames, mm_per_px=scale, noise_px=noise, seed=k)
        for k, (soil, frames, scale, noise) in enumerate(CASES)
    ]
    return [(test, find(test)) for test in tests]


def test_each_band_is_found_once_and_none_is_invented(runs):
    counts = [(len(found.bands), len(test.bands)) for test, found in runs]
    assert [found for found, _ in counts] == [true for _, true in counts]


def test_bands_start_within_a_frame_interval_at_their_outcrop_and_angle(runs):
    """The figures to reach: one interval, 1 mm, 0.5 degrees."""
    for test, found in runs:
        if len(test.bands) == len(found.bands):
            off = found.bands - test.bands[found.bands.columns]
            interval = float(np.diff(test.frames_u).max())
            assert off["u_start_mm"].abs().max() <= interval
            settled = found.bands["u_end_mm"] - found.bands["u_start_mm"] > 2 * interval
            assert off["outcrop_x_mm"][settled].abs().max() < 1.0
            assert off["beta_deg"][settled].abs().max() < 0.5


def test_stated_deviations_cover_the_errors(runs):
    """Within one 55 to 82 %, within two 88 % and more: a normal distribution's 68 and 95 %, with doubt."""
    table = pd.concat([errors(test, found) for test, found in runs])
    table = table[table["share"] == 1.0]
    assert len(table) > 350
    for name in ("beta", "outcrop", "velocity_x", "velocity_y"):
        within = [float((table[name].abs() < k).mean()) for k in (1, 2)]
        assert 0.55 < within[0] < 0.82, (name, within)
        assert within[1] > 0.88, (name, within)


def test_one_band_is_called_enough_where_it_is_and_not_where_two_were_active(runs):
    """False alarms below 2 %; a switch is called two bands where sand between moved by 0.15 to 0.85."""
    table = pd.concat([errors(test, found) for test, found in runs])
    alone = table[table["share"] == 1.0]
    assert (alone["mechanism"] != "one_band").mean() < 0.02
    switch = table[(table["share"] > 0.15) & (table["share"] < 0.85)]
    assert len(switch) >= 8
    assert (switch["mechanism"] != "one_band").mean() >= 0.8


@pytest.mark.slow
def test_random_tests_have_every_band_once_and_honest_deviations(made):
    """40 tests: 4 to 16 px/mm, 20 to 60 frames, noise of 0.01 to 0.1 px; theory-bands.md has the figures.

    What is stated for the sides of a band is that of photographs, which part them less well than these tests.
    """
    rng = np.random.default_rng(77)
    tables = []
    for number in range(40):
        soil = ((50.0, 32.0), (36.0, 32.0), (40.0, 33.0), (33.0, 33.0))[number % 4]
        frames, scale = int(rng.integers(20, 61)), float(1 / rng.uniform(4, 16))
        noise = float(np.exp(rng.uniform(np.log(0.01), np.log(0.1))))
        seed = int(rng.integers(1e6))
        test = made(soil, frames=frames, mm_per_px=scale, noise_px=noise, seed=seed)
        found = find(test)
        assert len(found.bands) == len(test.bands), (soil, frames, scale, noise, seed)
        off = (found.bands["u_start_mm"] - test.bands["u_start_mm"]).abs().max()
        assert off < 0.1 * np.diff(test.frames_u).max()
        tables.append(errors(test, found))
    table = pd.concat(tables)
    alone = table[table["share"] == 1.0]
    covered = {
        name: [float((alone[name].abs() < k).mean()) for k in (1, 2)]
        for name in ("beta", "outcrop", "velocity_x", "velocity_y")
    }
    for name, (one, two) in covered.items():
        assert 0.60 <= one <= (0.83 if name in ("beta", "outcrop") else 0.78), (name, covered)
        assert two >= 0.90, (name, covered)
    assert (alone["mechanism"] != "one_band").mean() < 0.02
    switch = table[(table["share"] > 0.15) & (table["share"] < 0.85)]
    assert (switch["mechanism"] == "two_bands").mean() > 0.9


@pytest.mark.parametrize("frames", [20, 60])
def test_peak_equal_to_residual_is_one_creeping_band(made, frames):
    """The outcrop moves on by up to 8 mm an increment; where it began is known to the curve of its creep."""
    test = made((33.0, 33.0), frames=frames, noise_px=0.05)
    bands = find(test).bands
    assert len(bands) == 1
    assert bands["outcrop_x_mm"].iloc[0] == pytest.approx(test.bands["outcrop_x_mm"].iloc[0], abs=2.0)


def test_small_softening_makes_small_jumps_and_each_is_a_band(made):
    test = made((35.0, 33.0), frames=40, noise_px=0.05)
    assert len(find(test).bands) == len(test.bands) == 5


def test_frames_missing_doubled_or_mostly_lost_change_no_band(made):
    rng = np.random.default_rng(5)
    u = np.linspace(0.0, 55.0, 40)
    test = made(u_mm=np.sort(np.append(u, u[[10, 20, 20, 30]])), noise_px=0.05)
    tracks = test.tracks
    for frame in (5, 6, 17, 35):
        _lose(tracks, frame, np.ones(tracks.sizes["point"], bool), Status.FRAME_MISSING)
    for frame in (9, 27):
        _lose(tracks, frame, rng.random(tracks.sizes["point"]) < 0.95, Status.LOW_CORRELATION)
    found = find(test)
    assert len(found.bands) == len(test.bands)
    assert (found.bands["u_start_mm"] - test.bands["u_start_mm"]).abs().max() <= 2 * 55.0 / 39
    doubled = found.increments[found.increments["du_mm"] == 0]
    assert len(doubled) == 4
    assert (doubled["band"] == -1).all()
    assert (doubled["mechanism"] == "").all()


def test_a_knocked_camera_makes_no_band(made):
    """All points shift by some 3 px in five frames and back; nothing but a switch may look like two bands."""
    rng = np.random.default_rng(2)
    test = made(frames=40)
    for frame in (4, 11, 19, 20, 33):
        for name in ("x_mm", "y_mm"):
            test.tracks[name][frame] += rng.normal(0, 3 * 0.25)
    found = find(test)
    assert len(found.bands) == len(test.bands)
    assert (found.increments["mechanism"] != "one_band").sum() <= 2


def test_sand_at_rest_before_a_moving_blade_is_still_and_has_no_band(made):
    test = made(frames=20)
    rng = np.random.default_rng(0)
    for name in ("x", "y"):
        seen = np.isfinite(test.tracks[f"{name}_mm"].to_numpy())
        rest = test.tracks[f"{name}0_mm"].to_numpy() + rng.normal(0, 0.01, seen.shape)
        test.tracks[f"{name}_mm"][:] = np.where(seen, rest, np.nan)
    found = find(test)
    assert len(found.bands) == 0
    assert (found.increments["mechanism"] == "still").all()
    assert tuple(found.increments.columns) == INCREMENT_COLUMNS


def test_the_numbers_of_a_mirrored_order_of_points_are_the_same(made):
    test = made(frames=12)
    order = np.random.default_rng(1).permutation(test.tracks.sizes["point"])
    other = find_bands(test.tracks.isel(point=order), test.surface, test.scene)
    pd.testing.assert_frame_equal(find(test).increments, other.increments, rtol=1e-6)


@pytest.mark.parametrize(("scale", "noise"), [*itertools.product((0.25, 0.1), (0.02, 0.1))])
def test_sand_that_shears_along_the_blade_is_told_from_a_second_band(made, scale, noise):
    """Within a few mm of the face the sand rises by as little as 0.4 of the rest, as friction there does."""
    test = made((40.0, 33.0), frames=20, mm_per_px=scale, noise_px=noise)
    tracks = test.tracks
    x, y, u = (tracks[name].to_numpy() for name in ("x_mm", "y_mm", "u_mm"))
    lag = np.zeros(x.shape)
    for frame in range(1, len(u)):
        rise = y[frame] - y[frame - 1]
        fading = np.exp(-(x[frame] - u[frame]) / 6.0)
        lag[frame] = np.where(rise > 0.2, 0.6 * rise * fading, 0.0)
    for frame in range(1, len(u)):
        y[frame] -= np.nan_to_num(lag[: frame + 1]).sum(axis=0)
    found = find(test)
    calm = found.increments.iloc[[1, 2, 3, 4, 8, 9, 10, 11]]
    assert (calm["mechanism"] == "shear_along_blade").mean() >= 0.75


def test_motion_that_fades_in_over_a_wide_fan_is_diffuse(made):
    test = made((40.0, 33.0), frames=12, noise_px=0.02)
    tracks = test.tracks
    u = tracks["u_mm"].to_numpy()
    start = np.column_stack([tracks["x0_mm"], tracks["y0_mm"]])
    place = start.copy()
    for frame in range(len(u)):
        if frame:
            du = u[frame] - u[frame - 1]
            angle = np.degrees(np.arctan2(place[:, 1], place[:, 0] - (u[frame] + u[frame - 1]) / 2))
            part = np.clip((angle - 10.0) / 30.0, 0.0, 1.0)
            place = place + np.outer(part * du, [1.0, 0.45])
        tracks["x_mm"][frame], tracks["y_mm"][frame] = place.T
        tracks["status"][frame] = np.where(place[:, 0] > u[frame], Status.OK, Status.BURIED)
    found = find(test)
    assert (found.increments["mechanism"] == "diffuse").mean() >= 0.8
    # what "the" line is uncertain by, a quarter of the fan to either side
    assert found.increments["beta_std_deg"].median() > 4.0


def _lose(tracks, frame, points, status):
    for name in ("x_mm", "y_mm", "std_mm"):
        tracks[name].to_numpy()[frame, points] = np.nan
    tracks["status"].to_numpy()[frame, points] = status
