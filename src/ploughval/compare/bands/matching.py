"""Measured against predicted shear bands: matched one to one, counted, and described by a few scalars."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from scipy.optimize import linear_sum_assignment

from ploughval.compare.force.peaks import MISSING, Quantity

START_GATE_DEPTHS = 1.0
OUTCROP_GATE_DEPTHS = 3.0
_FORBIDDEN = 1e6
_PAIRED = ("band", "u_start_mm", "u_end_mm", "beta_deg", "outcrop_x_mm")


def match_bands(
    measured: pd.DataFrame,
    model: pd.DataFrame,
    depth_mm: float,
    *,
    start_gate: float = START_GATE_DEPTHS,
    outcrop_gate: float = OUTCROP_GATE_DEPTHS,
) -> pd.DataFrame:
    """Pair bands so that as many as possible match and their places differ least.

    Parameters
    ----------
    measured : DataFrame
        BAND_COLUMNS of the experiment.
    model : DataFrame
        BAND_COLUMNS of the model.
    depth_mm : float
        Depth of the tip.
    start_gate : float
        Largest difference of u_start_mm between partners, depths.
    outcrop_gate : float
        Largest difference of outcrop_x_mm between partners, depths; an unknown outcrop passes.

    Returns
    -------
    DataFrame
        band, u_start_mm, u_end_mm, beta_deg, outcrop_x_mm, each with the ending _experiment and _model, in
        order of start; a band without a partner has NaN on the other side.
    """
    start = np.abs(_outer(measured, model, "u_start_mm")) / (start_gate * depth_mm)
    outcrop = np.nan_to_num(np.abs(_outer(measured, model, "outcrop_x_mm")) / (outcrop_gate * depth_mm))
    cost = np.where((start <= 1) & (outcrop <= 1), start**2 + outcrop**2, _FORBIDDEN)
    rows, columns = linear_sum_assignment(cost)
    allowed = cost[rows, columns] < _FORBIDDEN
    partner = dict(zip(rows[allowed].tolist(), columns[allowed].tolist(), strict=True))
    pairs: list[tuple[int | None, int | None]] = [(k, partner.get(k)) for k in range(len(measured))]
    pairs += [(None, k) for k in range(len(model)) if k not in partner.values()]
    table = pd.DataFrame(
        {
            f"{name}_{side}": [_cell(source, pair[place], name) for pair in pairs]
            for place, (side, source) in enumerate((("experiment", measured), ("model", model)))
            for name in _PAIRED
        },
        dtype=np.float64,
    )
    begin = table["u_start_mm_experiment"].fillna(table["u_start_mm_model"])
    return table.iloc[np.argsort(begin.to_numpy(), kind="stable")].reset_index(drop=True)


def band_quantities(bands: pd.DataFrame, limit_mm: float, start_std_mm: float) -> Mapping[str, Quantity]:
    """Scalars of the bands that begin within a travel.

    Parameters
    ----------
    bands : DataFrame
        BAND_COLUMNS.
    limit_mm : float
        Travel that both sides have in common: bands that begin later are left out.
    start_std_mm : float
        Standard uncertainty of the travel at which a band begins; NaN unknown.
    """
    table = bands[bands["u_start_mm"] < limit_mm].sort_values("u_start_mm", kind="stable")
    starts = table["u_start_mm"].to_numpy(dtype=np.float64)
    two = len(table) > 1
    span = float(starts[-1] - starts[0]) if two else float("nan")
    life = Quantity(float(starts[1] - starts[0]), np.sqrt(2) * start_std_mm) if two else MISSING
    return {
        "bands_count": Quantity(float(len(table)), 0.0),
        "first_band_beta_deg": _of(table, 0, "beta_deg", "beta_std_deg"),
        "first_outcrop_x_mm": _of(table, 0, "outcrop_x_mm", "outcrop_std_mm"),
        "first_band_life_mm": life,
        "second_band_beta_deg": _of(table, 1, "beta_deg", "beta_std_deg"),
        "second_outcrop_x_mm": _of(table, 1, "outcrop_x_mm", "outcrop_std_mm"),
        "second_band_u_mm": Quantity(float(starts[1]), start_std_mm) if two else MISSING,
        "band_frequency": Quantity(
            (len(table) - 1) / span, np.sqrt(2) * start_std_mm * (len(table) - 1) / span**2
        )
        if two and span > 0
        else MISSING,
    }


def _of(table: pd.DataFrame, place: int, value: str, std: str) -> Quantity:
    if len(table) <= place:
        return MISSING
    return Quantity(float(table[value].iloc[place]), float(table[std].iloc[place]))


def _outer(measured: pd.DataFrame, model: pd.DataFrame, name: str) -> np.ndarray:
    return np.asarray(np.subtract.outer(measured[name].to_numpy(float), model[name].to_numpy(float)))


def _cell(table: pd.DataFrame, place: int | None, name: str) -> float:
    return float("nan") if place is None else float(table[name].iloc[place])
