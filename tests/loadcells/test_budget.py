"""First-order propagation against brute force: many draws of every source at once (JCGM 101:2008)."""

from dataclasses import replace

import numpy as np
import pytest

from ploughval.loadcells.bending import CellGeometry, horizontal_force, line_of_action, moments
from ploughval.loadcells.budget import Sources, Term, arm_std, budget_table, force_std
from ploughval.loadcells.response import CellResponse

SPACING, LOWER = 150.0, 260.0
GAIN = np.array([2.0, -0.5])
ZERO = np.zeros(2)


def cells_of(force, arm):
    """Moments (2, N) by statics."""
    return np.stack(moments(np.atleast_1d(force), np.atleast_1d(arm), SPACING, LOWER))


def sources(*terms, gain_relative_std=(0.0, 0.0), spacing_std_mm=0.0, lower_to_tip_std_mm=0.0):
    response = CellResponse.constant(GAIN, np.abs(GAIN) * np.asarray(gain_relative_std))
    return Sources(terms, response, CellGeometry(SPACING, LOWER, spacing_std_mm, lower_to_tip_std_mm))


def features_of(cells):
    """Readings (2, N) that the constants turn into moments (2, N)."""
    return cells / GAIN[:, None]


NOISE = Term("noise", np.array([[4e-4, 1e-4], [1e-4, 2e-4]]), 1.0, ZERO)
FRICTION = Term("friction", np.array([[4e-4, 2.4e-4], [2.4e-4, 1.44e-4 + 1e-6]]), 1.0, np.array([1.0, 0.6]))
CASES = {
    "noise": ((NOISE,), {}),
    "friction": ((FRICTION,), {}),
    "gains": ((), {"gain_relative_std": (0.004, 0.003)}),
    "geometry": ((), {"spacing_std_mm": 0.6, "lower_to_tip_std_mm": 0.8}),
}
CASES["all"] = (
    (NOISE, FRICTION),
    {key: value for _, changes in CASES.values() for key, value in changes.items()},
)


@pytest.mark.parametrize("name", CASES)
def test_stated_deviations_are_those_of_many_draws(name):
    terms, changes = CASES[name]
    given = sources(*terms, **changes)
    cells = cells_of(40.0, 12.0)
    rng = np.random.default_rng(7)
    n = 400_000
    total = sum((term.cov for term in terms), np.zeros((2, 2)))
    drawn = cells + rng.multivariate_normal(np.zeros(2), total, n).T
    relative = np.asarray(changes.get("gain_relative_std", (0.0, 0.0)))
    drawn = drawn * (1 + relative[:, None] * rng.normal(size=(2, n)))
    spacing = SPACING + given.geometry.spacing_std_mm * rng.normal(size=n)
    lower = LOWER + given.geometry.lower_to_tip_std_mm * rng.normal(size=n)
    F = (drawn[0] - drawn[1]) * 1000 / spacing
    a = lower - 1000 * drawn[1] / F
    # Scatter of a standard deviation from 400 000 draws: 0.11 %; second order of 1 % deviations: below 0.1 %.
    assert force_std(features_of(cells), given)[0] == pytest.approx(F.std(), rel=0.01)
    assert arm_std(features_of(cells), given)[0] == pytest.approx(a.std(), rel=0.01)


@pytest.mark.parametrize("count", [2, 3, 5, 10])
@pytest.mark.parametrize("noise_N", [0.0, 0.05, 0.2])
def test_the_interval_holds_95_per_cent_however_few_the_empty_runs(count, noise_N):
    rng = np.random.default_rng(count)
    n = 2000
    levels = 0.1 * rng.normal(size=(n, count + 1))  # N, at the tip: the lower cell feels force x 0.26 m
    error = levels[:, -1] - levels[:, :-1].mean(axis=1) + noise_N * rng.normal(size=n)
    spread = levels[:, :-1].var(axis=1, ddof=1) * (1 + 1 / count)
    features = features_of(cells_of(40.0, 0.0))
    unit = cells_of(1.0, 0.0)
    inside = []
    for k in range(n):
        given = sources(
            Term("noise", noise_N**2 * unit @ unit.T, 1.0, ZERO),
            Term("friction", spread[k] * unit @ unit.T, 1.0, ZERO, count - 1.0),
        )
        inside.append(abs(error[k]) <= 1.96 * force_std(features, given)[0])
    # Binomial scatter of 2000 draws: 0.5 %; three of those around 93 to 97 %.
    assert 0.915 <= np.mean(inside) <= 0.985


@pytest.mark.parametrize("dof", [2, 5, 20])
def test_the_interval_holds_95_per_cent_however_few_the_points_of_the_calibration(dof):
    rng = np.random.default_rng(dof)
    cells = cells_of(40.0, 12.0)
    true_std = 0.004 * np.abs(GAIN)
    inside = []
    for error, spread in zip(rng.normal(size=(4000, 2)), rng.chisquare(dof, 4000) / dof, strict=True):
        response = replace(CellResponse.constant(GAIN, true_std * np.sqrt(spread)), dof=float(dof))
        moved = (GAIN + true_std * error) / GAIN  # of the moments that the same readings give
        off = (cells[0] * moved[0] - cells[1] * moved[1] - cells[0] + cells[1]) * 1000 / SPACING
        std = force_std(features_of(cells), Sources((), response, CellGeometry(SPACING, LOWER)))
        inside.append(abs(off[0]) <= 1.96 * std[0])
    # Student's: exactly 95 %; binomial scatter of 4000 draws 0.34 %, three of those.
    assert np.mean(inside) == pytest.approx(0.95, abs=0.0103)


def test_a_source_counts_only_where_its_weight_says():
    given = sources(Term("friction", FRICTION.cov, np.array([0.0, 1.0, 4.0]), ZERO))
    std = force_std(features_of(cells_of(np.full(3, 40.0), np.full(3, 10.0))), given)
    assert std[0] == 0
    assert std[1] > 0
    assert std[2] == pytest.approx(2 * std[1], rel=1e-12)


def table_of(given, cells, weights):
    terms = tuple(replace(term, weight=weights[term.name]) for term in given.terms)
    return budget_table(features_of(cells)[:, :1], replace(given, terms=terms))


def test_the_table_adds_up_to_the_stated_variance():
    given = sources(*CASES["all"][0], **CASES["all"][1])
    cells = cells_of(40.0, 12.0)
    table = table_of(given, cells, {"noise": 1.0, "friction": 1.0})
    assert table["share"].sum() == pytest.approx(1.0)
    assert table["arm_share"].sum() == pytest.approx(1.0)
    alone = table[table["source"].str.startswith(("calibration", "spacing", "lower_to_tip"))]
    assert len(alone) == 4
    for total, sensitivity, share in (
        (force_std(features_of(cells), given)[0], "sensitivity_N", "share"),
        (arm_std(features_of(cells), given)[0], "sensitivity_mm", "arm_share"),
    ):
        np.testing.assert_allclose(
            (alone[sensitivity] * alone["std"]) ** 2, alone[share] * total**2, rtol=1e-12
        )
    spacing = table.set_index("source").loc["spacing"]
    assert spacing["sensitivity_N"] == pytest.approx(-40.0 / SPACING)
    assert horizontal_force(cells[0], cells[1], SPACING)[0] == pytest.approx(40.0)
    assert line_of_action(cells[1], np.array([40.0]), LOWER)[0] == pytest.approx(12.0)
