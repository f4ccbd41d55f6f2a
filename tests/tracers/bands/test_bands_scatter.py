"""Standard deviations of increments cover the scatter of a jagged series, and of nothing else."""

import numpy as np
import pytest

from ploughval.tracers.scatter import common_scale, widened

U = np.arange(24.0)
VAGUE, SHARP = np.ones(24, bool), np.zeros(24, bool)
STD = np.full(24, 0.3)
BAND = (U > 11).astype(int)


def jagged(seed):
    """Lines that fall on one or the other edge of a zone of 5 degrees, over a trend."""
    return 30 + 0.6 * U + 5.0 * np.random.default_rng(seed).integers(0, 2, 24)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_lines_between_two_edges_get_an_std_that_reaches_the_other_edge_in_two(seed):
    found = widened(U, jagged(seed), STD, VAGUE)
    assert 1.0 < np.median(found) < 5.0  # the values are half of 5 degrees from the middle of the zone


def test_sharp_bands_keep_their_std_however_they_scatter():
    assert widened(U, jagged(1), STD, SHARP).tolist() == STD.tolist()


def test_noise_as_stated_and_a_jump_widen_nothing():
    noise = np.random.default_rng(4).normal(0, 0.3, 24)
    for value in (30 + 0.6 * U + noise, 30 + 0.6 * U + noise - 20 * (U > 11)):
        assert (
            np.mean(widened(U, value, STD, VAGUE) > STD) < 0.25
        )  # the two beside the jump, and what is chance


def test_values_that_could_not_be_had_are_passed_over():
    value = jagged(1)
    value[[3, 9]] = np.nan
    found = widened(U, value, STD, VAGUE)
    assert found[[3, 9]].tolist() == [0.3, 0.3]
    assert np.isfinite(found).all()
    assert widened(U[:4], value[:4], STD[:4], VAGUE[:4]).tolist() == STD[:4].tolist()


def test_the_scatter_of_a_series_beyond_what_is_stated_is_found_and_a_jump_is_not():
    """300 draws of 24 values: the median of their ratios scatters by a quarter, and is 1 at least."""
    rng = np.random.default_rng(5)
    for true, low, high in ((0.3, 1.0, 1.15), (0.9, 2.6, 3.4)):
        values = [30 - 15 * BAND + 0.6 * U + rng.normal(0, true, 24) for _ in range(300)]
        assert low <= np.median([common_scale(U, value, STD, BAND) for value in values]) < high


def test_few_values_tell_no_scatter():
    assert common_scale(U[:8], jagged(1)[:8], STD[:8], BAND[:8]) == 1.0
