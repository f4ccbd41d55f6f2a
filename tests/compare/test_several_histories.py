"""Force histories of several tests: switches aligned, levels kept, none without a common travel."""

import numpy as np
import pandas as pd
import pytest

from ploughval.compare.several import Record, mean_history


def record(**found):
    settings = {"blade": {"depth_mm": 30.0, "width_mm": 218.0}, "soil": {"unit_weight_kN_m3": 16.0}}
    return Record("t", settings, **found)


def saw(depth, period_d, level=1.0, noise=0.0, seed=0):
    """A force record whose peaks stand at whole periods of travel."""
    u = np.linspace(0.0, 3.2 * depth, 3000)
    force = level * 10.0 * (1 + np.mod(u / depth, period_d) / period_d)
    force = force + np.random.default_rng(seed).normal(0, noise, u.size)
    return pd.DataFrame({"u_mm": u, "force_N": force, "force_std_N": 0.1})


def test_alignment_of_switches_takes_their_scatter_out_of_the_spread():
    periods = (0.9, 1.0, 1.1)
    tests = [record(force=saw(30.0, p, noise=0.02, seed=k), P0_N=10.0) for k, p in enumerate(periods)]
    history = mean_history((0, 1, 2), tests)
    assert history.scale == "γd²B/2"
    # Peaks at 0.9, 1.8, 2.7; 1, 2, 3; 1.1, 2.2 d within the common travel of 3.2 d.
    assert history.switch_counts == (3, 3, 2)
    np.testing.assert_allclose(history.switches_d, [[0.9, 1.8], [1.0, 2.0], [1.1, 2.2]], atol=0.005)
    assert [s.std for s in history.switches] == pytest.approx([0.1, 0.2], abs=0.005)
    inside = history.u_d < 1.9
    assert np.sqrt(np.mean(history.aligned_std[inside] ** 2)) < 0.2 * np.sqrt(
        np.mean(history.std[inside] ** 2)
    )


def test_histories_that_differ_in_level_keep_their_spread():
    levels = (0.9, 1.0, 1.1)
    tests = [record(force=saw(30.0, 1.0, level), P0_N=10.0) for level in levels]
    history = mean_history((0, 1, 2), tests)
    np.testing.assert_allclose(history.std, 0.1 * history.mean, rtol=1e-6)


def test_no_mean_history_without_two_forces_or_a_common_travel():
    still = record(force=saw(30.0, 1.0).assign(u_mm=0.0))
    assert mean_history((0, 1), [record(), record(force=saw(30.0, 1.0))]) is None
    assert mean_history((0, 1), [still, record(force=saw(30.0, 1.0))]) is None
