"""Measured shear bands against the true ones: found once, missed, invented; coverage of their deviations."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.optimize import linear_sum_assignment

from ploughval.synth import Truth
from sequences.rows import Row

_GATE_DEPTHS = 0.5  # largest difference of outcrops between partners
_FORBIDDEN = 1e9


@dataclass(frozen=True, slots=True)
class BandMatch:
    """True and measured bands, one to one.

    Attributes
    ----------
    pairs : tuple of (int, int)
        Rows of the true and of the measured table.
    true, measured : DataFrame of BAND_COLUMNS
        True bands that live through at least one interval between photographs; all measured ones.
    """

    pairs: tuple[tuple[int, int], ...]
    true: pd.DataFrame
    measured: pd.DataFrame

    @property
    def missed(self) -> int:
        """True bands without a partner."""
        return len(self.true) - len(self.pairs)

    @property
    def invented(self) -> int:
        """Measured bands without a partner: invented, or found twice."""
        return len(self.measured) - len(self.pairs)


def match(measured: pd.DataFrame, truth: Truth) -> BandMatch:
    """Pair bands whose lives overlap and whose outcrops lie near each other."""
    frames_u = truth.blade["u_mm"].to_numpy()
    lives = [
        bool(np.any((frames_u[:-1] >= start - 1e-6) & (frames_u[1:] <= end + 1e-6)))
        for start, end in zip(truth.bands["u_start_mm"], truth.bands["u_end_mm"], strict=True)
    ]
    true = truth.bands[lives].reset_index(drop=True)
    measured = measured.reset_index(drop=True)
    gate = _GATE_DEPTHS * truth.options.depth_mm
    cost = np.full((len(true), len(measured)), _FORBIDDEN)
    for i, band in true.iterrows():
        for j, found in measured.iterrows():
            apart = np.nan_to_num(abs(found["outcrop_x_mm"] - band["outcrop_x_mm"]))
            common = min(found["u_end_mm"], band["u_end_mm"]) - max(found["u_start_mm"], band["u_start_mm"])
            if apart <= gate and common > 0:
                cost[i, j] = apart - common
    rows, columns = linear_sum_assignment(cost)
    pairs = [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if cost[i, j] < _FORBIDDEN]
    return BandMatch(tuple(pairs), true, measured)


def band_errors(results: Path, truth: Truth) -> list[Row]:
    """Shear bands against the true ones: counts, largest errors, coverage of the stated deviations."""
    found = match(pd.read_csv(results / "bands.csv"), truth)
    interval = float(np.median(np.diff(truth.blade["u_mm"])))
    rows = [
        Row("bands true", float(len(found.true)), "1"),
        Row("bands found", float(len(found.measured)), "1"),
        Row("bands missed", float(found.missed), "1", most=0),
        Row("bands invented", float(found.invented), "1", most=0),
    ]
    for name, quantity, unit, divisor, most in (
        ("u_start_mm", "start", "frame intervals", interval, 1.0),
        ("outcrop_x_mm", "outcrop", "mm", 1.0, 1.0),
        ("beta_deg", "beta", "degree", 1.0, 0.5),
    ):
        errors = [abs(found.measured[name][j] - found.true[name][i]) / divisor for i, j in found.pairs]
        worst = float(np.max(errors)) if errors else float("nan")
        rows.append(Row(f"bands, largest error of {quantity}", worst, unit, most=most))
    if (results / "increments.csv").is_file():
        rows += increment_errors(pd.read_csv(results / "increments.csv"), truth)
    return rows


def increment_errors(increments: pd.DataFrame, truth: Truth) -> list[Row]:
    """Inclination and outcrop of each increment against the truth, and coverage of their deviations."""
    active = increments[increments["band"] >= 0]
    true = true_increments(active, truth)
    rows = [Row("increments with a band", float(len(active)), "1")]
    for name, unit in (("beta", "degree"), ("outcrop", "mm")):
        value, std = ("beta_deg", "beta_std_deg") if name == "beta" else ("outcrop_x_mm", "outcrop_std_mm")
        error = np.abs(active[value].to_numpy() - true[value].to_numpy())
        sigma = active[std].to_numpy()
        known = np.isfinite(error) & (sigma > 0)
        rows.append(Row(f"{name} of increments, median |e|", _median(error[np.isfinite(error)]), unit))
        for word, times in (("one", 1), ("two", 2)):
            share = 100 * float((error[known] < times * sigma[known]).mean()) if known.any() else np.nan
            rows.append(Row(f"{name} of increments within {word} std", share, "%"))
    return rows


def true_increments(increments: pd.DataFrame, truth: Truth) -> pd.DataFrame:
    """True direction of each increment and outcrop half-way; NaN where the band changed within it."""
    motion = truth.motion
    rise = np.concatenate([[0.0], np.cumsum(motion.du_mm * np.tan(np.radians(motion.beta_deg)))])
    ends = np.concatenate([motion.u_mm, [motion.u_mm[-1] + motion.du_mm[-1]]])
    switches = truth.bands["u_start_mm"].to_numpy()
    rows = []
    for u, du in zip(increments["u_mm"], increments["du_mm"], strict=True):
        start, end = np.clip([u, u + du], 0.0, ends[-1])
        if np.any((switches > start + 1e-6) & (switches < end - 1e-6)) or end <= start:
            rows.append((np.nan, np.nan))
            continue
        beta = np.degrees(np.arctan2(np.interp(end, ends, rise) - np.interp(start, ends, rise), end - start))
        step = int(np.clip(np.searchsorted(ends, (start + end) / 2) - 1, 0, len(motion) - 1))
        rows.append((float(beta), float(motion.outcrop_x_mm[step])))
    return pd.DataFrame(rows, columns=["beta_deg", "outcrop_x_mm"])


def _median(values: np.ndarray) -> float:
    return float(np.median(values)) if len(values) else float("nan")
