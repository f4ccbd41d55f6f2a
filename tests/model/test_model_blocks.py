"""Two blocks on a bent band: equilibrium, bounds, published coefficients; when two are no better than one."""

import numpy as np
import pytest

from ploughval.errors import ConvergenceError
from ploughval.model.blocks import two_block_force
from ploughval.model.mechanism import initial_force


def unit(angle):
    return np.array([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize(
    ("phi", "wall"), [(30.0, 10.0), (36.0, 5.0), (40.0, 20.0), (40.0, 40.0), (50.0, 10.0)]
)
def test_both_blocks_are_in_equilibrium(phi, wall):
    # statics, which the search does not know: four equations for P and the reactions of two bands and the
    # interface, every one inclined by the friction angle against the sliding
    found = two_block_force(1.0, 1.0, phi, wall)
    assert found.blocks == 2
    phi, wall = np.radians([phi, wall])
    joint, out, top = np.array(found.joint), np.array(found.outcrop), np.array([0.0, 1.0])
    lower, upper, interface = (np.arctan2(*v[::-1]) for v in (joint, out - joint, top - joint))

    def area(*points):
        x, y = np.array(points).T
        return 0.5 * (np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))

    weights = area((0, 0), joint, top), area(joint, out, top)
    push = unit(-wall)
    band1, band2 = unit(lower + phi + np.pi / 2), unit(upper + phi + np.pi / 2)
    on_second = unit(
        interface - phi - np.pi / 2
    )  # of block 1 on block 2: to the right and, sliding up it, down
    system = np.column_stack(
        [
            np.concatenate([push, [0, 0]]),
            np.concatenate([band1, [0, 0]]),
            np.concatenate([[0, 0], band2]),
            np.concatenate([-on_second, on_second]),
        ]
    )
    forces = np.linalg.solve(system, [0.0, weights[0], 0.0, weights[1]])
    assert np.all(forces > 0.0)
    assert forces[0] == pytest.approx(found.force, rel=1e-9)


@pytest.mark.parametrize("phi", [20.0, 30.0, 40.0, 50.0])
@pytest.mark.parametrize("share", [0.0, 0.1, 1 / 3, 0.5, 2 / 3, 0.75])
def test_two_blocks_are_never_dearer_than_one(phi, share):
    wall = share * min(phi, 90.0 - phi)
    one, two = initial_force(30.0, 16e-6, phi, wall), two_block_force(30.0, 16e-6, phi, wall)
    assert two.force <= one
    assert (two.blocks == 2) == (wall > 0.0)
    assert two.force >= initial_force(30.0, 16e-6, phi)  # wall friction never makes it cheaper


def test_coefficients_lie_between_the_published_ones_of_curved_bands_and_coulombs():
    # Caquot and Kerisel (1948), read from their curves to two figures (2.5 % allowed), and Kerisel and Absi
    # for full wall friction: curved bands are the cheapest; two blocks stand between them and Coulomb's one
    published = {
        (25.0, 25 / 3): 3.0,
        (30.0, 10.0): 4.0,
        (30.0, 15.0): 4.5,
        (35.0, 35 / 3): 5.4,
        (35.0, 17.5): 6.0,
        (40.0, 40 / 3): 7.5,
        (40.0, 20.0): 9.0,
        (30.0, 30.0): 6.5,
        (40.0, 40.0): 17.5,
    }
    for (phi, wall), curved in published.items():
        two, one = 2.0 * two_block_force(1.0, 1.0, phi, wall).force, 2.0 * initial_force(1.0, 1.0, phi, wall)
        assert 0.975 * curved < two < one


def bent_band_force(shape, phi, wall):
    """P / (unit weight d^2) by docs/theory-model-two-blocks.md, Eq. (2).

    Shape: angles of both bands in radians, length of the lower in d.
    """
    lower, upper, length = shape
    x, y = length * np.cos(lower), length * np.sin(lower)
    interface = np.arctan2(1.0 - y, -x)
    allowed = lower < upper and lower + phi > 0.0 and y < 1.0 and interface - 2.0 * phi - upper > 0.0
    if not allowed or lower + phi + wall >= np.pi / 2:
        return np.inf
    quicker = np.sin(interface - 2.0 * phi - lower) / np.sin(interface - 2.0 * phi - upper)
    weights = 0.5 * x, 0.5 * (x + (1.0 - y) / np.tan(upper)) * (1.0 - y)
    work = weights[0] * np.sin(lower + phi) + weights[1] * np.sin(upper + phi) * quicker
    return work / np.cos(lower + phi + wall)


@pytest.mark.parametrize("seed", range(3))
def test_no_bent_band_tried_at_random_is_cheaper_than_the_one_found(seed):
    rng = np.random.default_rng(seed)
    phi, wall = np.radians([rng.uniform(25.0, 45.0), rng.uniform(3.0, 25.0)])
    found = two_block_force(1.0, 1.0, *np.degrees([phi, wall])).force
    shapes = rng.uniform([-0.6, 0.05, 0.05], [0.8, 1.2, 2.5], size=(20_000, 3))
    tried = np.array([bent_band_force(shape, phi, wall) for shape in shapes])
    assert found <= tried.min()
    assert tried.min() < 1.1 * found  # the net was fine enough to mean something


def test_force_scales_with_weight_and_the_square_of_the_depth():
    one, other = two_block_force(1.0, 1.0, 36.0, 18.0), two_block_force(30.0, 16e-6, 36.0, 18.0)
    assert other.force == pytest.approx(16e-6 * 900.0 * one.force, rel=1e-12)
    np.testing.assert_allclose(other.outcrop, 30.0 * np.array(one.outcrop), rtol=1e-12)


@pytest.mark.parametrize("seed", range(200))
def test_interface_through_the_tip_never_betters_the_cheaper_of_its_two_bands(seed):
    # docs/theory-model-two-blocks.md, Eq. (1): for any share of the slip on the old, softened band and the
    # fresh one, by virtual work
    rng = np.random.default_rng(seed)
    residual, peak, wall = np.radians([rng.uniform(20, 32), rng.uniform(32, 45), rng.uniform(0, 10)])
    fresh, old = np.sort(np.radians(rng.uniform(5.0, 40.0, 2)))
    near, far = (
        0.5 / np.tan(old),
        0.5 / np.tan(fresh) - 0.5 / np.tan(old),
    )  # weights of the wedges, level sand
    singles = [
        weight * np.sin(beta + phi) / np.cos(beta + phi + wall)
        for weight, beta, phi in ((near + far, fresh, peak), (near, old, residual))
        if beta + phi + wall < np.pi / 2
    ]
    for r, s in rng.uniform(0.0, 1.0, (20, 2)):
        second = r * unit(fresh + peak)
        first = second + s * unit(old + residual)
        power = first @ unit(-wall)
        if power > 0.0 and singles:
            assert (near * first[1] + far * second[1]) / power >= min(singles) * (1.0 - 1e-12)


def test_friction_that_locks_every_band_is_refused():
    with pytest.raises(ConvergenceError, match="less than 90"):
        two_block_force(30.0, 16e-6, 50.0, 40.0)
