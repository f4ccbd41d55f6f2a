"""Peak, residual and length: what made a curve is read from it, and what it does not hold is not."""

from dataclasses import replace

import numpy as np
import pytest

from ploughval.compare.mobilised.curve import BandCurve
from ploughval.compare.mobilised.sources import SOURCES, Response
from ploughval.compare.softening.fit import fit_softening
from ploughval.compare.softening.law import Law, ahead, softened
from ploughval.compare.softening.table import _row

DEPTH = 30.0
STRETCH = 1.08  # slip for a mm of travel
PEAK, RESIDUAL, LENGTH = 45.0, 32.0, 1.5
NOISE = 0.05
START = 20.7  # of the second band, between photographs at 20 and 22


def falls(slip):
    return PEAK - (PEAK - RESIDUAL) * np.clip(slip / LENGTH, 0.0, 1.0)


def made(
    law=falls,
    *,
    first=False,
    origin=START,
    until=8.0,
    after=0.0,
    noise=NOISE,
    rng=None,
    shared=0.0,
    shift=0.0,
):
    """A band's curve: rises by 4 degrees a mm up to the origin, then follows a law of the slip.

    ``shared``: effect of the force's zero, larger where friction is less; ``shift`` how much of it is there.
    """
    begin = 0.0 if first else 20.0
    width = np.r_[np.full(140, 0.05), np.full(40, 0.5)]
    edges = begin + np.r_[0.0, np.cumsum(width)]
    fine = np.linspace(edges[:-1], edges[1:], 41)[1::2]  # means over each row, by its twentieths
    slip = STRETCH * (fine - origin)
    mean = np.where(slip < 0, PEAK + 4.0 * (fine - origin), law(np.maximum(slip, 0.0))).mean(axis=0)
    middle = (edges[:-1] + edges[1:]) / 2
    kept = (middle >= begin + after) & (middle <= origin + until)
    effect = shared * (1 + (PEAK - mean) / (PEAK - RESIDUAL))
    fresh = np.where(width < 0.1, NOISE, NOISE / np.sqrt(10.0))
    phi = mean + shift * effect + (0.0 if rng is None else rng.normal(0.0, fresh))
    table = np.zeros((len(SOURCES), kept.sum()))
    table[SOURCES.index("force_zero")] = effect[kept]
    response = Response(fresh[kept], table, np.zeros((1, kept.sum())))
    ones = np.ones(kept.sum())
    placed = (0, origin, 0.0, 2.0) if first else (1, 21.0, 20.0, 22.0)
    return BandCurve(
        *placed, first, 0.01,
        middle[kept], width[kept], phi[kept], STRETCH * ones, response, 20 * ones, 5 * ones, 6 * ones,
    )  # fmt: skip


def read(curve):
    """The row of the table."""
    fit = fit_softening([curve], DEPTH)
    names = ("peak", "residual", "length")
    row = _row("1", fit, "")
    return fit, dict(zip(names, (row[1], row[5], row[9]), strict=True)), row[-1]


@pytest.mark.parametrize("length", [0.3, 1.5, 5.0])
def test_line_that_made_a_curve_is_read_from_it(length):
    def law(slip):
        return PEAK - (PEAK - RESIDUAL) * np.clip(slip / length, 0.0, 1.0)

    fit = fit_softening([made(law, until=20.0)], DEPTH)
    # rows of 0.05 mm in steps of 1/20 of them: 0.003 mm, and as much of the fall a mm
    assert fit.length.value == pytest.approx(length, abs=0.01)
    assert fit.origins[0][0] == pytest.approx(START, abs=0.01)
    assert fit.peak.value == pytest.approx(PEAK, abs=0.01 * (PEAK - RESIDUAL) / length + 0.02)
    assert fit.residual.value == pytest.approx(RESIDUAL, abs=0.02)


def test_start_is_found_where_friction_turns_and_not_where_the_photographs_put_it():
    curve = made()
    assert curve.start_mm == 21.0
    fit = fit_softening([curve], DEPTH)
    origin, std = fit.origins[0]
    assert abs(origin - START) < 3 * std < 0.05


def test_intervals_cover_what_made_the_curves_under_noise_and_a_shared_error():
    """Of 40 drawn curves 95 % limits hold the true value in 34 at least: fewer is a chance of 0.4 %."""
    rng = np.random.default_rng(11)
    inside = {"peak": 0, "residual": 0, "length": 0}
    truth = {"peak": PEAK, "residual": RESIDUAL, "length": LENGTH}
    for _ in range(40):
        curve = made(rng=rng, shared=0.4, shift=rng.standard_normal(), until=6.0)
        fit = fit_softening([curve], DEPTH)
        for name, value in truth.items():
            found = getattr(fit, name)
            inside[name] += found.low95 <= value <= found.high95
    assert min(inside.values()) >= 34


def test_shared_error_is_not_averaged_away_by_more_bands():
    one = fit_softening([made(shared=0.4)], DEPTH)
    two = fit_softening([made(shared=0.4), made(shared=0.4, first=True, origin=0.0)], DEPTH)
    assert two.residual.std == pytest.approx(one.residual.std, rel=0.05)
    assert one.residual.std == pytest.approx(0.8, rel=0.05)  # twice 0.4 at the residual


def test_missed_first_slip_leaves_peak_and_length_undetermined():
    curve = made(first=True, origin=0.0, after=2.5, rng=np.random.default_rng(3))
    _, found, note = read(curve)
    assert np.isnan(found["peak"])
    assert np.isnan(found["length"])
    assert "no softening is told" in note or "peak not determined" in note
    assert found["residual"] == pytest.approx(RESIDUAL, abs=0.1)


def test_first_slip_that_is_half_missed_bounds_the_length():
    curve = made(first=True, origin=0.0, after=0.7, rng=np.random.default_rng(4))
    fit, found, _ = read(curve)
    assert found["residual"] == pytest.approx(RESIDUAL, abs=0.1)
    assert fit.least_slip_mm > 0.7
    assert fit.length.low95 <= LENGTH <= fit.length.high95
    assert fit.peak.low95 <= PEAK <= fit.peak.high95


def test_band_that_ends_before_its_residual_tells_the_peak_alone():
    fit, found, note = read(made(until=0.8, rng=np.random.default_rng(5)))
    assert found["peak"] == pytest.approx(PEAK, abs=0.3)
    assert np.isnan(found["residual"])
    assert np.isnan(found["length"])
    assert "residual not determined" in note
    assert fit.length.low95 > 0.5


def test_even_friction_is_told_as_one_value():
    fit, found, note = read(made(lambda s: np.full(s.shape, RESIDUAL), first=True, origin=0.0))
    assert fit.fall < 2.0
    assert found["residual"] == pytest.approx(RESIDUAL, abs=0.05)
    assert np.isnan(found["peak"])
    assert "no softening is told" in note


def test_exponential_fall_is_told_from_a_straight_one():
    def law(slip):
        return RESIDUAL + (PEAK - RESIDUAL) * np.exp(-slip / 0.8)

    assert fit_softening([made(law)], DEPTH).gain > 10.0
    assert fit_softening([made()], DEPTH).gain < -10.0


def test_rise_before_the_first_peak_is_left_out():
    """Friction rises from 20 degrees over 0.4 mm before the blade's first band slips."""
    plain = made(first=True, origin=0.4)
    fit = fit_softening([plain], DEPTH)
    assert fit.origins[0][0] == pytest.approx(0.4, abs=0.03)
    assert fit.peak.value == pytest.approx(PEAK, abs=0.4)
    assert fit.length.value == pytest.approx(LENGTH, abs=0.04)


def test_waves_that_no_source_explains_widen_the_limits():
    curve = made(lambda s: falls(s) + 0.5 * np.sin(3.0 * s))
    calm = fit_softening([made()], DEPTH)
    wavy = fit_softening([curve], DEPTH)
    assert calm.scatter == pytest.approx(1.0, abs=0.05)
    assert wavy.scatter > 4.0
    assert wavy.peak.std > 3 * calm.peak.std


def test_share_softened_is_the_mean_of_the_law_over_a_row():
    low, high = np.array([-0.3, 0.2, 0.9, 2.0]), np.array([0.1, 0.7, 1.4, 2.5])
    s = np.linspace(low, high, 20001)
    for law, share in (
        (Law.LINEAR, np.clip(s, 0, 1)),
        (Law.EXPONENTIAL, 1 - np.exp(-np.maximum(s, 0.0))),
    ):
        expected = np.trapezoid(share, axis=0) / 20000
        np.testing.assert_allclose(softened(low, high, 1.0, law), expected, atol=1e-8)
    np.testing.assert_allclose(
        ahead(low, high, 0.5), np.trapezoid(np.maximum(0.5 - s, 0.0), axis=0) / 20000, atol=1e-8
    )


def test_rows_after_the_blade_has_come_to_the_outcrop_are_left_out():
    # the band steepens to 89.9 degrees: slip for a mm of travel grows a hundredfold, friction is none
    curve = made(first=True, origin=0.0)
    beta = np.where(curve.u_mm > 6.0, 89.9, 20.0)
    gone = curve.u_mm > 6.0
    spoiled = replace(
        curve,
        beta_deg=beta,
        stretch=np.where(gone, 573.0, STRETCH),
        phi_deg=np.where(gone, 80.0, curve.phi_deg),
    )
    _, told, _ = read(spoiled)
    assert told["peak"] == pytest.approx(PEAK, abs=0.3)
    assert told["residual"] == pytest.approx(RESIDUAL, abs=0.1)


def test_a_band_at_whose_outcrop_the_blade_stands_is_not_fitted():
    curve = made(first=True, origin=0.0)
    assert fit_softening([replace(curve, beta_deg=np.full_like(curve.u_mm, 89.0))], DEPTH) is None


def test_friction_that_rises_with_slip_is_no_softening():
    _, found, note = read(made(lambda s: RESIDUAL + 0.8 * np.clip(s / 6.0, 0.0, 1.0), first=True, origin=0.0))
    assert "does not fall with slip" in note
    assert np.isnan(found["length"])
    assert np.isnan(found["peak"])
    # one friction in place of a rise of 0.8 degrees
    assert found["residual"] == pytest.approx(RESIDUAL + 0.4, abs=0.4)
