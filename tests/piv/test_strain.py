"""Strain of homogeneous motions by its named measures, and its noise floor."""

import numpy as np
import pytest

from ploughval.errors import CorrelationError
from ploughval.piv.strain import StrainMeasure, strain_field, strain_of


def points():
    return np.random.default_rng(5).uniform(0, 200, (400, 2))


def test_homogeneous_motion_gives_its_strain_to_rounding():
    p, gradient = points(), np.array([[0.05, 0.12], [-0.03, -0.08]])
    field = strain_field(p, p @ gradient.T, gauge_px=60)
    f = np.eye(2) + gradient
    assert np.abs(field.strain - (f.T @ f - np.eye(2)) / 2).max() < 1e-10
    assert field.measure is StrainMeasure.GREEN_LAGRANGE


def test_rigid_rotation_strains_nothing_but_the_small_measure():
    angle = np.deg2rad(20)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) - np.eye(2)
    for measure in ("green_lagrange", "hencky"):
        assert np.abs(strain_of(turn[None], measure)).max() < 1e-12
    # Closed form: small strain of a rotation is cos(angle) - 1.
    assert strain_of(turn[None], "small")[0, 0, 0] == pytest.approx(np.cos(angle) - 1)


def test_hencky_strain_of_a_stretch_is_its_logarithm():
    assert strain_of([[[0.3, 0.0], [0.0, -0.1]]], "hencky")[0] == pytest.approx(np.diag(np.log([1.3, 0.9])))


def test_noise_floor_is_the_scatter_of_the_gradient():
    p, rng = points(), np.random.default_rng(6)
    drawn = [strain_field(p, rng.normal(0, 0.02, p.shape), gauge_px=60, std_px=0.02) for _ in range(60)]
    scatter = np.std([d.gradient for d in drawn], axis=0)
    ratio = np.sqrt(np.nanmean(scatter**2, axis=(1, 2))) / drawn[0].floor
    assert np.nanmedian(ratio) == pytest.approx(1.0, abs=0.05)


def test_too_few_neighbours_give_nan_not_zero():
    p = np.array(
        [[0.0, 0.0], [100.0, 0.0], [200.0, 0.0], [210.0, 0.0], [220.0, 0.0], [230.0, 0.0], [240.0, 0.0]]
    )
    field = strain_field(p, p * 0.1, gauge_px=80)
    assert np.isnan(field.strain).all()  # alone, or on one line


def test_a_gauge_that_is_not_positive_is_refused():
    with pytest.raises(CorrelationError, match="gauge_px"):
        strain_field(points(), points(), gauge_px=0)
