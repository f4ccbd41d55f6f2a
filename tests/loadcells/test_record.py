"""The whole chain from readings to force and arm, against draws of every source (JCGM 101:2008, 7)."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from ploughval.axes import BUDGET_COLUMNS
from ploughval.loadcells.bending import CellGeometry, moments
from ploughval.loadcells.budget import Term
from ploughval.loadcells.drift import zero_line
from ploughval.loadcells.friction import Friction
from ploughval.loadcells.record import (
    ARM_LIMIT,
    Rig,
    force_from_readings,
    mean_budget,
    mean_load,
    mean_sample,
)
from ploughval.loadcells.response import CURVED, CellResponse
from ploughval.loadcells.zero import Zero

SPACING, LOWER = 150.0, 260.0
GEOMETRY = CellGeometry(SPACING, LOWER, 0.4, 0.5)
STRAIGHT = np.array([[2.0, 0.05], [-0.08, 3.0]])  # N m per unit, with cross-talk
N = 300_000


def lever(spacing, lower):
    """Moments (2,) of a force and of its moment about the tip, N and N mm: (2, 2)."""
    return np.array([[lower + spacing, -1.0], [lower, -1.0]]) * 1e-3


def known_forces(straight):
    """Change of constants found from known forces at known arms with the geometry: per mm of each length."""
    per_reading = np.linalg.solve(lever(SPACING, LOWER), straight)  # force and moment about the tip
    return np.array([[1e-3, 0], [0, 0]]) @ per_reading, np.array([[1e-3, 0], [1e-3, 0]]) @ per_reading


def curved(*, moves=True):
    """A response with cross-talk and second order, full covariance, that may move with the geometry."""
    rng = np.random.default_rng(11)
    coefficients = np.hstack([STRAIGHT, np.array([[0.03, 0.0], [0.0, -0.04]])])
    draw = rng.normal(size=(8, 8)) * np.repeat([0.002, 0.0015], 4)[:, None]
    by_spacing, by_lower = (np.hstack([b, np.zeros((2, 2))]) * moves for b in known_forces(STRAIGHT))
    cov = (draw @ draw.T / 8).reshape(2, 4, 2, 4)
    return CellResponse(CURVED, coefficients, cov, by_spacing, by_lower)


START = Zero(
    mean=np.array([0.30, -0.10]),
    noise_cov=np.array([[9e-6, 3e-6], [3e-6, 4e-6]]),
    mean_cov=np.array([[4e-6, 2e-6], [2e-6, 4e-6]]),
    drift=np.array([0.004, 0.001]),
    drift_cov=np.array([[1e-6, 5e-7], [5e-7, 1e-6]]),
    rows=500,
    middle_s=5.0,
    end_s=10.0,
    span_s=10.0,
)
END = replace(START, mean=np.array([0.33, -0.11]), middle_s=105.0, end_s=110.0)
FRICTION = Friction(
    features=np.array([[0.9], [0.4], [0.81], [0.16]]),
    u_mm=np.zeros(1),
    cov=np.array([[2.5e-3, 1.5e-3], [1.5e-3, 1.2e-3]]),
    dof=np.inf,
    variation_cov=np.array([[9e-4, 6e-4], [6e-4, 5e-4]]),
    runs=30,
    reason="",
)
TIME = np.array([5.0, 40.0, 60.0])
READINGS = np.array([[0.30, 6.8, 6.9], [-0.10, 2.6, 2.7]])
MOVING = np.array([False, True, True])


@dataclass(frozen=True)
class Chain:
    """One way to know the rig, and the same chain written out for draws."""

    response: CellResponse
    end: Zero | None
    geometry: CellGeometry = GEOMETRY
    more: tuple[Term, ...] = ()

    @property
    def line(self):
        return zero_line(TIME, START, self.end)

    def stated(self):
        rig = Rig(self.geometry, self.response, START.noise_cov)
        return force_from_readings(READINGS, rig, self.line, moving=MOVING, friction=FRICTION, more=self.more)

    def drawn(self, row, rng):
        """Force and arm (N,) of one row, every source drawn."""
        line, response, geometry = self.line, self.response, self.geometry
        offset = np.broadcast_to(line.offset, READINGS.shape)[:, [row]]
        r = READINGS[:, [row]] - offset + rng.multivariate_normal(np.zeros(2), START.noise_cov, N).T
        for _, cov, weight, _ in line.parts:
            weight = np.broadcast_to(weight, TIME.shape)[row]
            r = r - rng.multivariate_normal(np.zeros(2), weight * cov, N).T
        ds, dl = (
            geometry.spacing_std_mm * rng.normal(size=N),
            geometry.lower_to_tip_std_mm * rng.normal(size=N),
        )
        cov = response.cov.reshape(8, 8)
        c = rng.multivariate_normal(response.coefficients.ravel(), cov, N, method="cholesky").reshape(N, 2, 4)
        c = c + ds[:, None, None] * response.by_spacing + dl[:, None, None] * response.by_lower_to_tip
        features = np.stack([r[0], r[1], r[0] ** 2, r[1] ** 2])
        if MOVING[row]:
            features = features - FRICTION.features
        m = np.einsum("nik,kn->in", c, features)
        if MOVING[row]:
            m -= rng.multivariate_normal(np.zeros(2), FRICTION.cov + FRICTION.variation_cov, N).T
        for term in self.more:
            m += rng.multivariate_normal(np.zeros(2), term.cov, N).T
        force = 1000 * (m[0] - m[1]) / (geometry.spacing_mm + ds)
        return force, geometry.lower_to_tip_mm + dl - 1000 * m[1] / force


CHAINS = {
    "one rest, constants given": Chain(curved(moves=False), None),
    "one rest, known forces": Chain(curved(), None),
    "two rests, known forces": Chain(curved(), END),
    "smoothed": Chain(
        curved(), END, more=(Term("smoothing", np.array([[4e-3, 2e-3], [2e-3, 1e-3]]), 1.0, np.zeros(2)),)
    ),
}


@pytest.mark.parametrize("name", CHAINS)
@pytest.mark.parametrize("row", [1, 2])
def test_stated_deviations_of_the_whole_chain_are_those_of_its_draws(name, row):
    chain = CHAINS[name]
    found = chain.stated()
    force, arm = chain.drawn(row, np.random.default_rng(row))
    # 300 000 draws: 0.13 %. Second order of relative deviations of 1 to 2 % adds less than 0.1 % to the force
    # and, divided by it, 0.5 % to the arm; the slopes of the readings are those of the mean reading.
    assert found.force_std_N[row] == pytest.approx(force.std(), rel=0.01)
    assert found.arm_std_mm[row] == pytest.approx(arm.std(), rel=0.02)
    assert found.force_N[row] == pytest.approx(force.mean(), abs=0.02 * force.std())
    assert found.arm_mm[row] == pytest.approx(arm.mean(), abs=0.05 * arm.std())


def test_before_motion_nothing_of_friction_counts():
    straight = np.hstack([STRAIGHT, np.zeros((2, 2))])
    chain = Chain(replace(curved(), coefficients=straight), END)
    force, _ = chain.drawn(0, np.random.default_rng(3))
    assert chain.stated().force_std_N[0] == pytest.approx(force.std(), rel=0.01)


@pytest.mark.parametrize("name", CHAINS)
def test_the_budget_adds_up_and_its_sensitivities_are_differences_of_the_chain(name):
    chain = CHAINS[name]
    found = chain.stated()
    last = np.array([False, False, True])
    table = mean_budget(mean_sample(found, last))
    assert tuple(table.columns) == BUDGET_COLUMNS
    assert table["share"].sum() == pytest.approx(1.0, abs=1e-12)
    assert table["arm_share"].sum() == pytest.approx(1.0, abs=1e-12)
    assert table["source"].is_unique
    rows = table.set_index("source")
    features, response, geometry = found.features[:, 2], chain.response, chain.geometry

    def result(coefficients, ds=0.0, dl=0.0, dm=(0.0, 0.0)):
        moved = coefficients + ds * response.by_spacing + dl * response.by_lower_to_tip
        m = moved @ features + dm
        force = 1000 * (m[0] - m[1]) / (geometry.spacing_mm + ds)
        return np.array([force, geometry.lower_to_tip_mm + dl - 1000 * m[1] / force])

    def check(source, up, down, step):
        np.testing.assert_allclose(
            rows.loc[source, ["sensitivity_N", "sensitivity_mm"]].to_numpy(float), (up - down) / (2 * step),
            rtol=1e-6, atol=1e-7,
        )  # fmt: skip

    c = response.coefficients
    check("spacing", result(c, ds=1e-3), result(c, ds=-1e-3), 1e-3)
    check("lower_to_tip", result(c, dl=1e-3), result(c, dl=-1e-3), 1e-3)
    for k, cell in enumerate(("upper", "lower")):
        unit = np.eye(2)[k] * 1e-5
        check(f"friction, {cell} cell", result(c, dm=unit), result(c, dm=-unit), 1e-5)
        step = np.zeros((2, 4))
        step[k, k] = 1e-5
        check(f"calibration, {cell} cell", result(c + step), result(c - step), 1e-5)
        step = np.zeros((2, 4))
        step[k, 2 + k] = 1e-5
        check(f"second order of the calibration, {cell} cell", result(c + step), result(c - step), 1e-5)


def shared(spacing_std, lower_std):
    by_spacing, by_lower = known_forces(STRAIGHT)
    response = CellResponse(CURVED[:2], STRAIGHT, np.zeros((2, 2, 2, 2)), by_spacing, by_lower)
    rig = Rig(CellGeometry(SPACING, LOWER, spacing_std, lower_std), response, np.zeros((2, 2)))
    still = zero_line(TIME, replace(START, mean=np.zeros(2), mean_cov=np.zeros((2, 2)), drift=np.zeros(2)))
    cells = np.stack(moments(np.array([0.0, 30.0, 40.0]), np.array([0.0, 12.0, 60.0]), SPACING, LOWER))
    return force_from_readings(np.linalg.solve(STRAIGHT, cells), rig, still, moving=MOVING)


def test_known_forces_at_known_arms_leave_no_doubt_about_either_length():
    # M = F (lower_to_tip [+ spacing] - arm) in calibration and test alike: force and arm are those hung on,
    # whatever the lengths are called.
    found = shared(2.0, 5.0)
    np.testing.assert_allclose(found.force_N[1:], [30.0, 40.0], rtol=1e-12)
    np.testing.assert_allclose(found.arm_mm[1:], [12.0, 60.0], rtol=1e-10)
    np.testing.assert_allclose(found.force_std_N[1:], 0.0, atol=1e-12)
    np.testing.assert_allclose(found.arm_std_mm[1:], 0.0, atol=1e-10)


def plain(readings, *, noise=0.004, spacing=SPACING):
    rig = Rig(
        CellGeometry(spacing, LOWER), CellResponse.constant(np.ones(2), np.zeros(2)), np.eye(2) * noise**2
    )
    still = replace(START, mean=np.zeros(2), mean_cov=np.zeros((2, 2)), drift=np.zeros(2))
    return force_from_readings(
        readings,
        rig,
        zero_line(np.arange(readings.shape[1], dtype=float), still),
        moving=np.ones(readings.shape[1], bool),
    )


@pytest.mark.parametrize("noise", [0.0, 0.004])
def test_a_force_that_crosses_zero_has_an_arm_near_the_true_one_or_none(noise):
    rng = np.random.default_rng(4)
    force = np.linspace(-20, 20, 40_001)
    cells = np.stack(moments(force, np.full(force.size, 10.0), SPACING, LOWER))
    found = plain(cells + rng.normal(0, noise, cells.shape), noise=noise)
    shown = np.isfinite(found.arm_mm)
    assert (found.small == ~shown).all()
    if noise == 0:
        np.testing.assert_allclose(found.arm_mm[shown], 10.0, atol=1e-6)
        return
    assert (np.abs(found.force_N[shown]) >= ARM_LIMIT * found.force_std_N[shown]).all()
    assert 0.9 < shown.mean() < 1
    # The arm is 10 mm less (e_lower + 0.25 m e_force) / F: at five deviations of the force its own is a fifth
    # of spacing / sqrt(2) x hypot(250, 400) / 150 = 334 mm, 67 mm; six of those, the force being four sigma.
    reach = np.hypot(LOWER - 10, LOWER - 10 + SPACING) / np.sqrt(2)
    assert np.abs(found.arm_mm[shown] - 10).max() < 6 * reach / ARM_LIMIT
    assert found.arm_std_mm[shown].max() < 2 * reach / ARM_LIMIT


def test_exact_zero_and_missing_readings_are_empty_without_a_warning():
    found = plain(np.array([[1.0, 1.0, np.nan, 3.0], [1.0, 1.0, 1.0, 1.0]]), noise=0.0)
    assert np.isnan(found.arm_mm[:3]).all()
    assert np.isnan(found.force_std_N[2])
    assert np.isfinite(found.arm_mm[3])


def test_cells_one_millimetre_apart_have_a_wide_force_and_say_so():
    force = np.full(5000, 30.0)
    cells = np.stack(moments(force, np.full(5000, 10.0), 1.0, LOWER))
    noisy = cells + np.random.default_rng(5).normal(0, 0.004, cells.shape)
    found = plain(noisy, spacing=1.0)
    # 0.004 N m x sqrt(2) / 0.001 m; the scatter of 5000 draws is 1 %.
    assert found.force_std_N[0] == pytest.approx(0.004 * np.sqrt(2) * 1000, rel=1e-12)
    assert (found.force_N - 30).std() == pytest.approx(found.force_std_N[0], rel=0.05)
    assert np.isfinite(found.arm_mm).mean() < 0.7


@pytest.mark.parametrize("name", CHAINS)
def test_the_mean_load_of_one_row_is_that_row(name):
    found = CHAINS[name].stated()
    for row in range(3):
        mean = mean_load(mean_sample(found, np.arange(3) == row))
        np.testing.assert_allclose(
            [mean.force_N, mean.force_std_N, mean.arm_mm, mean.arm_std_mm],
            [values[row] for values in (found.force_N, found.force_std_N, found.arm_mm, found.arm_std_mm)],
            rtol=1e-9,
        )


def test_without_load_there_is_no_mean_load():
    mean = mean_load(mean_sample(next(iter(CHAINS.values())).stated(), np.zeros(3, bool)))
    assert np.isnan([mean.force_N, mean.force_std_N, mean.arm_mm, mean.arm_std_mm]).all()


def test_friction_taken_off_the_force_alone_is_no_source_of_the_arm():
    chain = CHAINS["one rest, constants given"]
    rig = Rig(chain.geometry, chain.response, START.noise_cov)
    found = force_from_readings(READINGS, rig, chain.line, moving=MOVING, friction=FRICTION, per_cell=False)
    last = np.array([False, False, True])
    table = mean_budget(mean_sample(found, last)).set_index("source")
    assert table["share"].sum() == pytest.approx(1.0)
    assert table["arm_share"].sum() == pytest.approx(1.0)
    friction = table[table.index.str.startswith("friction")]
    assert len(friction) == 4
    assert (friction["share"] != 0).any()
    assert (friction[["sensitivity_mm", "arm_share"]] == 0).all(axis=None)
    # The arm is that of sand and friction together: its length's part is 0.5 mm of the stated deviation.
    assert table.loc["lower_to_tip", "arm_share"] == pytest.approx((0.5 / found.arm_std_mm[2]) ** 2, rel=1e-6)
