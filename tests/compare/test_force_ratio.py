"""Forces over the initial force of their own record: what both share cancels as far as it should."""

import numpy as np
import pytest

from ploughval.compare.force.curve import Curve, Shared
from ploughval.compare.force.initial import Initial
from ploughval.compare.force.scalars import over_initial
from ploughval.compare.quantity import Quantity

TRUE_P0, TRUE_SWITCH, TRUE_DROP = 10.0, 18.0, 8.0


@pytest.mark.parametrize(
    "shared", [Shared(0.3, 0.0), Shared(0.0, 0.03), Shared(0.2, 0.02), Shared(0.3, 0.02, -0.005)]
)
def test_the_stated_uncertainty_of_a_ratio_is_its_scatter(shared):
    """20 000 records with a drawn offset, a drawn gain and fresh noise: their scatter is the truth."""
    rng = np.random.default_rng(0)
    noise = 0.05
    matrix = [[shared.offset_N**2, shared.covariance_N], [shared.covariance_N, shared.gain**2]]
    offset, gain = rng.multivariate_normal([0, 0], matrix, 20_000).T
    P0, switch = (F * (1 + gain) + offset + rng.normal(0, noise, gain.size) for F in (TRUE_P0, TRUE_SWITCH))
    drop = TRUE_DROP * (1 + gain) + rng.normal(0, np.sqrt(2) * noise, gain.size)

    def std(force):
        return float(np.sqrt(noise**2 + shared.variance(force)))

    initial = Initial(0.0, 0.0, TRUE_P0, std(TRUE_P0), 0, "")
    stated = over_initial(Quantity(TRUE_SWITCH, std(TRUE_SWITCH)), initial, shared)
    assert stated.value == 1.8
    # Scatter of 20 000 draws: 0.5 %; the second order of the ratio: (0.3 / 10)^2 of it.
    assert stated.std == pytest.approx(np.std(switch / P0), rel=0.03)
    drop_std = float(np.hypot(np.sqrt(2) * noise, shared.gain * TRUE_DROP))
    fall = over_initial(Quantity(TRUE_DROP, drop_std), initial, shared, offsets=0.0)
    assert fall.std == pytest.approx(np.std(drop / P0), rel=0.03)


def test_offset_and_gain_are_told_apart_by_how_the_uncertainty_grows():
    force = np.linspace(5.0, 20.0, 50)
    curve = Curve(force, force, np.zeros(50), np.hypot(0.2, 0.03 * force), 0.1)
    assert curve.shared == pytest.approx((0.2, 0.03, 0.0), abs=1e-6)
    falling = Shared(0.4, 0.02, -0.006)
    stds = np.sqrt([falling.variance(value) for value in force])
    assert Curve(force, force, np.zeros(50), stds, 0.1).shared == pytest.approx(falling, rel=1e-6)
    level = Curve(force, force, np.zeros(50), np.full(50, 0.2), 0.1)
    assert level.shared == pytest.approx((0.2, 0.0, 0.0), abs=1e-6)


def test_without_an_initial_force_there_is_no_ratio():
    nothing = Initial(np.nan, np.nan, np.nan, np.nan, -1, "late")
    assert np.isnan(over_initial(Quantity(18.0, 0.1), nothing, Shared(0.1, 0.0)).value)
