"""The shipped model against the paper's algorithm to the letter: fixed increments, nodes, pairwise avalanche.

Nodes stand on a grid one increment apart, so that the block's motion is a shift by one node; softening is
kept for every node. No code is shared.
"""

import numpy as np
import pytest
from numba import njit

from ploughval.model import simulate
from ploughval.scene import Scene


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
def literal(steps, dx, soil, y, slip):
    """P / unit weight, outcrop's node at every increment; soil: peak, residual, mobilization, wall, limit."""
    peak, residual, length, wall, limit = soil
    n = len(y)
    force, node = np.empty(steps), np.empty(steps, np.int64)
    for k in range(steps):
        best, at, under = np.inf, k + 1, 0.0
        for i in range(k + 1, n):
            under += 0.5 * (y[i] + y[i - 1]) * dx
            reach = (i - k) * dx
            beta = np.arctan(y[i] / reach)
            phi = peak - (peak - residual) * min(slip[i] / length, 1.0)
            if beta + phi + wall < 0.5 * np.pi:
                weight = under - 0.5 * reach * y[i]
                p = weight * np.tan(beta + phi) / (np.cos(wall) - np.sin(wall) * np.tan(beta + phi))
                if p < best:
                    best, at = p, i
        force[k], node[k] = best, at
        beta = np.arctan(y[at] / ((at - k) * dx))
        for i in range(at, k, -1):  # the block moves by one node; its outcrop stays
            y[i] = y[i - 1] + dx * np.tan(beta)
            if i < at:
                slip[i] = slip[i - 1]
        slip[at] += dx / np.cos(beta)
        pairwise_to_rest(y, k + 1, dx, limit)
    return force, node


def literal_run(*, nodes, travel, length, surface=None, **soil):
    """u / d, P / (unit weight d^2), outcrop / d; so many nodes a depth, mobilization length in depths."""
    angles = {"peak": 50.0, "residual": 32.0, "wall": 0.0, "repose": 32.0, **soil}
    peak, residual, wall, repose = (
        float(np.radians(angles[k])) for k in ("peak", "residual", "wall", "repose")
    )
    x = np.arange(round(14.0 * nodes) + 1) / nodes
    y = np.ones_like(x) if surface is None else np.interp(x, *np.array(surface).T)
    steps = round(travel * nodes)
    law = (peak, residual, length, wall, np.tan(repose))
    force, node = literal(steps, 1.0 / nodes, law, y, np.zeros_like(x))
    return np.arange(steps) / nodes, force, node / nodes


def shipped_run(*, travel, length, surface=None, **soil):
    angles = {"peak": 50.0, "residual": 32.0, "wall": 0.0, "repose": 32.0, **soil}
    named = {f"{k}_friction_deg": angles[k] for k in ("peak", "residual", "wall")}
    scene = Scene.model_validate(
        {
            "test": {"name": "literal"},
            "blade": {"depth_mm": 100.0, "width_mm": 1000.0},
            "soil": {
                "unit_weight_kN_m3": 10.0,
                "mobilization_length_mm": 100.0 * length,
                "repose_deg": angles["repose"],
                **named,
            },
            "model": {
                "initial_surface_mm": None
                if surface is None
                else [(100.0 * a, 100.0 * b) for a, b in surface]
            },
        }
    )
    force = simulate(scene, displacement_mm=100.0 * travel, tolerance=1e-4).force
    # unit weight 1e-5 N/mm3, width 1000 mm, depth 100 mm
    return force["u_mm"] / 100.0, force["force_N"] / (1e-5 * 1000.0 * 100.0**2), force["outcrop_x_mm"] / 100.0


def places(u, x):
    """Where the outcrop jumps."""
    return np.asarray(u)[1:][np.diff(x) > 0.1]


@pytest.mark.parametrize(
    ("nodes", "case"),
    [
        (80, {}),
        (80, {"repose": 50.0}),
        (80, {"peak": 36.0}),
        (80, {"wall": 10.0}),
        (40, {"surface": [(0, 1), (14, 3)]}),
        (40, {"surface": [(0, 1), (1, 1.3), (3, 1.3), (4, 0.9), (14, 0.9)]}),
    ],
    ids=["reference", "steep repose", "loose sand", "wall friction", "rising", "mound"],
)
def test_paper_to_the_letter_comes_to_the_same_history(nodes, case):
    # tolerances: two increments of the literal run for a switch, four nodes for an outcrop, and for the
    # force one part in its nodes where both have the same band and it has softened (all errors are of first
    # order in the increment)
    u, force, outcrop = literal_run(nodes=nodes, travel=1.6, length=0.2, **case)
    ours = shipped_run(travel=1.6, length=0.2, **case)
    switches = places(u, outcrop), places(ours[0], ours[2])
    assert len(switches[0]) == len(switches[1])
    np.testing.assert_allclose(*switches, rtol=0.0, atol=2.0 / nodes)
    assert outcrop[-1] == pytest.approx(ours[2].iloc[-1], abs=4.0 / nodes)
    since = u - np.concatenate([[0.0], switches[0]])[np.searchsorted(switches[0], u, side="right")]
    later = np.searchsorted(switches[1], u, side="right") == np.searchsorted(switches[0], u, side="right")
    error = np.interp(u, ours[0], ours[1]) / force - 1.0
    assert np.sqrt(np.mean(error[(since > 0.25) & later] ** 2)) < 1.0 / nodes


def test_error_of_the_literal_model_falls_with_its_nodes():
    ours = shipped_run(travel=1.2, length=0.2)
    errors = []
    for nodes in (20, 40, 80):
        u, force, _ = literal_run(nodes=nodes, travel=1.2, length=0.2)
        late = u > 0.3
        errors.append(np.sqrt(np.mean((np.interp(u, *ours[:2]) / force - 1.0)[late] ** 2)))
    assert errors[2] < 0.7 * errors[1] < 0.7**2 * errors[0]
