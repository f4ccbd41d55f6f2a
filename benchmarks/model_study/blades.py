"""Runs of the model study on the blade: what its inclination does, and a second block beside a rough one."""

import math

import numpy as np
import pandas as pd
from scipy.optimize import minimize

from model_study.costs import seconds
from model_study.runs import DEPTH_MM, GAMMA_KN_M3, SANDS, scene_of, told
from ploughval.model import History, force_history, simulate
from ploughval.model.bent import Shear, bent_force
from ploughval.model.mechanism import block_areas, block_force
from ploughval.model.settings import run_march, scene_law
from ploughval.model.softening import mobilised_friction_deg
from ploughval.scene import Scene

WALLS_DEG = (0.0, 10.0)  # of the inclined blades
SCALE = 0.5e-6 * GAMMA_KN_M3 * 1000.0 * DEPTH_MM**2  # unit weight d^2 / 2 for a metre of blade, N
SHOWN_D = 1.2  # displacement of the layers that are shown
IMPOSSIBLE = 1e12  # P / unit weight of a shape that is none
HELD_D = 0.1  # steps in which a joint that is held is looked at
LAYERS_D = (0.2, 0.4, 0.6, 0.8)


def leaning(angle_deg: float, soil: dict[str, float]) -> Scene:
    """The reference scene with a blade that leans."""
    scene = scene_of({"repose_deg": 32.0, **soil})
    return scene.model_copy(update={"blade": scene.blade.model_copy(update={"inclination_deg": angle_deg})})


def inclinations() -> pd.DataFrame:
    """Forces and teeth of blades that lean, smooth and rough."""
    rows = []
    for wall in WALLS_DEG:
        for angle in np.arange(-50.0, 22.5 - wall, 2.5).tolist():
            history = simulate(leaning(angle, {"wall_friction_deg": wall}), displacement_mm=10.0 * DEPTH_MM)
            line = {"wall_friction_deg": wall, "inclination_deg": angle, "K0": history.P0_N / SCALE}
            line["K0_horizontal"] = line["K0"] * history.horizontal_share
            rows.append({**line, **told(history, DEPTH_MM)})
    return pd.DataFrame(rows)


def mechanisms() -> pd.DataFrame:
    """One block and two: first force, trough, switches, mean force, and what the second costs in time."""
    rows = []
    for sand, soil in SANDS.items():
        for wall in (0.0, 5.0, 10.0, 15.0, 20.0, 25.0):
            for name in ("one_block", "two_blocks"):
                scene = scene_of({**soil, "wall_friction_deg": wall}, model={"mechanism": name})
                history = simulate(scene, displacement_mm=5.0 * DEPTH_MM)
                line = told(history, DEPTH_MM)
                K, marched = history.force["force_N"].to_numpy() / SCALE, history.marched.rows
                bent = marched[:-1, 8] > marched[:-1, 0]
                rows.append(
                    {
                        "sand": sand,
                        "wall_friction_deg": wall,
                        "mechanism": name,
                        "first_K": K[0],
                        "trough_K": K[marched[:, 6] == 0].min(),
                        "switch_1_d": line["switch_1_d"],
                        "switch_K": line["peak_1_P0"] * history.P0_N / SCALE,
                        "switch_2_d": line["switch_2_d"],
                        "mean_K": np.trapezoid(K, marched[:, 0]) / history.end_mm,
                        "bent_share": float(np.sum(marched[:-1, 1][bent]) / history.end_mm),
                        "ms": 1e3 * seconds(lambda s=scene: force_history(s, displacement_mm=3.0 * DEPTH_MM)),
                    }
                )
    return pd.DataFrame(rows)


def rough(wall: float, mechanism: str) -> Scene:
    """The reference scene beside a rough blade."""
    return scene_of({"wall_friction_deg": wall}, model={"mechanism": mechanism})


def rough_histories() -> dict[tuple[float, str], History]:
    """The histories that the figures of two blocks show."""
    pairs = [(wall, name) for wall in (10.0, 20.0) for name in ("one_block", "two_blocks")]
    return {(w, n): simulate(rough(w, n), displacement_mm=4.0 * DEPTH_MM) for w, n in pairs}


def joints() -> pd.DataFrame:
    """The first band's force: joint of least force, joint held in the box, one block, strong interface."""
    rows = []
    for wall in (10.0, 20.0):
        scene = rough(wall, "two_blocks")
        history, law = simulate(scene, displacement_mm=4.0 * DEPTH_MM), scene_law(scene, scene.soil)
        marched = history.marched.rows
        last = int(np.flatnonzero(marched[:, 6] == 0)[-1])
        wanted = np.arange(0.0, marched[last, 0], HELD_D * DEPTH_MM)
        for row in np.searchsorted(marched[:, 0], wanted).tolist():
            u, _, P, _, out, top, _, slip = marched[row, :8]
            surface = history.surface(u)
            over = surface[surface[:, 0] < out]
            block = np.vstack([over, [(out, top)]])
            phi = float(mobilised_friction_deg(slip, 50.0, 32.0, 1.0))
            beta = math.degrees(math.atan2(top, out - u))
            strength = Shear(math.tan(math.radians(phi)), law.wall, 0.0, 0.0)
            held = marched[0, 8] - u, marched[0, 9]
            x, y = (np.append(v, 0.0) for v in surface.T)
            price, _ = bent_force(held, x, y, len(surface), strength, out, np.empty(len(x)))
            strong = strong_interface(block, u, marched[row, 8:10], math.radians(phi), law.wall)
            one = float(block_force(block_areas(block, u)[-1], beta, phi, wall))
            forces = {"two_blocks": P, "held": price, "one_block": one, "strong_interface": min(strong, one)}
            scaled = {f"{name}_K": 2.0 * force / DEPTH_MM**2 for name, force in forces.items()}
            joint = {
                "joint_ahead_d": (marched[row, 8] - u) / DEPTH_MM,
                "joint_up_d": marched[row, 9] / DEPTH_MM,
            }
            rows.append({"wall_friction_deg": wall, "u_d": u / DEPTH_MM, **joint, **scaled})
    return pd.DataFrame(rows)


def strong_interface(block: np.ndarray, u: float, joint: np.ndarray, phi: float, wall: float) -> float:
    """Least P / unit weight of two blocks, where the interface keeps the peak friction angle."""
    tip, outcrop, between = np.array([u, 0.0]), block[-1], phi + math.radians(50.0)

    def price(at: np.ndarray) -> float:
        (ax, ay), (bx, by), (cx, cy) = at - tip, outcrop - at, block[0] - at
        lower, upper, psi = math.atan2(ay, ax), math.atan2(by, bx), math.atan2(cy, cx)
        if not (0.0 <= lower < upper and psi > between + upper and ax > 0.0 and lower + phi + wall < 1.57):
            return IMPOSSIBLE
        shape = np.vstack([[at], block])
        x, y = shape.T
        second = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
        ratio = math.sin(psi - between - lower) / math.sin(psi - between - upper)
        work = 0.5 * ax * block[0, 1] * math.sin(lower + phi) + second * math.sin(upper + phi) * ratio
        return work / math.cos(lower + phi + wall)

    starts = [joint, *(tip + s * (outcrop - tip) - [0.0, 0.1 * DEPTH_MM] for s in (0.3, 0.5))]
    return float(min(minimize(price, start, method="Nelder-Mead").fun for start in starts))


def smooth() -> pd.DataFrame:
    """What two blocks would do beside a smooth blade, where the shipped rule has one."""
    scene, rows = scene_of(), []
    law = scene_law(scene, scene.soil)
    for blocks, bends in ((1, None), (2, 1.0)):
        marched = run_march(scene, law._replace(bends=bends), 5.0 * DEPTH_MM, 0.005 * DEPTH_MM, store=False)
        table = marched.rows
        k = int(np.flatnonzero(np.diff(table[:, 6]))[0]) + 1
        mean = np.trapezoid(table[:, 2], table[:, 0]) / table[-1, 0]
        rows.append(
            {
                "blocks": blocks,
                "switch_1_d": table[k, 0] / DEPTH_MM,
                "switch_K": 2.0 * table[k, 2] / DEPTH_MM**2,
                "mean_K": 2.0 * mean / DEPTH_MM**2,
            }
        )
    return pd.DataFrame(rows)
