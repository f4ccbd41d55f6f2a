"""What tests of several rooms need: the least test.toml, and a result folder made by hand.

The folder holds a saw-tooth force, straight layers and bands that steepen, in closed form of the travel.
"""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

MODEL_ONLY = """
[test]
name = "model only"
[blade]
depth_mm = 30.0
width_mm = 1000.0
[soil]
unit_weight_kN_m3 = 16.0
peak_friction_deg = 50.0
residual_friction_deg = 32.0
"""


@pytest.fixture(scope="session")
def model_settings():
    """Its text, to which tables may be added."""
    return MODEL_ONLY


@pytest.fixture
def model_only(tmp_path, model_settings):
    """A test folder with it, and two layers."""
    (tmp_path / "test.toml").write_text(model_settings + "[tracers]\nlayers_mm = [10, 20]\n")
    return tmp_path


DEPTH_MM, TRAVEL_MM, P0_N = 30.0, 60.0, 12.0
FRAMES = 13
BAND_STARTS_MM = (0.0, 40.0)
OUTCROP_MM = (150.0, 190.0)
HEIGHTS_MM = (5.0, 15.0, 25.0)
SETTINGS = {
    "test": {"name": "d30-01", "notes": "dense, pluviated"},
    "blade": {"depth_mm": DEPTH_MM, "width_mm": 218.0, "thickness_mm": 5.0},
    "soil": {
        "unit_weight_kN_m3": 16.0,
        "peak_friction_deg": 50.0,
        "residual_friction_deg": 32.0,
        "mobilization_length_mm": 1.0,
    },
    "report": {"frames_shown": 4},
}


def saw_tooth(u_mm):
    """Force in N: P0 at every band start, growing by P0 in 40 mm."""
    u = np.asarray(u_mm, float)
    return P0_N * (1 + np.mod(u, 40.0) / 40.0)


def band_table(shift_mm=0.0):
    starts, outcrops = np.array(BAND_STARTS_MM) + shift_mm, np.array(OUTCROP_MM) + shift_mm
    beta = np.degrees(np.arctan2(DEPTH_MM, outcrops - starts))
    ends = [starts[1], TRAVEL_MM]
    slip = (np.array(ends) - starts) / np.cos(np.radians(beta))
    columns = dict(band=[1, 2], u_start_mm=starts, u_end_mm=ends, beta_deg=beta, beta_std_deg=0.4)
    return pd.DataFrame({**columns, "outcrop_x_mm": outcrops, "outcrop_std_mm": 0.8, "slip_mm": slip})


def layer_rows(frame, u_mm, source, lift_mm=0.0):
    x = np.linspace(0.0, 200.0, 81)
    tables = []
    for height in HEIGHTS_MM:
        lifted = np.where(x < OUTCROP_MM[0] - u_mm, 0.2 * u_mm + lift_mm, 0.0)
        keep = x > u_mm
        columns = dict(frame=frame, u_mm=u_mm, layer=height, source=source, x_mm=x[keep])
        tables.append(pd.DataFrame({**columns, "y_mm": (height + lifted)[keep], "std_mm": 0.02}))
    return pd.concat(tables)


def surface_rows(frame, u_mm):
    x = np.linspace(u_mm, 220.0, 80)
    y = DEPTH_MM + np.maximum(0.0, 0.3 * u_mm - 0.25 * np.abs(x - u_mm - 20.0))
    return pd.DataFrame(dict(frame=frame, u_mm=u_mm, x_mm=x, y_mm=y))


def track_set(u_mm):
    x, y = (g.ravel() for g in np.meshgrid(np.arange(4.0, 200.0, 4.0), np.arange(-8.0, 29.0, 4.0)))
    moving = y > DEPTH_MM * x / OUTCROP_MM[0]
    beta = np.arctan2(DEPTH_MM, OUTCROP_MM[0])
    px = x + np.outer(u_mm, moving)
    py = y + np.outer(u_mm, moving * np.tan(beta))
    status = np.zeros(px.shape, np.int8)
    return xr.Dataset(
        {
            "x0_mm": ("point", x),
            "y0_mm": ("point", y),
            "layer_mm": ("point", np.full(x.shape, np.nan)),
            "x_mm": (("frame", "point"), px),
            "y_mm": (("frame", "point"), py),
            "std_mm": (("frame", "point"), np.full(px.shape, 0.01)),
            "zncc": (("frame", "point"), np.full(px.shape, 0.99)),
            "status": (("frame", "point"), status),
            "time_s": ("frame", u_mm + 10.0, {"units": "s"}),
            "u_mm": ("frame", u_mm, {"units": "mm"}),
            "blade_x_mm": ("frame", u_mm + 0.02),
        }
    )


def metrics():
    def metric(unit, experiment, model, std, *, note=""):
        error = None if experiment is None else model - experiment
        agrees = None if error is None else abs(error) <= 2 * std
        known = experiment is not None
        return dict(
            unit=unit,
            experiment=experiment,
            experiment_std=std / 2 if known else None,
            model=model,
            model_std=std / 3,
            error=error,
            validation_std=std if known else None,
            agrees=agrees,
            note=note,
        )

    return {
        "first_peak_N": metric("N", P0_N, 12.3375, 0.32),
        "mean_force_N": metric("N", 17.25, 19.125, 0.4),
        "peak_spacing_mm": metric("mm", 40.0, 38.75, 1.2),
        "band_count": metric("1", 2.0, 2.0, 0.5),
        "outcrop_x_mm": metric("mm", 150.0, 157.25, 1.1),
        "beta_deg": metric("degree", 11.31, 10.95, 0.45),
        "line_of_action_mm": metric("mm", None, 10.0, 0.5, note="the model has no line of action"),
    }


NOISE = {
    "grey": [60.0, 120.0, 180.0],
    "std": [1.5, 2.0, 2.4],
    "std_std": [0.02, 0.01, 0.02],
    "gain": 0.0293,
    "floor": 0.5,
    "misfit": 1.1,
    "mean_grey": 130.0,
    "std_at_mean_grey": 2.07,
}
CELLS = {
    "zero_Nm": [0.137, -0.0799],
    "zero_std_Nm": [0.0012, 0.0009],
    "noise_std_Nm": [0.002, 0.002],
    "noise_std_N": 0.019,
    "mean_load": {"force_N": 12.3, "force_std_N": 0.05, "arm_mm": 10.1, "arm_std_mm": 0.8},
    "drift_Nm": [0.0, 0.0],
    "friction": {
        "runs": 3,
        "mean_N": 1.62,
        "taken_off": "the mean: a run left out says <so>",
        "pieces": 1,
    },
    "bandwidth_Hz": None,
    "motion_starts_s": 10.02,
    "contact_s": 10.9,
    "contact_u_mm": 0.88,
    "contact_std_mm": 0.021,
}


def run_record(u_mm, folder):
    frames = [
        dict(frame=k, file=f"f{k:03d}.png", time_s=10.0 + u, u_mm=u, status="ok", reason="")
        for k, u in enumerate(u_mm)
    ]
    frames[5] |= {"status": "lost", "reason": "truncated file", "u_mm": None}
    return {
        "ploughval": "0.1.0",
        "test": "d30-01",
        "folder": str(folder),
        "settings": SETTINGS,
        "settings_hash": "ab" * 32,
        "versions": {"numpy": "2.4.6"},
        "inputs": {"test.toml": "cd" * 32},
        "timings_s": {"tracks": 12.5, "model": 0.25},
        "steps": [
            "calibration",
            "blade",
            "force",
            "surface",
            "tracks",
            "layers",
            "bands",
            "model",
            "compare",
        ],
        "frames": frames,
        "noise": NOISE,
        "loadcells": CELLS,
        "calibration": {
            "method": "scale and tip",
            "mm_per_px": 0.125,
            "scale_std": 1.5e-4,
            "residual_px": None,
        },
        "faults": ["frame 5: truncated file"],
        "warnings": ["no empty-box runs"],
    }


def write_folder(
    folder: Path, *, test_folder: Path | str = "", name: str = "d30-01", stages: int = 1
) -> Path:
    """All files of a result folder; values in closed form of the displacement."""
    (folder / "model").mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(7)
    u = np.linspace(0.0, TRAVEL_MM, 601)
    force = pd.DataFrame(dict(time_s=10 + u, u_mm=u, force_N=saw_tooth(u) + rng.normal(0, 0.05, u.size)))
    force["force_std_N"], force["arm_mm"], force["arm_std_mm"] = 0.3, 10.0 + 0.02 * u, 0.4
    force["force_raw_N"], force["friction_N"], force["status"] = force["force_N"] + 2.0, 2.0, "ok"
    force.loc[:4, "arm_mm"], force.loc[:4, "status"] = np.nan, "force_too_small_for_arm"
    force.to_csv(folder / "force.csv", index=False)
    bands, model_bands = band_table(), band_table(4.0)
    bands.to_csv(folder / "bands.csv", index=False)
    model_bands.to_csv(folder / "model" / "bands.csv", index=False)
    band = np.where(u < 44.0, 0, 1)
    outcrop, start = np.array(OUTCROP_MM)[band] + 4, np.array(BAND_STARTS_MM)[band] + 4
    rise = DEPTH_MM * np.ones_like(u) * (outcrop - start) / (outcrop - start)
    columns = dict(u_mm=u, force_N=1.05 * saw_tooth(u - 4 * band), outcrop_x_mm=outcrop, band=band + 1)
    model_force = pd.DataFrame({**columns, "beta_deg": np.degrees(np.arctan2(rise, outcrop - u))})
    model_force.to_csv(folder / "model" / "force.csv", index=False)
    frame_u = np.linspace(0.0, TRAVEL_MM, FRAMES)
    frames = [(k, x) for k, x in enumerate(frame_u) if k != 5]
    pd.concat([layer_rows(k, x, "tracks") for k, x in frames]).to_csv(folder / "layers.csv", index=False)
    predicted = pd.concat([layer_rows(k, x, "model", 1.0) for k, x in frames])
    predicted.to_csv(folder / "model" / "layers.csv", index=False)
    pd.concat([surface_rows(k, x) for k, x in frames]).to_csv(folder / "surface.csv", index=False)
    track_set(frame_u).to_netcdf(folder / "tracks.nc", engine="h5netcdf")
    _write_small_tables(folder, frame_u, rng)
    record = run_record(frame_u, test_folder)
    record["test"], record["settings"] = name, SETTINGS | {"report": {"frames_shown": stages}}
    (folder / "run.json").write_text(json.dumps(record))
    (folder / "metrics.json").write_text(json.dumps({"test": name, "metrics": metrics(), "warnings": []}))
    return folder


def _write_small_tables(folder, frame_u, rng):
    u = frame_u[1:]
    band = np.where(u <= 40.0, 0, 1)
    outcrop = np.array(OUTCROP_MM)[band]
    columns = dict(
        frame=np.arange(1, FRAMES), u_mm=u, du_mm=5.0, beta_deg=np.degrees(np.arctan2(DEPTH_MM, outcrop - u))
    )
    increments = pd.DataFrame(
        {**columns, "beta_std_deg": 0.5, "outcrop_x_mm": outcrop + rng.normal(0, 0.8, u.size)}
    )
    increments["outcrop_std_mm"], increments["slip_mm"], increments["band"] = 0.8, 5.1, band + 1
    increments["velocity_x"], increments["velocity_x_std"] = 1.0, 0.01
    increments["velocity_y"] = np.tan(np.radians(increments["beta_deg"]))
    increments["velocity_y_std"], increments["mechanism"] = 0.01, "one_band"
    increments["evidence"] = -5.0
    increments.to_csv(folder / "increments.csv", index=False)
    pd.DataFrame(
        {
            "source": [
                "noise, upper cell",
                "noise, lower cell",
                "zero offset, upper cell",
                "spacing",
                "calibration",
            ],
            "value": [0, 0, 0.2, 150.0, 1.0],
            "std": [0.005, 0.002, 0.01, 0.2, 0.004],
            "unit": ["N m", "N m", "N m", "mm", "1"],
            "sensitivity_N": [6.7, -6.7, 6.7, -0.12, 18.0],
            "share": [0.9, -0.25, 0.05, 0.1, 0.2],
            "sensitivity_mm": [160.0, -250.0, 160.0, -1.5, 600.0],
            "arm_share": [0.5, 0.2, 0.1, 0.05, 0.15],
        }
    ).to_csv(folder / "budget.csv", index=False)
    slip = np.concatenate([np.linspace(0, 2.5, 9), np.linspace(0, 2.0, 7)])
    phi = 50.0 - 18.0 * np.minimum(slip, 1.0)
    mobilised = pd.DataFrame(
        dict(frame=np.arange(16), u_mm=np.linspace(0, 60, 16), slip_mm=slip, band=[1] * 9 + [2] * 7)
    )
    mobilised["phi_deg"], mobilised["phi_std_deg"] = phi, 0.6
    mobilised.to_csv(folder / "mobilised.csv", index=False)
    blade = pd.DataFrame(
        dict(frame=np.arange(FRAMES), time_s=10 + frame_u, u_mm=frame_u, blade_x_mm=frame_u + 0.02)
    )
    blade["blade_std_mm"] = 0.015
    blade.to_csv(folder / "blade.csv", index=False)
    pd.DataFrame(
        dict(
            source=["experiment", "experiment", "model"],
            kind=["peak", "trough", "peak"],
            u_mm=[39.9, 40.0, 43.9],
            force_N=[23.97, 12.0, 25.2],
        )
    ).to_csv(folder / "peaks.csv", index=False)


@pytest.fixture(scope="session")
def make_results():
    """Writes a result folder; see :func:`write_folder`."""
    return write_folder


@pytest.fixture(scope="session")
def result_folder(tmp_path_factory):
    """One result folder for tests that only read."""
    return write_folder(tmp_path_factory.mktemp("d30") / "results", stages=4)


@pytest.fixture
def own_folder(make_results, tmp_path):
    """A result folder of the test's own, with a single stage shown."""
    return make_results(tmp_path / "r")
