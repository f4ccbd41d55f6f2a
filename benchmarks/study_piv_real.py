"""Subset correlation on real pictures of others: what it gives against all that their SOURCE.md states."""

import argparse
import csv
import re
import time
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from correlation import real_figures as figures
from correlation.figures import save
from correlation.real_figures import PERIODS, STILL, WAVE_SETTINGS
from drawing.style import style
from ploughval.axes import Status
from ploughval.photos.reading.decode import decode
from ploughval.piv import Tracks, correlate

Floats = NDArray[np.float64]
Pictures = list[NDArray[Any]] | dict[int, NDArray[Any]]
COLUMNS = ("set", "quantity", "stated", "measured", "unit", "note")
NORMAL = {1: 0.683, 2: 0.954}
FAR = [(300, 2700), (3700, 2700), (1900, 2300), (600, 1500), (2900, 1300), (600, 300)]
BELOW, BESIDE = (1920, 1990), (1150, 1450)
FLOW_PAIRS = (0, 5, 10, 15, 19)
FLOW = {
    (240, 280): [(-3.89, 4.26), (-5.07, 5.57), (-5.97, 5.70), (-5.24, 4.28), (-4.05, 2.81)],
    (300, 240): [(-2.18, 2.56), (-3.22, 3.67), (-4.02, 4.36), (-4.29, 4.57), (-4.37, 4.39)],
    (340, 200): [(-1.56, 1.51), (-1.89, 2.07), (-2.10, 2.18), (-2.65, 2.41), (-2.73, 2.48)],
}
LONG = {(88, 36): [(0, -8), (-1, -12)], (30, 40): [(0, -6), (0, -9)],
        (150, 25): [(-1, -9), (-2, -13)], (130, 95): [(-2, -8), (-4, -12)]}  # fmt: skip


@dataclass(slots=True)
class Table:
    """Rows of the result, and the scatter that was found against the std that was predicted."""

    name: str = ""
    rows: list[tuple[str, ...]] = field(default_factory=list)
    honesty: list[tuple[str, float, float]] = field(default_factory=list)

    def add(self, quantity: str, stated: object, measured: object, unit: str, note: str = "") -> None:
        """Append one row of the present set; floats are written with three decimals."""
        cells = (f"{c:.3f}" if isinstance(c, float) else str(c) for c in (stated, measured))
        self.rows.append((self.name, quantity, *cells, unit, note))

    def scatter(self, quantity: str, found: float, predicted: float, note: str) -> None:
        """Append the scatter found, the std predicted (stated) and what they are of."""
        self.add(quantity, float(predicted), float(found), "px", f"stated: predicted std; {note}")
        self.honesty.append((self.name, float(predicted), float(found)))


def grid(low: ArrayLike, high: ArrayLike, step: float) -> Floats:
    """Points (N, 2) of a square grid from low to below high, px."""
    axes = (
        np.arange(a, b, step) for a, b in zip(np.asarray(low, float), np.asarray(high, float), strict=True)
    )
    return np.stack([a.ravel() for a in np.meshgrid(*axes)], axis=1)


def both(pair: ArrayLike, digits: int = 3) -> str:
    """Two numbers as text."""
    u, v = np.asarray(pair, float)
    return f"({u:.{digits}f}, {v:.{digits}f})"


def span(values: ArrayLike) -> str:
    """Least and greatest of some values as text."""
    return f"{np.nanmin(values):.3f} to {np.nanmax(values):.3f}"


def robust(values: Floats) -> float:
    """Standard deviation from the median of absolute values about zero."""
    return float(1.4826 * np.nanmedian(np.abs(values)))


def wave_truth(points: Floats) -> Floats:
    """Stated v (N,) of the wave, px: 0.5 cos(2 pi (y - 250) / p), p = 10 + 0.07 x."""
    return np.asarray(0.5 * np.cos(2 * np.pi * (points[:, 1] - 250) / (10 + 0.07 * points[:, 0])))


def gain_by_period(points: Floats, v: Floats, truth: Floats) -> Floats:
    """Share of the true amplitude that is found, one for each interval of PERIODS."""
    period = 10 + 0.07 * points[:, 0]
    use = [np.isfinite(v) & (period >= low) & (period < high) for low, high in pairwise(PERIODS)]
    return np.array([v[u] @ truth[u] / (truth[u] @ truth[u]) for u in use])


def period_of_90(gain: Floats) -> float:
    """Shortest period above which the gain stays over 0.9, px."""
    middle = (PERIODS[:-1] + PERIODS[1:]) / 2
    last = min(int(np.flatnonzero(gain < 0.9)[-1]), len(gain) - 2)
    return float(np.interp(0.9, gain[last : last + 2], middle[last : last + 2]))


def dice_gold(path: Path) -> tuple[Floats, Floats, Floats]:
    """Points, displacement and true v of DICe's stored result, turned: its reference is Deformed."""
    gold = np.loadtxt(path, delimiter=",", skiprows=1)
    points = gold[:, 1:3]
    origin = points.copy()
    for _ in range(60):  # where the points of Deformed come from
        origin[:, 1] = points[:, 1] - wave_truth(origin)
    return points, -gold[:, 3:5], wave_truth(origin)


def study_wave(folder: Path, table: Table) -> dict[str, Floats]:
    """Resolution, noise and coverage on the DIC Challenge wave; gain by period of each setting."""
    table.name = "dic_challenge_wave"
    add, scatter = table.add, table.scatter
    pair = [decode(folder / f"DIC_Challenge_Wave_{n}_Noisy.bmp") for n in ("Reference", "Deformed")]
    where, moved, truth = dice_gold(folder / "DICe_solution_0.txt")
    peer = gain_by_period(where, moved[:, 1], truth)
    gains = {"DICe gold, subset 31": peer}
    points = grid((24, 24), (1976, 477), 8)
    for subset, order, _ in WAVE_SETTINGS:
        correlate(*pair, points[:200], subset=subset, order=order)  # compiles
        start = time.perf_counter()
        tracks = correlate(*pair, points, subset=subset, order=order)
        rate = len(points) / (time.perf_counter() - start)
        u, ratio = tracks.displacement[:, 0], np.abs(tracks.displacement[:, 0]) / tracks.std[:, 0]
        long = points[:, 0] >= 1000
        label = f"subset {subset}, order {order}"
        gain = gains[label] = gain_by_period(points, tracks.displacement[:, 1], wave_truth(points))
        add(f"{label}: valid", "", float(tracks.valid.mean()), "1")
        add(f"{label}: bias of u", 0.0, f"{np.nanmean(u):.5f}", "px")
        add(f"{label}: std of u", 0.020, f"{np.nanstd(u):.4f}", "px", "stated: DICe, subset 31")
        for k in (1, 2):
            note = f"stated: normal; periods over 80 px: {np.nanmean(ratio[long] < k):.3f}"
            add(f"{label}: |u| within {k} predicted std", NORMAL[k], float(np.nanmean(ratio < k)), "1", note)
        for k in np.searchsorted(PERIODS, (20, 28, 40, 60, 100, 140)):
            quantity = f"{label}: gain at periods {PERIODS[k]:.0f} to {PERIODS[k + 1]:.0f}"
            add(quantity, float(peer[k]), float(gain[k]), "1", "stated: DICe, subset 31")
        periods = (period_of_90(g) for g in (peer, gain))
        add(f"{label}: period of 90 % gain", *periods, "px", "stated: DICe")
        add(f"{label}: speed", "", f"{rate:.0f}", "points/s", "one thread, compiled")
        predicted = np.sqrt(np.nanmean(tracks.std[long, 0] ** 2))
        scatter(f"{label}: std of u, periods over 80 px", np.nanstd(u[long]), predicted, "rms")
    return gains


def disc_of(picture: NDArray[Any]) -> NDArray[np.bool_]:
    """The dark disc of the T-bar: the largest dark patch of the smoothed picture."""
    dark = (cv2.GaussianBlur(picture, (0, 0), 8) < 60).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(dark)
    return np.asarray(labels == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax()))


def tbar_mask(picture: NDArray[Any], margin: int = 20) -> NDArray[np.bool_]:
    """Soil of the T-bar's pictures: without the disc, its rim and smear, and the rows of bright marks."""
    kernel = np.ones((2 * margin + 1,) * 2, np.uint8)
    soil = cv2.dilate(disc_of(picture).astype(np.uint8), kernel) == 0
    soil[:30] = False
    return np.asarray(soil)


def study_tbar(folder: Path, table: Table) -> dict[str, Any]:
    """Far field, near field, edge of the disc and repeatability of the five T-bar pairs."""
    table.name = "tbar_clay_geopyv"
    add, scatter = table.add, table.scatter
    frames = [decode(path) for path in sorted(folder.glob("*.jpg"))]
    mask = tbar_mask(frames[0])
    beside = np.stack([np.arange(1440.0, 1530, 10), np.full(9, 1450.0)], axis=1)
    points = np.vstack([FAR, BELOW, BESIDE, beside, grid((96, 96), (4010, 2920), 96)]).astype(float)
    disc, masked = (m[tuple(points.astype(int).T[::-1])] for m in (disc_of(frames[0]), ~mask))
    result: dict[str, Any] = {"mask": mask, "points": points}
    for subset in (31, 81):
        all_tracks = [correlate(a, b, points, subset=subset, mask=mask) for a, b in pairwise(frames)]
        d, std = np.array([t.displacement for t in all_tracks]), np.array([t.std for t in all_tracks])
        label, many = f"subset {subset}", "6 points, 5 pairs"
        for quantity, stated_span, values, note in (
            ("v of the far field", "1.92 to 2.10", d[:, :6, 1], many),
            ("u of the far field", "-0.1 to 0.1", d[:, :6, 0], many),
            ("v below the disc", "1.89 to 1.93", d[:, 6, 1], str(BELOW)),
            ("v beside the disc", "3.42 to 3.48", d[:, 7, 1], str(BESIDE)),
        ):
            add(f"{label}: {quantity}", stated_span, span(values), "px", note)
        edge, moved = d[:, 8:17, 1], np.isfinite(d[:, :, 0])
        count = f"{moved[:, 8:17].sum()} of {edge.size} valid"
        add(f"{label}: v at the disc's edge, x 1440 to 1520", "not 0", span(edge), "px", count)
        add(f"{label}: valid on the disc", 0, int(moved[:, disc].sum()), "vectors")
        add(f"{label}: valid though the point is masked", 0, int(moved[:, masked].sum()), "vectors")
        add(f"{label}: valid share of soil", "", float(moved[:, ~masked].mean()), "1")
        apart = d[2:] - d[:-2]  # no picture in common: its noise would count twice
        found = robust(apart) / 2**0.5
        scatter(
            f"{label}: repeatability",
            found,
            np.nanmedian(std),
            "every other pair; differences / sqrt 2, robust",
        )
        ratio = np.abs(apart) / np.hypot(std[2:], std[:-2])
        for k in (1, 2):
            share = float(np.mean(ratio[np.isfinite(ratio)] < k))
            add(f"{label}: pair to pair within {k} predicted std", NORMAL[k], share, "1", "stated: normal")
        result[f"d{subset}"] = d
    return result


def onward(frames: Pictures, k: int, points: Floats, first: Tracks, subset: int) -> tuple[Floats, ...]:
    """Sum of pairs minus direct over frames k, k+1, k+2; closure of k forth and back; std of the sum."""
    start = points + np.nan_to_num(first.displacement)
    second, back = (correlate(frames[k + 1], frames[n], start, subset=subset) for n in (k + 2, k))
    direct = correlate(frames[k], frames[k + 2], points, subset=subset)
    total = first.displacement + second.displacement - direct.displacement
    closure = first.displacement + back.displacement
    return total, closure, np.sqrt(first.std**2 + second.std**2 + direct.std**2)


def study_avalanche(folder: Path, table: Table) -> dict[str, Any]:
    """Still zones, flowing sand, what is refused, and two frames apart, on the 20 pairs of the avalanche."""
    table.name = "sand_avalanche"
    add, scatter = table.add, table.scatter
    frames = [decode(path) for path in sorted(folder.glob("*.jpeg"))]
    points = np.vstack([STILL, list(FLOW), grid((24, 24), (617, 337), 16)]).astype(float)
    pairs = [correlate(a, b, points) for a, b in pairwise(frames)]
    d, std = np.array([t.displacement for t in pairs]), np.array([t.std for t in pairs])
    still = d[:, :6]
    note = "largest component; the parabola of SOURCE.md is short by a quarter at 1/8 px"
    add("still points: greatest motion", "at most 0.11", float(np.abs(still).max()), "px", note)
    add("still points: mean over the pairs", "below 0.02", float(np.abs(still.mean(axis=0)).max()), "px")
    zone = (points[:, 0] >= 400) & (points[:, 1] <= 210)
    off = d[:, zone] - np.nanmedian(d[:, zone], axis=1, keepdims=True)
    note = "less the zone's own median; holds what the video moves unevenly"
    scatter("still zone: scatter", robust(off), np.nanmedian(std[:, zone]), note)
    for j, (point, expected) in enumerate(FLOW.items()):
        for k, (u, v) in zip(FLOW_PAIRS, expected, strict=True):
            got, t = d[k, 6 + j], pairs[k]
            state = f"{Status(int(t.status[6 + j])).meaning}, zncc {t.zncc[6 + j]:.2f}; stated to 0.3 px"
            add(f"{point}, pair {k}-{k + 1}", f"({u}, {v})", both(got, 2), "px", state)
    corner = (points[:, 0] < 120) & (points[:, 1] > 280)
    moving = np.hypot(*np.nan_to_num(d).transpose(2, 0, 1)) > 1
    bad = np.array([~t.valid for t in pairs])
    add("lower left: not valid", "flagged", float(bad[:, corner].mean()), "1", "x < 120, y > 280")
    add("all points: not valid", "", float(bad.mean()), "1", "20 pairs")
    runs = [onward(frames, k, points, pairs[k], 31) for k in range(0, 19, 2)]
    total, closure = (np.hypot(*np.array([r[m] for r in runs]).transpose(2, 0, 1)) for m in (0, 1))
    flowing = moving[0:19:2]
    for what, use in (("all", np.ones_like(flowing)), ("moving over 1 px", flowing), ("lower left", corner)):
        use = np.broadcast_to(use, total.shape)
        for kind, values in (("two frames apart", total[use]), ("forth and back", closure[use])):
            p50, p95, top = np.nanpercentile(values, (50, 95, 100))
            note = f"95 %: {p95:.3f}; greatest: {top:.2f}; n = {np.isfinite(values).sum()}"
            add(f"{kind}, {what}: median difference", 0.0, float(p50), "px", note)
    signed, predicted = np.array([r[0] for r in runs]), np.array([r[2] for r in runs])
    found, note = robust(signed[flowing]), "one component, robust"
    scatter("moving: sum of pairs less direct", found, np.nanmedian(predicted[flowing]), note)
    return {"picture": frames[8], "points": points, "tracks": pairs[8]}


def study_wedge(folder: Path, table: Table) -> Floats:
    """Difference to PIVlab and long-baseline matches; returns rows frame, median u, v, MAD u, v."""
    table.name, subset, out = "sandbox_wedge_crop", 25, []
    add, scatter = table.add, table.scatter
    frames = {int(path.stem[-3:]): decode(path) for path in (folder / "images").glob("*.jpg")}
    tracked = place = np.array(list(LONG), float)
    path = [place]
    for file in sorted((folder / "pivlab").glob("*.txt")):
        frame = int(re.findall(r"_(\d+)\.jpg", file.read_text().splitlines()[1])[0])
        rows = np.genfromtxt(file, delimiter=",", skip_header=3)
        nodes = rows[:, :2]
        both_sets = np.vstack([np.nan_to_num(place), nodes])
        tracks = correlate(frames[frame], frames[frame + 1], both_sets, subset=subset)
        place = place + tracks.displacement[:4]
        path.append(place)
        far = np.array(frames[500].shape[::-1]) - subset // 2
        fits = ((nodes >= subset // 2) & (nodes < far)).all(axis=1)
        off = (tracks.displacement[4:] - rows[:, 2:])[fits]
        median = np.nanmedian(off, axis=0)
        spread = np.nanmedian(np.abs(off - median), axis=0)
        out.append([frame, *median, *spread])
        note = f"MAD {both(spread, 2)}; valid {tracks.valid[4:][fits].mean():.2f}"
        add(f"median less PIVlab, {frame}-{frame + 1}", "0 to about 0.1", both(median), "px", note)
    medians = np.array(out)
    add("median less PIVlab: greatest of 19 pairs", "about 0.1", float(np.abs(medians[:, 1:3]).max()), "px")
    for j, (point, matches) in enumerate(LONG.items()):
        for count, match in zip((10, 15), matches, strict=True):
            moved = both(path[count][j] - tracked[j], 2)
            add(f"{point} after {count} frames", match, moved, "px", "to about 1 px; nan: refused in a pair")
    nodes = grid((20, 20), (231, 131), 8)
    runs = []
    for k in range(500, 518, 3):
        tracks = correlate(frames[k], frames[k + 1], nodes, subset=subset)
        runs.append(onward(frames, k, nodes, tracks, subset))
    signed, predicted = (np.array([r[m] for r in runs]) for m in (0, 2))
    bias = both(np.nanmedian(signed, axis=(0, 1)))
    add("sum of pairs less direct: median", "(0, 0)", bias, "px", "two frames")
    scatter("sum of pairs less direct", robust(signed), np.nanmedian(predicted), "two frames; robust")
    return medians


def main() -> None:
    """Measure the four sets and write piv-real.csv and piv-real.png."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--realdata", type=Path, required=True, help="folder that holds the sets")
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    table, folder = Table(), arguments.realdata
    wave = study_wave(folder / "dic_challenge_wave", table)
    tbar = study_tbar(folder / "tbar_clay_geopyv", table)
    avalanche = study_avalanche(folder / "sand_avalanche", table)
    wedge = study_wedge(folder / "sandbox_wedge_crop", table)
    arguments.out.mkdir(parents=True, exist_ok=True)
    with (arguments.out / "piv-real.csv").open("w", newline="") as file:
        csv.writer(file).writerows([COLUMNS, *table.rows])
    with style():
        figure = Figure(figsize=(15, 9), layout="constrained")
        axes = figure.subplot_mosaic("AAAABBBBCCCC;DDDDDDDEEEEE", height_ratios=(1.1, 1)).values()
        names = ("wave", "tbar", "avalanche", "wedge", "honesty")
        drawers = [getattr(figures, f"draw_{name}") for name in names]
        for draw, ax, data in zip(drawers, axes, (wave, tbar, avalanche, wedge, table.honesty), strict=True):
            draw(ax, data)
        # no SVG: its photographs would make it ten times as large
        save(figure, arguments.out / "piv-real")
    print("\n".join(" | ".join(row) for row in table.rows))


if __name__ == "__main__":
    main()
