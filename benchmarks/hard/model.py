"""Hard cases of the model: soils, grounds, blades and steps at which an incremental collapse may fail."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from hard.cases import Canvas, Happened, HardCase, Part
from ploughval.model import History, simulate
from ploughval.model.collapse import march_error
from ploughval.model.march import March
from ploughval.model.settings import run_march, scene_law
from ploughval.report.figures.style import INK, MEASURED, MODEL, MUTED, SAND
from ploughval.scene import Scene

Floats = NDArray[np.float64]

DEPTH = 30.0
SOIL = {
    "unit_weight_kN_m3": 16.0,
    "peak_friction_deg": 50.0,
    "residual_friction_deg": 32.0,
    "mobilization_length_mm": 1.0,
    "repose_deg": 32.0,
}
TRAVEL = 3.6  # depths: past the second switch of the paper's soil
FINER = 16.0  # the converged run's tolerance is so much smaller
AREA = 1e-10  # of the area: rounding of some thousand strips
LIMIT = 1.0  # rms error of the force, % of its greatest: ten times the tolerance; switches are sudden
STATED = 5.0  # times the stated numerical uncertainty: an estimate of first order from two runs
PAPER = ((1.290, 1.790), (3.270, 2.792))  # u / d and P / P0 of the first switches, extrapolated in the step
DRAWN = 240  # points of a line


@dataclass(frozen=True, slots=True)
class Drawn:
    """What is drawn of a run: force and surfaces in depths and P0."""

    force: tuple[Floats, Floats]
    finer: tuple[Floats, Floats]
    first: Floats
    last: Floats
    face: float


def scene_of(
    *,
    depth: float = DEPTH,
    ground: Sequence[tuple[float, float]] | None = None,
    box: float | None = None,
    lean: float = 0.0,
    mechanism: str = "one_block",
    **soil: float,
) -> Scene:
    """A scene whose lengths are in depths but for the depth itself and the mobilization length, mm."""
    model: dict[str, object] = {"mechanism": mechanism}
    if ground is not None:
        model["initial_surface_mm"] = [(depth * x, depth * y) for x, y in ground]
    return Scene.model_validate(
        {
            "test": {"name": "hard"},
            "blade": {"depth_mm": depth, "width_mm": 1000.0, "inclination_deg": lean},
            "box": {} if box is None else {"length_mm": depth * box},
            "soil": SOIL | soil,
            "model": model,
        }
    )


def area_closure(marched: March, face: float) -> float:
    """Greatest area that is neither there nor in the triangles that the tip leaves, of the area at first."""
    rows, ends, (x, y) = marched.rows, marched.ends, marched.pool
    across = x - face * y
    starts = np.append(0, ends[:-1, 1])
    areas = np.array([np.trapezoid(y[a:b], across[a:b]) for a, b in zip(starts, ends[:, 0], strict=True)])
    bent = rows[:-1, 8] > rows[:-1, 0]
    ahead = np.where(bent, rows[:-1, 8] - rows[:-1, 0], 1.0)
    lower = np.where(bent, rows[:-1, 9] / ahead, rows[:-1, 3])
    lost = np.cumsum(0.5 * rows[:-1, 1] ** 2 * lower / (1.0 - face * lower))
    return float(np.abs(areas[1:] - (areas[0] - lost)).max() / areas[0]) if len(lost) else 0.0


def switches(marched: March) -> Floats:
    """Displacements at which fresh bands start, mm."""
    return np.asarray(marched.rows[1:, 0][np.diff(marched.rows[:, 6]) > 0])


def by_tolerance(scene: Scene, travel: float = TRAVEL, tolerance: float | None = None) -> Happened:
    """A run at a tolerance against one that is sixteen times finer."""
    run = simulate(scene, displacement_mm=travel * scene.blade.depth_mm, tolerance=tolerance)
    aim = (scene.model.tolerance if tolerance is None else tolerance) / FINER
    fine = simulate(scene, displacement_mm=run.end_mm, tolerance=max(aim, 1e-6))
    told = (
        ()
        if run.end_reason == "displacement reached"
        else (f"ends at {run.end_mm:.4g} mm: {run.end_reason}",)
    )
    share = 100.0 * run.force_std_N / float(run.force["force_N"].max())
    return compared(scene, run.marched, fine.marched, run, told=told, stated=share)


def by_step(scene: Scene, step: float, finer: float, travel: float = TRAVEL) -> Happened:
    """A march with a step in depths, whatever the tolerance would ask for, against another step."""
    depth = scene.blade.depth_mm
    law = scene_law(scene, scene.soil)
    run, fine = (run_march(scene, law, travel * depth, s * depth, store=True) for s in (step, finer))
    return compared(scene, run, fine, simulate(scene, displacement_mm=depth))


def compared(
    scene: Scene, run: March, fine: March, history: History, *, told: tuple[str, ...] = (),
    stated: float | None = None,
) -> Happened:  # fmt: skip
    """Finite, area, force and places of switches of a run against a finer one."""
    depth, face = scene.blade.depth_mm, float(np.tan(np.radians(scene.blade.inclination_deg)))
    finite = bool(np.isfinite(run.rows).all() and np.isfinite(run.pool).all() and np.all(run.rows[:, 2] > 0))
    closure = area_closure(run, face)
    error = 100.0 * march_error(run, fine) / float(fine.rows[:, 2].max())
    here, there = switches(run) / depth, switches(fine) / depth
    broken = [] if finite else ["not finite, or a force that is not positive"]
    broken += [] if closure <= AREA else [f"area closes to {closure:.1e} only"]
    if stated is not None and error > STATED * stated + 0.1:
        broken.append(f"the stated numerical uncertainty is {stated:.1g} % only")
    if len(here) == len(there) and len(here):
        moved = f", {len(here)} switches moved by {np.abs(here - there).max():.1g} d at most"
    else:
        moved = f", {len(here)} switches, finer run {len(there)}"
    known = "" if stated is None else f" (stated {stated:.2g} %)"
    what = f"finite, area to {closure:.0e}, force {error:.2g} % from the finer run{known}{moved}"
    scale = 1e-6 * scene.soil.unit_weight_kN_m3 * scene.blade.width_mm / history.P0_N
    first, last = surface_at(run, 0), surface_at(run, len(run.rows) - 1)
    lines = [(thinned(m.rows[:, 0] / depth), thinned(scale * m.rows[:, 2])) for m in (run, fine)]
    drawn = Drawn(lines[0], lines[1], first / depth, last / depth, face)
    return Happened(error if finite else float("inf"), what, told, tuple(broken), drawn)


def surface_at(marched: March, k: int) -> Floats:
    """Surface (M, 2) mm at the start of row k."""
    start = marched.ends[k - 1, 1] if k else 0
    return np.ascontiguousarray(marched.pool[:, start : marched.ends[k, 0]].T)


def thinned(values: Floats) -> Floats:
    """At most ``DRAWN`` of the values, both ends among them."""
    return np.asarray(values[np.linspace(0, len(values) - 1, min(len(values), DRAWN)).round().astype(int)])


def published() -> Happened:
    """The paper's soil against the values extrapolated in the step."""
    scene = scene_of()
    happened = by_tolerance(scene)
    run = simulate(scene, displacement_mm=TRAVEL * DEPTH)
    u, force = run.force["u_mm"].to_numpy(), run.force["force_N"].to_numpy()
    starts = np.flatnonzero(np.diff(run.force["band"].to_numpy())) + 1
    gaps = [
        (abs(u[k] / DEPTH - place), abs(force[k] / run.P0_N / height - 1.0))
        for k, (place, height) in zip(starts[:2], PAPER, strict=True)
    ]
    places, heights = np.array(gaps).max(axis=0)
    what = (
        f"switches within {places:.2g} d and {100 * heights:.2g} % of the published values; {happened.what}"
    )
    broken = (
        happened.broken
        if places < 0.01 and heights < 0.005
        else (*happened.broken, "published values missed")
    )
    return Happened(happened.error, what, happened.told, broken, happened.shown)


def noisy_ground() -> list[tuple[float, float]]:
    """Level sand with a roughness of a twentieth of the depth, nodes a tenth of a depth apart."""
    x = np.arange(0.0, 14.0, 0.1)
    y = 1.0 + np.random.default_rng(4).normal(0.0, 0.05, x.size)
    return list(zip(x.tolist(), y.tolist(), strict=True))


def mound_nodes() -> list[tuple[float, float]]:
    """A bell of 0.3 depths, nodes each 0.05 depths."""
    x = np.arange(0.0, 14.0, 0.05)
    return list(zip(x.tolist(), (1.0 + 0.3 * np.exp(-((x - 3.0) ** 2))).tolist(), strict=True))


def ground_cases() -> list[tuple[str, str, Scene]]:
    """Initial surfaces."""
    step = [(0.0, 1.0), (1.5, 1.0), (1.6, 1.8), (14.0, 1.8)]
    ditch = [(0.0, 1.0), (1.5, 1.0), (1.6, 0.5), (14.0, 0.5)]
    every = mound_nodes()
    return [
        (
            "ground that rises 15 degrees",
            "initial surface y = 1 + 0.268 x",
            scene_of(ground=[(0, 1), (14, 4.75)]),
        ),
        (
            "ground that falls 4 degrees",
            "initial surface y = 1 - 0.07 x",
            scene_of(ground=[(0, 1), (14, 0.02)]),
        ),
        ("a step up before the blade", "from 1 to 1.8 depths within 0.1 depth", scene_of(ground=step)),
        ("a step down before the blade", "from 1 to 0.5 depths within 0.1 depth", scene_of(ground=ditch)),
        ("rough ground", "a roughness of 0.05 depths (standard deviation)", scene_of(ground=noisy_ground())),
        ("a mound, every node", "bell of 0.3 depths, nodes each 0.05 depths", scene_of(ground=every)),
        ("a mound, one node in ten", "the same with each tenth node", scene_of(ground=every[::10])),
    ]


def scene_cases() -> list[tuple[str, str, Scene]]:
    """Soils, depths and blades."""
    return [
        ("peak = residual", "32 / 32 degrees: the band creeps on", scene_of(peak_friction_deg=32.0)),
        ("mobilization length 0", "friction falls at once", scene_of(mobilization_length_mm=0.0)),
        (
            "mobilization length 1 µm",
            "softening within 1/30000 of the depth",
            scene_of(mobilization_length_mm=1e-3),
        ),
        ("mobilization length 100 depths", "hardly softens", scene_of(mobilization_length_mm=100 * DEPTH)),
        (
            "wall friction near the limit",
            "39 degrees; 40 leave no mechanism",
            scene_of(wall_friction_deg=39.0),
        ),
        ("repose below the band", "repose of 8 degrees, bands of 10 to 45", scene_of(repose_deg=8.0)),
        ("repose of 80 degrees", "hardly anything avalanches", scene_of(repose_deg=80.0)),
        (
            "depth 1 mm",
            "mobilization length in proportion",
            scene_of(depth=1.0, mobilization_length_mm=1 / 30),
        ),
        (
            "depth 10 m",
            "mobilization length in proportion",
            scene_of(depth=1e4, mobilization_length_mm=1e4 / 30),
        ),
        ("end of the box", "7 depths of sand: no room for the second band", scene_of(box=7.0)),
        ("blade that leans ahead", "20 degrees over the sand", scene_of(lean=20.0)),
        ("blade that leans back", "-20 degrees", scene_of(lean=-20.0)),
        ("blade flatter than repose", "60 degrees, repose 32", scene_of(lean=60.0)),
        (
            "two blocks",
            "bent bands, wall friction 15 degrees",
            scene_of(mechanism="two_blocks", wall_friction_deg=15.0),
        ),
        (
            "two blocks near the limit",
            "wall friction 35 degrees",
            scene_of(mechanism="two_blocks", wall_friction_deg=35.0),
        ),
    ]


def cases() -> list[HardCase]:
    """Every hard case of the model."""
    must = f"finite, area to {AREA:g}, force within {LIMIT:g} % rms of the converged run, as is stated"
    made = [HardCase("paper's soil", "50 / 32 degrees, repose 32", "published values", published, LIMIT, "%")]
    says = r"ends at|no shear band|force still changes"
    for name, done, scene in (*scene_cases(), *ground_cases()):
        made.append(HardCase(name, done, must, partial(by_tolerance, scene), LIMIT, "%", says))
    mound = scene_of(ground=mound_nodes())
    coarse = partial(by_step, mound, 0.25, 0.25 / FINER)
    tiny = partial(by_step, mound, 5e-5, 0.005)
    return [
        *made,
        HardCase(
            "steps of five nodes",
            "du = 0.25 depths, nodes each 0.05",
            "finite, area to 1e-10, force within 5 % rms: first order in the step",
            coarse,
            5.0,
            "%",
        ),
        HardCase(
            "steps of a thousandth of a node", "du = 0.00005 depths, nodes each 0.05", must, tiny, LIMIT, "%"
        ),
    ]


def draw(canvas: Canvas, case: HardCase, shown: Drawn) -> None:
    """Surface at first and at the end above, force against travel below."""
    above, below = canvas.subplots(2, 1, height_ratios=(1.0, 1.2))
    first, last = shown.first, shown.last
    reach = float(last[0, 0]) + 8.0
    above.fill_between(last[:, 0], last[:, 1], 0.0, color=SAND, linewidth=0)
    x = np.append(first[first[:, 0] < reach, 0], reach)
    above.plot(x, np.interp(x, *first.T), color=MUTED, linewidth=0.8, linestyle="--")
    above.plot(*last.T, color=INK, linewidth=1.0)
    tip, top = float(last[0, 0] - shown.face * last[0, 1]), float(last[0, 1])
    above.plot([tip, tip + shown.face * 1.1 * top], [0.0, 1.1 * top], color=MODEL, linewidth=1.5)
    seen = last[last[:, 0] <= reach, 1]
    above.set_xlim(min(0.0, tip) - 0.3, reach)
    above.set_ylim(0.0, 1.15 * max(1.0, float(seen.max())))
    above.set_ylabel("y / d")
    below.plot(*shown.finer, color=MUTED, linewidth=2.2)
    below.plot(*shown.force, color=MEASURED, linewidth=1.0)
    below.set_ylim(0.0, None)
    below.set_ylabel("P / P₀")
    below.set_xlabel("u / d")


PART = Part(
    "model",
    "Model",
    "Each scene is run as a laboratory would run it and again with a tolerance sixteen times finer. "
    "Above: the "
    "surface at first (dashed) and at the end; below: the force (blue) on that of the finer run (grey).",
    cases,
    draw,
)
