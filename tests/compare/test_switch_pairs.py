"""Matched switches of made histories whose differences are known, and what is left when they coincide."""

import numpy as np
import pandas as pd
import pytest

from ploughval.compare.ensemble import Ensemble
from ploughval.compare.force.alignment import aligned_u, log_stretch
from ploughval.compare.force.curve import Curve, Shared, model_curve
from ploughval.compare.force.envelope import envelope_table
from ploughval.compare.force.history import common_histories, history_metrics
from ploughval.compare.force.pairs import Pairs, match_places, match_switches, pair_metrics, pair_table
from ploughval.compare.force.reading import read_force
from ploughval.compare.inputs import Input

U = np.array([0.0, 1.0, 38.0, 39.0, 95.0, 96.0, 110.0])
F = np.array([10.0, 5.0, 18.0, 8.0, 26.0, 12.0, 14.0])
DEPTH = 30.0


def reading(stretch=1.0, scale=1.0, limit=100.0):
    curve = model_curve(pd.DataFrame({"u_mm": U * stretch, "force_N": F * scale}), 0.0)
    return read_force(curve.until(limit), 1.0, DEPTH)


def matched(measured, model, drawn=()):
    return match_switches(measured, model, drawn, depth_mm=DEPTH, tolerance=1e-3)


def ensemble(drawn):
    """Draws of one input; their histories are not looked at here."""
    values = np.linspace(-1, 1, len(drawn))[:, None]
    return Ensemble((Input("unit_weight_kN_m3", 16.0, 0.5, 0.0),), values, tuple(drawn), None)


def test_as_many_as_possible_match_in_order_and_the_rest_is_alone():
    assert match_places(np.array([38.0, 98.0]), np.array([25.0, 60.0, 90.0]), 30.0) == ((0, 0), (1, 2))
    # Two and two within the gate: first to first, though the second lies nearer to the first.
    assert match_places(np.array([10.0, 30.0]), np.array([28.0, 55.0]), 30.0) == ((0, 0), (1, 1))
    assert match_places(np.array([10.0]), np.array([50.0]), 30.0) == ()
    assert match_places(np.empty(0), np.array([50.0]), 30.0) == ()


def test_differences_of_matched_switches_are_those_that_were_made():
    measured, model = reading(), reading(1.05, 1.1, limit=104.0)
    pairs = matched(measured, model)
    found = {metric.name: metric for metric in pair_metrics(pairs, ensemble([]))}
    assert found["switches_matched_count"].experiment == 2
    assert found["switch_u_mean_mm"].error == pytest.approx(0.05 * (38 + 95) / 2)
    assert found["switch_u_rms_mm"].error == pytest.approx(0.05 * np.sqrt((38**2 + 95**2) / 2))
    assert found["switch_force_mean_N"].error == pytest.approx(0.1 * (18 + 26) / 2)
    assert found["switch_drop_rms_N"].error == pytest.approx(0.1 * np.sqrt((10**2 + 14**2) / 2))
    assert found["switch_spacing_mean_mm"].error == pytest.approx(0.05 * 57)
    table = pair_table(pairs, measured, model)
    assert table["switch_model"].tolist() == [1.0, 2.0]
    np.testing.assert_allclose(table["u_mm_error"], [0.05 * 38, 0.05 * 95])
    assert np.isnan(table["spacing_mm_error"][0])
    assert table["u_mm_agrees"].tolist() == [False, False]


def test_a_switch_without_partner_stands_in_the_table_alone():
    measured, model = reading(), reading(limit=60.0)
    table = pair_table(matched(measured, model), measured, model)
    assert table["switch_experiment"].tolist() == [1.0, 2.0]
    assert table["switch_model"].isna().tolist() == [False, True]
    assert table["force_N_experiment"].tolist() == [18.0, 26.0]
    assert table["force_N_experiment_std"].tolist() == [0.0, 0.0]
    assert "force_N_model_std" not in table


def test_drawn_switches_widen_the_model_by_their_scatter():
    drawn = [reading(1.0, scale) for scale in np.linspace(0.9, 1.1, 21)]
    pairs = matched(reading(), reading(), drawn)
    found = {metric.name: metric for metric in pair_metrics(pairs, ensemble(drawn))}
    spread = np.std(np.linspace(0.9, 1.1, 21))
    assert found["switch_force_mean_N"].input_std == pytest.approx(22.0 * spread)
    assert found["switch_force_mean_N"].dominant_input == "unit_weight_kN_m3"
    assert found["switch_u_mean_mm"].input_std == pytest.approx(0.0, abs=1e-9)


def test_means_of_measured_switches_scatter_as_stated():
    """4000 records, gain, offset, places and heights drawn anew: their scatter is the truth.

    The gain is the same error in all drops and does not average out; of spacings the inner places cancel.
    """
    rng = np.random.default_rng(0)
    places, tops, drops = (
        np.array([38.0, 60.0, 80.0, 95.0]),
        np.full(4, 20.0),
        np.array([8.0, 9.0, 10.0, 13.0]),
    )
    gain, offset, fresh, place = 0.03, 0.2, 0.05, 0.1
    means = []
    for _ in range(4000):
        factor, zero = 1 + rng.normal(0, gain), rng.normal(0, offset)
        u = places + rng.normal(0, place, 4)
        means.append(
            (
                np.mean(factor * tops + zero + rng.normal(0, fresh, 4)),
                np.mean(factor * drops + rng.normal(0, fresh, 4)),
                np.mean(np.diff(u)),
            )
        )
    shared = Shared(offset, gain)
    stds = np.column_stack(
        [
            np.full(4, place),
            np.hypot(fresh, np.sqrt([shared.variance(force) for force in tops])),
            np.hypot(fresh, gain * drops),
            np.append(np.nan, np.full(3, np.sqrt(2) * place)),
        ]
    )
    values = np.column_stack([places, tops, drops, np.append(np.nan, np.diff(places))])
    shares = np.column_stack(
        [np.zeros(4), np.sqrt([shared.variance(f) for f in tops]), gain * drops, np.zeros(4)]
    )
    numbers = tuple((k, k) for k in range(4))
    pairs = Pairs(numbers, (0, 0), values, stds, shares, values, 0 * stds, np.empty((0, 4, 4)))
    known = np.isfinite(values)
    # 4000 draws leave 1.1 % of a standard deviation.
    for k, found in ((1, 0), (2, 1), (3, 2)):
        assert pairs.mean_std(k, known[:, k]) == pytest.approx(
            np.std([one[found] for one in means]), rel=0.04
        )


def test_what_a_record_shares_is_taken_from_its_own_uncertainties():
    """A measured saw-tooth with 3 % of gain: of its drops' uncertainty that is the part that all share."""
    u = np.arange(0.0, 100.0, 0.05)
    force = np.interp(u, U, F)
    curve = Curve(u, force, np.full(u.size, 0.001), 0.03 * force, 0.05)
    measured = read_force(curve, 1.0, DEPTH)
    pairs = matched(measured, reading())
    np.testing.assert_allclose(pairs.shared_std[:, 2], 0.03 * np.array([10.0, 14.0]), rtol=0.02)
    np.testing.assert_allclose(pairs.shared_std[:, 1], 0.03 * np.array([18.0, 26.0]), rtol=0.02)


def metrics_of(measured, model, drawn=()):
    pairs = matched(measured, model, drawn)
    histories = common_histories(measured.curve, model.curve, [one.curve for one in drawn])
    found = history_metrics(histories, measured, model, drawn, pairs, 10.0)
    return {metric.name: metric for metric in found}, histories


def test_a_model_that_is_late_only_differs_in_phase():
    found, _ = metrics_of(reading(), reading(1.04, limit=100.0))
    assert found["force_phase_share"].error > 0.95
    assert found["travel_stretch"].error == pytest.approx(np.log(1.04), rel=1e-6)
    assert found["force_rms_aligned_P0"].error < 0.25 * found["force_rms_P0"].error


def test_a_model_that_is_too_high_only_differs_in_height():
    found, histories = metrics_of(reading(), reading(1.0, 1.1))
    assert found["force_phase_share"].error == pytest.approx(0.0, abs=1e-9)
    assert found["travel_stretch"].error == pytest.approx(0.0, abs=1e-12)
    rms = 0.1 * np.sqrt(np.mean(histories.measured**2)) / 10
    assert found["force_rms_P0"].error == pytest.approx(rms)
    # Over its own initial force each side is the same curve.
    assert found["force_shape_rms_P0"].error == pytest.approx(0.0, abs=1e-9)
    assert found["area_validation_P0"].error == pytest.approx(0.1 * histories.measured.mean() / 10, rel=1e-6)
    assert found["area_validation_percent"].error == pytest.approx(10.0, rel=1e-6)


def test_the_area_counts_the_draws():
    """Measured exactly in the middle of draws spread evenly over 10 %: mean distance is a quarter of it."""
    drawn = [reading(1.0, scale) for scale in np.linspace(0.9, 1.1, 41)]
    found, histories = metrics_of(reading(), reading(), drawn)
    expected = np.mean(np.abs(np.linspace(-0.1, 0.1, 41))) * 100
    assert found["area_validation_percent"].error == pytest.approx(expected, rel=1e-3)
    table = envelope_table(histories)
    # 95 % of an even spread of 20 %.
    np.testing.assert_allclose((table["high_N"] - table["low_N"]) / table["force_N"], 0.19, rtol=1e-6)


def test_alignment_puts_peak_on_peak_and_shifts_what_follows():
    u = np.array([0.0, 10.0, 20.0, 30.0, 40.0])
    assert aligned_u(u, np.array([20.0]), np.array([30.0])).tolist() == [0.0, 15.0, 30.0, 40.0, 50.0]
    np.testing.assert_allclose(log_stretch(np.array([20.0]), np.array([30.0])), [np.log(1.5)])


def test_why_alignment_cannot_be_judged_is_said():
    """Most drawn runs end before the second switch: how well it coincides is not known."""
    found, _ = metrics_of(reading(), reading(), [reading(limit=60.0)] * 3 + [reading()])
    for name in ("force_rms_aligned_P0", "travel_stretch"):
        assert found[name].agrees is None
        assert "3 of 4 draws" in found[name].note
