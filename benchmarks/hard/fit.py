"""Hard cases of the fit: records that hold little, too much noise, or another sand than is told."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fit_study.records import FINE, paper_soil, scene_of
from hard.cases import NO_WORDS, Canvas, Happened, HardCase, Part
from ploughval.model import SoilFit, fit_soil, force_history
from ploughval.model.fit import PARAMETERS, Discrepancy, SharedErrors
from ploughval.report.figures.style import INK, MEASURED, MODEL, MUTED

Floats = NDArray[np.float64]

TOLD = {"peak_friction_deg": 45.0, "residual_friction_deg": 30.0, "mobilization_length_mm": 2.0}
LIMIT = 3.0  # standard deviations
MUST = (
    "no value further from the truth than three of its stated deviations, or an open interval with a remark"
)
SHORT = ("φp", "φr", "l")


@dataclass(frozen=True, slots=True)
class Recipe:
    """A record and what is told of it.

    Attributes
    ----------
    truth, told : dict
        Soil that made the record; what differs from it, beside the fitted parameters, in the scene.
    travel_d : (from, to)
        Depths of travel that were recorded.
    rows : int
    noise : float
        Of the mean force.
    spoil : str
        Kind of the record: "", "spikes", "constant", "nothing".
    """

    truth: dict[str, float] = field(default_factory=dict)
    told: dict[str, float] = field(default_factory=dict)
    travel_d: tuple[float, float] = (0.0, 2.2)
    rows: int = 300
    noise: float = 0.01
    spoil: str = ""


@dataclass(frozen=True, slots=True)
class Drawn:
    """Record, fitted curve; intervals about the truth in its parts."""

    u: Floats
    force: Floats
    model: Floats
    intervals: Floats
    values: Floats


def fitted(recipe: Recipe) -> Happened:
    """Make a record, fit it, and set intervals against the truth."""
    truth = paper_soil() | recipe.truth
    depth = 30.0
    history = force_history(scene_of(truth), displacement_mm=depth * recipe.travel_d[1], tolerance=FINE)
    u = np.linspace(depth * recipe.travel_d[0], depth * recipe.travel_d[1], recipe.rows)
    force = np.interp(u, history.u_mm, history.force_N)
    force = force * np.cos(np.radians(truth.get("wall_friction_deg", 0.0)))
    rng = np.random.default_rng(11)
    noise = recipe.noise * float(force.mean())
    force = spoiled(force, recipe.spoil, rng) + rng.normal(0.0, 1.0, recipe.rows) * noise
    told = truth | TOLD | recipe.told
    told = {name: value for name, value in told.items() if value is not None}
    fit = fit_soil(
        u, force, noise, scene_of(told), shared=SharedErrors(0.0, 0.0), discrepancy=Discrepancy(0.0, 0.003)
    )
    return scored(fit, np.array([truth[name] for name in PARAMETERS]))


def spoiled(force: Floats, kind: str, rng: np.random.Generator) -> Floats:
    """The record's force with its fault."""
    if kind == "spikes":
        force = force.copy()
        force[rng.choice(force.size, 5, replace=False)] *= 3.0
    if kind == "constant":
        return np.full_like(force, float(force.mean()))
    return np.zeros_like(force) if kind == "nothing" else force


def scored(fit: SoilFit, truth: Floats) -> Happened:
    """Distance of the values from the truth in their stated deviations."""
    pulls = np.abs(fit.values - truth) / fit.std
    holds = (fit.interval_95[:, 0] <= truth) & (truth <= fit.interval_95[:, 1])
    limits = ["open" if not np.isfinite(e).all() else f"{e[0]:.3g} to {e[1]:.3g}" for e in fit.interval_95]
    what = "; ".join(
        f"{short} {value:.3g} ({limit}; true {true:.3g})"
        for short, value, limit, true in zip(SHORT, fit.values, limits, truth, strict=True)
    )
    what += f"; {int(holds.sum())} of 3 intervals of 95 % hold the truth, {len(fit.switches)} switches"
    low, high = np.clip(fit.interval_95 / truth[:, None] - 1.0, -1.0, 1.0).T
    drawn = Drawn(
        fit.curve["u_mm"].to_numpy(), fit.curve["force_N"].to_numpy(), fit.curve["model_N"].to_numpy(),
        np.column_stack([low, high]), fit.values / truth - 1.0,
    )  # fmt: skip
    return Happened(float(pulls.max()), what, fit.remarks, (), drawn)


def cases() -> Sequence[HardCase]:
    """Every hard record."""
    heavy = {"unit_weight_kN_m3": 15.7 * 0.9}
    doubted = heavy | {"unit_weight_std_kN_m3": 1.6}
    rows: list[tuple[str, str, Recipe, str]] = [
        ("plain record", "paper's sand, 1 % of noise, one switch", Recipe(), ""),
        ("no softening", "peak = residual = 32 degrees", Recipe({"peak_friction_deg": 32.0}), "no softening"),
        (
            "softening within a row",
            "mobilization length 0.02 mm, a row each 0.22 mm",
            Recipe({"mobilization_length_mm": 0.02}),
            "not bounded",
        ),
        (
            "softening longer than the record",
            "mobilization length 300 mm, travel 66 mm",
            Recipe({"mobilization_length_mm": 300.0}),
            "residual_friction_deg only if",
        ),
        ("ends before the first switch", "travel of 0.6 depths", Recipe(travel_d=(0.0, 0.6)), ""),
        (
            "starts late",
            "the first 0.3 depths are missing, no switch",
            Recipe(travel_d=(0.3, 1.2)),
            "missing",
        ),
        ("noise of 5 %", "of the mean force", Recipe(noise=0.05), ""),
        ("noise of 30 %", "of the mean force", Recipe(noise=0.3), ""),
        ("four rows", "one more than parameters", Recipe(rows=4), "not determined"),
        ("two rows", "fewer than parameters", Recipe(rows=2), ""),
        ("spikes", "five of 300 rows threefold", Recipe(spoil="spikes"), "misses the record by"),
        ("unit weight wrong by 10 %", "told as certain", Recipe(told=heavy), "unit_weight.*taken as exact"),
        (
            "unit weight wrong by 10 %, doubted",
            "its standard uncertainty of 10 % told",
            Recipe(told=doubted),
            "",
        ),
        (
            "a rough blade that nobody told of",
            "wall friction 10 degrees",
            Recipe({"wall_friction_deg": 10.0}, {"wall_friction_deg": 0.0}),
            "wall_friction.*taken as exact",
        ),
        ("constant force", "no tooth, no fall", Recipe(spoil="constant"), "force is bent by"),
        ("no force", "noise about zero", Recipe(spoil="nothing"), "not determined"),
    ]
    return [
        HardCase(name, done, MUST, partial(fitted, recipe), LIMIT, "std", says or NO_WORDS)
        for name, done, recipe, says in rows
    ]


def draw(canvas: Canvas, case: HardCase, shown: Drawn) -> None:
    """Record and fit; intervals of 95 % about the truth."""
    left, right = canvas.subplots(1, 2, width_ratios=(2.2, 1.0))
    some = np.unique(np.linspace(0, len(shown.u) - 1, min(len(shown.u), 120)).round().astype(int))
    left.plot(shown.u[some], shown.force[some], ".", color=MEASURED, markersize=2)
    left.plot(shown.u[some], shown.model[some], color=MODEL, linewidth=1.2)
    left.set_xlabel("u, mm")
    left.set_ylabel("F, N")
    for k, ((low, high), value) in enumerate(zip(shown.intervals, shown.values, strict=True)):
        right.plot([k, k], [100 * low, 100 * high], color=MEASURED, linewidth=3, solid_capstyle="butt")
        right.plot(k, 100 * np.clip(value, -1, 1), "o", color=INK, markersize=3)
    right.axhline(0.0, color=MUTED, linewidth=0.8)
    right.set_ylim(-105, 105)
    right.set_xlim(-0.6, 2.6)
    right.set_xticks(range(3), SHORT)
    right.set_ylabel("from truth, %")


PART = Part(
    "fit",
    "Fit",
    "Records of the model itself with known soil, told as 45 / 30 degrees and 2 mm. Blue: record; "
    "orange: fit; "
    "to the right the intervals of 95 % about the truth (cut at ±100 %).",
    cases,
    draw,
)
