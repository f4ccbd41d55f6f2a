"""Laying the record on the model: switches on switches, softening unstretched, the price of the stretch."""

import numpy as np
import pytest

from ploughval.model.fit.registration import Teeth, laid_on, prices, starts_in_record, teeth_of

TEETH = Teeth(
    place_mm=np.array([0.0, 20.0, 50.0]),
    soft_mm=np.array([1.0, 1.5, 1.5]),
    middle_mm=np.array([0.4, 0.6, 0.7]),
    drop=np.array([0.5, 0.4, 0.4]),
)


def test_switches_of_the_record_lie_on_those_of_the_model():
    u = np.array([0.0, 22.0, 48.0])
    assert laid_on(u, 0.0, np.array([22.0, 48.0]), 60.0, TEETH) == pytest.approx([0.0, 20.0, 50.0])


def test_softening_is_not_stretched_and_the_rest_of_a_tooth_is():
    places = np.array([22.0, 48.0])
    travel = laid_on(np.array([0.5, 1.0, 11.5, 23.0]), 0.0, places, 60.0, TEETH)
    # from (1, 1) to (22, 20): 19 mm of the model in 21 mm of the record; 1 mm after the switch: 1 mm
    assert travel == pytest.approx([0.5, 1.0, 1.0 + 10.5 * 19.0 / 21.0, 21.0])


def test_the_last_tooth_goes_on_unstretched_unless_the_model_switches_first():
    after = laid_on(np.array([60.0]), 0.0, np.array([22.0, 48.0]), 60.0, TEETH)
    assert after == pytest.approx([62.0])
    # one switch in the record, which ends 38 mm after it; the model's tooth is over after 30 mm
    short = laid_on(np.array([60.0]), 0.0, np.array([22.0]), 60.0, TEETH)
    assert short == pytest.approx([50.0])


def test_travel_of_the_model_never_goes_back():
    rng = np.random.default_rng(5)
    u = np.linspace(0.0, 70.0, 400)
    for _ in range(200):
        places = np.sort(rng.uniform(2.0, 65.0, 2))
        start = float(rng.uniform(0.0, 1.5))
        assert np.all(np.diff(laid_on(u, start, places, 70.0, TEETH)) >= 0.0)


def test_stretch_costs_its_share_of_a_tooth_over_what_is_allowed():
    cost = prices(0.0, np.array([22.0, 49.0]), 60.0, TEETH, (0.05, 0.0))
    # teeth of 22 and 27 mm for 20 and 30: 10 % too long, 10 % too short; no switch is missing
    assert cost == pytest.approx([2.0, -2.0, 0.0])


def test_a_switch_that_the_record_does_not_show_costs_what_its_tooth_lacks():
    cost = prices(0.0, np.array([20.0]), 65.0, TEETH, (0.05, 0.0))
    # the tooth should have ended after 30 mm and goes on for 45; both switches fall alike
    assert cost == pytest.approx([0.0, (45.0 - 30.0) / (0.05 * 30.0) * 0.4 / 0.5])


def test_a_switch_that_the_model_does_not_have_costs_a_whole_tooth():
    one = Teeth(np.array([0.0]), np.array([1.0]), np.array([0.4]), np.array([0.5]))
    assert prices(0.0, np.array([20.0]), 30.0, one, (0.05, 0.0)) == pytest.approx([20.0, 0.0])


def test_falls_of_record_and_model_are_laid_on_each_other_half_way():
    middles = np.array([22.6, 48.7, 70.0])
    assert starts_in_record(middles, TEETH) == pytest.approx([22.0, 48.0, 70.0 - 0.7])


def test_teeth_are_read_from_a_march():
    # u, -, force, -, -, -, band, slip: a fall to half over 2 mm, a switch with a fall of 1 %, one to half
    rows = np.zeros((8, 8))
    rows[:, 0] = [0, 1, 2, 10, 11, 20, 22, 30]
    rows[:, 2] = [4, 3, 2, 4, 3.96, 5, 2.5, 4]
    rows[:, 6] = [0, 0, 0, 1, 1, 2, 2, 2]
    rows[:, 7] = [0, 1, 2, 0, 1, 0, 2, 10]
    teeth = teeth_of(rows, 2.0, 0.05)
    assert teeth.place_mm.tolist() == [0.0, 20.0]
    assert teeth.soft_mm.tolist() == [2.0, 2.0]
    assert teeth.middle_mm == pytest.approx([1.0, 1.0])
    assert teeth.drop == pytest.approx([0.5, 0.5])
