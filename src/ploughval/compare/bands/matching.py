"""Measured against predicted shear bands: matched one to one, and described by a few scalars."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from ploughval.compare.bands.observed import QUANTITIES
from ploughval.compare.quantity import MISSING, Quantity

Floats = NDArray[np.float64]
START_GATE_DEPTHS = 1.0
OUTCROP_GATE_DEPTHS = 3.0
_GATE_STDS = 3.0  # a gate is so many standard deviations of what a model may miss a place by
_FORBIDDEN = 1e6


def match_bands(
    measured: pd.DataFrame,
    model: pd.DataFrame,
    depth_mm: float,
    *,
    start_gate: float = START_GATE_DEPTHS,
    outcrop_gate: float = OUTCROP_GATE_DEPTHS,
) -> pd.DataFrame:
    """Pair bands so that as many as possible match and their places differ least.

    docs/theory-comparison-lines.md, Eq. (2).

    The cost of a pair is the sum of the squared differences of start and outcrop (mm), each over its
    variance (mm2): of both sides' uncertainty, and of a third of the gate, by which a model may be off.

    Parameters
    ----------
    measured : DataFrame
        Of the experiment, as ``observe`` gives it.
    model : DataFrame
        Of the model, likewise.
    depth_mm : float
        Depth of the tip.
    start_gate : float
        Largest difference of u_start_mm between partners, depths; an unknown start passes.
    outcrop_gate : float
        Largest difference of outcrop_x_mm between partners, depths; an unknown outcrop passes.

    Returns
    -------
    DataFrame
        band, joined, complete, calibration_std_mm and the QUANTITIES with their standard uncertainties, each
        with the ending _experiment and _model, in order of start; a band without a partner has NaN on the
        other side.
    """
    cost, allowed = np.zeros((len(measured), len(model))), np.ones((len(measured), len(model)), dtype=bool)
    for name, gate in (("u_start_mm", start_gate * depth_mm), ("outcrop_x_mm", outcrop_gate * depth_mm)):
        apart = np.subtract.outer(measured[name].to_numpy(float), model[name].to_numpy(float))
        stds = [np.nan_to_num(side[f"{name}_std"].to_numpy(float)) for side in (measured, model)]
        variance = np.add.outer(stds[0] ** 2, stds[1] ** 2) + (gate / _GATE_STDS) ** 2
        cost += np.nan_to_num(apart**2 / variance)
        allowed &= ~(np.abs(apart) > gate)
    rows, columns = linear_sum_assignment(np.where(allowed, cost, _FORBIDDEN))
    kept = allowed[rows, columns]
    partner = dict(zip(rows[kept].tolist(), columns[kept].tolist(), strict=True))
    pairs: list[tuple[int | None, int | None]] = [(k, partner.get(k)) for k in range(len(measured))]
    pairs += [(None, k) for k in range(len(model)) if k not in partner.values()]
    table = pd.DataFrame(
        {
            f"{name}_{side}": [_cell(source, pair[place], name) for pair in pairs]
            for place, (side, source) in enumerate((("experiment", measured), ("model", model)))
            for name in source.columns
        },
        dtype=np.float64,
    )
    begin = table["u_start_mm_experiment"].fillna(table["u_start_mm_model"])
    return table.iloc[np.argsort(begin.to_numpy(), kind="stable")].reset_index(drop=True)


def band_quantities(bands: pd.DataFrame) -> Mapping[str, Quantity]:
    """Scalars of the first two bands of a record.

    Parameters
    ----------
    bands : DataFrame
        As ``observe`` gives it.

    Returns
    -------
    mapping of str to Quantity
        Their number, and inclination, outcrop, start and life; missing where the record does not show them.
    """
    return {
        "bands_count": Quantity(float(len(bands)), 0.0),
        "first_band_beta_deg": quantity(bands, 0, "beta_deg"),
        "first_outcrop_x_mm": quantity(bands, 0, "outcrop_x_mm"),
        "first_band_life_mm": quantity(bands, 0, "life_mm"),
        "second_band_beta_deg": quantity(bands, 1, "beta_deg"),
        "second_outcrop_x_mm": quantity(bands, 1, "outcrop_x_mm"),
        "second_band_u_mm": quantity(bands, 1, "u_start_mm"),
    }


def numbered(bands: pd.DataFrame) -> dict[str, float]:
    """All quantities of all bands of a record, by name and number: ``beta_deg/0``."""
    columns = {name: bands[name].to_numpy(dtype=np.float64) for name in QUANTITIES}
    return {f"{name}/{place}": float(value) for name, c in columns.items() for place, value in enumerate(c)}


def quantity(bands: pd.DataFrame, place: int, name: str) -> Quantity:
    """A quantity of the band at a place of a table of ``observe``; a place has its calibration's part."""
    if len(bands) <= place:
        return MISSING
    std = float(bands[f"{name}_std"].to_numpy()[place])
    if name in ("outcrop_x_mm", "ahead_mm"):
        std = float(np.hypot(std, np.nan_to_num(bands["calibration_std_mm"].to_numpy()[place])))
    return Quantity(float(bands[name].to_numpy()[place]), std)


def _cell(table: pd.DataFrame, place: int | None, name: str) -> float:
    return float("nan") if place is None else float(table[name].iloc[place])
