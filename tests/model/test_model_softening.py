"""Friction against slip: the scalar kernel and its array twin agree with the straight line."""

import math

import numpy as np
import pytest

from ploughval.model.softening import mobilised_friction_deg, tan_mobilised


@pytest.mark.parametrize("length", [0.0, 1e-3, 1.0, 50.0])
def test_kernel_and_arrays_give_the_same_friction(length):
    slip = np.array([0.0, 1e-9, 5e-4, 0.3, 1.0, 70.0])
    arrays = mobilised_friction_deg(slip, 50.0, 32.0, length)
    kernel = [math.degrees(math.atan(tan_mobilised(s, *np.radians([50.0, 32.0]), length))) for s in slip]
    np.testing.assert_allclose(arrays, kernel, atol=1e-12)


def test_friction_is_peak_when_fresh_and_residual_past_the_length():
    assert mobilised_friction_deg([0.0, 2.0, 9.0], 50.0, 32.0, 2.0).tolist() == [50.0, 32.0, 32.0]
    assert mobilised_friction_deg([0.0, 1e-12], 50.0, 32.0, 0.0).tolist() == [50.0, 32.0]
