"""The march with two blocks: statics, velocities, power, area, bounds, random scenes, and a plain march."""

import numpy as np
import pytest
from numba import njit
from scipy.optimize import minimize

from ploughval.errors import ConvergenceError
from ploughval.model import force_history, simulate
from ploughval.model.blocks import two_block_force
from ploughval.model.mechanism import block_areas, block_force
from ploughval.model.settings import run_march, scene_law
from ploughval.model.softening import mobilised_friction_deg
from ploughval.scene import Scene

DEPTH, WIDTH, WEIGHT = 30.0, 1000.0, 16e-6
K = 0.5 * WEIGHT * WIDTH * DEPTH**2


def scene_of(mechanism="two_blocks", *, surface=None, model=None, lean=0.0, **soil):
    settings = {"peak_friction_deg": 50.0, "residual_friction_deg": 32.0, **soil}
    return Scene.model_validate(
        {
            "test": {"name": "two blocks"},
            "blade": {"depth_mm": DEPTH, "width_mm": WIDTH, "inclination_deg": lean},
            "soil": {"unit_weight_kN_m3": 1e6 * WEIGHT, **settings},
            "model": {"mechanism": mechanism, "initial_surface_mm": surface, **(model or {})},
        }
    )


ROUGH = {10.0: scene_of(wall_friction_deg=10.0), 20.0: scene_of(wall_friction_deg=20.0)}


@pytest.fixture(scope="module", params=list(ROUGH))
def history(request):
    return simulate(ROUGH[request.param], displacement_mm=110.0)


def unit(angle):
    return np.array([np.cos(angle), np.sin(angle)])


def area_of(points):
    x, y = np.asarray(points).T
    return 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def bent_rows(history, every=17):
    rows = history.marched.rows[:-1]
    return np.flatnonzero(rows[:, 8] > rows[:, 0])[::every]


def shapes_of(history, row):
    """Tip, joint, outcrop, top of the face, and the weights of both blocks of a row."""
    u, _, _, _, out, top, _, _, joint_x, joint_y, _ = history.marched.rows[row]
    surface = history.surface(u)
    tip, joint, outcrop = np.array([u, 0.0]), np.array([joint_x, joint_y]), np.array([out, top])
    over = surface[surface[:, 0] < out]
    first = area_of([tip, joint, surface[0]])
    second = area_of(np.vstack([[joint], [outcrop], over[::-1]]))
    return tip, joint, outcrop, surface[0], WEIGHT * WIDTH * np.array([first, second])


def velocities_of(history, row):
    """Velocities of both blocks for 1 of the blade, from the three directions of sliding alone."""
    tip, joint, outcrop, top, _ = shapes_of(history, row)
    lower, upper = joint - tip, outcrop - joint
    first = lower / lower[0]
    second_share, _ = np.linalg.solve(np.column_stack([upper, joint - top]), first)
    return first, second_share * upper


def test_smooth_blade_is_marched_with_one_block():
    one, two = (force_history(scene_of(m, wall_friction_deg=0.0)) for m in ("one_block", "two_blocks"))
    np.testing.assert_array_equal(one.u_mm, two.u_mm)
    np.testing.assert_array_equal(one.force_N, two.force_N)


@pytest.mark.parametrize(
    ("peak", "wall"),
    [(30.0, 10.0), (36.0, 5.0), (36.0, 15.0), (33.2865, 26.9065), (40.0, 20.0), (50.0, 10.0), (50.0, 20.0)],
)
def test_first_force_and_band_are_those_of_level_sand(peak, wall):
    residual = min(peak, 32.0)
    scene = scene_of(peak_friction_deg=peak, residual_friction_deg=residual, wall_friction_deg=wall)
    found = simulate(scene, displacement_mm=1.0)
    closed = two_block_force(DEPTH, WEIGHT, peak, wall)
    assert closed.joint[1] > 0.0
    assert found.force["force_N"][0] == pytest.approx(WIDTH * closed.force, rel=1e-9)
    assert found.force["outcrop_x_mm"][0] == pytest.approx(closed.outcrop[0], rel=1e-5)
    assert found.increments[0].joint_x_mm == pytest.approx(closed.joint[0], rel=1e-4)
    assert found.increments[0].joint_y_mm == pytest.approx(closed.joint[1], rel=1e-4)


def test_both_blocks_are_in_equilibrium_and_the_blades_work_is_lifted_or_rubbed(history):
    # statics: four equations for P and three reactions, each inclined by friction against the sliding
    wall = np.arccos(history.horizontal_share)
    rows = bent_rows(history)
    assert len(rows) > 20
    for row in rows:
        tip, joint, outcrop, top, weights = shapes_of(history, row)
        lower, upper = (np.arctan2(*v[::-1]) for v in (joint - tip, outcrop - joint))
        interface = np.arctan2(*(top - joint)[::-1])
        slip = history.marched.rows[row, 7]
        phi = np.radians(mobilised_friction_deg(slip, 50.0, 32.0, 1.0))
        band1, band2 = unit(lower + phi + np.pi / 2), unit(upper + phi + np.pi / 2)
        on_second = unit(interface - phi - np.pi / 2)
        system = np.zeros((4, 4))
        system[:2, 0], system[:2, 1], system[2:, 2] = unit(-wall), band1, band2
        system[:2, 3], system[2:, 3] = -on_second, on_second
        P, first, second, between = np.linalg.solve(system, [0.0, weights[0], 0.0, weights[1]])
        assert min(P, first, second, between) > 0.0
        assert history.force["force_N"][row] == pytest.approx(P, rel=1e-7)
        v1, v2 = velocities_of(history, row)
        rubbed = np.sin(phi) * (
            first * np.hypot(*v1) + second * np.hypot(*v2) + between * np.hypot(*(v2 - v1))
        )
        rubbed += P * np.sin(wall) * v1[1]
        lifted = weights @ [v1[1], v2[1]]
        assert P * np.cos(wall) == pytest.approx(lifted + rubbed, rel=1e-7)


def test_velocities_close_and_carry_away_what_the_blade_sweeps(history):
    for row in bent_rows(history):
        _, joint, outcrop, top, _ = shapes_of(history, row)
        v1, v2 = velocities_of(history, row)
        assert v1[0] == pytest.approx(1.0)
        assert v1[1] >= 0.0  # up the face, as the friction there supposes
        assert v2[0] < 1.0
        along = (top - joint) / np.hypot(*(top - joint))
        assert (v2 - v1) @ along == pytest.approx(np.hypot(*(v2 - v1)), rel=1e-9)  # up the interface
        assert history.marched.rows[row, 10] == pytest.approx(v2[0], rel=1e-9)
        # through the surface goes what the face sweeps: v2 x (from its top to the outcrop)
        across = outcrop - top
        assert v2[1] * across[0] - v2[0] * across[1] == pytest.approx(top[1], rel=1e-9)


def test_force_is_never_above_that_of_one_block(history):
    wall = np.degrees(np.arccos(history.horizontal_share))
    rows = history.marched.rows
    cheaper = 0
    for row in range(0, len(rows) - 1, 11):
        u, _, _, _, out, top, _, slip = rows[row, :8]
        surface = history.surface(u)
        x, y = surface[surface[:, 0] < out].T
        block = np.column_stack([np.append(x, out), np.append(y, top)])
        phi = mobilised_friction_deg(slip, 50.0, 32.0, 1.0)
        beta = np.degrees(np.arctan2(top, out - u))
        same = WEIGHT * WIDTH * block_force(block_areas(block, u)[-1], beta, phi, wall)
        fine = np.union1d(np.arange(u, u + 300.0, 0.25), surface[:, 0])
        nodes = np.column_stack([fine, np.interp(fine, *surface.T)])[1:]
        whole = np.vstack([surface[:1], nodes])
        angles = np.degrees(np.arctan2(nodes[:, 1], nodes[:, 0] - u))
        fresh = WEIGHT * WIDTH * block_force(block_areas(whole, u)[1:], angles, 50.0, wall)
        force = history.force["force_N"][row]
        assert force <= same * (1.0 + 1e-9)
        assert force <= fresh.min() * (1.0 + 1e-5)
        cheaper += force < same * (1.0 - 1e-4)
    assert cheaper > 10


def surfaces_of(marched):
    """First and last place in the pool of the surface at rest of every row."""
    return np.append(0, marched.ends[:-1, 1]), marched.ends[:, 0]


def check_area(marched):
    """All that is lost is the triangle between the tip's places and the lower band, to 1e-10."""
    rows, (x, y) = marched.rows, marched.pool
    areas = np.array([np.trapezoid(y[a:b], x[a:b]) for a, b in zip(*surfaces_of(marched), strict=True)])
    bent = rows[:-1, 8] > rows[:-1, 0]
    ahead = np.where(bent, rows[:-1, 8] - rows[:-1, 0], 1.0)
    lower = np.where(bent, rows[:-1, 9] / ahead, rows[:-1, 3])
    lost = np.cumsum(0.5 * rows[:-1, 1] ** 2 * lower)
    np.testing.assert_allclose(areas[1:], areas[0] - lost, rtol=0.0, atol=1e-10 * areas[0])


def test_area_is_kept_but_for_the_tips_triangles(history):
    check_area(history.marched)


@pytest.mark.parametrize("wall", [10.0, 20.0])
def test_error_is_of_first_order_in_the_increment(wall):
    scene = ROUGH[wall]
    law, ends = scene_law(scene, scene.soil), []
    for step in (1.2, 0.6, 0.3, 0.15):
        rows = run_march(scene, law, 80.0, step, store=False).rows
        band = rows[:, 6] == 0
        ends.append(np.interp(1.4 * DEPTH, rows[band, 0], rows[band, 2]))
    steps = np.abs(np.diff(ends))
    assert steps[1] / steps[0] == pytest.approx(0.5, abs=0.1)
    assert steps[2] / steps[1] == pytest.approx(0.5, abs=0.1)


def random_scene(rng):
    peak = rng.uniform(25.0, 50.0)
    residual = peak if rng.random() < 0.1 else rng.uniform(20.0, peak)
    wall = rng.uniform(1.0, min(0.9 * residual, 80.0 - peak))
    x = np.arange(0.0, 12.0, 0.5)
    y = {
        "level": np.ones_like(x),
        "sloping": 1.0 + np.maximum(rng.uniform(-0.07, 0.15) * x, -0.7),
        "stepped": np.where(x > rng.uniform(0.5, 5.0), rng.uniform(0.6, 1.6), 1.0),
        "noisy": 1.0 + rng.normal(0.0, 0.05, x.size),
    }[rng.choice(["level", "sloping", "stepped", "noisy"])]
    length = DEPTH * rng.choice([0.0, 10.0 ** rng.uniform(-3.0, 2.0)])
    return scene_of(
        surface=[(float(a), float(b)) for a, b in DEPTH * np.column_stack([x, y])],
        peak_friction_deg=peak,
        residual_friction_deg=residual,
        wall_friction_deg=wall,
        mobilization_length_mm=length,
        repose_deg=rng.uniform(10.0, 50.0),
        surcharge_kPa=rng.choice([0.0, rng.uniform(0.0, 1.0)]),
    )


def test_random_scenes_stay_finite_keep_their_area_and_fall_at_switches():
    rng, runs, bent, switches = np.random.default_rng(4), 0, 0, 0
    for number in range(500):
        scene = random_scene(rng)
        law = scene_law(scene, scene.soil)
        try:
            marched = run_march(scene, law, 2.5 * DEPTH, 0.1 * DEPTH, store=True)
        except ConvergenceError:
            continue
        rows = marched.rows
        assert np.isfinite(rows).all(), number
        assert np.isfinite(marched.pool).all(), number
        assert np.all(rows[:, 2] > 0.0), number
        check_area(marched)
        first = run_march(scene, law._replace(bends=None), 0.1 * DEPTH, 0.1 * DEPTH, store=False)
        assert rows[0, 2] <= first.rows[0, 2], number
        runs += 1
        bent += np.mean(rows[:, 8] > rows[:, 0]) > 0.0
        if scene.soil.mobilization_length_mm < 0.2 * DEPTH:
            for k in np.flatnonzero(np.diff(rows[:, 6])) + 1:
                switches += 1
                if k + 1 < len(rows):
                    before, after = np.diff(rows[k - 1 : k + 2, 2]) / rows[k - 1 : k + 1, 1]
                    assert after < before, number
    assert runs > 480
    assert bent > 400
    assert switches > 200


# --- a march without the shipped code: a grid, fixed increments, polygons, a general search ----------


@njit
def pairwise_to_rest(y, first, dx, limit):
    """Eqs (4) and (5) of the paper on a grid, swept until no slope exceeds the limit by more than 1e-7."""
    n, moved = len(y), True
    while moved:
        moved = False
        for i in range(first, n - 1):
            left = dx if i > first else 0.0
            right = dx if i + 2 < n else 0.0
            total = 2.0 * dx + left + right
            excess = abs(y[i] - y[i + 1]) / dx - limit
            if excess > 1e-7:
                way = 1.0 if y[i] > y[i + 1] else -1.0
                y[i] -= way * dx * (right + dx) * excess / total
                y[i + 1] += way * dx * (left + dx) * excess / total
                moved = True


@njit
def over_joint(joint, x, y, first, out, phi, wall):
    """P / unit weight of the band over a joint (from the tip) to node ``out``.

    docs/theory-model-two-blocks.md, Eq. (2).
    """
    tip, joint_x, joint_y = x[first], joint[0], joint[1]
    lower = np.arctan2(joint_y, joint_x)
    upper = np.arctan2(y[out] - joint_y, x[out] - tip - joint_x)
    psi = np.arctan2(y[first] - joint_y, -joint_x)
    if (
        joint_x <= 0
        or joint_y < 0
        or lower > upper
        or lower + phi + wall >= np.pi / 2
        or psi - 2 * phi - upper <= 0
    ):
        return np.inf
    own = 0.5 * joint_x * y[first]
    other = 0.0
    for k in range(first, out):
        ax, ay = x[k] - tip - joint_x, y[k] - joint_y
        bx, by = x[k + 1] - tip - joint_x, y[k + 1] - joint_y
        other += 0.5 * (ay * bx - ax * by)
    ratio = np.sin(psi - 2 * phi - lower) / np.sin(psi - 2 * phi - upper)
    return (own * np.sin(lower + phi) + other * np.sin(upper + phi) * ratio) / np.cos(lower + phi + wall)


def plain_march(scene, nodes, travel):
    """P / (unit weight d^2) of the first band at every increment of d / nodes; ``travel`` in depths."""
    soil, dx = scene.soil, 1.0 / nodes
    wall, limit = np.radians(soil.wall_friction_deg), np.tan(np.radians(soil.slope_of_repose_deg))
    start = two_block_force(1.0, 1.0, soil.peak_friction_deg, soil.wall_friction_deg)
    x = np.arange(round(9.0 * nodes) + 1) * dx
    y, out = np.ones_like(x), round(start.outcrop[0] * nodes)
    joint, slip, forces = np.array(start.joint), 0.0, []
    for k in range(round(travel * nodes)):
        degrees = mobilised_friction_deg(
            slip, soil.peak_friction_deg, soil.residual_friction_deg, soil.mobilization_length_mm / DEPTH
        )
        phi = np.radians(float(degrees))
        state = (x, y, k, out, phi, wall)
        found = minimize(over_joint, joint, state, "Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-10})
        joint = found.x
        forces.append(found.fun)
        lower, upper = joint[1] / joint[0], (y[out] - joint[1]) / (x[out] - x[k] - joint[0])
        forward = y[k] / (y[k] - joint[1] + joint[0] * upper)
        before = np.trapezoid(y[k:], x[k:])
        s, new = forward * dx, y.copy()
        inside = (x > x[k]) & (x <= x[out])
        new[inside] = np.interp(x[inside] - s, x[k:], y[k:]) + s * upper
        over = (x > x[out]) & (x < x[out] + s)
        line = joint[1] + (x[over] - s - x[k] - joint[0]) * upper
        new[over] += np.interp(x[over] - s, x, y) - line
        missing = before - 0.5 * dx**2 * lower - np.trapezoid(new[k + 1 :], x[k + 1 :])
        new[k + 1] += 2.0 * missing / dx
        pairwise_to_rest(new, k + 1, dx, limit)
        y, slip = new, slip + s * np.hypot(1.0, upper)
    return np.arange(len(forces)) * dx, np.array(forces)


@pytest.mark.parametrize("wall", [10.0, 20.0])
def test_plain_march_comes_to_the_same_force(wall):
    # first order in its increment: 1 / nodes in the force, less than half of it at three times the nodes
    scene, errors = scene_of(wall_friction_deg=wall, mobilization_length_mm=6.0), []
    ours = simulate(scene, displacement_mm=1.3 * DEPTH, tolerance=1e-4).force
    assert ours["band"].max() == 0
    for nodes in (30, 90):
        u, P = plain_march(scene, nodes, 1.25)
        ratio = np.interp(u, ours["u_mm"] / DEPTH, ours["force_N"]) / (2.0 * K * P) - 1.0
        errors.append(np.sqrt(np.mean(ratio[u > 0.3] ** 2)))
    assert errors[1] < 1.0 / 90
    assert errors[1] < 0.5 * errors[0]


# --- material points -------------------------------------------------------------------------------


def test_points_move_with_their_block(history):
    for row in bent_rows(history, every=120):
        step, (v1, v2) = history.increments[row], velocities_of(history, row)
        tip, joint, outcrop, top, _ = shapes_of(history, row)
        rng = np.random.default_rng(int(row))
        x = rng.uniform(tip[0] + 1e-3, outcrop[0] + 40.0, 3000)
        surface = history.surface(step.u_mm)
        points = np.column_stack([x, rng.uniform(0.0, 1.0, 3000) * np.interp(x, *surface.T)])
        moved = history.advect(points, step.u_mm, step.u_mm + step.du_mm)
        band = np.interp(points[:, 0], *np.array([tip, joint, outcrop]).T)
        moves = (points[:, 1] > band) & (points[:, 0] < outcrop[0])
        beside = moves & (
            points[:, 1] < top[1] + (joint[1] - top[1]) * (points[:, 0] - tip[0]) / (joint[0] - tip[0])
        )
        drift = np.where(beside[:, None], v1, np.where(moves[:, None], v2, 0.0))
        expected = points + step.du_mm * drift
        expected[:, 0] = np.where(moves, np.maximum(expected[:, 0], step.u_mm + step.du_mm), expected[:, 0])
        stays = np.isfinite(moved[:, 0])
        assert stays.mean() > 0.95
        assert beside.sum() > 100
        np.testing.assert_allclose(moved[stays], expected[stays], atol=1e-9)


def test_sand_beside_a_rough_blade_is_sheared_as_it_crosses_the_interface():
    # two points of one height, near and far from the face: one block carries them alike, two do not
    lifts = {}
    for mechanism in ("one_block", "two_blocks"):
        history = simulate(scene_of(mechanism, wall_friction_deg=20.0), displacement_mm=24.0)
        near, far = history.advect([(3.0, 20.0), (45.0, 20.0)], 0.0, 24.0)
        lifts[mechanism] = near[1] - 20.0, far[1] - 20.0
    assert lifts["one_block"][0] == pytest.approx(lifts["one_block"][1], rel=1e-9)
    assert lifts["two_blocks"][0] < 0.7 * lifts["two_blocks"][1]


# --- what does not go together ---------------------------------------------------------------------


def test_two_blocks_are_refused_where_nothing_is_derived_for_them():
    with pytest.raises(ValueError, match=r"one_block.*leans"):
        scene_of(lean=10.0, wall_friction_deg=10.0)
    with pytest.raises(ValueError, match="least_force"):
        scene_of(model={"direction": "least_softened"}, wall_friction_deg=10.0)
