"""What is a peak and what is noise, and what the uncertainties of peaks are where they follow by hand."""

import numpy as np
import pandas as pd
import pytest

from ploughval.compare.force.curve import Curve, model_curve
from ploughval.compare.force.peaks import (
    PEAK_COLUMNS,
    Weak,
    find_extremes,
    ripple_prominence,
    weak_prominence,
)

STEP = 0.05


def exact(u, force):
    return model_curve(pd.DataFrame({"u_mm": u, "force_N": force}), 0.0)


def of_kind(table, kind):
    return table[table["kind"] == kind].reset_index(drop=True)


def averaged(corners_u, corners_F, *, shared_std_N, noise_std_N=0.0):
    """Means over steps of travel, as of a log, of straight lines between corners."""
    fine = np.arange(0.0, corners_u[-1], STEP / 20) + STEP / 40
    u, force = (v.reshape(-1, 20).mean(axis=1) for v in (fine, np.interp(fine, corners_u, corners_F)))
    return Curve(u, force, np.full(u.size, noise_std_N), shared_std_N(force), STEP)


TOOTH_U, TOOTH_F = np.array([0.0, 10.0, 12.0, 20.0, 22.0, 25.0]), np.array([5.0, 20.0, 8.0, 24.0, 6.0, 9.0])


# --- what is a peak ---------------------------------------------------------------------------------------


def zigzag(heights):
    """Teeth on zero; the prominence of each is its height."""
    force = np.zeros(2 * len(heights) + 1)
    force[1::2] = heights
    return exact(np.arange(force.size, dtype=float), force)


def test_thirty_teeth_are_ripple_and_fewer_are_bands():
    assert ripple_prominence(zigzag(np.full(30, 2.0))) == pytest.approx(2.5 * 2.0)
    assert ripple_prominence(zigzag(np.full(29, 2.0))) == 0.0
    assert ripple_prominence(zigzag(np.full(30, 0.25))) == pytest.approx(2.5 * 0.25)  # however small


def test_ripple_is_what_four_fifths_of_the_teeth_stay_below():
    heights = np.random.default_rng(0).permutation(np.arange(1.0, 42.0))
    assert ripple_prominence(zigzag(heights)) == pytest.approx(2.5 * 33.0)  # 80 % between 1 and 41


def test_initial_peak_needs_a_fiftieth_of_the_first_force_and_more_than_the_noise():
    quiet = zigzag([1.0, 2.0])
    noisy = Curve(np.arange(9.0), np.ones(9), np.full(9, 0.5), np.zeros(9), 1.0)
    assert weak_prominence(quiet, 50.0) == pytest.approx(1.0)
    assert weak_prominence(noisy, 50.0) == pytest.approx(3.0)


LESSER_U = np.arange(11.0)
LESSER_F = np.array([0.0, 6.0, 5.0, 8.0, 6.0, 20.0, 4.0, 11.0, 8.5, 12.0, 11.5])


def test_one_lesser_peak_is_let_in_and_it_is_the_most_prominent_before_its_limit():
    curve = exact(LESSER_U, LESSER_F)  # prominences: 1 at 1, 2 at 3, 16 at 5, 2.5 at 7, 0.5 at 9
    places = [of_kind(find_extremes(curve, 10.0, weak=weak), "peak")["u_mm"].tolist() for weak in (
        None, Weak(4.0, 0.5), Weak(8.0, 0.5), Weak(3.0, 0.5), Weak(1.0, 0.5), Weak(4.0, 3.0), Weak(9.0, 20.0),
    )]  # fmt: skip
    assert places == [[5.0], [3.0, 5.0], [5.0, 7.0], [1.0, 5.0], [5.0], [5.0], [5.0]]


def test_peak_whose_prominence_is_just_the_least_is_one():
    curve = exact([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 5.0, 3.0, 9.0, 2.0])
    assert of_kind(find_extremes(curve, 2.0), "peak")["u_mm"].tolist() == [1.0, 3.0]
    assert of_kind(find_extremes(curve, 2.1), "peak")["u_mm"].tolist() == [3.0]


def test_rebound_is_lower_and_near_and_before_a_deeper_fall():
    def peaks(u, force, rebound_mm):
        return of_kind(find_extremes(exact(u, force), 1.0, rebound_mm=rebound_mm), "peak")["u_mm"].tolist()

    u = [0.0, 2.0, 4.0, 6.0, 8.0]
    assert peaks(u, [20.0, 10.0, 14.0, 6.0, 9.0], 4.0) == [0.0]  # 4 mm after it: near enough
    assert peaks(u, [20.0, 10.0, 14.0, 6.0, 9.0], 3.9) == [0.0, 4.0]
    assert peaks(u, [20.0, 10.0, 20.0, 6.0, 9.0], 4.0) == [0.0, 4.0]  # as high
    assert peaks(u, [20.0, 10.0, 14.0, 10.0, 13.0], 4.0) == [0.0, 4.0]  # no deeper than before
    # two rebounds in one fall: the second is measured from the first trough's peak, and from the lower trough
    twice = [20.0, 10.0, 14.0, 6.0, 8.0, 5.0, 6.0]
    assert peaks([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0], twice, 5.0) == [0.0]
    higher = [20.0, 10.0, 14.0, 6.0, 9.0, 7.0, 8.0]
    assert peaks([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0], higher, 5.0) == [0.0, 4.0]


def test_rebound_belongs_to_the_peak_before_it_and_a_higher_peak_is_none():
    def peaks(u, force, rebound_mm):
        return of_kind(find_extremes(exact(u, force), 1.0, rebound_mm=rebound_mm), "peak")["u_mm"].tolist()

    u = [0.0, 1.0, 20.0, 21.0, 22.0, 24.0, 26.0]
    assert peaks(u, [20.0, 5.0, 30.0, 12.0, 15.0, 6.0, 9.0], 4.0) == [0.0, 20.0]
    assert peaks(u, [20.0, 5.0, 30.0, 12.0, 35.0, 6.0, 9.0], 4.0) == [0.0, 20.0, 22.0]


def test_force_is_taken_to_rise_from_zero():
    # a first peak stands as high as it is, however low the force falls after it
    table = find_extremes(exact([0.0, 1.0, 2.0, 3.0], [3.0, -0.5, 9.0, 4.0]), 1.0)
    assert of_kind(table, "peak")["prominence_N"].tolist() == [3.0, 5.0]
    small = find_extremes(exact([0.0, 1.0, 2.0, 3.0], [0.3, 0.1, 0.9, 0.4]), 0.05)
    assert of_kind(small, "peak")["u_mm"].tolist() == [0.0, 2.0]


def test_table_is_in_order_of_travel_and_has_the_columns_that_are_documented():
    table = find_extremes(exact(TOOTH_U, TOOTH_F), 1.0)
    assert tuple(table.columns) == PEAK_COLUMNS
    assert table["kind"].tolist() == ["peak", "trough", "peak", "trough"]
    assert table["u_mm"].tolist() == [10.0, 12.0, 20.0, 22.0]
    assert table["prominence_N"].tolist()[::2] == [12.0, 18.0]
    assert table["drop_N"].tolist()[::2] == [12.0, 18.0]
    assert table["spacing_mm"].tolist()[:2] == [10.0, 10.0]
    assert table["spacing_mm"].isna().tolist() == [False, False, True, True]
    troughs = of_kind(table, "trough")
    assert troughs[["prominence_N", "drop_N", "drop_std_N"]].isna().all(axis=None)


# --- how well it is known ---------------------------------------------------------------------------------


def test_points_of_a_given_curve_carry_its_uncertainty_and_a_fall_only_what_is_fresh():
    noise, shared = np.array([0.1, 0.3, 0.4, 0.3, 0.1, 0.1]), np.full(6, 0.5)
    table = find_extremes(Curve(TOOTH_U, TOOTH_F, noise, shared, 0.0), 1.0)
    assert table["force_std_N"].tolist() == pytest.approx(np.hypot([0.3, 0.4, 0.3, 0.1], 0.5).tolist())
    assert table["u_std_mm"].tolist() == [0.0] * 4
    assert of_kind(table, "peak")["drop_std_N"].tolist() == pytest.approx([0.5, np.hypot(0.3, 0.1)])
    assert table["spacing_std_mm"].tolist()[:2] == [0.0, 0.0]
    assert table["spacing_std_mm"].isna().tolist() == [False, False, True, True]


def test_sharp_corners_of_a_log_are_placed_within_one_of_its_steps():
    table = find_extremes(averaged(TOOTH_U, TOOTH_F, shared_std_N=np.zeros_like), 1.0)
    np.testing.assert_allclose(table["u_mm"], TOOTH_U[1:5], atol=1e-9)
    np.testing.assert_allclose(table["force_N"], TOOTH_F[1:5], atol=1e-9)
    np.testing.assert_allclose(table["u_std_mm"], STEP / np.sqrt(12.0), rtol=1e-12)
    np.testing.assert_allclose(table["spacing_std_mm"][:2], STEP / np.sqrt(6.0), rtol=1e-12)


def test_gain_stretches_a_fall_and_an_offset_does_not():
    for shared, gain in ((lambda f: 0.02 * f, 0.02), (lambda f: np.full_like(f, 0.4), 0.0)):
        peaks = of_kind(find_extremes(averaged(TOOTH_U, TOOTH_F, shared_std_N=shared), 1.0), "peak")
        np.testing.assert_allclose(peaks["drop_std_N"], gain * peaks["drop_N"], rtol=1e-3, atol=1e-4)
        # the shared part at the highest mean, which lies up to half a step off the corner
        np.testing.assert_allclose(peaks["force_std_N"], shared(peaks["force_N"].to_numpy()), rtol=0.01)


def test_blunt_top_between_near_troughs_is_as_uncertain_as_it_is_wide_and_cut_off():
    # flanks of 5 N/mm from the troughs at 10 and 17 mm would meet at 13.5 mm and 17.5 N; the curve has two
    # points of 15 N there. Beyond the troughs the force goes another way, and counts for nothing.
    force = [0, 6, 12, 18, 24, 30, 24, 18, 12, 6, 0, 5, 10, 15, 15, 10, 5, 0, 9, 18, 27, 36]
    n = len(force)
    curve = Curve(np.arange(float(n)), np.array(force, float), np.full(n, 0.1), np.full(n, 0.2), 1.0)
    peak = find_extremes(curve, 1.0).set_index("kind").loc["peak"].iloc[1]
    assert (peak["u_mm"], peak["force_N"]) == (13.0, 15.0)
    own = np.hypot(1.0 / np.sqrt(12.0), 0.5)  # a rectangle over the top, and its middle half a mm away
    assert peak["u_std_mm"] == pytest.approx(np.hypot(own, 0.5 / np.sqrt(3.0)))
    assert peak["force_std_N"] == pytest.approx(np.sqrt(0.1**2 + 2.5**2 / 3.0 + 0.2**2))


def between_troughs(top, noise_N=0.125):
    """A curve with a higher peak, then points of a top between two troughs that stand close."""
    force = [0.0, 10.0, 20.0, 30.0, 20.0, 10.0, 0.0, *top, 0.0, 10.0, 20.0, 30.0, 31.0]
    n = len(force)
    return Curve(np.arange(float(n)), np.array(force), np.full(n, noise_N), np.zeros(n), 1.0)


@pytest.mark.parametrize(
    ("top", "near_mm"),
    [
        ((15.0, 14.625), 1.0),  # three noise widths down
        ((15.0, 14.5625), 0.0),  # 3.5
        ((15.0, 14.375, 14.75), 2.0),  # beyond a dip of 5
        ((15.0, 14.25, 14.75), 0.0),  # beyond a dip of 6: a neighbour
        ((15.0, 14.1875, 14.75), 0.0),
        ((14.75, 14.1875, 15.0), 0.0),
        ((14.75, 14.375, 15.0), 2.0),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_points_within_three_noise_widths_and_no_dip_of_six_are_of_the_top(top, near_mm, sign):
    curve = between_troughs(top)
    if sign < 0:  # the same upside down, from 40 N on: a trough
        curve = Curve(curve.u_mm, 40.0 - curve.force_N, curve.noise_std_N, curve.shared_std_N, 1.0)
    table = find_extremes(curve, 3.0)
    place = 7.0 + top.index(15.0)
    row = table[(table["kind"] == ("peak" if sign > 0 else "trough")) & (table["u_mm"] == place)].iloc[0]
    # a rectangle over the top, at least a step wide, and its middle off the highest point
    assert row["u_std_mm"] == pytest.approx(np.hypot(max(near_mm, 1.0) / np.sqrt(12.0), 0.5 * near_mm))
    assert row["force_std_N"] == pytest.approx(0.125)


def test_spacing_is_as_uncertain_as_both_its_ends():
    sharp = [0.0, 6.0, 12.0, 18.0, 24.0, 30.0, 24.0, 18.0, 12.0, 6.0, 0.0]
    force = np.array([*sharp, 15.0, 14.8, *sharp])
    curve = Curve(np.arange(24.0), force, np.full(24, 0.1), np.zeros(24), 1.0)
    peaks = of_kind(find_extremes(curve, 3.0), "peak")
    std = peaks["u_std_mm"].to_numpy()
    assert len(std) == 3
    assert std[1] > 1.5 * std[0]
    np.testing.assert_allclose(peaks["spacing_std_mm"][:-1], np.hypot(std[1:], std[:-1]))
    np.testing.assert_allclose(peaks["spacing_mm"][:-1], np.diff(peaks["u_mm"]))


def test_points_of_the_models_curve_are_taken_as_they_are():
    # many points, a rounded top: of a log the flanks' corner would be asked for
    u = np.linspace(0.0, 20.0, 81)
    force = 10.0 - 0.08 * np.abs(u - 9.0) ** 1.2
    peak = find_extremes(exact(u, force), 0.2).iloc[0]
    assert (peak["u_mm"], peak["force_N"], peak["u_std_mm"], peak["force_std_N"]) == (9.0, 10.0, 0.0, 0.0)


@pytest.mark.parametrize(("after", "found"), [(4, True), (3, False)])
def test_corner_of_a_last_trough_needs_four_points_to_the_end(after, found):
    curve = averaged([0.0, 10.0, 12.02, 15.0], [5.0, 20.0, 8.0, 20.0], shared_std_N=np.zeros_like)
    last = int(np.argmin(np.where(curve.u_mm > 10.0, curve.force_N, np.inf))) + after
    cut = Curve(
        *(v[: last + 1] for v in (curve.u_mm, curve.force_N, curve.noise_std_N, curve.shared_std_N)), STEP
    )
    trough = of_kind(find_extremes(cut, 0.5), "trough").iloc[0]
    assert (trough["u_mm"] == pytest.approx(12.02, abs=1e-9)) == found
    assert (trough["force_N"] == pytest.approx(8.0, abs=1e-9)) == found
