"""Material lines carried by the tracked points."""

import numpy as np
import pandas as pd
import xarray as xr
from scipy.ndimage import median_filter

from ploughval.axes import LAYER_COLUMNS, Status
from ploughval.tracers.view import Floats, Mask

_TORN_SPACINGS = 0.5  # jump in displacement between neighbours, in spacings of the layer's points
_TORN_STRAIN = 0.3  # ... and in their own distance at rest
_TORN_STDS = 5.0  # of one component: in the plane noise exceeds that once in 300 000 pairs
_LEAST_SPACINGS = 0.1  # a smaller jump is a tear only where neighbours do not move apart like that
_TIMES_USUAL, _NEIGHBOURS = 5.0, 9  # times the usual strain of so many successive pairs of points


def layers_from_tracks(tracks: xr.Dataset) -> pd.DataFrame:
    """Positions of the layers' points in every frame.

    Parameters
    ----------
    tracks : Dataset
        As in tracks.nc, with layer_mm (point).

    Returns
    -------
    DataFrame
        LAYER_COLUMNS, source "tracks", in order along each layer at rest. Lost points are absent.
        A row of NaN x_mm and y_mm stands where a shear band has torn the layer: where the
        displacement jumps between successive points: by half their spacing, or by less where that is clear
        against noise and against how far their neighbours moved apart.
    """
    layer = tracks["layer_mm"].to_numpy()
    x0, y0 = tracks["x0_mm"].to_numpy(), tracks["y0_mm"].to_numpy()
    u_mm = tracks["u_mm"].to_numpy()
    x, y = tracks["x_mm"].to_numpy(), tracks["y_mm"].to_numpy()
    std = tracks["std_mm"].to_numpy()
    good = (
        np.isin(tracks["status"].to_numpy(), (Status.OK, Status.REPLACED)) & np.isfinite(x) & np.isfinite(y)
    )
    frames = tracks["frame"].to_numpy()
    parts = []
    for k, frame in enumerate(frames):
        for height in np.unique(layer[np.isfinite(layer)]):
            member = np.flatnonzero(layer == height)
            member = member[np.argsort(x0[member], kind="stable")]
            spacing = float(np.median(np.diff(x0[member]))) if len(member) > 1 else np.inf
            member = member[good[k, member]]
            if len(member) == 0:
                continue
            rest = np.column_stack([x0[member], y0[member]])
            line = np.column_stack([x[k, member], y[k, member], std[k, member]])
            line = np.insert(line, np.flatnonzero(_torn(rest, line, spacing)) + 1, np.nan, axis=0)
            parts.append(_rows(int(frame), float(u_mm[k]), float(height), line))
    if not parts:
        return pd.DataFrame(columns=list(LAYER_COLUMNS))
    return pd.concat(parts, ignore_index=True)


def _torn(rest: Floats, line: Floats, spacing: float) -> Mask:
    """Whether the layer is torn between each point and the next, (K - 1,) bool."""
    if len(line) < 2:
        return np.zeros(0, bool)
    moved = line[:, :2] - rest
    jump = np.hypot(*np.diff(moved, axis=0).T)
    apart = np.hypot(*np.diff(rest, axis=0).T)
    noise = np.nan_to_num(np.hypot(line[1:, 2], line[:-1, 2]))
    large = (jump > _TORN_SPACINGS * spacing) & (jump > _TORN_STRAIN * apart)
    usual = median_filter(jump / apart, _NEIGHBOURS, mode="nearest") * apart
    alone = (jump > _LEAST_SPACINGS * spacing) & (jump > _TIMES_USUAL * usual)
    return np.asarray((large | alone) & (jump > _TORN_STDS * noise))


def _rows(frame: int, u_mm: float, height: float, line: Floats) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "frame": frame,
            "u_mm": u_mm,
            "layer": height,
            "source": "tracks",
            "x_mm": line[:, 0],
            "y_mm": line[:, 1],
            "std_mm": line[:, 2],
        },
        columns=list(LAYER_COLUMNS),
    )
