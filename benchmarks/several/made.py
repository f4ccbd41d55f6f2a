"""Made tests that repeat each other, and some of other depths: only the sand scatters, by a stated amount.

Each test has its own grains, noise, friction and line of action (its seed), and sand of its own, drawn from
the stated scatter. All state the same sand.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ploughval.errors import PloughvalError
from ploughval.model import simulate
from ploughval.report import write_report
from ploughval.run.process import process_folder
from ploughval.scene import Blade, ModelTable, Scene, Soil, TestTable
from ploughval.synth import SynthOptions, make_folder

MEAN = Soil(
    unit_weight_kN_m3=15.7,
    peak_friction_deg=42.0,
    residual_friction_deg=32.0,
    peak_friction_std_deg=1.0,
    residual_friction_std_deg=0.5,
)
REPEATS, DEPTH_MM = 10, 30.0
DEPTHS_MM = (20.0, 25.0, 40.0, 50.0, 60.0)
TESTS_A_DEPTH = 2
TRAVEL_DEPTHS, FRAMES, PX_A_DEPTH = 2.2, 24, 60
SEED = 900


@dataclass(frozen=True, slots=True)
class MadeTest:
    """A test's name, depth and true sand."""

    name: str
    seed: int
    depth_mm: float
    soil: Soil


def sand(rng: np.random.Generator) -> Soil:
    """Sand of one test: friction drawn from the stated scatter, the rest as stated."""
    return MEAN.model_copy(
        update={
            "peak_friction_deg": MEAN.peak_friction_deg + MEAN.peak_friction_std_deg * rng.standard_normal(),
            "residual_friction_deg": MEAN.residual_friction_deg
            + MEAN.residual_friction_std_deg * rng.standard_normal(),
        }
    )


def plan() -> Iterator[MadeTest]:
    """The tests: repeats at one depth, and a few at others."""
    rng = np.random.default_rng(SEED)
    depths = [DEPTH_MM] * REPEATS + [depth for depth in DEPTHS_MM for _ in range(TESTS_A_DEPTH)]
    for number, depth in enumerate(depths):
        name = f"d{depth:.0f}-{1 + depths[:number].count(depth):02d}"
        yield MadeTest(name, SEED + number, depth, sand(rng))


def make_tests(folder: Path) -> list[Path]:
    """Make and process every test that is not there yet.

    Returns
    -------
    list of Path
        Test folders in the order of the plan.
    """
    made = []
    for test in plan():
        place = folder / test.name
        made.append(place)
        if (place / "results" / "run.json").is_file():
            continue
        heights = tuple(round(share * test.depth_mm, 3) for share in (0.2, 0.5, 0.8))
        options = SynthOptions(
            seed=test.seed, name=test.name, frames=FRAMES, mm_per_px=test.depth_mm / PX_A_DEPTH,
            depth_mm=test.depth_mm, displacement_mm=TRAVEL_DEPTHS * test.depth_mm, soil=test.soil,
            told_soil=MEAN, layers_mm=heights, layer_thickness_mm=0.05 * test.depth_mm,
        )  # fmt: skip
        make_folder(place, options, overwrite=True)
        outcome = process_folder(place, workers=2)
        write_report(outcome.results)
        print(f"{test.name}: {outcome.seconds:.1f} s, complete: {outcome.complete}", flush=True)
    return made


def true_values(soil: Soil, depth_mm: float) -> Mapping[str, float]:
    """Metrics of sand that behaves as the model: some of its force, and of its first band.

    Parameters
    ----------
    soil : Soil
        The sand.
    depth_mm : float
        Depth of the tip.
    """
    scene = Scene(
        test=TestTable(name="truth"),
        blade=Blade(depth_mm=depth_mm, width_mm=SynthOptions().width_mm, speed_mm_s=1.0),
        soil=soil,
        model=ModelTable(displacement_mm=TRAVEL_DEPTHS * depth_mm),
    )
    history = simulate(scene)
    u, force = history.force["u_mm"].to_numpy(), history.force["force_N"].to_numpy()
    first, second = history.bands.iloc[0], history.bands.iloc[1]
    return {
        "first_peak_N": history.P0_N * history.horizontal_share,
        "force_mean_N": float(np.trapezoid(force, u)) / float(u[-1]) * history.horizontal_share,
        "first_switch_u_mm": float(second["u_start_mm"]),
        "first_band_beta_deg": float(first["beta_deg"]),
        "first_outcrop_x_mm": float(first["outcrop_x_mm"]),
    }


def population(count: int, depth_mm: float = DEPTH_MM) -> dict[str, np.ndarray]:
    """True values of many sands drawn from the stated scatter, (count,) each."""
    rng = np.random.default_rng([SEED, count])
    drawn = []
    while len(drawn) < count:
        try:
            drawn.append(true_values(sand(rng), depth_mm))
        except PloughvalError:
            continue  # residual above peak: no such sand
    return {name: np.array([values[name] for values in drawn]) for name in drawn[0]}
