"""Measured arrays as the tables and datasets of the result folder."""

import json

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ploughval.axes import BLADE_COLUMNS, LAYER_COLUMNS, SURFACE_COLUMNS, WORLD, Status
from ploughval.photos import Calibration
from ploughval.results.catalogue import VARIABLES
from ploughval.run.walk.window import WindowRecord
from ploughval.scene import Scene

Floats = NDArray[np.float64]


def tracks_dataset(
    record: WindowRecord, calibration: Calibration, scene: Scene, time_s: Floats, u_mm: Floats
) -> xr.Dataset:
    """Tracked points in world coordinates: the dataset of tracks.nc.

    Returns
    -------
    Dataset
        Dims frame and point; x_mm, y_mm, std_mm, zncc, status (frame, point); x0_mm, y0_mm, layer_mm,
        calibration_std_mm (point); time_s, u_mm, blade_x_mm (frame). A point that is not OK is NaN and
        ``status`` says why. ``std_mm`` is the random part of a position; ``calibration_std_mm`` is shared by
        all points and frames, is not lessened by averaging, and mostly cancels in displacements; NaN where
        the scale was given without its standard uncertainty.
    """
    initial = calibration.to_mm(record.points_px)
    valid = np.isin(record.status, (Status.OK, Status.REPLACED))
    position = np.where(valid[..., None], calibration.to_mm(record.position_px), np.nan)
    local_mm_per_px = calibration.mm_per_px_at(record.position_px)
    std = np.where(valid, record.point_std_px * local_mm_per_px, np.nan)
    shared_std = _shared_std_mm(record, calibration)
    data = {
        "x0_mm": ("point", initial[:, 0]),
        "y0_mm": ("point", initial[:, 1]),
        "layer_mm": ("point", record.layer_mm),
        "calibration_std_mm": ("point", shared_std),
        "x_mm": (("frame", "point"), position[..., 0]),
        "y_mm": (("frame", "point"), position[..., 1]),
        "std_mm": (("frame", "point"), std),
        "zncc": (("frame", "point"), record.zncc),
        "status": (("frame", "point"), record.status),
        "time_s": ("frame", time_s),
        "u_mm": ("frame", u_mm),
        "blade_x_mm": ("frame", record.blade[:, 0]),
    }
    dataset = xr.Dataset(data)
    for name, variable in dataset.data_vars.items():
        told = VARIABLES[str(name)]
        variable.attrs = {"units": told.unit, "long_name": told.meaning}
    dataset["status"].attrs["flag_values"] = np.array([int(s) for s in Status], np.int8)
    dataset["status"].attrs["flag_meanings"] = " ".join(s.meaning for s in Status)
    dataset.attrs = {
        "title": scene.test.name,
        "axes": WORLD,
        "settings": json.dumps(json.loads(scene.settings_json), sort_keys=True),
    }
    return dataset


def _shared_std_mm(record: WindowRecord, calibration: Calibration) -> Floats:
    """What the calibration leaves open (N,), mm; NaN where nobody said how well the scale is known."""
    if not calibration.spread.any():
        return np.full(len(record.points_px), np.nan)
    return np.asarray(np.sqrt(np.mean(calibration.std_mm(record.points_px) ** 2, axis=-1)))


def surface_table(record: WindowRecord, u_mm: Floats) -> pd.DataFrame:
    """Free surface, one row a point: SURFACE_COLUMNS and std_mm."""
    frame = record.surface[:, 0].astype(int)
    columns = [frame, u_mm[frame], *record.surface[:, 1:].T]
    return pd.DataFrame(dict(zip([*SURFACE_COLUMNS, "std_mm"], columns, strict=True)))


def with_calibration_std(table: pd.DataFrame, calibration: Calibration) -> pd.DataFrame:
    """A table of places with ``calibration_std_mm``: what the calibration leaves open of each.

    Parameters
    ----------
    table : DataFrame
        With x_mm and y_mm.
    calibration : Calibration
        The mapping with its uncertainty.

    Returns
    -------
    DataFrame
        The rms of both components; NaN where nobody said how well the scale is known, or without a place.
    """
    places = table[["x_mm", "y_mm"]].to_numpy(dtype=np.float64)
    std = np.full(len(places), np.nan)
    known = np.isfinite(places).all(axis=1)
    if calibration.spread.any() and known.any():
        of = calibration.std_mm(calibration.to_px(places[known]))
        std[known] = np.sqrt(np.mean(of**2, axis=-1))
    return table.assign(calibration_std_mm=std)


def dyed_table(record: WindowRecord, u_mm: Floats) -> pd.DataFrame:
    """Dyed layers found in the photographs: LAYER_COLUMNS with the source "dye"."""
    frame = record.dyed[:, 0].astype(int)
    x, y, std = record.dyed[:, 2:].T
    columns = [frame, u_mm[frame], record.dyed[:, 1], np.full(len(frame), "dye"), x, y, std]
    return pd.DataFrame(dict(zip(LAYER_COLUMNS, columns, strict=True)))


def blade_table(record: WindowRecord, time_s: Floats, u_mm: Floats) -> pd.DataFrame:
    """Blade face of each frame: BLADE_COLUMNS."""
    columns = [np.arange(len(u_mm)), time_s, u_mm, *record.blade.T]
    return pd.DataFrame(dict(zip(BLADE_COLUMNS, columns, strict=True)))
