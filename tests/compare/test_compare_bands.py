"""Bands paired one to one, gates kept, scalars read."""

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import BAND_COLUMNS
from ploughval.compare.bands.matching import band_quantities, match_bands


def bands(*rows):
    """Rows of (u_start, u_end, beta, outcrop)."""
    return pd.DataFrame(
        [(k, a, b, beta, 0.5, x, 1.0, 0.0) for k, (a, b, beta, x) in enumerate(rows, start=1)],
        columns=list(BAND_COLUMNS),
    ).astype({"beta_deg": float, "outcrop_x_mm": float})


def test_each_band_gets_its_nearest_and_each_only_one():
    measured = bands((0, 26, 30, 45), (26, 50, 24, 78), (50, 70, 22, 110))
    model = bands((0, 38, 20, 82), (38, 70, 14, 157))
    pairs = match_bands(measured, model, 30.0)
    partner = dict(zip(pairs["band_experiment"], pairs["band_model"], strict=True))
    assert partner[1] == 1
    # 26 and 50 are both 12 mm from 38; the outcrops 78 and 110 mm decide for the third band.
    assert partner[3] == 2
    assert np.isnan(partner[2])
    assert len(pairs) == 3


def test_more_pairs_are_preferred_to_nearer_ones():
    measured = bands((0, 10, 30, 50), (10, 20, 30, 60))
    model = bands((9, 15, 30, 55), (30, 40, 30, 65))
    pairs = match_bands(measured, model, 30.0)
    assert pairs[["band_experiment", "band_model"]].to_numpy().tolist() == [[1, 1], [2, 2]]


def test_gates_leave_strangers_alone():
    pairs = match_bands(bands((0, 10, 30, 50)), bands((31, 60, 30, 50)), 30.0)
    assert len(pairs) == 2
    assert pairs[["band_experiment", "band_model"]].isna().sum().tolist() == [1, 1]
    inside = match_bands(bands((0, 10, 30, 50)), bands((30, 60, 30, 50)), 30.0)
    assert len(inside) == 1


def test_an_unknown_outcrop_does_not_stop_a_pair_and_no_bands_no_pairs():
    assert len(match_bands(bands((0, 10, 30, np.nan)), bands((1, 10, 30, 50)), 30.0)) == 1
    assert match_bands(bands(), bands(), 30.0).empty
    assert len(match_bands(bands(), bands((0, 1, 2, 3)), 30.0)) == 1


def test_scalars_of_bands_within_the_travel():
    found = band_quantities(bands((0, 38, 20, 82), (38, 95, 14, 157), (95, 120, 13, 250)), 100.0, 0.3)
    assert found["bands_count"].value == 3
    assert found["first_band_beta_deg"] == (20.0, 0.5)
    assert found["first_outcrop_x_mm"] == (82.0, 1.0)
    assert found["first_band_life_mm"].value == 38.0
    assert found["second_outcrop_x_mm"].value == 157.0
    assert found["band_frequency"].value == pytest.approx(2 / 95)
    short = band_quantities(bands((0, 38, 20, 82), (38, 95, 14, 157)), 38.0, 0.3)
    assert short["bands_count"].value == 1
    assert np.isnan(short["band_frequency"].value)
