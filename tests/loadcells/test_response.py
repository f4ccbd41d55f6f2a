"""What readings mean, against polynomials written by hand."""

import numpy as np
import pytest

from ploughval.loadcells.response import CURVED, CellResponse

C = np.array([[2.0, 0.1, 0.03, 0.0], [-0.2, 3.0, 0.0, -0.05]])
NONE = np.zeros((2, 4))
CURVE = CellResponse(CURVED, C, np.zeros((2, 4, 2, 4)), NONE, NONE)


def by_hand(upper, lower):
    return np.array([2 * upper + 0.1 * lower + 0.03 * upper**2, -0.2 * upper + 3 * lower - 0.05 * lower**2])


def test_moments_are_the_polynomials_written_by_hand():
    readings = np.random.default_rng(0).normal(size=(2, 50))
    np.testing.assert_allclose(CURVE.moments(readings), by_hand(*readings), rtol=1e-13, atol=1e-13)


def test_products_of_both_readings_are_features_too():
    both = CellResponse(
        ((1, 1), (0, 0)), np.eye(2), np.zeros((2, 2, 2, 2)), np.zeros((2, 2)), np.zeros((2, 2))
    )
    np.testing.assert_allclose(both.features(np.array([[2.0], [5.0]])), [[10.0], [1.0]])
    np.testing.assert_allclose(both.slopes(np.array([2.0, 5.0])), [[5.0, 2.0], [0.0, 0.0]])


@pytest.mark.parametrize("at", [(0.0, 0.0), (1.5, -0.7)])
def test_slopes_are_differences_of_the_moments(at):
    upper, lower = at
    step = 1e-6
    differences = np.column_stack(
        [
            (by_hand(upper + step, lower) - by_hand(upper - step, lower)) / (2 * step),
            (by_hand(upper, lower + step) - by_hand(upper, lower - step)) / (2 * step),
        ]
    )
    np.testing.assert_allclose(CURVE.slopes(np.array(at)), differences, atol=1e-8)


def test_missing_readings_have_no_moment():
    moments = CURVE.moments(np.array([[1.0, np.nan], [1.0, 1.0]]))
    assert np.isfinite(moments[:, 0]).all()
    assert np.isnan(moments[:, 1]).all()


def test_constants_keep_their_deviations():
    two = CellResponse.constant(np.array([2.0, -3.0]), np.array([0.1, 0.2]))
    assert two.cov[0, 0, 0, 0] == pytest.approx(0.01)
    assert two.cov[1, 1, 1, 1] == pytest.approx(0.04)
    assert two.cov.sum() == pytest.approx(0.05)
    assert two.dof == np.inf
