"""The model's force with what its inputs leave open, as a table for files and figures."""

import numpy as np
import pandas as pd

from ploughval.compare.force.history import Histories

ENVELOPE_COLUMNS = ("u_mm", "force_N", "input_std_N", "low_N", "high_N")
_LIMITS = (2.5, 97.5)  # percent
_MOST_ROWS = 600


def envelope_table(histories: Histories) -> pd.DataFrame:
    """Force of the run with the stated inputs and the limits that hold 95 % of the draws, by travel.

    Parameters
    ----------
    histories : Histories
        The model's with drawn inputs at even travels.

    Returns
    -------
    DataFrame of ENVELOPE_COLUMNS
        Horizontal force, as load cells measure it; limits are NaN without draws.
    """
    picked = np.unique(np.linspace(0, histories.u_mm.size - 1, _MOST_ROWS).round().astype(int))
    low, high = np.full((2, picked.size), np.nan)
    if len(histories.drawn):
        drawn = histories.drawn[:, picked]
        known = np.isfinite(drawn).mean(axis=0) >= 0.5
        low[known], high[known] = np.nanpercentile(drawn[:, known], _LIMITS, axis=0)
    return pd.DataFrame(
        {
            "u_mm": histories.u_mm[picked],
            "force_N": histories.model[picked],
            "input_std_N": histories.input_std[picked],
            "low_N": low,
            "high_N": high,
        }
    )
