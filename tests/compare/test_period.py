"""The period of saw-teeth whose spacing is known, few, growing and cut off anywhere."""

import numpy as np
import pandas as pd
import pytest

from ploughval.compare.force.curve import Curve, measured_curve
from ploughval.compare.force.period import dominant_period


def saw(places, u):
    """Peaks of growing height at places, initial force 1 at 0; falls within 0.03."""
    corners = [(0, 1.0), (0.03, 0.5)]
    for place in places:
        corners += [(place, 1 + 0.4 * place), (place + 0.03, 0.55 * (1 + 0.4 * place))]
    last = 1.6 * places[-1]
    return np.interp(u, *np.array([*corners, (last, 1 + 0.4 * last)]).T)


def curve_of(places, end, noise=0.05, seed=0):
    u = np.linspace(0.001, end, 1200)
    force = 10 * saw(places, u) + np.random.default_rng(seed).normal(0, noise, u.size)
    return Curve(30 * u, force, np.full(u.size, noise), np.zeros(u.size), 30 * float(u[1] - u[0]))


@pytest.mark.parametrize("count", [2, 3, 4])
@pytest.mark.parametrize("tail", [0.05, 0.5, 0.9])
@pytest.mark.parametrize("period", [0.5, 1.9])
def test_an_even_spacing_is_found_within_the_stated_uncertainty(period, count, tail):
    curve = curve_of(period * np.arange(1, count + 1), period * (count + tail))
    found = dominant_period(curve, count)
    assert abs(found.value / 30 - period) < 2 * found.std / 30
    # docs/theory-comparison.md, Eq. (11): 13 % with two teeth and no tail, 2 % with four.
    assert found.std / found.value < 0.3 / count


@pytest.mark.parametrize(
    "places", [[1.29, 3.27], [0.391, 0.953, 1.702, 2.647], [0.85, 1.8, 2.9]], ids=["50/32", "36/32", "even"]
)
def test_a_growing_spacing_gives_a_period_between_the_least_and_the_greatest(places):
    gaps = np.diff(places, prepend=0.0)
    found = dominant_period(curve_of(places, 1.1 * places[-1]), len(places))
    assert gaps.min() < found.value / 30 < gaps.max()
    assert found.value / 30 == pytest.approx(gaps.mean(), rel=0.15)


def test_slower_sampling_and_noise_move_it_less_than_stated():
    values = []
    for seed in range(10):
        table = pd.DataFrame({"u_mm": np.linspace(0.05, 99, 900)})
        force = 10 * saw([0.9, 1.8, 2.7], table["u_mm"].to_numpy() / 30)
        force = force + np.random.default_rng(seed).normal(0, 0.5, 900)
        values.append(dominant_period(measured_curve(table.assign(force_N=force, force_std_N=0.5), 30.0), 3))
    assert np.std([one.value for one in values]) < np.mean([one.std for one in values])
    assert np.mean([one.value for one in values]) == pytest.approx(27.0, rel=0.05)


def test_fewer_than_two_switches_have_no_period():
    assert np.isnan(dominant_period(curve_of([1.0], 1.8), 1).value)
