"""The study of the mobilised friction counts what it says."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from study_mobilised import by_band, row_coverage, softening_coverage, true_friction

SOIL = SimpleNamespace(peak_friction_deg=44.0, residual_friction_deg=32.0, mobilization_length_mm=2.0)


def test_true_friction_falls_straight_to_the_residual():
    truth = SimpleNamespace(options=SimpleNamespace(soil=SOIL))
    np.testing.assert_allclose(true_friction(np.array([0.0, 0.5, 2.0, 9.0]), truth), [44.0, 41.0, 32.0, 32.0])


def rows():
    """Two bands: one of four rows, one of two, of which the first is off by three stds."""
    table = pd.DataFrame({"test": "000", "band": [0, 0, 0, 0, 1, 1], "phi_std_deg": 0.5})
    slip = [0.5, 0.9, 2.0, 3.0, 0.5, 3.0]
    return table.assign(
        error_deg=[0.1, -0.1, 0.1, -0.1, 1.5, 0.1], true_slip_mm=slip, slip_mm=slip, slip_error_mm=0.01,
        slip_std_mm=[0.02] * 4 + [0.001] * 2,
    )  # fmt: skip


def test_bands_count_alike_whatever_their_rows():
    found = {line["quantity"]: line for line in row_coverage(rows())}
    assert found["phi, all rows"]["covered_95"] == pytest.approx(0.75)
    assert found["phi, slip up to 1 mm"]["covered_95"] == pytest.approx(0.5)
    assert found["phi, slip beyond 1 mm"]["covered_95"] == pytest.approx(1.0)
    assert found["slip at a band's start"]["covered_95"] == pytest.approx(0.5)
    assert found["phi, all rows"]["count"] == 2


def test_rows_of_a_band_are_summed_up():
    table = by_band(rows()).set_index("band")
    assert table.loc[0, "rows"] == 4
    assert table.loc[1, "covered"] == pytest.approx(0.5)
    assert table.loc[1, "rms_z"] == pytest.approx(np.sqrt((9 + 0.04) / 2))


def test_limits_that_hold_the_truth_are_counted_and_what_is_not_determined_apart():
    table = pd.DataFrame({"test": ["000", "000", "000", "001"], "band": ["0", "1", "all", "0"]})
    for what, unit in (("peak", "deg"), ("residual", "deg"), ("length", "mm")):
        table[f"{what}_{unit}"] = [10.0, np.nan, 10.0, 12.0]
        table[f"{what}_std_{unit}"], table[f"true_{what}_{unit}"] = 0.5, 10.2
        table[f"{what}_low_{unit}"] = table[f"{what}_{unit}"] - 1.0
        table[f"{what}_high_{unit}"] = table[f"{what}_{unit}"] + 1.0
    found = {line["quantity"]: line for line in softening_coverage(table)}
    one, test = found["peak, one band"], found["length, a test"]
    assert (one["count"], one["not_determined"], one["covered_95"]) == (2, 1, pytest.approx(0.5))
    assert (test["count"], test["not_determined"], test["covered_95"]) == (2, 0, pytest.approx(0.5))
    assert test["mean_error"] == pytest.approx(0.8)
