"""Zeros over a record whose zeros are known to wander."""

import numpy as np
import pytest

from ploughval.loadcells.drift import zero_line
from ploughval.loadcells.zero import Zero, zero_of

COV = np.array([[4e-6, 3e-6], [3e-6, 9e-6]])


def noise(rng, size, scale=1.0):
    return scale * np.linalg.cholesky(COV) @ rng.normal(size=(2, size))


def still(mean, *, middle=5.0, drift=(0.0, 0.0), drift_std=(1e-4, 1e-4), span=10.0):
    return Zero(
        np.asarray(mean, float), COV, COV / 100, np.asarray(drift, float), np.diag(np.square(drift_std)), 100,
        middle, middle + span / 2, span,
    )  # fmt: skip


def total(line, size):
    """Covariance (2, 2, N) of the offsets."""
    return sum(cov[..., None] * np.broadcast_to(weight, (size,)) for _, cov, weight, _ in line.parts)


def test_zeros_that_do_not_drift_are_one_number():
    line = zero_line(np.arange(100.0), still([0.3, -0.1]))
    np.testing.assert_array_equal(line.offset, [[0.3], [-0.1]])
    assert [name for name, *_ in line.parts] == ["zero offset"]
    assert not line.total.any()


def test_between_two_rests_zeros_run_straight_and_stay_beyond_them():
    t = np.array([-20.0, 0.0, 5.0, 55.0, 105.0, 110.0, 200.0])
    line = zero_line(t, still([0.0, 1.0]), still([1.0, 0.0], middle=105.0))
    upper = np.array([-0.05, -0.05, 0.0, 0.5, 1.0, 1.05, 1.05])
    np.testing.assert_allclose(line.offset, [upper, 1 - upper], atol=1e-14)
    np.testing.assert_array_equal(line.total, [1.0, -1.0])
    cov = total(line, t.size)
    # At a rest: its own mean's. Half way: half of both, and a bow of up to a quarter of the drift of 1.
    np.testing.assert_allclose(cov[..., 2], COV / 100, rtol=1e-12)
    np.testing.assert_allclose(cov[..., 3], COV / 200 + np.array([[1, -1], [-1, 1]]) / 48, rtol=1e-12)


def test_every_rest_is_stated_with_the_offset_that_was_read_there():
    t = np.linspace(0, 110, 12)
    line = zero_line(t, still([0.0, 1.0]), still([1.0, 0.2], middle=105.0))
    stated = {name: list(value) for name, *_, value in line.parts}
    assert stated["zero offset before motion"] == [0.0, 1.0]
    assert stated["zero offset at the end"] == [1.0, 0.2]
    assert stated["drift that is not straight"] == [0.0, 0.0]
    drifting = zero_line(t, still([0.3, -0.1], drift=(0.1, 0.0)))
    assert {name: list(value) for name, *_, value in drifting.parts}["zero offset"] == [0.3, -0.1]


@pytest.mark.parametrize(
    "shape", [lambda s: s, lambda s: s + s * (1 - s), lambda s: np.expm1(-2 * s) / np.expm1(-2)]
)
def test_a_bow_between_the_rests_is_within_what_is_stated(shape):
    t = np.linspace(0, 110, 2000)
    drift = 0.2 * shape(np.clip((t - 5) / 100, 0, 1))
    line = zero_line(t, still([drift[0], 0.0]), still([0.2, 0.0], middle=105.0))
    error = np.abs(line.offset[0] - drift)
    std = np.sqrt(total(line, t.size)[0, 0])
    # A bow of a quarter, s + s (1 - s), is sqrt(3) deviations. One that levels off as exp(-2 s) starts 2.31
    # times as steep as the straight line: 1.31 s of error where the bow's deviation is 0.577 s.
    assert (error <= 2.3 * std + 1e-9).all()


def test_a_drift_at_rest_goes_on_at_its_rate():
    line = zero_line(np.array([0.0, 5.0, 10.0, 110.0]), still([0.3, 0.0], drift=(0.02, 0.0)))
    np.testing.assert_allclose(line.offset[0], [0.29, 0.3, 0.31, 0.51], rtol=1e-12)
    np.testing.assert_allclose(line.offset[1], 0.0, atol=1e-15)
    cov = total(line, 4)[0, 0]
    # Rate 0.002 +- 1e-5 unit/s. Within the rest: mean and rate; 100 s later also 0.2 / sqrt(3) for a stop.
    np.testing.assert_allclose(cov[1], COV[0, 0] / 100, rtol=1e-12)
    np.testing.assert_allclose(cov[3], COV[0, 0] / 100 + (105e-5) ** 2 + 0.2**2 / 3, rtol=1e-12)


def test_the_rate_of_a_drift_keeps_what_both_cells_have_in_common():
    rng = np.random.default_rng(5)
    t = np.arange(0, 10, 0.01)
    rate = np.array([0.01, 0.006])
    ends, stated = [], []
    for _ in range(400):
        zero = zero_of(t, rate[:, None] * t + noise(rng, t.size))
        line = zero_line(np.array([0.0, 100.0]), zero)
        ends.append(line.offset[:, 1] - rate * 100)
        stated.append({name: cov * np.broadcast_to(w, 2)[1] for name, cov, w, _ in line.parts})
    own = np.mean([s["zero offset"] + s["rate of the drift"] for s in stated], axis=0)
    # Variances of 400 draws scatter by sqrt(2 / 400) = 7 %; three of those.
    np.testing.assert_allclose(own, np.cov(np.transpose(ends)), rtol=0.25)


@pytest.mark.parametrize("stops_s", [None, 10.0, 40.0])
def test_a_drift_that_goes_on_or_stops_is_within_two_standard_uncertainties(stops_s):
    rng = np.random.default_rng(6)
    t = np.arange(0, 100, 0.01)
    drift = 0.01 * np.minimum(t, t[-1] if stops_s is None else stops_s)
    zero = zero_of(t[:1000], np.stack([drift, 0 * t])[:, :1000] + noise(rng, 1000))
    assert zero.drifts
    line = zero_line(t, zero)
    error = np.abs(line.offset[0] - drift)
    # The deviation is the root mean square of drifts that stop at any moment: full / sqrt(3) for one at once.
    assert (error <= 2 * np.sqrt(total(line, t.size)[0, 0])).all()


def test_drifts_that_stop_at_any_moment_are_within_the_interval():
    rng = np.random.default_rng(7)
    t = np.linspace(0, 100, 101)
    inside = []
    for stop in rng.uniform(10, 100, 1000):
        line = zero_line(t, still([0.05, 0.0], drift=(0.1, 0.0)))
        error = line.offset[0] - 0.01 * np.minimum(t, stop)
        inside.append(np.abs(error) <= 1.96 * np.sqrt(total(line, t.size)[0, 0]))
    # Conservative: no stop is further than sqrt(3) deviations.
    assert np.mean(inside) >= 0.95
