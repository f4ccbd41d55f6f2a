"""Contact of the blade with sand that begins at a known travel."""

import numpy as np
import pytest

from ploughval.loadcells.contact import find_contact

GAP_MM = 3.0
RISES = {
    "step": lambda u: np.where(u > 0, 30.0, 0.0),
    "steep": lambda u: np.clip(60 * u, 0, 30.0),
    "slow": lambda u: np.clip(3 * u, 0, 30.0),
    "root": lambda u: 10 * np.sqrt(np.clip(u, 0, 9.0)),
}


def record(rise, noise_N, seed, *, gap=GAP_MM, level=0.0, sign=1):
    """100 rows a mm at rest for 5 s, then 1 mm/s."""
    t = np.arange(0, 35, 0.01)
    u = np.clip(t - 5, 0, None)
    force = np.where(u > 0, RISES[rise](u - gap) + level, 0.0)
    return t, sign * u, force + np.random.default_rng(seed).normal(0, noise_N, t.size)


@pytest.mark.parametrize("rise", RISES)
@pytest.mark.parametrize("noise_N", [0.0, 0.05, 0.5, 3.0])
def test_sand_that_begins_3_mm_on_is_met_within_three_standard_uncertainties(rise, noise_N):
    errors = []
    for seed in range(60):
        t, u, force = record(rise, noise_N, seed)
        found = find_contact(t, u, force, onset=501, noise_N=noise_N)
        assert found is not None
        assert found.u_mm == pytest.approx(found.time_s - 5, abs=1e-9)
        errors.append((found.u_mm - GAP_MM) / found.std_mm)
    assert np.mean(np.abs(errors) <= 3) >= 0.95
    assert np.sqrt(np.mean(np.square(errors))) < 2


@pytest.mark.parametrize(
    ("rise", "noise_N", "most_mm"), [("step", 0.5, 0.05), ("steep", 0.5, 0.05), ("slow", 0.05, 0.1)]
)
def test_the_stated_uncertainty_is_of_use(rise, noise_N, most_mm):
    found = find_contact(*record(rise, noise_N, 0), onset=501, noise_N=noise_N)
    assert found.std_mm < most_mm


def test_a_displacement_coarser_than_the_rise_gives_a_contact_within_its_step():
    t = np.arange(0, 20, 0.02)
    travel = np.clip(t - 5, 0, None)
    u = np.floor(travel)  # steps of 1 mm: none while the force rises
    force = 10 * np.clip((travel - 0.4) / 0.05, 0, 1) + np.random.default_rng(0).normal(0, 0.01, t.size)
    found = find_contact(t, u, force, onset=250, noise_N=0.01)
    assert found is not None
    assert found.time_s == pytest.approx(5.4, abs=0.1)  # rows of 0.02 s, five of them averaged
    assert abs(found.u_mm - 0.4) < 2 * found.std_mm
    assert found.std_mm == pytest.approx(1 / np.sqrt(3))


def test_travel_may_be_negative():
    found = find_contact(*record("steep", 0.1, 0, sign=-1), onset=501, noise_N=0.1)
    assert found.u_mm == pytest.approx(-GAP_MM, abs=3 * found.std_mm)


def test_a_blade_in_contact_from_the_start_meets_the_sand_at_once():
    t, u, force = record("steep", 0.1, 0, gap=0.0)
    found = find_contact(t, u, force, onset=501, noise_N=0.1)
    assert found.u_mm == pytest.approx(0.0, abs=3 * found.std_mm)
    assert found.std_mm < 0.05


def test_a_force_within_its_noise_is_no_contact():
    t, u, force = record("step", 0.2, 0, gap=1e3)
    assert find_contact(t, u, force, onset=501, noise_N=0.2) is None
    assert find_contact(t, u, 0 * force, onset=501, noise_N=0.0) is None


def test_what_is_left_of_friction_is_no_contact_when_its_uncertainty_is_given():
    t, u, force = record("steep", 0.05, 0, level=0.3)
    fooled = find_contact(t, u, force, onset=501, noise_N=0.05)
    assert fooled.u_mm < 0.1
    found = find_contact(t, u, force, onset=501, noise_N=0.05, level_std_N=0.2)
    assert found.u_mm == pytest.approx(GAP_MM, abs=3 * found.std_mm)


def test_missing_rows_are_passed_over():
    t, u, force = record("steep", 0.1, 0)
    force[790:798], u[810:813] = np.nan, np.nan
    found = find_contact(t, u, force, onset=501, noise_N=0.1)
    # the eight rows about the contact that are missing hold 0.08 mm of travel
    assert found.u_mm == pytest.approx(GAP_MM, abs=0.12)


def test_a_force_that_falls_after_its_first_peak_and_doubles_later_does_not_blur_the_contact():
    t = np.arange(0, 65, 0.01)
    u = np.clip(t - 5, 0, None)
    force = np.where(u > 0, np.where(u < 1, 30 - 16 * u, 14 + 2 * (u - 1)), 0.0)
    force = force + np.random.default_rng(0).normal(0, 0.05, t.size)
    found = find_contact(t, u, force, onset=501, noise_N=0.05, level_std_N=0.3)
    assert found.u_mm == pytest.approx(0.0, abs=0.03)
    assert found.std_mm < 0.03
