"""A result folder with what is hard to export: lost points, torn layers, names in Greek, a fit."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from ploughval.axes import Status

NAME = "d30 β/01"


@pytest.fixture(scope="session")
def folder(make_results, tmp_path_factory):
    """Point 3 is lost from frame 4 on, frame 5 has no photograph, layers are torn at their 11th row."""
    made = make_results(tmp_path_factory.mktemp("export") / "results", name=NAME)
    with xr.open_dataset(made / "tracks.nc", engine="h5netcdf") as stored:
        tracks = stored.load()
    lost = np.zeros(tracks["x_mm"].shape, dtype=bool)
    lost[4:, 3], lost[5] = True, True
    for name in ("x_mm", "y_mm", "std_mm", "zncc"):
        tracks[name] = tracks[name].where(~lost)
    status = np.where(lost, Status.LOST, Status.OK)
    status[5] = Status.FRAME_MISSING
    tracks["status"] = (("frame", "point"), status.astype(np.int8))
    tracks.to_netcdf(made / "tracks.nc", engine="h5netcdf")
    layers = pd.read_csv(made / "layers.csv")
    layers.loc[10, ["x_mm", "y_mm", "std_mm"]] = np.nan
    layers.to_csv(made / "layers.csv", index=False)
    shutil.copy(made / "surface.csv", made / "model" / "surface.csv")
    record = json.loads((made / "run.json").read_text())
    record["complete"], record["warnings"] = False, ["größer als erwartet"]
    (made / "run.json").write_text(json.dumps(record))
    (made / "fit.json").write_text(json.dumps({"parameters": {"peak_friction_deg": {"value": 44.5}}}))
    pd.DataFrame({"parameter": ["peak_friction_deg"], "value": [44.5], "rise": [0.0]}).to_csv(
        made / "fit_profiles.csv", index=False
    )
    return made


@pytest.fixture(scope="session")
def tracks(folder):
    """Its tracks as they stand in the file."""
    with xr.open_dataset(folder / "tracks.nc", engine="h5netcdf") as stored:
        return stored.load()
