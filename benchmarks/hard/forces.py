"""Hard cases of the load cells: made logs of a known force, spoiled as loggers and rigs spoil them."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from hard.cases import NO_WORDS, Canvas, Happened, HardCase, Part
from made.rigs import NAMES, SAND_ARM_MM, Case, Rig, true_force
from ploughval.loadcells import ForceResult, measure_force
from ploughval.report.figures.style import MEASURED, MODEL, MUTED

Floats = NDArray[np.float64]
Spoil = Callable[[pd.DataFrame, np.random.Generator], pd.DataFrame]

TIME, TRAVEL, UPPER, LOWER = NAMES
PLAIN = Case("noise", noise_Nm=0.002, scatter=0.02)
MOVING_S = (10.0, 50.0)
STDS = 3.0
ROWS = 1.0  # % of rows that may lie beyond three stated standard deviations
DRAWN = 150


@dataclass(frozen=True, slots=True)
class Recipe:
    """How a test is made and spoiled.

    Attributes
    ----------
    rig : bench_force.Case
    log, empty : callable
        Change the log and each empty run before they are written.
    table : dict
        Keys of [loadcells] that are set, None: taken out.
    force : float
        Factor on the force of the sand.
    travel_mm : float
    least : float
        Share of the rows in motion that must have a force.
    """

    rig: Case = PLAIN
    log: Spoil = field(default=lambda table, rng: table)
    empty: Spoil = field(default=lambda table, rng: table)
    table: dict[str, Any] = field(default_factory=dict)
    force: float = 1.0
    travel_mm: float = 40.0
    least: float = 0.9


@dataclass(frozen=True, slots=True)
class Drawn:
    """Force against travel: true, measured, its standard deviation; travel of rows with no force."""

    u: Floats
    true: Floats
    found: Floats
    std: Floats
    lost: Floats


def measured(recipe: Recipe, arms: bool = False) -> Happened:
    """Make, spoil and read a test; rows that are ok must be within what they state."""
    rng = np.random.default_rng(5)
    rig = Rig(recipe.rig, rng, travel_mm=recipe.travel_mm)
    rig.force = rig.force * recipe.force
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        scene = rig.write(folder)
        for path, spoil in [
            (folder / "loadcells.csv", recipe.log),
            *((p, recipe.empty) for p in sorted(folder.glob("empty/*.csv"))),
        ]:
            spoil(pd.read_csv(path), rng).to_csv(path, index=False, float_format="%.14g")
        cells = scene.loadcells.model_dump(mode="python", exclude_none=True) | recipe.table
        cells = {key: value for key, value in cells.items() if value is not None}
        scene = scene.model_validate(
            scene.model_dump(exclude_none=True) | {"loadcells": cells, "folder": folder}
        )
        result = measure_force(scene)
    return scored(recipe, rig, result, arms)


def scored(recipe: Recipe, rig: Rig, result: ForceResult, arms: bool) -> Happened:
    """Rows in motion against the force at their time."""
    record = result.record
    u = np.maximum(record["time_s"].to_numpy() - MOVING_S[0], 0.0)
    end = rig.u[-1]
    moving = (u > 1.2) & (u < end - 0.2) & ~((u % 20) < 1.2)  # away from the falls of 9 N within a millimetre
    ok = (record["status"].isin(["ok", "force_too_small_for_arm"])).to_numpy()
    true = recipe.force * true_force(u)
    error = record["force_N"].to_numpy() - true
    std = record["force_std_N"].to_numpy()
    what = record["arm_mm"].to_numpy() - SAND_ARM_MM if arms else error
    stated = record["arm_std_mm"].to_numpy() if arms else std
    known = moving & ok & np.isfinite(what)
    out = (
        100.0 * float(np.mean(np.abs(what[known]) > STDS * stated[known]))
        if known.any()
        else (0.0 if arms else float("nan"))
    )
    mean = float(np.mean(true[moving])) if moving.any() else float("nan")
    here = moving & ok & np.isfinite(error)
    rms = float(np.sqrt(np.mean(error[here] ** 2))) if here.any() else float("nan")
    share = float(np.mean(ok[moving])) if moving.any() else 0.0
    text = (
        f"{100 * share:.3g} % of the rows in motion with a force, {rms:.2g} N rms "
        f"({100 * rms / mean:.2g} % of "
        f"the mean; stated {np.nanmedian(std[here]) if here.any() else float('nan'):.2g} N)"
    )
    if arms:
        text += f", {100 * np.mean(np.isfinite(what[moving])):.2g} % with a line of action"
    broken = () if share >= recipe.least else (f"less than {100 * recipe.least:.0f} % of the rows",)
    reasons = record.loc[~record["status"].isin(["ok"]), "status"].value_counts()
    told = (*result.faults, *(f"status {name}: {count} rows" for name, count in reasons.items() if count))
    return Happened(out, text, told, broken, drawn_of(u, true, record, ok))


def drawn_of(u: Floats, true: Floats, record: pd.DataFrame, ok: NDArray[np.bool_]) -> Drawn:
    """At most ``DRAWN`` rows for the picture, and the rows that have no force."""
    last = int(np.searchsorted(u, MOVING_S[1] - MOVING_S[0] - 0.1))
    some = np.unique(np.linspace(0, max(last - 1, 0), min(last, DRAWN)).round().astype(int))
    bad = np.flatnonzero(~ok)
    found = np.where(ok, record["force_N"].to_numpy(), np.nan)
    std = record["force_std_N"].to_numpy()
    return Drawn(u[some], true[some], found[some], std[some], u[bad[:: max(1, len(bad) // 60)]])


def clipped(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """The amplifier stops at 80 % of the largest moment."""
    return table.assign(**{c: table[c].clip(upper=0.8 * table[c].max()) for c in (UPPER, LOWER)})


def at_rows(rows: int, by: Callable[[Floats], Floats]) -> Spoil:
    """Change both moments in some rows in motion."""

    def spoil(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
        table = table.copy()
        chosen = np.sort(rng.choice(np.flatnonzero(table[TIME] > 12.0), rows, replace=False))
        for name in (UPPER, LOWER):
            values = table[name].to_numpy().copy()
            values[chosen] = by(values[chosen])
            table[name] = values
        return table

    return spoil


def gap(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Three seconds were not stored."""
    return table[~table[TIME].between(25.0, 28.0)]


def leap(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """The logger's clock was put on by 100 s in the middle."""
    return table.assign(**{TIME: table[TIME] + 100.0 * (table[TIME] > 30.0)})


def backwards(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """The clock was put back by 7 s in the middle."""
    return table.assign(**{TIME: table[TIME] - 7.0 * (table[TIME] > 30.0)})


def unsorted(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Two pieces of the log changed places."""
    return pd.concat([table.iloc[:300], table.iloc[600:800], table.iloc[300:600], table.iloc[800:]])


def doubled(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Each twentieth row was stored twice."""
    return table.iloc[np.sort(np.append(np.arange(len(table)), np.arange(0, len(table), 20)))]


def swapped(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """The cells' plugs were exchanged."""
    return table.rename(columns={UPPER: LOWER, LOWER: UPPER})[list(NAMES)]


def dead(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """The lower cell's cable broke at 25 s: it stands still."""
    last = float(table.loc[table[TIME] <= 25.0, LOWER].iloc[-1])
    return table.assign(**{LOWER: table[LOWER].where(table[TIME] <= 25.0, last)})


def halved(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """The empty runs stop half-way."""
    return table[table[TIME] < 30.0]


def one_at_rest(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """The log starts with a single row at rest."""
    return table[table[TIME] >= 9.99]


def in_motion(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """The log starts when the blade has gone 5 mm."""
    return table[table[TIME] >= 15.0]


def offset(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Zeros of a million N m."""
    return table.assign(**{UPPER: table[UPPER] + 1e6, LOWER: table[LOWER] - 1e6})


def scaled(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Readings in units of a millionth of a N m."""
    return table.assign(**{c: 1e6 * table[c] for c in (UPPER, LOWER)})


def turned(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """Both cells with the wrong sign."""
    return table.assign(**{c: -table[c] for c in (UPPER, LOWER)})


def stuck_travel(table: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    """The displacement transducer stood still from 25 s on."""
    last = float(table.loc[table[TIME] <= 25.0, TRAVEL].iloc[-1])
    return table.assign(**{TRAVEL: table[TRAVEL].where(table[TIME] <= 25.0, last)})


MILLIONTHS = {"upper_Nm_per_unit": 1e-6, "lower_Nm_per_unit": 1e-6}
DRIFT = replace(PLAIN, drift=0.05)
FAST, SLOW = replace(PLAIN, rate_hz=10_000.0), replace(PLAIN, rate_hz=1.0)
SPIKES, ZEROS = at_rows(20, lambda v: v + 5.0), at_rows(12, np.zeros_like)
HOLES = at_rows(30, lambda v: v * np.nan)
Row = tuple[str, str, Recipe, str]


def spoiled_logs() -> list[Row]:
    """What loggers do: name, what is done, recipe, words that own up to it."""
    return [
        (
            "noise of 0.4 %",
            "of the moments, each row",
            Recipe(replace(PLAIN, noise_Nm=0.0, noise_share=0.004)),
            "",
        ),
        ("drift, rest at both ends", "5 % of the greatest moment over the test", Recipe(DRIFT), ""),
        (
            "drift, rest before alone",
            "the same, no rest window after the travel",
            Recipe(DRIFT, table={"rest_end_s": None}),
            "drift",
        ),
        ("saturated cells", "clipped at 80 %", Recipe(log=clipped, least=0.5), "saturat"),
        ("dropouts", "12 rows at zero", Recipe(log=ZEROS), "dropout"),
        ("spikes", "20 rows off by 5 N m", Recipe(log=SPIKES), "spike"),
        ("not a number", "30 rows without a value", Recipe(log=HOLES), "not_finite"),
        ("a gap", "3 s not stored", Recipe(log=gap), "gap"),
        ("clock put on", "by 100 s in the middle", Recipe(log=leap), "clock|time"),
        ("clock put back", "by 7 s in the middle", Recipe(log=backwards), "clock|time"),
        ("rows out of order", "two pieces changed places", Recipe(log=unsorted), "order|sorted"),
        ("rows twice", "each twentieth", Recipe(log=doubled), "twice|double|duplicate"),
        (
            "cells swapped",
            "upper and lower exchanged, also in the empty runs",
            Recipe(log=swapped, empty=swapped),
            "swap|exchang",
        ),
    ]


def spoiled_rigs() -> list[Row]:
    """What rigs and those who wire them do."""
    return [
        (
            "cells swapped in the test alone",
            "the empty runs are right",
            Recipe(log=swapped),
            "swap|exchang|no sand can press",
        ),
        ("wrong signs", "both cells, also in the empty runs", Recipe(log=turned, empty=turned), "sign"),
        (
            "a cell dies",
            "the lower one stands still from 25 s on",
            Recipe(log=dead, least=0.8),
            "stuck|stand",
        ),
        (
            "transducer stuck",
            "the displacement stands still from 25 s on",
            Recipe(log=stuck_travel, least=0.3),
            "displacement|stuck|stand",
        ),
        ("empty runs shorter", "they end half-way", Recipe(empty=halved), "empty"),
        ("no empty runs", "3 N of friction", Recipe(table={"empty": ()}), "empty|friction"),
        ("one row at rest", "nothing before it", Recipe(log=one_at_rest), "rest|zero"),
        ("starts in motion", "first row at 5 mm", Recipe(log=in_motion), "rest|zero|motion"),
        ("1 Hz", "50 rows in all", Recipe(SLOW, least=0.8), ""),
        ("10 kHz", "15 s", Recipe(FAST, travel_mm=5.0), ""),
        ("zeros of a million N m", "the signal is 4 N m", Recipe(log=offset, empty=offset), "zero|offset"),
        (
            "constants of 1e-6",
            "readings of some millions",
            Recipe(log=scaled, empty=scaled, table={"calibration": MILLIONTHS}),
            "",
        ),
    ]


def cases() -> Sequence[HardCase]:
    """Every spoiled log."""
    must = f"at most {ROWS:g} % of the rows that are ok beyond three stated deviations; faulty rows named"
    made = [
        HardCase(name, done, must, partial(measured, recipe), ROWS, "% of rows", says or NO_WORDS)
        for name, done, recipe, says in (*spoiled_logs(), *spoiled_rigs())
    ]
    tiny = partial(measured, Recipe(force=2e-4, rig=replace(PLAIN, friction_N=0.0)), arms=True)
    none = "no line of action, or one within three of its stated deviations"
    made.append(HardCase("force near zero", "0.003 N, noise of 0.02 N", none, tiny, ROWS, "% of rows"))
    return made


def draw(canvas: Canvas, case: HardCase, shown: Drawn) -> None:
    """Measured force over the true one; ticks where rows have no force."""
    ax = canvas.subplots()
    order = np.argsort(shown.u, kind="stable")
    ax.plot(shown.u[order], shown.true[order], color=MUTED, linewidth=2.2)
    ax.fill_between(
        shown.u,
        shown.found - 2 * shown.std,
        shown.found + 2 * shown.std,
        color=MEASURED,
        alpha=0.25,
        linewidth=0,
    )
    ax.plot(shown.u, shown.found, color=MEASURED, linewidth=0.8)
    ax.plot(shown.lost, np.full(len(shown.lost), ax.get_ylim()[0]), "|", color=MODEL, markersize=6)
    ax.set_xlabel("u, mm")
    ax.set_ylabel("F, N")


PART = Part(
    "forces",
    "Forces",
    "A known force of 11 to 20 N over 40 mm, 3 N of friction, three empty runs; the log is spoiled "
    "before it is read. "
    "Grey: true force; blue: measured, with two standard deviations; orange ticks: rows that have no "
    "force and say why.",
    cases,
    draw,
)
