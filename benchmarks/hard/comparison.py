"""Hard cases of the comparison: measurements made of the model, with parts missing, few, or of another."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from hard.cases import NO_WORDS, Canvas, Happened, HardCase, Part
from ploughval.axes import FORCE_COLUMNS
from ploughval.compare import compare_test
from ploughval.compare.validation import Metric
from ploughval.model import History, simulate
from ploughval.report.figures.style import MEASURED, MODEL, MUTED
from ploughval.scene import Scene

Floats = NDArray[np.float64]

DEPTH, WIDTH = 30.0, 218.0
TRAVEL = 3.6 * DEPTH
HEIGHTS = (6.0, 12.0, 18.0, 24.0)
STDS = {
    "unit_weight_std_kN_m3": 0.2, "peak_friction_std_deg": 0.5, "residual_friction_std_deg": 0.5,
    "mobilization_length_std_mm": 0.2,
}  # fmt: skip
BANDS = "band|outcrop|mobilised"
FORCES = ("force_mean_N", "work_mJ", "first_switch_N")
DIFFER = 10.0  # % of the judged metrics: 5 % of right ones differ by chance


@dataclass(frozen=True, slots=True)
class Measured:
    """The four tables of a test; None: not measured."""

    force: pd.DataFrame | None
    bands: pd.DataFrame | None
    layers: pd.DataFrame | None
    surface: pd.DataFrame | None


@dataclass(frozen=True, slots=True)
class Recipe:
    """What made the measurements, what was done to them, and what the model is told.

    Attributes
    ----------
    sand : dict
        What the sand of the experiment has that the model is not told.
    spoil : callable
    stds : dict
        Standard uncertainties of the model's inputs.
    wrong : bool
        Whether experiment and model are another sand, so that metrics that agree are the error.
    noise_N : float
    about : str
        Pattern of the metrics that have a right to differ.
    row_mm : float
        Travel between rows of the force.
    """

    sand: dict[str, float] = field(default_factory=dict)
    spoil: Callable[[Measured], Measured] = field(default=lambda measured: measured)
    stds: dict[str, float] = field(default_factory=lambda: dict(STDS))
    wrong: bool = False
    noise_N: float = 0.1
    about: str = NO_WORDS
    row_mm: float = 0.1


@dataclass(frozen=True, slots=True)
class Drawn:
    """Forces of both sides, and how many metrics agree, differ, or are not judged."""

    measured: tuple[Floats, Floats]
    model: tuple[Floats, Floats]
    counts: tuple[int, int, int]


def scene_of(sand: dict[str, float], stds: dict[str, float]) -> Scene:
    """The paper's sand, 30 mm deep."""
    soil = {
        "unit_weight_kN_m3": 15.7, "peak_friction_deg": 50.0, "residual_friction_deg": 32.0,
        "mobilization_length_mm": 1.0,
    } | sand | stds  # fmt: skip
    return Scene.model_validate(
        {
            "test": {"name": "hard"},
            "blade": {"depth_mm": DEPTH, "width_mm": WIDTH},
            "soil": soil,
            "compare": {"draws": 16},
        }
    )


@lru_cache(maxsize=8)
def history_of(sand: tuple[tuple[str, float], ...]) -> History:
    """The run that stands for a sand."""
    return simulate(scene_of(dict(sand), {}), displacement_mm=TRAVEL)


def measured_of(history: History, noise_N: float, row_mm: float = 0.1, seed: int = 3) -> Measured:
    """What a laboratory would measure of a run: the four tables with their errors."""
    rng = np.random.default_rng(seed)
    time = np.arange(-5.0, TRAVEL, row_mm)
    u = np.maximum(time, 0.0)
    force = np.where(time > 0.0, np.interp(u, history.force["u_mm"], history.force["force_N"]), 0.0)
    force = force + rng.normal(0, noise_N, u.size)
    record = pd.DataFrame(np.nan, index=range(u.size), columns=list(FORCE_COLUMNS[:-1]))
    record = record.assign(time_s=time, u_mm=u, force_N=force, force_std_N=max(noise_N, 1e-9), status="ok")
    bands = history.bands.assign(beta_std_deg=0.3, outcrop_std_mm=0.5)
    bands["outcrop_x_mm"] += rng.normal(0, 0.5, len(bands))
    bands["beta_deg"] += rng.normal(0, 0.3, len(bands))
    frames, travel = np.arange(12), np.linspace(1.0, TRAVEL - 1.0, 12)
    layers = history.layers(HEIGHTS, travel, frames).assign(source="tracks", std_mm=0.05)
    layers["y_mm"] += rng.normal(0, 0.05, len(layers))
    lines = [seen(history.surface(place), rng) for place in travel]
    surface = pd.concat(
        [
            pd.DataFrame({"frame": k, "u_mm": place, "x_mm": line[:, 0], "y_mm": line[:, 1], "std_mm": 0.05})
            for k, (place, line) in enumerate(zip(travel, lines, strict=True))
        ],
        ignore_index=True,
    )
    return Measured(record, bands, layers, surface)


def seen(line: Floats, rng: np.random.Generator) -> Floats:
    """A surface as photographs show it: a place each half millimetre, with an error of 0.05 mm."""
    x = np.arange(line[0, 0], min(line[-1, 0], line[0, 0] + 350.0), 0.5)
    return np.column_stack([x, np.interp(x, *line.T) + rng.normal(0, 0.05, x.size)])


def compared(recipe: Recipe) -> Happened:
    """Make the measurements, spoil them, compare."""
    run = history_of(tuple(recipe.sand.items()))
    measured = recipe.spoil(measured_of(run, recipe.noise_N, recipe.row_mm))
    scene, history = scene_of({}, recipe.stds), history_of(())
    found = compare_test(
        scene, history, force=measured.force, bands=measured.bands, layers=measured.layers,
        surface=measured.surface,
    )  # fmt: skip
    return scored(recipe, measured, history, found.metrics)


def scored(recipe: Recipe, measured: Measured, history: History, metrics: Sequence[Metric]) -> Happened:
    """Share of metrics whose verdict is wrong; values without a reason break."""
    agree = [m for m in metrics if m.agrees is True]
    differ = [m for m in metrics if m.agrees is False]
    unknown = [m for m in metrics if m.agrees is None]
    judged = len(agree) + len(differ)
    surprising = [m for m in differ if not re.search(recipe.about, m.name)]
    force = [m for m in (agree + differ) if m.name in FORCES]
    if recipe.wrong:
        bad = [m for m in force if m.agrees]
        error = 100.0 * len(bad) / len(force) if force else 0.0
    else:
        error = 100.0 * len(surprising) / judged if judged else 0.0
    mute = [m.name for m in unknown if not m.note and not np.isfinite(m.error)]
    odd = [m.name for m in metrics if np.isfinite(m.validation_std) and m.validation_std < 0]
    broken = (f"no reason for {', '.join(mute[:4])}",) if mute else ()
    broken += (f"negative uncertainty of {odd[0]}",) if odd else ()
    broken += () if metrics else ("no metric, and no word why",)
    what = f"{len(metrics)} metrics: {len(agree)} agree, {len(differ)} differ, {len(unknown)} not judged"
    if differ and not recipe.wrong:
        what += f" ({', '.join(m.name for m in differ[:5])})"
    told = tuple(dict.fromkeys(m.note for m in metrics if m.note))
    record = measured.force
    line = (
        (np.empty(0), np.empty(0))
        if record is None
        else (
            record["u_mm"].to_numpy()[:: len(record) // 300 + 1],
            record["force_N"].to_numpy()[:: len(record) // 300 + 1],
        )
    )
    model = history.force["u_mm"].to_numpy()[::8], history.force["force_N"].to_numpy()[::8]
    return Happened(error, what, told, broken, Drawn(line, model, (len(agree), len(differ), len(unknown))))


def only(**tables: Callable[[pd.DataFrame], pd.DataFrame | None]) -> Callable[[Measured], Measured]:
    """Change some of the tables."""

    def spoil(measured: Measured) -> Measured:
        return replace(measured, **{name: by(getattr(measured, name)) for name, by in tables.items()})

    return spoil


def gaps(table: pd.DataFrame) -> pd.DataFrame:
    """Every third 2 mm of travel lost of the force, of the others each third twenty rows."""
    place = table["u_mm"] / 2.0 if "force_N" in table else np.arange(len(table)) / 20.0
    lost = np.floor(place) % 3 == 1
    columns = [c for c in ("force_N", "x_mm", "y_mm") if c in table]
    return table.assign(**{c: table[c].where(~lost) for c in columns})


def later(table: pd.DataFrame) -> pd.DataFrame:
    """Travel that the model does not reach."""
    moved = {c: table[c] + 2.0 * TRAVEL for c in ("u_mm", "u_start_mm", "u_end_mm") if c in table}
    return table.assign(**moved)


def invented(table: pd.DataFrame) -> pd.DataFrame:
    """Two bands more, between the first and the second."""
    more = table.iloc[[0, 0]].assign(
        u_start_mm=[12.0, 22.0], u_end_mm=[22.0, float(table["u_end_mm"].iloc[0])], outcrop_x_mm=[95.0, 120.0]
    )
    table = pd.concat([table, more]).sort_values("u_start_mm", kind="stable")
    return table.assign(band=np.arange(len(table)))


def certain(measured: Measured) -> Measured:
    """Every stated standard deviation is zero."""
    force = measured.force.assign(force_std_N=0.0)
    bands = measured.bands.assign(beta_std_deg=0.0, outcrop_std_mm=0.0)
    return Measured(force, bands, measured.layers.assign(std_mm=0.0), measured.surface.assign(std_mm=0.0))


def empty(table: pd.DataFrame) -> pd.DataFrame:
    """No rows."""
    return table.iloc[:0]


CREEPS = {"peak_friction_deg": 32.0}
EVERYTHING = dict.fromkeys(("force", "bands", "layers", "surface"), later)
SAME = f"at most {DIFFER:g} % of the metrics that are judged differ; what is not judged has a reason"
OTHER = "no force of another sand agrees; what is not judged has a reason"
Row = tuple[str, str, str, Recipe, str]


def whole_tests() -> list[Row]:
    """Everything was measured, of this sand or another: name, what is done, demand, recipe, words."""
    return [
        ("the same sand", "measured with its stated errors", SAME, Recipe(), ""),
        (
            "no peaks measured",
            "the experiment creeps: peak = residual",
            OTHER,
            Recipe(CREEPS, wrong=True),
            "",
        ),
        (
            "another sand",
            "40 / 32 degrees in the experiment",
            OTHER,
            Recipe({"peak_friction_deg": 40.0}, wrong=True),
            "",
        ),
        (
            "force in mN",
            "a thousand times too large",
            OTHER,
            Recipe(spoil=only(force=lambda t: t.assign(force_N=1e3 * t["force_N"])), wrong=True),
            "",
        ),
        (
            "force with the wrong sign",
            "all rows",
            OTHER,
            Recipe(spoil=only(force=lambda t: t.assign(force_N=-t["force_N"])), wrong=True),
            "",
        ),
    ]


def parts_of_tests() -> list[Row]:
    """Something is missing, or too much."""
    return [
        (
            "one peak of three",
            "the record ends after the first switch",
            SAME,
            Recipe(spoil=only(force=lambda t: t[t["u_mm"] < 45.0])),
            "",
        ),
        (
            "a band missed",
            "the second one",
            SAME,
            Recipe(spoil=only(bands=lambda t: t[t["band"] != 1]), about=BANDS),
            "",
        ),
        ("bands invented", "two more", SAME, Recipe(spoil=only(bands=invented), about=BANDS), ""),
        ("no band", "an empty table", SAME, Recipe(spoil=only(bands=empty), about=BANDS), ""),
        (
            "gaps",
            "a third of the force, layers and surface are not a number",
            SAME,
            Recipe(spoil=only(force=gaps, layers=gaps, surface=gaps)),
            "",
        ),
        ("coarse record", "a row each 0.3 mm, friction falls within 1 mm", SAME, Recipe(row_mm=0.3), ""),
        (
            "no overlap of travel",
            "measured beyond the end of the run",
            SAME,
            Recipe(spoil=only(**EVERYTHING), about=BANDS),
            "travel|reach|overlap",
        ),
        (
            "empty tables",
            "of everything",
            SAME,
            Recipe(spoil=only(**dict.fromkeys(EVERYTHING, empty)), about=BANDS),
            "",
        ),
    ]


def vague_tests() -> list[Row]:
    """Uncertainties of none, or of much."""
    return [
        (
            "one row of force",
            "and nothing else",
            SAME,
            Recipe(spoil=lambda m: Measured(m.force.iloc[200:201], None, None, None)),
            "",
        ),
        (
            "no uncertainty at all",
            "zero on both sides, noise of 0.1 N",
            "nothing is infinite, nothing falls over",
            Recipe(spoil=certain, stds={}),
            "uncertaint",
        ),
        ("noise as large as the force", "10 N a row", SAME, Recipe(noise_N=10.0), ""),
        (
            "inputs hardly known",
            "peak friction 50 ± 8 degrees",
            SAME,
            Recipe(stds=STDS | {"peak_friction_std_deg": 8.0}),
            "",
        ),
    ]


def cases() -> Sequence[HardCase]:
    """Every hard comparison."""
    return [
        HardCase(
            name,
            done,
            must,
            partial(compared, recipe),
            0.0 if recipe.wrong else DIFFER,
            "% wrong",
            says or NO_WORDS,
        )
        for name, done, must, recipe, says in (*whole_tests(), *parts_of_tests(), *vague_tests())
    ]


def draw(canvas: Canvas, case: HardCase, shown: Drawn) -> None:
    """Both forces, and a bar of metrics."""
    bar, ax = canvas.subplots(2, 1, height_ratios=(1, 7))
    bar.set_xlim(0, max(sum(shown.counts), 1))
    bar.set_ylim(-0.4, 0.4)
    ax.plot(*shown.model, color=MODEL, linewidth=1.2)
    ax.plot(*shown.measured, color=MEASURED, linewidth=0.8)
    ax.set_xlabel("u, mm")
    ax.set_ylabel("F, N")
    start = 0
    for count, colour in zip(shown.counts, (MEASURED, MODEL, MUTED), strict=True):
        bar.barh(0, count, left=start, color=colour)
        if count:
            bar.text(start + count / 2, 0, str(count), ha="center", va="center", color="#ffffff", fontsize=7)
        start += count
    bar.set_axis_off()


PART = Part(
    "comparison",
    "Comparison",
    "Measurements are made of the model itself, with noise, so that what should agree is known. "
    "Blue: measured "
    "force; orange: predicted. Bar: metrics that agree (blue), differ (orange), are not judged (grey).",
    cases,
    draw,
)
