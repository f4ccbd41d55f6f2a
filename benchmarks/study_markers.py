"""How exactly markers are found: by radius, blur and noise, half covered, under glare, and through a series.

    python benchmarks/study_markers.py [--out reports/speed-error] [--pictures 6]

Dots and circles are painted by exact area on pale discs of 2.4 radii in sand. In the cases of covers and
glare every fourth marker is spoiled, and only those count.
"""

import argparse
import math
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from correlation.figures import save
from drawing.style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION, style
from ploughval.photos.markers.find import find_markers
from ploughval.photos.markers.watch import MarkerWatch
from ploughval.synth.discs import disc_cover
from ploughval.synth.sand import sand_texture

Floats = NDArray[np.float64]
PALE, CONTRAST, DISC = 180.0, 60.0, 2.4
ROWS, COLUMNS = 3, 4
TABLE = (
    "case", "kind", "radius_px", "blur_px", "noise_grey", "markers", "found", "rmse_px", "bias_px", "p95_px",
    "within_1_std", "within_2_std", "bound_px",
)  # fmt: skip
SHAPE, MIDDLE = (300, 460), np.array([230.0, 150.0])
FIXED = np.array([[40.0, 45.0], [420.0, 40.0], [45.0, 255.0], [415.0, 260.0], [230.0, 30.0]])


@dataclass(frozen=True, slots=True)
class Case:
    """One way of painting and spoiling markers."""

    name: str
    radius: float = 8.0
    blur: float = 0.7
    noise: float = 4.0
    kind: str = "dot"
    covered: float = 0.0
    cover_grey: float = 215.0
    glare: float = 0.0
    glare_size: float = 0.5  # radii
    light: float = 0.0  # relative change over the picture

    @property
    def spoiled(self) -> bool:
        """Whether only every fourth marker counts."""
        return self.covered > 0 or self.glare > 0

    @property
    def bound_px(self) -> float:
        """Cramer-Rao bound of a coordinate for a whole dot of which all else is known."""
        if self.kind == "ring" or self.spoiled:
            return math.nan
        blur = math.sqrt(self.blur**2 + 1 / 12)
        information = (CONTRAST / self.noise) ** 2 / (2 * blur * math.sqrt(math.pi))
        return 1 / math.sqrt(information * math.pi * self.radius)


CASES = (
    [Case("whole", r, b) for r in (4.0, 6.0, 8.0, 12.0, 20.0, 40.0) for b in (0.0, 1.0, 2.0)]
    + [Case("noise", noise=n) for n in (1.0, 2.0, 8.0)]
    + [Case("light changes by 60 % over the picture", light=0.6)]
    + [Case("circle", r, kind="ring") for r in (8.0, 12.0, 20.0)]
    + [
        Case(f"pale sheet over {s:.0%}", r, covered=s)
        for r in (8.0, 16.0)
        for s in (0.1, 0.25, 0.4, 0.5, 0.6)
    ]
    + [Case(f"dark sheet over {s:.0%}", covered=s, cover_grey=60.0) for s in (0.1, 0.25, 0.5)]
    + [
        Case(f"glare +{a:.0f}, {w} radii wide", glare=a, glare_size=w)
        for a in (40.0, 90.0)
        for w in (0.5, 1.5)
    ]
)


def painted(case: Case, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Picture without noise and the centres (N, 2)."""
    pitch = int(7 * case.radius + 24)
    shape = (ROWS * pitch, COLUMNS * pitch)
    picture = sand_texture(rng, shape).picture(shape).astype(float)
    centres = np.array([[k % COLUMNS + 0.5, k // COLUMNS + 0.5] for k in range(ROWS * COLUMNS)]) * pitch
    centres = centres + rng.uniform(-1, 1, centres.shape)
    line = max(2.0, 0.25 * case.radius)
    for k, centre in enumerate(centres):
        whole = disc_cover(shape, tuple(centre), DISC * case.radius)
        if case.kind == "ring":
            cover = disc_cover(shape, tuple(centre), case.radius + line / 2)
            cover = cover - disc_cover(shape, tuple(centre), case.radius - line / 2)
        else:
            cover = disc_cover(shape, tuple(centre), case.radius)
        picture = picture * (1 - whole) + whole * PALE
        picture = picture * (1 - cover) + cover * (PALE - CONTRAST)
        if k % 4 == 0:
            picture = spoiled(picture, centre, case, rng)
    picture = picture * np.linspace(1 - case.light / 2, 1 + case.light / 2, shape[1])
    return cv2.GaussianBlur(picture, (0, 0), case.blur) if case.blur else picture, centres


def spoiled(picture: Floats, centre: Floats, case: Case, rng: np.random.Generator) -> Floats:
    """A sheet with a straight edge over part of a marker, or a patch of glare on its rim."""
    y, x = np.indices(picture.shape)
    angle, radius = rng.uniform(0, 2 * np.pi), case.radius
    if case.covered:
        along = (x - centre[0]) * math.cos(angle) + (y - centre[1]) * math.sin(angle)
        sheet = np.clip(along - radius * (1 - 2 * case.covered) + 0.5, 0, 1)
        sheet[np.hypot(x - centre[0], y - centre[1]) > 3 * radius] = 0.0
        picture = picture * (1 - sheet) + sheet * case.cover_grey
    if case.glare:
        spot = centre + radius * rng.uniform(0.6, 1.3) * np.array([math.cos(angle), math.sin(angle)])
        far = (x - spot[0]) ** 2 + (y - spot[1]) ** 2
        picture = picture + case.glare * np.exp(-0.5 * far / (case.glare_size * radius) ** 2)
    return picture


def exposed(picture: Floats, noise: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    """The picture with noise, in whole grey levels."""
    return np.clip(np.rint(picture + noise * rng.standard_normal(picture.shape)), 0, 255).astype(np.uint8)


def measured(case: Case, pictures: int) -> dict[str, object]:
    """One row of the table."""
    off, ratios, asked = [], [], 0
    for number in range(pictures if case.radius < 30 else max(pictures // 3, 1)):
        rng = np.random.default_rng([number, round(10 * case.radius), round(10 * case.blur)])
        picture, centres = painted(case, rng)
        given = centres + rng.uniform(-0.4, 0.4, centres.shape) * case.radius
        found = find_markers(exposed(picture, case.noise, rng), given, case.radius, kind=case.kind)
        counted = np.arange(len(centres)) % 4 == 0 if case.spoiled else np.ones(len(centres), bool)
        asked += int(counted.sum())
        there = counted & found.found
        off.append((found.px - centres)[there])
        ratios.append(np.abs((found.px - centres)[there] / found.std_px[there]))
    error, ratio = np.concatenate(off), np.concatenate(ratios)
    nothing = not error.size
    return {
        "case": case.name, "kind": case.kind, "radius_px": case.radius, "blur_px": case.blur,
        "noise_grey": case.noise, "markers": asked, "found": len(error),
        "rmse_px": math.nan if nothing else float(np.sqrt(np.mean(error**2))),
        "bias_px": math.nan if nothing else float(np.abs(error.mean(axis=0)).max()),
        "p95_px": math.nan if nothing else float(np.quantile(np.abs(error), 0.95)),
        "within_1_std": math.nan if nothing else float(np.mean(ratio < 1)),
        "within_2_std": math.nan if nothing else float(np.mean(ratio < 2)),
        "bound_px": case.bound_px,
    }  # fmt: skip


def sand_without_markers(pictures: int) -> list[dict[str, object]]:
    """How often something in plain sand is taken for a marker."""
    rows = []
    for radius in (4.0, 6.0, 8.0, 12.0):
        taken = 0
        for number in range(pictures):
            rng = np.random.default_rng([number, round(radius)])
            image = exposed(sand_texture(rng, (300, 300)).picture((300, 300)), 2.0, rng)
            taken += int(find_markers(image, rng.uniform(50, 250, (10, 2)), radius).found.sum())
        rows.append(
            {"case": "plain sand, no marker", "kind": "dot", "radius_px": radius, "noise_grey": 2.0,
             "markers": 10 * pictures, "found": taken}
        )  # fmt: skip
    return rows


def series(name: str, frames: int = 30) -> dict[str, object]:
    """What is left of a camera's movement after five fixed markers have told it."""
    rng, watch = np.random.default_rng(5), None
    rest, ratio = [], []
    for frame in range(frames):
        turn = math.radians(0.01 * frame) if "turn" in name else 0.0
        linear = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
        shift = np.array([3.0, -2.0]) * (frame >= 10) if "knock" in name else np.array([0.02, -0.01]) * frame
        own = np.zeros_like(FIXED)
        own[2] = np.array([0.05, 0.02]) * frame * ("stuck" in name)
        picture = np.full(SHAPE, 150.0)
        for place in (FIXED + own - MIDDLE) @ linear.T + MIDDLE + shift:
            for radius, grey in ((16.0, 200.0), (7.0, 60.0)):
                cover = disc_cover(SHAPE, tuple(place), radius)
                picture = picture * (1 - cover) + cover * grey
        if "covered" in name and frame >= 10:
            picture[:, 395:] = 110.0
        picture = cv2.GaussianBlur(picture, (0, 0), 0.6) * (1 + 0.1 * math.sin(frame))
        image = exposed(picture, 2.0, rng)
        if watch is None:
            watch = MarkerWatch(image, FIXED + 1.5, 7.0)
            continue
        seen = watch.see(image)
        left = seen.at_first((FIXED - MIDDLE) @ linear.T + MIDDLE + shift) - FIXED
        rest.append(left)
        ratio.append(np.abs(left / seen.std_at(FIXED)[:, None]))
    error = np.concatenate(rest)
    return {
        "case": f"series: {name}", "kind": "dot", "radius_px": 7.0, "blur_px": 0.6, "noise_grey": 2.0,
        "markers": len(FIXED), "found": len(FIXED) - ("stuck" in name) - 2 * ("covered" in name),
        "rmse_px": float(np.sqrt(np.mean(error**2))), "bias_px": float(np.abs(error.mean(axis=0)).max()),
        "p95_px": float(np.quantile(np.abs(error), 0.95)),
        "within_1_std": float(np.mean(np.array(ratio) < 1)),
        "within_2_std": float(np.mean(np.array(ratio) < 2)),
    }  # fmt: skip


SERIES = (
    "creep of 0.02 px a frame", "creep and a turn of 0.01 degrees a frame", "knock of 3.6 px",
    "creep, two covered from frame 10 on", "creep, one stuck to the sand",
)  # fmt: skip


def drawn(table: pd.DataFrame) -> Figure:
    """Error by radius and blur beside its bound, and what covers and glare cost; examples below."""
    with style():
        figure = Figure(figsize=(7.2, 5.6), layout="constrained")
        top, bottom = figure.subfigures(2, 1, height_ratios=[1.5, 1.0])
        left, right = top.subplots(1, 2)
        _by_radius(left, table[table["case"] == "whole"])
        _by_cover(right, table)
        _examples(bottom)
    return figure


def _by_radius(axes: object, whole: pd.DataFrame) -> None:
    for colour, (blur, rows) in zip((BLUE, GREEN, VERMILION), whole.groupby("blur_px"), strict=True):
        axes.plot(rows["radius_px"], rows["rmse_px"], "o-", color=colour)
        axes.plot(rows["radius_px"], rows["bound_px"], ":", color=colour, linewidth=1.0)
        last = rows.iloc[-1]
        axes.annotate(f" blur {blur:g} px", (last["radius_px"], last["rmse_px"]), color=colour, va="center")
    axes.axhline(0.05, color=GREY, linewidth=0.7)
    axes.set(
        xscale="log", yscale="log", xlim=(3.6, 110), xlabel="radius, px", ylabel="rmse of a coordinate, px"
    )
    axes.set_xticks([4, 8, 16, 40], ["4", "8", "16", "40"])
    axes.set_yticks([0.005, 0.01, 0.02, 0.05, 0.1], ["0.005", "0.01", "0.02", "0.05", "0.1"])
    axes.minorticks_off()
    axes.set_title("whole dots, contrast 60, noise 4; dotted: bound")


def _by_cover(axes: object, table: pd.DataFrame) -> None:
    rows = table[table["case"].str.startswith("pale sheet")]
    for colour, (radius, part) in zip((BLUE, ORANGE), rows.groupby("radius_px"), strict=True):
        share = part["case"].str.extract(r"(\d+)")[0].astype(float)
        axes.plot(share, part["rmse_px"], "o-", color=colour, label=f"radius {radius:g} px")
        for x, y, found, asked in zip(share, part["rmse_px"], part["found"], part["markers"], strict=True):
            if found < asked and np.isfinite(y):
                text, place = f"{found} of {asked}", (x, y)
                axes.annotate(
                    text, place, xytext=(0, -24), textcoords="offset points", ha="center", fontsize=8
                )
    axes.axhline(0.05, color=GREY, linewidth=0.7)
    axes.set(yscale="log", xlabel="covered share of the diameter, %", ylabel="rmse of a coordinate, px")
    axes.set_yticks([0.01, 0.02, 0.05, 0.1, 0.2], ["0.01", "0.02", "0.05", "0.1", "0.2"])
    axes.minorticks_off()
    axes.legend(frameon=False, loc="upper left")
    axes.set_title("a sheet over part of a dot, blur 0.7 px")


def _examples(figure: object) -> None:
    """The first spoiled marker of some cases, with the centre that was found."""
    shown = [
        Case("whole"), Case("pale sheet, half", covered=0.5),
        Case("dark sheet, a quarter", covered=0.25, cover_grey=60.0), Case("glare", glare=90.0),
        Case("circle", 12.0, kind="ring"),
    ]  # fmt: skip
    for axes, case in zip(figure.subplots(1, len(shown)), shown, strict=True):
        rng = np.random.default_rng(2)
        picture, centres = painted(case, rng)
        image = exposed(picture, case.noise, rng)
        found = find_markers(image, centres, case.radius, kind=case.kind)
        x, y = centres[0]
        axes.imshow(image, cmap="gray", vmin=0, vmax=255)
        axes.plot(*centres[0], "o", color=SKY, markersize=7, markerfacecolor="none", markeredgewidth=1.2)
        if found.found[0]:
            axes.plot(*found.px[0], "+", color=VERMILION, markersize=7, markeredgewidth=1.2)
        half = 3.2 * case.radius
        axes.set(xlim=(x - half, x + half), ylim=(y + half, y - half), xticks=[], yticks=[])
        axes.set_title(case.name, color=BLACK, fontsize=8)


def main() -> None:
    """Write markers.csv and markers.png."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("reports/speed-error"))
    parser.add_argument("--pictures", type=int, default=6)
    given = parser.parse_args()
    rows = [measured(case, given.pictures) for case in CASES]
    rows += sand_without_markers(given.pictures) + [series(name) for name in SERIES]
    table = pd.DataFrame(rows, columns=list(TABLE)).round(4)
    given.out.mkdir(parents=True, exist_ok=True)
    table.to_csv(given.out / "markers.csv", index=False, lineterminator="\n")
    print(table.to_string(index=False))
    save(drawn(table), given.out / "markers")


if __name__ == "__main__":
    main()
