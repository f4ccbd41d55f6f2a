"""Made tests that repeat each other: their sands scatter as stated, their truth is the closed form."""

import numpy as np
import pytest

from several import made


def test_plan_has_the_repeats_and_the_depths_with_sand_of_their_own():
    tests = list(made.plan())
    assert len({test.name for test in tests}) == len(tests) == made.REPEATS + 2 * len(made.DEPTHS_MM)
    assert [test.depth_mm for test in tests].count(made.DEPTH_MM) == made.REPEATS
    assert len({test.soil.peak_friction_deg for test in tests}) == len(tests)
    assert tests == list(made.plan())


def test_sands_scatter_as_every_test_states():
    rng = np.random.default_rng(5)
    peak = np.array([made.sand(rng).peak_friction_deg for _ in range(2000)])
    # Three standard errors: 1 / sqrt(2000) of the mean, 1 / sqrt(4000) of the standard deviation.
    assert peak.mean() == pytest.approx(made.MEAN.peak_friction_deg, abs=0.067)
    assert peak.std() == pytest.approx(made.MEAN.peak_friction_std_deg, abs=0.048)


def test_true_first_peak_is_rankines_passive_force_on_the_width():
    truth = made.true_values(made.MEAN, 30.0)
    passive = np.tan(np.radians(45 + made.MEAN.peak_friction_deg / 2)) ** 2
    assert truth["first_peak_N"] == pytest.approx(15.7e-6 * 30.0**2 / 2 * 218.0 * passive, rel=1e-9)
    assert truth["first_band_beta_deg"] == pytest.approx(45 - made.MEAN.peak_friction_deg / 2, abs=0.01)
