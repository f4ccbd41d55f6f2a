"""Speed against error of the subset correlation, on exact pictures of sand."""

import argparse
import csv
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ploughval.piv import correlate
from ploughval.synth.sand import Grains, sand_texture

Floats = NDArray[np.float64]
SHAPE = (480, 640)
ANGLE = np.deg2rad(25.0)
COLUMNS = (
    "case", "subset", "spline", "points", "valid", "bias_px", "rmse_px", "p95_px", "std_px", "times_bound",
    "points_s",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Case:
    """A motion of the sand, with grey noise and contrast."""

    name: str
    motion: Callable[[Floats], Floats]
    noise: float = 0.0
    contrast: float = 1.0
    near_px: float = np.inf  # only points so near the band count


def shift(x: float, y: float) -> Callable[[Floats], Floats]:
    """Motion of a plain displacement, px."""
    return lambda p: np.tile([x, y], (len(p), 1))


def affine(p: Floats) -> Floats:
    """2 % stretch, 3 % shear and 1.5 degrees about the middle of the picture."""
    turn = np.deg2rad(1.5)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    gradient = rotation @ np.array([[1.02, 0.03], [0.0, 1.0]]) - np.eye(2)
    return np.asarray((p - np.array(SHAPE[::-1]) / 2) @ gradient.T)


def side(p: Floats) -> Floats:
    """Distance from a line through the picture's middle, px."""
    return np.asarray((p - np.array(SHAPE[::-1]) / 2) @ [-np.sin(ANGLE), -np.cos(ANGLE)])


def band(width: float) -> Callable[[Floats], Floats]:
    """Motion of a block along a line by 5.4 px, spread over ``width`` px (tanh)."""
    along = np.array([np.cos(ANGLE), -np.sin(ANGLE)])
    return lambda p: 2.7 * (1.0 + np.tanh(side(p) / (width / 2)))[:, None] * along


def cases() -> list[Case]:
    """Translation sweep, affine, far, near a band, and hard contrast."""
    sweep = [
        Case(f"shift {s:.2f} noise {n}", shift(s, s / 2), n) for n in (0, 3) for s in (0.1, 0.25, 0.5, 0.75)
    ]
    return [
        *sweep,
        Case("affine", affine),
        Case("far 17 px", shift(17.3, -3.2)),
        Case("far 60 px", shift(60.3, -23.2)),
        Case("near band 12 px", band(12), 1.0, near_px=15.5),
        Case("near band 4 px", band(4), 1.0, near_px=15.5),
        Case("contrast 10 % noise 4", shift(0.25, 0.125), 4.0, 0.1),
    ]


def picture(grains: Grains, case: Case, rng: np.random.Generator) -> NDArray[np.uint8]:
    """8 bit picture with the case's contrast and noise."""
    light = 140 + case.contrast * (grains.picture(SHAPE).astype(float) - 140)
    return np.clip(np.round(light + rng.normal(0, case.noise, SHAPE)), 0, 255).astype(np.uint8)


def slope_bound(grains: Grains, case: Case, subset: int) -> float:
    """Cramer-Rao bound of a displacement component: translation of a subset, both pictures noisy, px."""
    ahead, behind = (grains.moved((s, 0.0)).picture(SHAPE).astype(float) for s in (0.05, -0.05))
    slope = np.mean((case.contrast * (ahead - behind) / 0.1) ** 2)
    noise = np.hypot(case.noise, 1 / np.sqrt(12))
    return float(np.sqrt(2 / slope) * noise / subset)


def run(case: Case, grains: Grains, subset: int, spline: int, rng: np.random.Generator) -> tuple[object, ...]:
    """One row of the table."""
    step, margin = 12.0, 24.0
    axes = (np.arange(margin, n - margin, step) for n in SHAPE[::-1])
    points = np.stack([a.ravel() for a in np.meshgrid(*axes)], axis=1)
    first, current = (
        picture(grains, case, rng),
        picture(grains.moved(case.motion(grains.positions_px)), case, rng),
    )
    start = time.perf_counter()
    tracks = correlate(first, current, points, subset=subset, spline=spline)
    seconds = time.perf_counter() - start
    truth = case.motion(points)
    room = subset // 2 + 2
    arrived = points + truth
    counted = ((arrived > room) & (arrived < np.array(SHAPE[::-1]) - room)).all(axis=1)
    counted &= np.abs(side(points)) < case.near_px
    valid = tracks.valid & counted
    error = (tracks.displacement - truth)[valid]
    rmse = float(np.sqrt(np.mean(error**2)))
    return (
        case.name, subset, spline, int(counted.sum()), round(valid.sum() / counted.sum(), 4),
        round(float(np.abs(error.mean(axis=0)).max()), 5), round(rmse, 5),
        round(float(np.percentile(np.abs(error), 95)), 5),
        round(float(np.sqrt(np.mean(tracks.std[valid] ** 2))), 5),
        round(float(np.std(error - error.mean(axis=0))) / slope_bound(grains, case, subset), 3),
        round(len(points) / seconds),
    )  # fmt: skip


def main(arguments: list[str] | None = None) -> int:
    """Print the table and write it as CSV."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    out = parser.parse_args(arguments).out
    rng = np.random.default_rng(2024)
    grains = sand_texture(rng, SHAPE, margin_px=80)
    run(Case("warm", shift(0.3, 0.1)), grains, 31, 5, rng)  # compiles
    rows = [run(case, grains, 31, spline, rng) for spline in (5, 3) for case in cases()]
    chosen = [c for c in cases() if c.name in ("shift 0.25 noise 3", "affine", "near band 12 px")]
    rows += [run(case, grains, subset, 5, rng) for subset in (21, 41, 61) for case in chosen]
    print("  ".join(f"{name:>11s}" for name in COLUMNS))
    for row in rows:
        print(f"{row[0]:24s}" + "  ".join(f"{value!s:>9s}" for value in row[1:]))
    out.mkdir(parents=True, exist_ok=True)
    with (out / "piv.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(rows)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
