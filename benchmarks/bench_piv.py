"""Speed against error of the subset correlation, on exact pictures of sand: tables and figures.

    python benchmarks/bench_piv.py [--out reports/speed-error] [--seeds 3] [--quick]

The cases are those of ``correlation.cases``. Errors are pooled over the seeds; times are medians of rounds,
in one thread unless the table says otherwise: points a second by the clock, microseconds of CPU a point.
"""

import argparse
import csv
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation import cases, figures
from ploughval.piv import Tracks, correlate
from speed_error.timing import Seconds, timed

Floats = NDArray[np.float64]
ROUNDS = 3
VARIED_CASES = ("shift 0.25 noise 0", "shift 0.25 noise 3", "affine", "band 4 px tanh noise 3", "star")
CASE_COLUMNS = (
    "case", "seeds", "points", "valid", "bias_px", "random_px", "rmse_px", "p99_px", "bound_px",
    "times_bound", "near_rmse_px", "near_valid", "elsewhere_rmse_px", "elsewhere_valid", "star_period_px",
    "within_1_std", "within_2_std", "points_s", "cpu_us",
)  # fmt: skip
SETTING_COLUMNS = (
    "case", "subset", "order", "spline", "shape", "step_px", "workers", "points", "points_s", "cpu_us",
    "rmse_px", "bias_px", "times_bound", "near_rmse_px", "star_period_px", "valid",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Setting:
    """One way of calling the correlation."""

    subset: int = 31
    order: int = 1
    spline: int = 5
    shape: str = "adaptive"
    step_px: int = 16
    workers: int = 1

    @property
    def options(self) -> dict[str, Any]:
        """Arguments of ``correlate``."""
        return {name: value for name, value in asdict(self).items() if name != "step_px"}


@dataclass(slots=True)
class Pool:
    """What the seeds of one case gave, put together."""

    points: list[Floats] = field(default_factory=list)
    tracks: list[Tracks] = field(default_factory=list)
    seconds: list[Seconds] = field(default_factory=list)


@lru_cache(maxsize=64)
def pictures(name: str, seed: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Both pictures of a case."""
    return cases.make_pair(by_name(name), seed)


@lru_cache(maxsize=1)
def _all() -> dict[str, cases.Case]:
    return {case.name: case for case in cases.all_cases()}


def by_name(name: str) -> cases.Case:
    """The case of a name."""
    return _all()[name]


def measure(case: cases.Case, setting: Setting, seeds: Sequence[int], rounds: int = ROUNDS) -> Pool:
    """Correlate a case's pictures for every seed."""
    pool = Pool()
    points = cases.grid_points(setting.step_px)
    for seed in seeds:
        first, second = pictures(case.name, seed)
        tracks, seconds = timed(lambda a=first, b=second: correlate(a, b, points, **setting.options), rounds)
        pool.points.append(points)
        pool.tracks.append(tracks)
        pool.seconds.append(seconds)
    return pool


def pooled(case: cases.Case, pool: Pool, subset: int, seeds: Sequence[int]) -> dict[str, float]:
    """Metrics of all seeds together: shares and squares averaged, the bias taken of the mean error."""
    each = [
        asdict(cases.score(case, p, t.displacement, t.valid, t.std, subset=subset, seed=seed))
        for p, t, seed in zip(pool.points, pool.tracks, seeds, strict=True)
    ]
    out = {name: float(np.mean([row[name] for row in each])) for name in each[0]}
    for name in ("random_px", "rmse_px", "near_rmse_px", "elsewhere_rmse_px", "bound_px"):
        out[name] = float(np.sqrt(np.mean([row[name] ** 2 for row in each])))
    errors = [
        np.nanmean(
            np.where(
                (t.valid & cases.counted_points(case, p, subset))[:, None],
                t.displacement - case.motion(p),
                np.nan,
            ),
            axis=0,
        )
        for p, t in zip(pool.points, pool.tracks, strict=True)
    ]
    out["bias_px"] = float(np.abs(np.mean(errors, axis=0)).max())
    out["times_bound"] = out["random_px"] / out["bound_px"]
    count = sum(len(p) for p in pool.points)
    out["points_s"] = count / sum(seconds.wall for seconds in pool.seconds)
    out["cpu_us"] = 1e6 * sum(seconds.cpu for seconds in pool.seconds) / count
    return out


def case_rows(seeds: Sequence[int], rounds: int, chosen: Sequence[cases.Case]) -> list[dict[str, Any]]:
    """A row a case, with the defaults."""
    rows = []
    for case in chosen:
        pool = measure(case, Setting(), seeds, rounds)
        rows.append({"case": case.name, "seeds": len(seeds), **pooled(case, pool, 31, seeds)})
        print(f"{case.name:26s} " + "  ".join(f"{k} {rows[-1][k]:.4g}" for k in CASE_COLUMNS[2:]))
    return rows


def settings() -> list[Setting]:
    """Settings about the defaults, one or two changed at a time."""
    return [
        *(
            Setting(subset=side, order=order, shape="fixed")
            for side in (15, 21, 31, 41, 61)
            for order in (0, 1, 2)
        ),
        *(Setting(subset=side, spline=3, shape="fixed") for side in (21, 31, 41)),
        *(Setting(subset=side) for side in (21, 31, 41)),
        *(Setting(step_px=step) for step in (8, 32)),
        Setting(workers=2),
    ]


def setting_rows(seeds: Sequence[int], rounds: int, chosen: Sequence[Setting]) -> list[dict[str, Any]]:
    """A row a setting and case."""
    rows = []
    for name in VARIED_CASES:
        case = by_name(name)
        for setting in chosen:
            found = pooled(case, measure(case, setting, seeds, rounds), setting.subset, seeds)
            rows.append({"case": name, **asdict(setting), **found})
    return rows


def write(rows: list[dict[str, Any]], columns: Sequence[str], path: Path) -> None:
    """Write some columns of rows as CSV, numbers with five digits; not measured is empty."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in rows:
            writer.writerow([_cell(row[name]) for name in columns])


def _cell(value: object) -> object:
    if not isinstance(value, float):
        return value
    return "" if np.isnan(value) else f"{value:.5g}"


def band_profiles(seeds: Sequence[int]) -> list[dict[str, Any]]:
    """Distance from a band and error there, by width and shape."""
    out = []
    for name in ("band 12 px tanh noise 3", "band 4 px tanh noise 3"):
        case = by_name(name)
        for shape in ("fixed", "adaptive"):
            pool = measure(case, Setting(shape=shape, step_px=8), seeds, 1)
            assert case.side is not None
            side = np.concatenate([case.side(p) for p in pool.points])
            error = np.concatenate(
                [
                    np.linalg.norm(t.displacement - case.motion(p), axis=1)
                    for p, t in zip(pool.points, pool.tracks, strict=True)
                ]
            )
            out.append({"case": name, "shape": shape, "side_px": side, "error_px": error})
    return out


def star_profiles(seeds: Sequence[int]) -> list[dict[str, Any]]:
    """Share of a sinusoid's amplitude that is measured, by period and setting."""
    case, out = by_name("star noise 3"), []
    assert case.period is not None
    edges = np.linspace(12, 148, 18)
    for label, setting in (
        ("affine, 31 px", Setting(shape="fixed")),
        ("second order, 31 px", Setting(order=2, shape="fixed")),
        ("second order, 21 px", Setting(order=2, subset=21, shape="fixed")),
        ("adaptive, 31 px (default)", Setting()),
    ):
        pool = measure(case, setting, seeds, 1)
        period = np.concatenate([case.period(p) for p in pool.points])
        truth = np.concatenate([case.motion(p)[:, 1] for p in pool.points])
        found = np.concatenate([t.displacement[:, 1] for t in pool.tracks])
        gains = []
        for low, high in pairwise(edges):
            here = (period >= low) & (period < high) & np.isfinite(found)
            gains.append(
                float(found[here] @ truth[here] / np.sum(truth[here] ** 2)) if here.sum() > 20 else np.nan
            )
        out.append({"label": label, "period_px": (edges[1:] + edges[:-1]) / 2, "gain": np.array(gains)})
    return out


def main(arguments: list[str] | None = None) -> int:
    """Measure, print, write tables and figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--quick", action="store_true", help="one seed, one round, few cases, no figures")
    given = parser.parse_args(arguments)
    rounds = 1 if given.quick else ROUNDS
    seeds = range(2024, 2024 + (1 if given.quick else given.seeds))
    given.out.mkdir(parents=True, exist_ok=True)
    chosen, varied = list(_all().values()), settings()
    if given.quick:
        chosen = [by_name(name) for name in VARIED_CASES]
        varied = [s for s in varied if s.subset == Setting().subset or s.shape == Setting().shape]
    for setting in varied:  # compiles what is not compiled yet
        measure(by_name(VARIED_CASES[-2]), setting, seeds[:1], 1)
    write(case_rows(seeds, rounds, chosen), CASE_COLUMNS, given.out / "piv.csv")
    write(setting_rows(seeds[:1], rounds, varied), SETTING_COLUMNS, given.out / "piv-settings.csv")
    if given.quick:
        return 0
    figures.save(figures.draw_band(band_profiles(seeds)), given.out / "piv-band")
    figures.save(figures.draw_star(star_profiles(seeds)), given.out / "piv-star")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
