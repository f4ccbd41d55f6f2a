"""find_bands against exact block kinematics: beta, outcrop, slip and the start of bands are known."""

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import BAND_COLUMNS, Status
from ploughval.scene import Bands, Blade, Camera, Scene, TestTable
from ploughval.tracers import find_bands

SPACING = 2.0  # mm; a line between points this far apart is known to a small part of it


def scene(**bands):
    camera = Camera(photos="*.png", mm_per_px=0.2, tip_px=(0, 0))
    blade = Blade(depth_mm=30, width_mm=200)
    return Scene(test=TestTable(name="t"), blade=blade, camera=camera, bands=Bands(**bands))


def switching(u):
    return 80.0 if u < 20.0 else 140.0


def test_a_stationary_band_is_found_once_with_its_angle_outcrop_and_slip(kinematics):
    block_of, tracks_of, surface_of = kinematics
    u = np.arange(0, 21.0)
    found = find_bands(tracks_of(block_of(lambda _: 80.0), u), surface_of(u), scene())
    assert len(found.bands) == 1
    band = found.bands.iloc[0]
    assert (band["u_start_mm"], band["u_end_mm"]) == (0.0, 20.0)
    # the figures to reach: outcrop 1 mm, beta 0.5 degrees; here without noise
    assert band["outcrop_x_mm"] == pytest.approx(80.0, abs=0.3)
    assert band["beta_deg"] == pytest.approx(np.degrees(np.arctan2(30, 80)), abs=0.1)
    # slip = integral of du / cos beta with tan beta = 30 / (80 - u)
    fine = np.linspace(0, 20, 4001)
    slip = np.mean(1 / np.cos(np.arctan2(30, 80 - fine))) * 20
    assert band["slip_mm"] == pytest.approx(slip, rel=0.002)


def test_the_increments_follow_the_band_as_it_steepens(kinematics):
    block_of, tracks_of, surface_of = kinematics
    u = np.arange(0, 21.0)
    rows = find_bands(tracks_of(block_of(lambda _: 80.0), u), surface_of(u), scene()).increments
    true = np.degrees(np.arctan2(30, 80 - (rows["u_mm"] + rows["du_mm"] / 2)))
    assert np.abs(rows["beta_deg"] - true).max() < 0.4
    assert np.sqrt(np.mean((rows["beta_deg"] - true) ** 2)) < 0.15
    assert np.abs(rows["outcrop_x_mm"] - 80).max() < 1.0
    assert rows["frame"].tolist() == list(range(20))


def test_a_switch_is_two_bands_and_its_start_is_found_within_its_interval(kinematics):
    """Sand between the two lines moves by the share of the interval left after the switch: 0.05 of 1 mm."""
    block_of, tracks_of, surface_of = kinematics
    u = np.arange(0, 31.0) * 1.01
    bands = find_bands(tracks_of(block_of(switching), u), surface_of(u), scene()).bands
    assert bands["band"].tolist() == [0, 1]
    assert bands["outcrop_x_mm"].to_numpy() == pytest.approx([80, 140], abs=1.0)
    assert bands["u_start_mm"].iloc[1] == pytest.approx(20.0, abs=0.05)
    assert bands["u_end_mm"].iloc[0] == bands["u_start_mm"].iloc[1]
    slip = np.trapezoid(np.hypot(1.0, 30 / (80 - np.linspace(0, 20, 500))), np.linspace(0, 20, 500))
    assert bands["slip_mm"].iloc[0] == pytest.approx(slip, abs=0.1)
    assert bands["beta_deg"].iloc[1] == pytest.approx(np.degrees(np.arctan2(30, 120)), abs=0.5)


def test_a_creeping_band_is_one_band(kinematics):
    block_of, tracks_of, surface_of = kinematics
    u = np.arange(0, 31.0)
    bands = find_bands(tracks_of(block_of(lambda v: 60.0 + 1.6 * v), u), surface_of(u), scene()).bands
    assert len(bands) == 1
    assert bands["outcrop_x_mm"].iloc[0] == pytest.approx(60.0, abs=1.0)


def test_without_motion_there_is_no_band(kinematics):
    block_of, tracks_of, surface_of = kinematics
    u = np.arange(0, 6.0)
    tracks = tracks_of(block_of(lambda _: 80.0), u)
    tracks["x_mm"][:], tracks["y_mm"][:] = tracks["x0_mm"], tracks["y0_mm"]
    found = find_bands(tracks, surface_of(u), scene())
    assert list(found.bands.columns) == list(BAND_COLUMNS)
    assert len(found.bands) == 0
    assert found.increments["beta_deg"].isna().all()
    assert (found.increments["band"] == -1).all()


def test_a_blade_at_rest_makes_no_band_out_of_noise(kinematics):
    block_of, tracks_of, surface_of = kinematics
    u = np.zeros(6)
    tracks = tracks_of(block_of(lambda _: 80.0), u, noise=0.01)
    assert len(find_bands(tracks, surface_of(u), scene()).bands) == 0


def test_noise_and_lost_points_leave_one_band_within_its_stated_uncertainty(kinematics):
    block_of, tracks_of, surface_of = kinematics
    u = np.arange(0, 16.0)
    tracks = tracks_of(block_of(lambda _: 80.0), u, noise=0.05)
    rng = np.random.default_rng(2)
    lost = rng.random(tracks["x_mm"].shape) < 0.2
    tracks["status"].to_numpy()[lost] = Status.LOW_CORRELATION
    tracks["x_mm"].to_numpy()[lost] += 40.0  # what is not OK must not be read, whatever it says
    found = find_bands(tracks, surface_of(u), scene())
    assert len(found.bands) == 1
    band = found.bands.iloc[0]
    assert abs(band["outcrop_x_mm"] - 80) < max(3 * band["outcrop_std_mm"], 0.3)
    rows = found.increments
    true = np.degrees(np.arctan2(30, 80 - (rows["u_mm"] + rows["du_mm"] / 2)))
    # 15 increments: within three stated deviations all but one, and the deviation is not a blank cheque
    assert (np.abs(rows["beta_deg"] - true) < 3 * rows["beta_std_deg"] + 0.05).sum() >= 14
    assert rows["beta_std_deg"].max() < 0.5


def test_one_bad_increment_makes_no_band_of_its_own(kinematics):
    block_of, tracks_of, surface_of = kinematics
    u = np.arange(0, 16.0)
    tracks = tracks_of(block_of(lambda _: 80.0), u)
    wrong = block_of(lambda _: 140.0).carry(
        np.column_stack([tracks["x_mm"][7], tracks["y_mm"][7]]), 7.0, 8.0
    ) - np.column_stack([tracks["x_mm"][7], tracks["y_mm"][7]])
    tracks["x_mm"][8:] += wrong[:, 0] - (tracks["x_mm"][8] - tracks["x_mm"][7])
    tracks["y_mm"][8:] += wrong[:, 1] - (tracks["y_mm"][8] - tracks["y_mm"][7])
    bands = find_bands(tracks, surface_of(u), scene()).bands
    assert len(bands) == 1
    assert bands["outcrop_x_mm"].iloc[0] == pytest.approx(80.0, abs=1.0)


def test_a_missing_frame_is_bridged(kinematics):
    block_of, tracks_of, surface_of = kinematics
    u = np.arange(0, 11.0)
    tracks = tracks_of(block_of(lambda _: 80.0), u)
    tracks["x_mm"][4] = np.nan
    tracks["status"][4] = Status.FRAME_MISSING
    rows = find_bands(tracks, surface_of(u), scene()).increments
    assert rows.loc[rows["frame"] == 3, "du_mm"].tolist() == [2.0]
    assert np.nansum(rows["slip_mm"]) == pytest.approx(
        np.sum(1 / np.cos(np.arctan2(30, 80 - (np.arange(10) + 0.5)))), rel=0.005
    )


def test_bands_with_less_slip_than_asked_are_left_out(kinematics):
    block_of, tracks_of, surface_of = kinematics
    u = np.arange(0, 24.0)
    tracks, surface = tracks_of(block_of(switching), u), surface_of(u)
    assert len(find_bands(tracks, surface, scene()).bands) == 2
    assert len(find_bands(tracks, surface, scene(min_slip_mm=6.0)).bands) == 1


def test_mirrored_points_order_does_not_matter(kinematics):
    block_of, tracks_of, surface_of = kinematics
    u = np.arange(0, 8.0)
    tracks, surface = tracks_of(block_of(lambda _: 80.0), u, noise=0.01), surface_of(u)
    shuffled = tracks.isel(point=np.random.default_rng(0).permutation(tracks.sizes["point"]))
    one = find_bands(tracks, surface, scene()).increments
    other = find_bands(shuffled, surface.sample(frac=1, random_state=1), scene()).increments
    pd.testing.assert_frame_equal(one, other, rtol=1e-6)


def test_a_band_that_comes_out_beyond_the_picture_is_no_band_and_that_is_said(kinematics, caplog):
    block_of, tracks_of, surface_of = kinematics
    u = np.arange(0, 11.0)
    surface = surface_of(u)
    found = find_bands(tracks_of(block_of(lambda _: 190.0), u), surface[surface["x_mm"] < 120.0], scene())
    assert len(found.bands) == 0
    true = np.degrees(np.arctan2(30, 190 - (found.increments["u_mm"] + 0.5)))
    assert np.abs(found.increments["beta_deg"] - true).max() < 0.2  # its inclination is known all the same
    assert "in 10 of 10 increments a band is seen whose outcrop is not" in caplog.text


def test_a_band_within_the_picture_raises_no_such_word(kinematics, caplog):
    block_of, tracks_of, surface_of = kinematics
    u = np.arange(0, 11.0)
    find_bands(tracks_of(block_of(lambda _: 80.0), u), surface_of(u), scene())
    assert "outcrop is not" not in caplog.text
