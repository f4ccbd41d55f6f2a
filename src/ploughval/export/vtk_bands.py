"""Shear bands as straight lines from the tip of the blade to the outcrop."""

import numpy as np
import pandas as pd

from ploughval.export.vtk_xml import Lines

_OF_INCREMENT = ("beta_deg", "beta_std_deg", "outcrop_x_mm", "outcrop_std_mm", "slip_mm", "band", "du_mm")


def increment_lines(rows: pd.DataFrame) -> Lines:
    """The band of an increment, half-way through it; none where inclination or outcrop is not known.

    Parameters
    ----------
    rows : DataFrame of INCREMENT_COLUMNS
        Of one photograph, with which the increment begins.
    """
    known = rows.dropna(subset=["beta_deg", "outcrop_x_mm", "u_mm", "du_mm"])
    tip = (known["u_mm"] + known["du_mm"] / 2).to_numpy(np.float64)
    return _lines(known, tip, _OF_INCREMENT, {"u_mm": float(tip[0])} if len(tip) else {})


def band_lines(bands: pd.DataFrame) -> Lines:
    """All bands of one side, each as it starts.

    Parameters
    ----------
    bands : DataFrame of BAND_COLUMNS
        Those without a start, an inclination or an outcrop have no line.
    """
    known = bands.dropna(subset=["u_start_mm", "beta_deg", "outcrop_x_mm"])
    return _lines(known, known["u_start_mm"].to_numpy(np.float64), tuple(bands.columns), {})


def _lines(
    rows: pd.DataFrame, tip_mm: np.ndarray, columns: tuple[str, ...], about: dict[str, float]
) -> Lines:
    x = rows["outcrop_x_mm"].to_numpy(np.float64)
    y = (x - tip_mm) * np.tan(np.radians(rows["beta_deg"].to_numpy(np.float64)))
    ends = np.stack([np.column_stack([tip_mm, np.zeros(len(x))]), np.column_stack([x, y])], axis=1)
    return Lines(
        ends.reshape(-1, 2),
        np.full(len(x), 2, dtype=np.int64),
        on_lines={name: rows[name].to_numpy(np.float64) for name in columns},
        about=about,
    )
