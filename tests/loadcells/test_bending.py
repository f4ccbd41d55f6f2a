"""Statics of the two cells against forces and arms that are known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ploughval.loadcells.bending import CellGeometry, horizontal_force, line_of_action, moments


def test_force_and_arm_follow_from_moments_written_by_hand():
    # 20 N at 10 mm above the tip; cells at 260 and 410 mm: moments 20 x 0.25 = 5 and 20 x 0.40 = 8 N m.
    force = horizontal_force(np.array([8.0]), np.array([5.0]), 150.0)
    assert force == pytest.approx([20.0], rel=1e-14)
    assert line_of_action(np.array([5.0]), force, 260.0) == pytest.approx([10.0], abs=1e-12)


@given(st.floats(0.1, 1e4), st.floats(-50.0, 200.0), st.floats(20.0, 1000.0), st.floats(200.0, 2000.0))
def test_moments_and_back_return_force_and_arm(force, arm, spacing, lower):
    upper_Nm, lower_Nm = moments(np.array([force]), np.array([arm]), spacing, lower)
    back = horizontal_force(upper_Nm, lower_Nm, spacing)
    # Cancellation in the difference loses at most lower/spacing = 100 units in the last place.
    assert back == pytest.approx([force], rel=1e-12)
    assert line_of_action(lower_Nm, back, lower) == pytest.approx([arm], abs=1e-8)


def test_moments_of_a_force_at_the_lower_cell_bend_the_upper_cell_alone():
    upper_Nm, lower_Nm = moments(np.array([10.0]), np.array([260.0]), 150.0, 260.0)
    assert lower_Nm[0] == 0
    assert upper_Nm[0] == pytest.approx(1.5)


def test_no_force_has_no_line_of_action():
    assert np.isnan(line_of_action(np.array([1.0]), np.array([0.0]), 260.0)).all()


def test_a_pull_has_the_line_of_action_of_the_push():
    upper_Nm, lower_Nm = moments(np.array([-20.0]), np.array([10.0]), 150.0, 260.0)
    assert horizontal_force(upper_Nm, lower_Nm, 150.0) == pytest.approx([-20.0], rel=1e-14)
    assert line_of_action(lower_Nm, np.array([-20.0]), 260.0) == pytest.approx([10.0], abs=1e-12)


def test_geometry_says_what_a_difference_of_moments_is_worth_and_is_exact_unless_told_otherwise():
    geometry = CellGeometry(spacing_mm=125.0, lower_to_tip_mm=260.0)
    assert geometry.per_Nm == horizontal_force(np.array([1.0]), np.array([0.0]), 125.0)[0] == 8.0
    assert geometry.spacing_std_mm == geometry.lower_to_tip_std_mm == 0.0
