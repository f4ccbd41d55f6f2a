"""The force for the player: curves as many rows as a chart can show, and the values at each frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.report.player.coding import pack, zigzag
from ploughval.report.player.frames import Moment
from ploughval.report.stages import increment_at
from ploughval.report.thinning import thinned_rows
from ploughval.results import Results

_DIGITS = 1e-4  # of the greatest value: the step to which forces are rounded, at most
_BESIDE_MM = 0.1  # a frame so little beyond the ends of a history or a band has the value of the end

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Curve:
    """A curve as text: of each row a mark, then the differences of u and of the values to the row before.

    The mark is 1 where the curve begins anew after a gap, else 0. Differences are in ``steps`` (of u, of
    values), folded and one added; 0 is a value that is not known. ``kept`` of ``rows`` rows are in it.
    """

    steps: tuple[float, float]
    columns: int
    rows: int
    kept: int
    text: str


@dataclass(frozen=True, slots=True)
class Values:
    """What is known at a frame; NaN where it is not."""

    force_N: float
    force_std_N: float
    model_N: float
    beta_deg: float
    beta_std_deg: float
    model_beta_deg: float
    band: float
    model_band: float


def curve(table: pd.DataFrame, names: Sequence[str]) -> Curve:
    """A history for the chart.

    Parameters
    ----------
    table : DataFrame
        Columns u_mm, mm, and those that are named.
    names : sequence of str
        The first is what is drawn as a line, N; the others go with it.
    """
    u = table["u_mm"].to_numpy(dtype=np.float64)
    values = np.column_stack([table[name].to_numpy(dtype=np.float64) for name in names])
    rows = thinned_rows(u, values[:, 0])
    steps = (_step(u[rows]), _step(values[rows].ravel()))
    first = _breaks(rows, np.isfinite(u) & np.isfinite(values[:, 0]))
    places = np.round(np.column_stack([u[rows] / steps[0], values[rows] / steps[1]]))
    known = np.isfinite(places)
    filled = pd.DataFrame(places).ffill().fillna(0.0).to_numpy().astype(np.int64)
    moves = zigzag(np.diff(filled, axis=0, prepend=0)) + 1
    moves = np.where(known, moves, 0)
    numbers = np.column_stack([first.astype(np.int64), moves])
    return Curve(steps, len(names), len(table), len(rows), pack(numbers.ravel().tolist()))


def _breaks(rows: NDArray[np.int64], good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which kept rows follow on a row that is not known."""
    if not len(rows):
        return np.empty(0, bool)
    gaps = np.cumsum(~good)
    broken: NDArray[np.bool_] = np.r_[True, np.diff(gaps[rows]) > 0]
    return broken


def _step(values: Floats) -> float:
    """A power of ten that is fine enough for a chart, and its numbers short."""
    good = values[np.isfinite(values)]
    top = float(np.abs(good).max()) if good.size else 1.0
    return float(10.0 ** np.floor(np.log10(max(top, 1e-9) * _DIGITS)))


def values_at(results: Results, moments: Sequence[Moment]) -> list[Values]:
    """Forces, inclinations and bands at some frames."""
    own = results.table("force_frames.csv")
    rows = {} if own is None else {int(r["frame"]): r for r in own.to_dict("records")}
    found = []
    for moment in moments:
        u = moment.u_mm
        row = rows.get(moment.frame)
        if row is not None:
            force, std = float(row["force_N"]), float(row["force_std_N"])
        else:
            force, std = _at(results.force, u, "force_N"), _at(results.force, u, "force_std_N")
        beta, beta_std, middle = _inclination(results.increments, float("nan") if moment.reason else u)
        # A band steepens as the tip comes nearer: both sides are read at one travel.
        model_beta, _, _ = _inclination(results.model_force, middle if np.isfinite(middle) else u)
        found.append(
            Values(
                force, std, _at(results.model_force, u, "force_N"),
                beta, beta_std, model_beta, _band(results.bands, u), _band(results.model_bands, u),
            )
        )  # fmt: skip
    return found


def envelope_of(results: Results) -> pd.DataFrame | None:
    """Limits of the runs with drawn inputs, None without any."""
    table = results.table("force_envelope.csv")
    return table if table is not None and table["low_N"].notna().any() else None


def _at(table: pd.DataFrame | None, u_mm: float, name: str) -> float:
    """A column of a history at a travel, between its rows; NaN beyond them."""
    if table is None or not np.isfinite(u_mm):
        return float("nan")
    good = table[np.isfinite(table["u_mm"]) & np.isfinite(table[name])]
    u = good["u_mm"].to_numpy(dtype=np.float64)
    if not len(u) or not u.min() - _BESIDE_MM <= u_mm <= u.max() + _BESIDE_MM:
        return float("nan")
    order = np.argsort(u, kind="stable")
    return float(np.interp(u_mm, u[order], good[name].to_numpy(dtype=np.float64)[order]))


def _inclination(history: pd.DataFrame | None, u_mm: float) -> tuple[float, float, float]:
    """Inclination of the increment nearest to a travel with its std, degrees, and its middle, mm."""
    now = None if history is None or not np.isfinite(u_mm) else increment_at(history, u_mm)
    if now is None:
        return float("nan"), float("nan"), float("nan")
    middle = float(now["u_mm"]) + float(now.get("du_mm", 0.0)) / 2
    return float(now["beta_deg"]), float(now.get("beta_std_deg", float("nan"))), middle


def _band(bands: pd.DataFrame | None, u_mm: float) -> float:
    """Number of the latest band that is active at a travel."""
    if bands is None or not np.isfinite(u_mm):
        return float("nan")
    ends = bands["u_end_mm"].fillna(np.inf)
    active = bands[(bands["u_start_mm"] <= u_mm + 1e-6) & (ends >= u_mm - _BESIDE_MM)]
    return float(active.sort_values("u_start_mm")["band"].iloc[-1]) if len(active) else float("nan")
