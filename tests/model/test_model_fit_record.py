"""What the fit reads from a force record: switches, the first rise, a fall that the record cuts off."""

import numpy as np
import pytest

from ploughval.errors import DataError
from ploughval.model.fit.record import read_record


def saw(u, starts, *, low=1.0, high=2.0, soft=1.0):
    """Teeth that rise from ``low`` to ``high`` and fall over ``soft``; the first starts high."""
    edges = np.concatenate([[0.0], starts, [starts[-1] + 30.0]])
    place = np.clip(np.searchsorted(edges, u, side="right") - 1, 0, len(edges) - 2)
    since, length = u - edges[place], np.diff(edges)[place]
    rise = low + (high - low) * (since - soft) / (length - soft)
    return np.where(since < soft, high - (high - low) * since / soft, rise)


def test_switches_are_found_at_the_middle_of_their_falls():
    u = np.arange(0.0, 60.0, 0.1)
    force = saw(u, [20.0, 45.0]) + np.random.default_rng(3).normal(0.0, 0.02, u.size)
    record = read_record(u, force, 0.02, 30.0, least=3)
    # falls over 1 mm from the switch: half-way 0.5 mm after it; the force falls by 0.02 in 0.02 mm
    assert record.middles_mm == pytest.approx([20.5, 45.5], abs=0.1)
    assert record.start_mm == 0.0
    assert len(record.u_mm) == u.size


def test_the_rise_to_the_first_peak_is_left_out_and_the_start_is_uncertain_by_it():
    u = np.arange(0.0, 40.0, 0.1)
    force = saw(np.maximum(u - 0.8, 0.0), [20.0]) * np.minimum(u / 0.8, 1.0)
    record = read_record(u, force, 0.01, 30.0, least=3)
    assert record.u_mm[0] == pytest.approx(0.8, abs=0.11)
    assert record.start_mm == pytest.approx(0.4, abs=0.06)
    assert record.start_std_mm == pytest.approx(0.8 / np.sqrt(12.0), rel=0.15)  # uniform over the rise


def test_a_fall_that_the_record_cuts_off_is_left_out():
    u = np.arange(0.0, 20.05, 0.05)
    record = read_record(u, saw(u, [20.0]), 0.002, 30.0, least=3)
    assert record.middles_mm.size == 0
    assert record.end_mm == pytest.approx(20.0, abs=0.051)
    whole = read_record(u[u < 19.9], saw(u[u < 19.9], [20.0]), 0.002, 30.0, least=3)
    assert whole.left_out == 0


def test_noise_is_no_switch():
    u = np.linspace(0.0, 50.0, 300)
    force = 5.0 + 0.1 * u + np.random.default_rng(1).normal(0.0, 0.5, u.size)
    assert read_record(u, force, 0.5, 30.0, least=3).middles_mm.size == 0


@pytest.mark.parametrize("seed", range(8))
def test_noise_that_lasts_over_rows_is_no_switch_though_it_is_told_as_independent(seed):
    u, rng = np.arange(0.0, 70.0, 0.1), np.random.default_rng(seed)
    noise = rng.normal(size=u.size)
    for k in range(1, u.size):  # autoregressive, integrated over 8 rows
        noise[k] = 7 / 9 * noise[k - 1] + np.sqrt(1 - (7 / 9) ** 2) * noise[k]
    clean = saw(u, [40.0], low=10.0, high=16.0)
    record = read_record(u, clean + 0.4 * noise, 0.4, 30.0, least=3)
    assert record.middles_mm == pytest.approx([40.5], abs=0.5)


def test_rows_are_sorted_and_bad_ones_left_out():
    u = np.array([3.0, 1.0, np.nan, 2.0, -1.0, 4.0, 5.0])
    record = read_record(u, 10.0 + u, [0.1, 0.0, 0.1, 0.2, 0.1, np.nan, 0.2], 30.0, least=3)
    assert record.u_mm.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert record.noise_std_N.tolist() == [0.2, 0.2, 0.1, 0.2, 0.2]  # median of the positive ones
    assert record.left_out == 2
    with pytest.raises(DataError, match="rows"):
        read_record(u[:3], u[:3], 0.1, 30.0, least=3)
