"""Tracked sequences: errors of points against the time they take, by setting and by rule of the reference.

    python benchmarks/bench_sequences.py [--out reports/speed-error] [--quick]

One made test is drawn and its sand masked once; only the tracking is timed. Beside the tracker's own rule,
which keeps the first photograph as long as it will do, stand the plain ones: the first or the last.
"""

import argparse
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.photos import Calibration, calibrate, open_frames
from ploughval.piv import Tracker, correlate
from ploughval.scene import Piv, Scene, load_scene
from ploughval.synth import EXAMPLE, SynthOptions, Truth, make_folder
from ploughval.tracers import Watcher, place_points
from speed_error.timing import Seconds, timed

Floats = NDArray[np.float64]
Rule = Callable[["Film", "Setting", Floats], Floats]

ROUNDS = 2
MADE = replace(EXAMPLE, name="film", seed=41, mm_per_px=0.25, frames=25, loadcells=False)
SMALL = replace(MADE, mm_per_px=0.5, frames=5, displacement_mm=12.0)
MOVED_PX = 1.0  # sand that has moved less counts as still


@dataclass(frozen=True, slots=True)
class Setting:
    """One way of tracking a sequence; every ``stride``-th photograph is used."""

    subset_px: int = 31
    spacing_px: float = 15.0
    order: int = 1
    spline: int = 5
    stride: int = 1
    workers: int = 1
    rule: str = "renewed where needed"

    @property
    def piv(self) -> Piv:
        """The [piv] table of test.toml."""
        return Piv(subset_px=self.subset_px, spacing_px=self.spacing_px, order=self.order, spline=self.spline)  # type: ignore[arg-type]


DEFAULT = Setting()
FAMILIES: dict[str, tuple[Setting, ...]] = {
    "subset": tuple(replace(DEFAULT, subset_px=side) for side in (21, 31, 41, 61)),
    "spacing": tuple(replace(DEFAULT, spacing_px=px) for px in (8.0, 15.0, 30.0, 45.0)),
    "shape function": tuple(replace(DEFAULT, order=order) for order in (0, 1, 2)),
    "spline": tuple(replace(DEFAULT, spline=order) for order in (3, 5)),
    "photographs": tuple(replace(DEFAULT, stride=stride) for stride in (1, 2, 3, 4)),
    "reference": tuple(
        replace(DEFAULT, rule=rule)
        for rule in ("renewed where needed", "always the first", "always the last")
    ),
    "threads": tuple(replace(DEFAULT, workers=workers) for workers in (1, 2)),
}
VARIED = {
    "subset": "subset_px",
    "spacing": "spacing_px",
    "shape function": "order",
    "spline": "spline",
    "photographs": "stride",
    "reference": "rule",
    "threads": "workers",
}
COLUMNS = (
    "family", "setting", "default", "points", "photographs", "cpu_ms", "wall_ms", "median_px", "p95_px",
    "wrong_pct", "not_tracked_pct", "within_1_std",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Film:
    """A made sequence in memory: F photographs, their sand, and the exact motion."""

    scene: Scene
    calibration: Calibration
    images: tuple[NDArray[np.generic], ...]
    sand: tuple[NDArray[np.bool_], ...]
    truth: Truth


def make_film(options: SynthOptions) -> Film:
    """Make a test, read its photographs and mask their sand."""
    with tempfile.TemporaryDirectory() as scratch:
        truth = make_folder(Path(scratch) / "film", options)
        scene = load_scene(Path(scratch) / "film")
        frames = open_frames(scene)
        calibration = calibrate(scene, frames)
        watcher = Watcher(scene, calibration)
        images = tuple(frames.read(k) for k in range(len(frames)))
        sand = tuple(watcher.look(k, image).sand for k, image in enumerate(images))
    return Film(scene, calibration, images, sand, truth)


def points_of(film: Film, setting: Setting) -> Floats:
    """Points that the first photograph is covered with, (N, 2) px."""
    scene = film.scene.model_copy(update={"piv": setting.piv})
    return place_points(film.sand[0], film.calibration, scene).px


def by_tracker(film: Film, setting: Setting, points: Floats) -> Floats:
    """Places and standard deviations (F, N, 3) px, by the tracker."""
    tracker = Tracker(setting.piv, setting.workers)
    tracker.start(film.images[0], points, film.sand[0])
    found = [np.column_stack([points, np.zeros(len(points))])]
    for k in range(setting.stride, len(film.images), setting.stride):
        seen = tracker.advance(film.images[k], film.sand[k])
        found.append(np.column_stack([seen.position_px, seen.std_px]))
    return np.stack(found)


def always_first(film: Film, setting: Setting, points: Floats) -> Floats:
    """The same where every photograph is matched with the first; a point begins at its last motion."""
    moved: Floats | None = None
    found = [np.column_stack([points, np.zeros(len(points))])]
    for k in range(setting.stride, len(film.images), setting.stride):
        tracks = correlate(
            film.images[0], film.images[k], points, guess=moved, mask=film.sand[0], **_how(setting)
        )
        found.append(np.column_stack([points + tracks.displacement, tracks.std[:, 0]]))
        before = np.zeros_like(points) if moved is None else moved
        moved = np.where(tracks.valid[:, None], tracks.displacement, before)
    return np.stack(found)


def always_last(film: Film, setting: Setting, points: Floats) -> Floats:
    """The same where every photograph is matched with the one before; a point that is lost stays lost."""
    place, variance = points.copy(), np.zeros(len(points))
    found = [np.column_stack([place, variance])]
    frames = range(0, len(film.images), setting.stride)
    for before, after in pairwise(frames):
        known = np.flatnonzero(np.isfinite(place[:, 0]))
        tracks = correlate(
            film.images[before], film.images[after], place[known], mask=film.sand[before], **_how(setting)
        )
        next_place, next_variance = np.full_like(place, np.nan), np.full_like(variance, np.nan)
        next_place[known] = place[known] + tracks.displacement
        next_variance[known] = variance[known] + tracks.std[:, 0] ** 2
        place, variance = next_place, next_variance
        found.append(np.column_stack([place, np.sqrt(variance)]))
    return np.stack(found)


RULES: dict[str, Rule] = {
    "renewed where needed": by_tracker,
    "always the first": always_first,
    "always the last": always_last,
}


def _how(setting: Setting) -> dict[str, Any]:
    names = {"subset": setting.subset_px, "order": setting.order, "spline": setting.spline}
    return {**names, "workers": setting.workers}


def measure(film: Film, setting: Setting, rounds: int) -> dict[str, Any]:
    """Errors in all photographs and time a photograph of one setting."""
    points = points_of(film, setting)
    found, seconds = timed(lambda: RULES[setting.rule](film, setting, points), rounds)
    return {
        "points": len(points),
        **times_of(seconds, len(found) - 1),
        **errors_of(film, setting, points, found),
    }


def times_of(seconds: Seconds, photographs: int) -> dict[str, float]:
    """Milliseconds a photograph."""
    per = 1e3 / photographs
    return {"photographs": photographs, "cpu_ms": per * seconds.cpu, "wall_ms": per * seconds.wall}


def errors_of(film: Film, setting: Setting, points: Floats, found: Floats) -> dict[str, float]:
    """Distance of points that have moved from the exact place of the same sand; what was not tracked."""
    start = film.calibration.to_mm(points)
    true_mm = film.truth.positions(start)[:: setting.stride]
    true_px = film.calibration.to_px(true_mm)
    error = found[..., :2] - true_px
    size = np.linalg.norm(error, axis=-1)
    moved = np.isfinite(true_mm[..., 0]) & (np.linalg.norm(true_px - points, axis=-1) > MOVED_PX)
    known = moved & np.isfinite(size)
    sigma = found[..., 2][known]
    within = np.abs(error[known]) < sigma[:, None]
    return {
        "median_px": float(np.median(size[known])),
        "p95_px": float(np.quantile(size[known], 0.95)),
        "wrong_pct": 100.0 * float(np.mean(size[known] > 1.0)),
        "not_tracked_pct": 100.0 * float(1.0 - known.sum() / moved.sum()),
        "within_1_std": float(within.mean()),
    }


def rows_of(film: Film, rounds: int) -> list[dict[str, Any]]:
    """A row a setting; the default is measured once and stands in every family."""
    known: dict[Setting, dict[str, Any]] = {}
    rows = []
    for family, settings in FAMILIES.items():
        for setting in settings:
            if setting not in known:
                known[setting] = measure(film, setting, rounds)
            name = getattr(setting, VARIED[family])
            label = f"{name:g}" if isinstance(name, float) else str(name)
            rows.append({"family": family, "setting": label, "default": setting == DEFAULT, **known[setting]})
            print("  ".join(f"{_cell(rows[-1][column])!s:>12}" for column in COLUMNS), flush=True)
    return rows


def _cell(value: object) -> object:
    return f"{value:.4g}" if isinstance(value, float) else value


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table and write sequences.csv into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--quick", action="store_true", help="few small photographs, one round")
    options = parser.parse_args(arguments)
    film = make_film(SMALL if options.quick else MADE)
    print(f"{len(film.images)} photographs of {film.images[0].shape[1]} x {film.images[0].shape[0]} px")
    for setting in {s for settings in FAMILIES.values() for s in settings}:  # compiles
        if setting.stride == 1 and setting.spacing_px == DEFAULT.spacing_px:
            few = replace(setting, spacing_px=60.0)
            RULES[setting.rule](film, few, points_of(film, few))
    table = pd.DataFrame(rows_of(film, 1 if options.quick else ROUNDS), columns=list(COLUMNS))
    options.out.mkdir(parents=True, exist_ok=True)
    table.to_csv(options.out / "sequences.csv", index=False, float_format="%.4g", lineterminator="\n")


if __name__ == "__main__":
    main()
