"""Measured arrays become tables in world coordinates, NaN where a point is not OK."""

from types import SimpleNamespace

import numpy as np

from ploughval.axes import Status
from ploughval.photos import calibrate
from ploughval.run.tables import (
    blade_table,
    dyed_table,
    surface_table,
    tracks_dataset,
    with_calibration_std,
)
from ploughval.run.walk.window import WindowRecord
from ploughval.scene import Scene

SCENE = Scene.model_validate(
    {
        "test": {"name": "tables"},
        "blade": {"depth_mm": 30, "width_mm": 200},
        "camera": {"photos": "*.png", "mm_per_px": 0.5, "tip_px": [100, 80], "direction": "left"},
    }
)


def record():
    position = np.array([[[100.0, 80.0], [90.0, 60.0]], [[98.0, 79.0], [np.nan, np.nan]]])
    return WindowRecord(
        blade=np.array([[0.0, 0.01], [1.0, 0.02]]),
        surface=np.array([[0, 1.0, 30.0, 0.1], [1, 2.0, 31.0, 0.1]]),
        dyed=np.array([[1, 10.0, 5.0, 10.5, 0.2], [1, 10.0, np.nan, np.nan, np.nan]]),
        points_px=position[0],
        layer_mm=np.array([np.nan, 10.0]),
        position_px=position,
        point_std_px=np.array([[0.0, 0.0], [0.02, np.nan]]),
        zncc=np.array([[1.0, 1.0], [0.98, 0.2]]),
        status=np.array([[0, 0], [0, Status.LOW_CORRELATION]], np.int8),
        camera=np.zeros((2, 3)),
        lost_frames={},
        noise=np.array([[150.0, 2.0, 0.01, 5000.0]]),
        noise_line=np.array([np.nan, np.nan, 4.0, 0.1, 1.0]),
        texture=np.full((1, 2, 33), 9.0),
        texture_squares=np.array([[120.0, 96.0]]),
        notes={1: ["layer 10 mm: not found"]},
    )


def dataset():
    calibration = calibrate(SCENE, SimpleNamespace(shape=(120, 160)))
    return tracks_dataset(record(), calibration, SCENE, np.array([np.nan, np.nan]), np.array([0.0, 1.0]))


def test_positions_are_world_millimetres_mirrored_for_a_blade_that_travels_left():
    data = dataset()
    assert np.allclose(data["x0_mm"], [0.0, 5.0])
    assert np.allclose(data["y0_mm"], [0.0, 10.0])
    assert np.allclose([data["x_mm"][1, 0], data["y_mm"][1, 0]], [1.0, 0.5])
    assert np.allclose(data["std_mm"][1, 0], 0.01)


def test_a_point_that_is_not_ok_is_nan_and_says_why():
    data = dataset()
    assert np.isnan(data["x_mm"][1, 1])
    assert int(data["status"][1, 1]) == Status.LOW_CORRELATION
    meanings = data["status"].attrs["flag_meanings"].split()
    assert meanings[list(data["status"].attrs["flag_values"]).index(2)] == "low_correlation"


def test_every_variable_names_its_unit():
    units = {name: variable.attrs["units"] for name, variable in dataset().data_vars.items()}
    assert units["x_mm"] == "mm"
    assert units["time_s"] == "s"
    assert units["zncc"] == "1"


def test_what_the_calibration_leaves_open_is_told_apart_from_the_random_part():
    # a scale known to 1 % moves a place by 1 % of its distance from the tip: (0, 0) and (5, 10) mm
    camera = SCENE.camera.model_copy(update={"mm_per_px_std": 0.005})
    scene = SCENE.model_copy(update={"camera": camera})
    calibration = calibrate(scene, SimpleNamespace(shape=(120, 160)))
    times = np.array([0.0, 1.0])
    data = tracks_dataset(record(), calibration, scene, times, times)
    assert data["calibration_std_mm"].dims == ("point",)
    assert np.allclose(data["calibration_std_mm"], [0.0, np.sqrt((0.05**2 + 0.1**2) / 2)], atol=1e-9)
    assert np.array_equal(data["std_mm"], dataset()["std_mm"], equal_nan=True)
    assert np.isnan(dataset()["calibration_std_mm"]).all()  # nobody said how well 0.5 mm/px is known
    assert "not in std_mm" in data["calibration_std_mm"].attrs["long_name"]


def test_places_of_a_table_carry_what_the_calibration_leaves_open_of_them():
    camera = SCENE.camera.model_copy(update={"mm_per_px_std": 0.005})
    shape = SimpleNamespace(shape=(120, 160))
    known = calibrate(SCENE.model_copy(update={"camera": camera}), shape)
    table = dyed_table(record(), np.array([0.0, 1.5]))
    std = with_calibration_std(table, known)["calibration_std_mm"].to_numpy()
    # 1 % of (5, 10.5) mm from the tip; a torn place has none.
    assert np.isclose(std[0], np.hypot(0.05, 0.105) / np.sqrt(2), rtol=1e-6)
    assert np.isnan(std[1])
    unknown = with_calibration_std(table, calibrate(SCENE, shape))
    assert unknown["calibration_std_mm"].isna().all()


def test_tables_carry_the_displacement_of_their_frame():
    u = np.array([0.0, 1.5])
    assert surface_table(record(), u)["u_mm"].tolist() == [0.0, 1.5]
    dyed = dyed_table(record(), u)
    assert dyed["u_mm"].tolist() == [1.5, 1.5]
    assert dyed["layer"].tolist() == [10.0, 10.0]
    assert set(dyed["source"]) == {"dye"}
    assert blade_table(record(), u, u)["blade_std_mm"].tolist() == [0.01, 0.02]


def test_the_record_survives_the_store_unchanged():
    first = record()
    again = WindowRecord.from_arrays(first.to_arrays())
    for name in ("blade", "surface", "dyed", "position_px", "status", "zncc"):
        assert np.array_equal(getattr(first, name), getattr(again, name), equal_nan=True)
    assert again.lost_frames == {}
    assert again.notes == first.notes


def test_the_uncertainty_of_a_point_is_turned_into_mm_by_the_scale_at_its_place():
    # 2 px/mm at the origin and w = 1 + x / 400: at x one pixel is w ** 1.5 / 2 mm
    mm = np.stack(np.meshgrid(np.linspace(-40, 60, 5), np.linspace(-20, 40, 4)), -1).reshape(-1, 2)
    x = mm[:, :1]
    px = (np.array([100.0, 80.0]) * (1 + x / 400) + mm * [2.0, -2.0]) / (1 + x / 400)
    camera = {"photos": "*.png", "control_points": np.hstack([px, mm]).tolist()}
    scene = Scene.model_validate(
        {"test": {"name": "tables"}, "blade": {"depth_mm": 30, "width_mm": 200}, "camera": camera}
    )
    calibration = calibrate(scene, SimpleNamespace(shape=(160, 220)))
    there = record()
    there.position_px[1, 0] = calibration.to_px(np.array([60.0, 30.0]))
    data = tracks_dataset(there, calibration, scene, np.array([0.0, 1.0]), np.array([0.0, 1.0]))
    assert np.allclose(data["std_mm"][1, 0], 0.02 * 0.5 * 1.15**1.5, rtol=1e-6)
