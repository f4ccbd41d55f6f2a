"""Shear bands as a record shows them: pieces of one band joined, ends that nobody saw left open."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Floats = NDArray[np.float64]
QUANTITIES = (
    "u_start_mm", "u_end_mm", "life_mm", "beta_deg", "outcrop_x_mm", "ahead_mm", "slip_mm",
    "start_spacing_mm", "outcrop_spacing_mm",
)  # fmt: skip
_JOIN_STDS = 2.0  # two outcrops that lie nearer to each other than this are one
# of an interval: std of a start that the sand between two bands places (docs/theory-bands.md, section 7)
_PLACED = 0.1
_HALFWAY = 1e-3  # of an interval


@dataclass(frozen=True, slots=True)
class Window:
    """Travel that a record covers.

    Attributes
    ----------
    first_mm, last_mm : float
        Travel of the blade at the record's first and last look.
    looks_mm : (F,) float
        Travel at every look, in order; empty for the model, which looks all the time.
    """

    first_mm: float
    last_mm: float
    looks_mm: Floats

    @property
    def interval_mm(self) -> float:
        """Travel between two looks, mm; 0 where the record has no gaps, NaN for a single look."""
        if self.looks_mm.size == 0:
            return 0.0
        return float(np.median(np.diff(self.looks_mm))) if self.looks_mm.size > 1 else float("nan")

    @property
    def late(self) -> bool:
        """Whether the first look came when the blade had moved on: a band active then had started before."""
        return self.first_mm > self.slack_mm

    @property
    def slack_mm(self) -> float:
        """Travel within which two places of a record are one, mm."""
        return 0.5 * self.interval_mm + 1e-9 * max(abs(self.last_mm), 1.0)

    def start_std_mm(self, starts_mm: Floats) -> Floats:
        """Standard uncertainty of the travel at which bands start or end, mm.

        The sand between an old and a new band tells when within an interval the new one took over. Where it
        could not, the start stands half-way between two looks, and is anywhere between them.
        """
        if self.looks_mm.size == 0:
            return np.zeros(starts_mm.shape)
        if self.looks_mm.size == 1:
            return np.full(starts_mm.shape, np.nan)
        after = np.clip(np.searchsorted(self.looks_mm, starts_mm), 1, self.looks_mm.size - 1)
        begin, width = self.looks_mm[after - 1], self.looks_mm[after] - self.looks_mm[after - 1]
        halfway = np.abs((starts_mm - begin) / width - 0.5) < _HALFWAY
        return np.asarray(np.where(halfway, 1.0 / np.sqrt(12.0), _PLACED) * width)


def observe(bands: pd.DataFrame, window: Window) -> pd.DataFrame:
    """Describe the bands that are active within a record.

    Parameters
    ----------
    bands : DataFrame
        BAND_COLUMNS; ``calibration_std_mm`` of the outcrops where that is known.
    window : Window
        What the record covers.

    Returns
    -------
    DataFrame
        ``band``, ``joined`` (pieces that it was found in), ``complete`` (1: its end was seen), the
        QUANTITIES, each with its standard uncertainty (ending ``_std``), and ``calibration_std_mm``, in
        order of start. ``ahead_mm``: from the blade to the outcrop at the start; the spacings: to the next
        band. What the record did not see (a start before its first look, an end after its last, and what
        follows from them) is NaN.
    """
    table = bands.sort_values("u_start_mm", kind="stable")
    table = table[(table["u_start_mm"] < window.last_mm) & ~(table["u_end_mm"] <= window.first_mm)]
    table = _joined(table.assign(joined=1).reset_index(drop=True), window)
    value = {name: table[name].to_numpy(dtype=np.float64) for name in bands.columns if name != "band"}
    slack = np.nan_to_num(window.slack_mm)
    seen = ~((value["u_start_mm"] <= window.first_mm + slack) & window.late)
    start = np.where(seen, value["u_start_mm"], np.nan)
    follows = np.arange(len(table)) < len(table) - 1
    complete = follows | (value["u_end_mm"] < window.last_mm - 3.0 * slack)
    end = np.where(complete, value["u_end_mm"], np.nan)
    outcrop, beta_std = value["outcrop_x_mm"], np.nan_to_num(value["beta_std_deg"])
    place_std = np.nan_to_num(value["outcrop_std_mm"])
    slip = np.where(seen & complete, value["slip_mm"], np.nan)
    start_std, end_std = window.start_std_mm(value["u_start_mm"]), window.start_std_mm(value["u_end_mm"])
    both = np.hypot(start_std, end_std)
    beta = np.radians(value["beta_deg"])
    slip_std = np.hypot(both / np.cos(beta), slip * np.tan(beta) * np.radians(beta_std))
    columns: dict[str, tuple[Floats, Floats]] = {
        "u_start_mm": (start, start_std),
        "u_end_mm": (end, end_std),
        "life_mm": (end - start, both),
        "beta_deg": (np.where(seen, value["beta_deg"], np.nan), beta_std),
        "outcrop_x_mm": (outcrop, place_std),
        "ahead_mm": (outcrop - start, np.hypot(place_std, start_std)),
        "slip_mm": (slip, slip_std),
        "start_spacing_mm": (_to_next(start), np.hypot(start_std, _next(start_std))),
        "outcrop_spacing_mm": (_to_next(outcrop), np.hypot(place_std, _next(place_std))),
    }
    out = {"band": table["band"], "joined": table["joined"], "complete": complete.astype(np.int64)}
    for name, (values, std) in columns.items():
        out[name] = values
        out[f"{name}_std"] = np.where(np.isfinite(values), std, np.nan)
    out["calibration_std_mm"] = value.get("calibration_std_mm", np.zeros(len(table)))
    return pd.DataFrame(out)


def _joined(table: pd.DataFrame, window: Window) -> pd.DataFrame:
    """Pieces that follow each other and come out at one place, as one band: a fresh band jumps ahead."""
    rows: list[dict[str, float]] = []
    for record in table.to_dict("records"):
        row = {str(name): value for name, value in record.items()}
        before = rows[-1] if rows else None
        if before is not None and _same(before, row, window):
            before["u_end_mm"] = row["u_end_mm"]
            before["slip_mm"] += row["slip_mm"]
            before["joined"] += 1
        else:
            rows.append(row)
    return pd.DataFrame(rows, columns=table.columns)


def _same(before: dict[str, float], row: dict[str, float], window: Window) -> bool:
    std = np.hypot(np.nan_to_num(before["outcrop_std_mm"]), np.nan_to_num(row["outcrop_std_mm"]))
    apart = abs(row["outcrop_x_mm"] - before["outcrop_x_mm"])
    return bool(
        apart <= _JOIN_STDS * std and row["u_start_mm"] <= before["u_end_mm"] + 1.5 * window.interval_mm
    )


def _next(values: Floats) -> Floats:
    return np.append(values[1:], np.nan)[: len(values)]


def _to_next(values: Floats) -> Floats:
    return np.asarray(_next(values) - values)
