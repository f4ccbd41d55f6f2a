"""Bands paired one to one, gates kept, what a record did not see left open, frequencies in their interval."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import BAND_COLUMNS
from ploughval.compare.bands.frequency import Spacings, frequency_ratio, spacings
from ploughval.compare.bands.matching import band_quantities, match_bands
from ploughval.compare.bands.metrics import band_metrics
from ploughval.compare.bands.observed import Window, observe
from ploughval.compare.bands.pairs import PAIR_COLUMNS
from ploughval.compare.case import Case
from ploughval.compare.ensemble import Ensemble
from ploughval.compare.inputs import Input
from ploughval.scene import Scene

LOOKS = np.arange(0.0, 101.0, 2.0)
MODEL = ((0, 38, 20, 82), (38, 95, 14, 157), (95, 120, 13, 250))


def bands(*rows, std=1.0):
    """Rows of (u_start, u_end, beta, outcrop)."""
    return pd.DataFrame(
        [(k, a, b, beta, 0.5, x, std, b - a) for k, (a, b, beta, x) in enumerate(rows, start=1)],
        columns=list(BAND_COLUMNS),
    ).astype(float)


def seen(*rows, last=100.0, first=0.0, std=1.0):
    return observe(bands(*rows, std=std), Window(first, last, LOOKS[(first <= LOOKS) & (last >= LOOKS)]))


@dataclass
class StandIn:
    """A model that has nothing but bands."""

    bands: pd.DataFrame
    end_mm: float = 100.0

    @property
    def force(self):
        return pd.DataFrame({"u_mm": [0.0, self.end_mm]})


def case(model, drawn=()):
    soil = {"unit_weight_kN_m3": 16.0, "peak_friction_deg": 50.0, "residual_friction_deg": 32.0}
    scene = Scene.model_validate(
        {"test": {"name": "t"}, "blade": {"depth_mm": 30.0, "width_mm": 218}, "soil": soil}
    )
    values = np.arange(float(len(drawn)))[:, None]
    inputs = (Input("peak_friction_deg", 50.0, 1.0, 0.0),)
    return Case(scene, model, Ensemble(inputs, values, tuple(drawn), model))


def compared(measured, model=MODEL, drawn=(), looks=LOOKS, calibration_std_mm=None):
    surface = pd.DataFrame({"u_mm": looks, "x_mm": 100.0})
    if calibration_std_mm is not None:
        surface = surface.assign(calibration_std_mm=calibration_std_mm)
    runs = [StandIn(bands(*one, std=0.0)) for one in drawn]
    metrics, pairs = band_metrics(case(StandIn(bands(*model, std=0.0)), runs), measured, [surface])
    return {metric.name: metric for metric in metrics}, pairs


def test_each_band_gets_its_nearest_and_each_only_one():
    measured = seen((0, 26, 30, 45), (26, 50, 24, 78), (50, 70, 22, 110))
    model = seen((0, 38, 20, 82), (38, 70, 14, 157))
    pairs = match_bands(measured, model, 30.0)
    partner = dict(zip(pairs["band_experiment"], pairs["band_model"], strict=True))
    assert partner[1] == 1
    # 26 and 50 are both 12 mm from 38; the outcrops 78 and 110 mm decide for the third band.
    assert partner[3] == 2
    assert np.isnan(partner[2])
    assert len(pairs) == 3


def test_more_pairs_are_preferred_to_nearer_ones():
    pairs = match_bands(
        seen((0, 10, 30, 50), (10, 20, 30, 60)), seen((9, 15, 30, 55), (30, 40, 30, 65)), 30.0
    )
    assert pairs[["band_experiment", "band_model"]].to_numpy().tolist() == [[1, 1], [2, 2]]


def test_gates_leave_strangers_alone():
    pairs = match_bands(seen((0, 10, 30, 50)), seen((31, 60, 30, 50)), 30.0)
    assert len(pairs) == 2
    assert pairs[["band_experiment", "band_model"]].isna().sum().tolist() == [1, 1]
    assert len(match_bands(seen((0, 10, 30, 50)), seen((30, 60, 30, 50)), 30.0)) == 1


def test_a_place_that_is_hardly_known_decides_less():
    # The start says the second, the outcrop says the first; which of them is known decides.
    measured = ((20, 30, 30, 60),)
    model = seen((5, 20, 30, 62), (22, 40, 30, 100), std=0.0)
    sharp = match_bands(seen(*measured, std=0.1), model, 30.0)
    vague = match_bands(seen(*measured, std=60.0), model, 30.0)
    partner = [float(t.loc[t["band_experiment"] == 1, "band_model"].iloc[0]) for t in (sharp, vague)]
    # Squares: 15 mm of 10 and 2 of 30 against 2 of 10 and 40 of 30; with 60 mm the last shrinks.
    assert 1.5**2 + (2 / 30) ** 2 > 0.2**2 + (40 / 30) ** 2
    assert partner == [2, 2]
    near = seen((9, 20, 30, 62), (22, 40, 30, 100), std=0.0)
    sharp = match_bands(seen(*measured, std=0.1), near, 30.0)
    vague = match_bands(seen(*measured, std=60.0), near, 30.0)
    partner = [float(t.loc[t["band_experiment"] == 1, "band_model"].iloc[0]) for t in (sharp, vague)]
    assert partner == [1, 2]


def test_an_unknown_outcrop_does_not_stop_a_pair_and_no_bands_no_pairs():
    assert len(match_bands(seen((0, 10, 30, np.nan)), seen((1, 10, 30, 50)), 30.0)) == 1
    assert match_bands(seen(), seen(), 30.0).empty
    assert len(match_bands(seen(), seen((0, 1, 2, 3)), 30.0)) == 1


def test_scalars_of_a_record():
    found = band_quantities(seen(*MODEL[:2], (95, 100, 13, 250)))
    assert found["bands_count"].value == 3
    assert found["first_band_beta_deg"] == (20.0, 0.5)
    assert found["first_outcrop_x_mm"] == (82.0, 1.0)
    assert found["first_band_life_mm"].value == 38.0
    assert found["second_outcrop_x_mm"].value == 157.0


def test_a_band_that_the_record_ends_in_has_no_life_and_no_slip():
    table = seen((0, 38, 20, 82), (38, 100, 14, 157))
    assert table["complete"].tolist() == [1, 0]
    assert table["life_mm"].tolist()[0] == 38.0
    assert table.loc[1, ["u_end_mm", "life_mm", "slip_mm", "start_spacing_mm"]].isna().all()
    assert band_quantities(seen((0, 100, 20, 82)))["first_band_life_mm"].value != 100.0


def test_a_band_active_at_a_late_first_look_has_no_start():
    table = seen((20, 38, 20, 82), (38, 90, 14, 157), first=20.0)
    assert np.isnan(table["u_start_mm"].iloc[0])
    assert np.isnan(table["life_mm"].iloc[0])
    assert table["u_end_mm"].tolist() == [38.0, 90.0]
    # The model's bands that ended before that look are no part of the comparison.
    late = LOOKS[LOOKS >= 50]
    metrics, pairs = compared(bands((50, 95, 14, 156), (95, 100, 13, 249)), looks=late)
    assert metrics["bands_unmatched_count"].model == 0
    assert pairs["band_model"].tolist() == [2, 3]


def test_a_band_that_starts_before_the_travel_is_zero_is_matched_and_its_life_counts_from_there():
    metrics, pairs = compared(bands((-0.4, 37, 20, 82), (37, 100, 14, 157)), MODEL[:2])
    assert metrics["bands_matched_count"].experiment == 2
    assert pairs["u_start_mm_difference"].iloc[0] == pytest.approx(0.4)
    assert metrics["first_band_life_mm"].experiment == pytest.approx(37.4)


def test_a_band_found_in_two_pieces_is_one():
    split = bands((0, 20, 20, 82.0), (20, 38, 30, 83.5), (38, 100, 14, 157))
    metrics, pairs = compared(split, MODEL[:2])
    assert metrics["bands_count"].experiment == 2
    assert metrics["bands_unmatched_count"].experiment == 0
    assert metrics["first_band_life_mm"].error == pytest.approx(0.0)
    assert pairs["joined_experiment"].tolist() == [2, 1]
    assert "1 pieces were joined" in metrics["bands_matched_count"].note
    # 12 mm further out (1.4 mm is what both stds leave) is a band of its own.
    apart = bands((0, 20, 20, 82.0), (20, 38, 25, 94.0), (38, 100, 14, 157))
    assert compared(apart, MODEL[:2])[0]["bands_count"].experiment == 3


def test_starts_half_way_between_looks_are_rectangles_and_others_are_placed():
    stds = Window(0.0, 100.0, LOOKS).start_std_mm(np.array([5.0, 5.3]))
    np.testing.assert_allclose(stds, [2.0 / np.sqrt(12), 0.2])


def test_mean_and_rms_differences_over_all_pairs():
    measured = bands((0, 36, 21, 80), (36, 92, 16, 153), (92, 100, 12, 246))
    metrics, pairs = compared(measured)
    # Model minus experiment: starts 2 and 3 mm (the first begins with the motion), outcrops 2, 4, 4.
    assert metrics["band_start_mean_mm"].error == pytest.approx(2.5)
    assert metrics["band_start_rms_mm"].error == pytest.approx(np.sqrt((4 + 9) / 2))
    assert metrics["band_outcrop_mean_mm"].error == pytest.approx(10 / 3)
    assert metrics["band_outcrop_rms_mm"].error == pytest.approx(np.sqrt(36 / 3))
    assert metrics["band_beta_mean_deg"].error == pytest.approx((-1 - 2 + 1) / 3)
    # Three outcrops known to 1 mm each; numerics are a thousandth of the place.
    assert metrics["band_outcrop_mean_mm"].experiment_std == pytest.approx(1 / np.sqrt(3))
    assert metrics["band_outcrop_mean_mm"].numerical_std == pytest.approx((0.082 + 0.157 + 0.25) / 3)
    # Ahead of the blade at the start: 80, 117, 154 against 82, 119, 155.
    assert metrics["band_ahead_mean_mm"].error == pytest.approx((2 + 2 + 1) / 3)
    # Lives 36, 56 against 38, 57; the third is cut.
    assert metrics["band_life_mean_mm"].error == pytest.approx(1.5)
    assert metrics["band_outcrop_spacing_mean_mm"].error == pytest.approx((2 + 0) / 2)
    assert tuple(pairs.columns) == PAIR_COLUMNS
    assert pairs["life_mm_difference"].tolist()[:2] == [2.0, 1.0]
    assert np.isnan(pairs["life_mm_difference"].iloc[2])


def test_calibration_moves_all_outcrops_together():
    measured = bands((0, 36, 21, 80), (36, 92, 16, 153), (92, 100, 12, 246))
    metrics, _ = compared(measured, calibration_std_mm=0.7)
    assert metrics["band_outcrop_mean_mm"].experiment_std == pytest.approx(np.hypot(1 / np.sqrt(3), 0.7))
    assert metrics["first_outcrop_x_mm"].experiment_std == pytest.approx(np.hypot(1.0, 0.7))
    # Two spacings, of three outcrops: the mean is a half of third less first.
    assert metrics["band_outcrop_spacing_mean_mm"].experiment_std == pytest.approx(np.sqrt(2.0) / 2)


def test_inputs_spread_every_quantity_of_every_band():
    drawn = [((0, 38 + d, 20, 82 + d), (38 + d, 95, 14, 157 - 2 * d), (95, 120, 13, 250)) for d in (-2, 2)]
    measured = bands((0, 36, 21, 80), (36, 92, 16, 153), (92, 100, 12, 246))
    metrics, _ = compared(measured, drawn=drawn)
    assert metrics["first_outcrop_x_mm"].input_std == pytest.approx(2.0)
    assert metrics["second_outcrop_x_mm"].input_std == pytest.approx(4.0)
    # The mean of both moves by (d - 2 d + 0) / 3.
    assert metrics["band_outcrop_mean_mm"].input_std == pytest.approx(2 / 3)
    assert metrics["band_outcrop_rms_mm"].input_std == pytest.approx(np.sqrt((4 + 16) / 3))


@pytest.mark.parametrize("measured", [(), ((0, 100, 20, 82),)])
@pytest.mark.parametrize("model", [(), ((0, 120, 20, 84),)])
def test_no_bands_or_one_on_either_side_is_counted_and_nothing_is_invented(measured, model):
    metrics, pairs = compared(bands(*measured), model)
    assert metrics["bands_count"].experiment == len(measured)
    assert metrics["bands_count"].model == len(model)
    assert len(pairs) == max(len(measured), len(model))
    assert "band_frequency_ratio" not in metrics
    assert not [name for name in metrics if "life" in name and metrics[name].agrees is not None]


def test_a_band_that_has_hardly_begun_counts_on_neither_side():
    model = (MODEL[0], (38, 98.5, 14, 157), (98.5, 120, 13, 250))
    metrics, _ = compared(bands((0, 38, 20, 82), (38, 100, 14, 157)), model)
    assert metrics["bands_count"].error == 0
    assert metrics["bands_unmatched_count"].model == 0
    # The looks are 2 mm apart and end at 100 mm: at 97.5 it has to be seen.
    metrics, _ = compared(bands((0, 38, 20, 82), (38, 100, 14, 157)), (*MODEL[:2], (97.5, 120, 13, 250)))
    assert metrics["bands_count"].error == 1


def test_two_photographs_show_the_band_that_is_there_from_the_first():
    """Whether blade's noise makes the first travel a little more or less than 0 decides nothing."""
    for first in (-0.01, 0.0, 0.01):
        looks = np.array([first, 6.0])
        metrics, _ = compared(bands((first, 6.0, 21, 82)), looks=looks)
        assert (metrics["bands_count"].experiment, metrics["bands_count"].model) == (1, 1)
        assert metrics["bands_matched_count"].experiment == 1


def test_a_mean_life_is_as_well_known_as_its_ends():
    """Lives that follow each other: 30 draws of the starts of four bands, read anew, are the truth."""
    rng = np.random.default_rng(0)
    whole = np.array([0.0, 20.0, 44.0, 70.0])
    means = []
    for _ in range(400):
        a, b, c, d = whole + rng.normal(0, 0.2, 4)  # a tenth of the interval of 2 mm
        means.append(np.mean([b - a, c - b, d - c]))
    rows = [
        (x, y, 20 - k, 80 + 40 * k) for k, (x, y) in enumerate(zip(whole, [*whole[1:], 100.0], strict=True))
    ]
    metrics, _ = compared(bands(*rows), model=rows)
    assert metrics["band_life_mean_mm"].experiment_std == pytest.approx(np.std(means), rel=0.1)
    assert metrics["band_start_spacing_mean_mm"].experiment_std == pytest.approx(np.std(means), rel=0.1)


@pytest.mark.parametrize("ratio", [0.3, 0.999999, 1.0, 1.2, 3.0])
def test_the_verdict_on_the_frequency_is_that_of_its_logarithm(ratio):
    """A third as often is as far from equal as three times as often."""
    model = np.array([20.0, 24.0, 30.0])
    found = frequency_ratio(Spacings(ratio * model * [0.9, 1.0, 1.1], np.nan), Spacings(model, np.nan))
    assert (abs(found.value - 1) <= 2 * found.std) == (abs(np.log(found.value)) <= 2 * found.ln_std)
    turned = frequency_ratio(Spacings(model, np.nan), Spacings(ratio * model * [0.9, 1.0, 1.1], np.nan))
    assert (turned.value - 1) / turned.std == pytest.approx(-np.log(found.value) / found.ln_std, rel=1e-6)


def test_unmatched_bands_are_named_with_their_place():
    metrics, _ = compared(bands((0, 26, 30, 45), (26, 50, 24, 78), (50, 100, 22, 110)), MODEL[:2])
    assert metrics["bands_unmatched_count"].experiment == 1
    assert metrics["bands_unmatched_count"].note.endswith("starting at u: experiment 26 mm")


def test_one_whole_spacing_leaves_the_frequency_open_and_equal_ones_close_it():
    one = frequency_ratio(Spacings(np.array([36.0]), 24.0), Spacings(np.array([38.0]), 22.0))
    assert one.value == pytest.approx(36 / 38)
    assert one.low < 0.5 < 2.0 < one.high
    whole = np.array([20.0, 30.0, 35.0, 40.0])
    four = frequency_ratio(Spacings(1.3 * whole, 10.0), Spacings(whole, 20.0))
    assert four.value == pytest.approx(1.3, rel=1e-3)
    assert 1.3 / 1.2 < four.low < four.high < 1.3 * 1.2


def test_a_cut_spacing_that_is_longer_than_the_models_whole_one_raises_the_ratio():
    model = Spacings(np.array([20.0, 20.0]), 5.0)
    whole = Spacings(np.array([20.0]), 10.0)
    longer = Spacings(np.array([20.0]), 40.0)
    assert frequency_ratio(longer, model).value > 1.1 * frequency_ratio(whole, model).value
    assert np.isnan(frequency_ratio(Spacings(np.empty(0), 50.0), model).value)


@pytest.mark.parametrize("scatter", [0.1, 0.2, 0.4])
@pytest.mark.parametrize("travel_depths", [2.2, 4.0, 8.0])
def test_the_interval_of_the_frequency_ratio_covers(scatter, travel_depths):
    """600 records of a known ratio: 95 % would be 570; fewer than 540 (90 %) are refused."""
    rng = np.random.default_rng(1)
    model = np.array([1.29, 1.98, 2.5, 3.0, 3.4, 3.8])
    inside = seen_any = 0
    for _ in range(600):
        truth = np.exp(rng.uniform(-0.5, 0.5))
        whole = model * truth * np.exp(scatter * rng.standard_normal(model.size))
        starts = [np.append(0.0, np.cumsum(one)) for one in (whole, model)]
        found = frequency_ratio(*(spacings(one, travel_depths) for one in starts))
        seen_any += found.pairs > 0
        inside += found.low <= truth <= found.high
    assert inside >= 0.9 * seen_any
