"""Hard cases of tracers: drawn surfaces, blades and dyed layers, and bands of exact block kinematics."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hard.cases import NO_WORDS, Canvas, Happened, HardCase, Part
from hard.drawn import (
    MM_PER_PX,
    SCALE,
    SHAPE,
    Block,
    Floats,
    Line,
    band_scene,
    flat_surface,
    photograph,
    scene_of,
    tracks_of,
)
from ploughval.report.figures.style import MEASURED, MODEL, MUTED
from ploughval.tracers import Watcher, find_bands
from ploughval.tracers.watcher import Sight

Picture = NDArray[np.uint8]
Spoil = Callable[[Picture], Picture]

HEIGHTS = (8.0, 16.0)
TRAVEL = (0.0, 1.5, 3.0, 4.5, 6.0)
CUT, SLOPE = 45.0, 0.5  # mm: where a thrust cuts the layers; rise a mm of its slip
SURFACE_PX, LAYER_PX = 1.0, 2.0
SEEN = "surface rms within 1 px, dyed layers 95 % within 2 px, blade within 0.5 px; what is not seen is said"
STDS = 4.0
BANDS = "as many bands as there are, outcrop and inclination within four of their deviations (least 0.3 mm)"


@dataclass(frozen=True, slots=True)
class Seen:
    """A photograph with the surface and layers found in it, px."""

    picture: Picture
    surface: Floats
    layers: tuple[Floats, ...]


@dataclass(frozen=True, slots=True)
class Tracked:
    """Points and their motion in one increment, the bands found and the true one, mm."""

    points: Floats
    motion: Floats
    found: tuple[tuple[float, float, float], ...]
    true: tuple[float, float] | None


def heap(u: float, *, drop_mm: float = 9.0) -> Line:
    """A crest before the face that falls to the still sand within ``drop_mm``."""
    place = np.array([0.0, 5.0 + u, 5.0 + u + drop_mm])
    height = np.array([25 + 1.1 * u, 25 + 1.1 * u, 25.0])
    return lambda x: np.interp(x - u, place, height)


def level(height: float) -> Line:
    """A line at a height."""
    return lambda x: np.full_like(x, height)


def watched(spoil: Spoil | None = None, *, drop_mm: float = 9.0, dyed: bool = True) -> Happened:
    """Five photographs; the last is spoiled and measured."""
    watcher = Watcher(scene_of(HEIGHTS), SCALE)
    still = [level(h) for h in HEIGHTS] if dyed else []
    for k, u in enumerate(TRAVEL):
        picture = photograph(u, heap(u, drop_mm=drop_mm), seed=20 + k, layers=still)
        if spoil is not None and k == len(TRAVEL) - 1:
            picture = spoil(picture)
        sight = watcher.see(k, picture)
    return scored(
        sight, picture, heap(TRAVEL[-1], drop_mm=drop_mm), TRAVEL[-1], {h: [level(h)] for h in HEIGHTS}
    )


def thrust(u_mm: float) -> Happened:
    """Layers that a band cuts and doubles, in steps of 1.5 mm."""
    watcher = Watcher(scene_of(HEIGHTS), SCALE)

    def pieces(h: float, u: float) -> list[Line]:
        return [
            lambda x: np.where(x < CUT + u, h + SLOPE * u, -100.0),
            lambda x: np.where(x >= CUT, h, -100.0),
        ]

    for k, u in enumerate(np.arange(0.0, u_mm + 0.1, 1.5)):
        top: Line = lambda x, u=u: np.interp(x, [CUT, CUT + u + 0.1], [25.0 + SLOPE * u, 25.0])  # noqa: E731
        lines = [piece for h in HEIGHTS for piece in pieces(h, u)]
        picture = photograph(u, top, seed=40 + k, layers=lines)
        sight = watcher.see(k, picture)
    return scored(sight, picture, top, u_mm, {h: pieces(h, u_mm) for h in HEIGHTS})


def thinned(least: float) -> Happened:
    """A piece of 30 mm of both layers is thinned step by step to a share of its thickness."""
    watcher = Watcher(scene_of(HEIGHTS), SCALE)
    still = [level(h) for h in HEIGHTS]
    for k, share in enumerate(np.linspace(1.0, least, 5)):
        half = lambda x, s=share: np.where((x > 30) & (x < 60), max(s, 1e-9), 1.0)  # noqa: E731
        picture = photograph(0.0, level(25.0), seed=4, layers=still, half_mm=half)
        sight = watcher.see(k, picture)
    truth = [level(h) for h in HEIGHTS] if least > 0 else [
        lambda x, h=h: np.where((x > 30) & (x < 60), -100.0, h) for h in HEIGHTS
    ]  # fmt: skip
    return scored(
        sight, picture, level(25.0), 0.0, {h: [line] for h, line in zip(HEIGHTS, truth, strict=True)}
    )


def scored(sight: Sight, picture: Picture, top: Line, u: float, layers: dict[float, list[Line]]) -> Happened:
    """Errors of surface, layers and blade over their limits; the largest of them is the error."""
    line = sight.surface_mm
    off = from_line(line, top) / MM_PER_PX
    surface = float(np.sqrt(np.mean(off**2))) if off.size else float("nan")
    worst, kept = 0.0, []
    for height, pieces in layers.items():
        points = sight.dyed.get(height, np.empty((0, 3)))
        points = points[np.isfinite(points[:, 0])]
        kept.append(points)
        if len(points):
            errors = np.min([np.abs(points[:, 1] - piece(points[:, 0])) for piece in pieces], axis=0)
            worst = max(worst, float(np.percentile(errors, 95)) / MM_PER_PX)
    blade = abs(sight.blade_x_mm - u) / MM_PER_PX
    shares = [
        0.0 if np.isnan(v) else v / most
        for v, most in ((surface, SURFACE_PX), (worst, LAYER_PX), (blade, 0.5))
    ]
    seen = 100 * len(line) * 2 * MM_PER_PX / (91.8 - u)
    what = (
        f"surface {surface:.2g} px rms over {seen:.0f} % of the view, layers {worst:.2g} px (95 %), "
        f"{sum(len(k) for k in kept)} points of them, blade {blade:.2g} px"
    )
    broken = ["the surface was not seen whole"] if seen < 90 else []
    broken += ["the blade was not found"] if np.isnan(blade) else []
    broken += ["a dyed layer was not found"] if min(map(len, kept)) < 20 else []
    pixels = tuple(SCALE.to_px(k[:, :2]) for k in kept if len(k))
    drawn = Seen(picture, SCALE.to_px(line) if len(line) else np.empty((0, 2)), pixels)
    return Happened(max(shares), what, sight.reasons, tuple(broken), drawn)


def from_line(points: Floats, line: Line) -> Floats:
    """Distances (N,) of points from a line, mm: along the normal, or from the face of a step."""
    x = np.arange(-5.0, 130.0, 0.01)
    y = line(x)
    steps = np.flatnonzero(np.abs(np.diff(y)) > 0.1)
    faces = [np.column_stack([np.full(50, x[k]), np.linspace(y[k], y[k + 1], 50)]) for k in steps]
    return np.asarray(cKDTree(np.vstack([np.column_stack([x, y]), *faces])).query(points)[0])


def covered(picture: Picture, columns: slice, rows: slice, grey: float) -> Picture:
    """A part of a photograph hidden by something of one grey."""
    picture = picture.copy()
    picture[rows, columns] = np.clip(
        np.random.default_rng(1).normal(grey, 1.5, picture[rows, columns].shape), 0, 255
    )
    return picture


def shadowed(picture: Picture) -> Picture:
    """A shadow with soft edges over blade and crest: half of the light."""
    x = np.arange(SHAPE[1])
    share = 1.0 - 0.5 / (1.0 + np.exp((np.abs(x - 90) - 45) / 6.0))
    return np.clip(np.rint(picture * share), 0, 255).astype(np.uint8)


def banded(
    outcrop: Callable[[float], float], *, count: int = 1, noise: float = 0.0,
    second: float | None = None, last_x: float = 150.0, still: bool = False,
) -> Happened:  # fmt: skip
    """Tracks of a block's motion; the first band against what carried it."""
    u = np.zeros(8) if still else np.arange(0.0, 15.5, 1.0)
    block = Block(outcrop, second=second)
    tracks = tracks_of(block, u, noise=noise, last_x=last_x)
    found = find_bands(tracks, flat_surface(u, last_x=last_x), band_scene())
    bands, rows = found.bands, found.increments
    named = [m for m in rows["mechanism"].dropna().unique() if m]
    unread = int(rows["beta_deg"].isna().sum())
    told = tuple(f"mechanism: {m}" for m in named)
    told += (f"{unread} of {len(rows)} increments without an inclination",) if unread else ()
    true = (float(outcrop(0.0)), float(np.degrees(np.arctan2(30.0, outcrop(0.0)))))
    text = ", ".join(
        f"outcrop {b.outcrop_x_mm:.4g} ± {b.outcrop_std_mm:.2g} mm, {b.beta_deg:.3g} ± "
        f"{b.beta_std_deg:.2g} degrees"
        for b in bands.itertuples()
    )
    what = f"{len(bands)} of {count} bands{': ' + text if text else ''}"
    broken = () if len(bands) == count else (f"{len(bands)} bands where there are {count}",)
    error = 0.0
    if len(bands) and count:
        first = bands.iloc[0]
        pairs = (
            (first["outcrop_x_mm"] - true[0], first["outcrop_std_mm"], 0.3),
            (first["beta_deg"] - true[1], first["beta_std_deg"], 0.2),
        )
        error = max(abs(gap) / np.hypot(std, least / STDS) for gap, std, least in pairs if np.isfinite(gap))
    place = np.column_stack([tracks["x_mm"][0], tracks["y_mm"][0]])
    step = np.column_stack([tracks["x_mm"][1], tracks["y_mm"][1]]) - place
    lines = tuple((float(b.u_start_mm), float(b.outcrop_x_mm), 30.0) for b in bands.itertuples())
    return Happened(
        float(error),
        what,
        told,
        broken,
        Tracked(place, step, lines, (0.0, true[0]) if count else None),
    )


Row = tuple[str, str, Callable[[], Happened], str]


def photograph_cases() -> list[Row]:
    """Surfaces, blades and layers: name, what is done, how it is run, words that own up to what is lost."""
    hand = partial(covered, columns=slice(200, 330), rows=slice(0, 190), grey=120.0)
    upper = partial(covered, columns=slice(0, 110), rows=slice(0, 110), grey=90.0)
    whole = partial(covered, columns=slice(0, 160), rows=slice(0, 230), grey=120.0)
    return [
        ("plain heap", "a crest before the face, two dyed layers", watched, ""),
        (
            "over-steep front",
            "the heap falls by 6.6 mm within 1 mm",
            partial(watched, drop_mm=1.0),
            "surface",
        ),
        ("layers doubled by a thrust", "12 mm of slip in 8 steps", partial(thrust, 12.0), "layer"),
        ("layers thinned", "30 mm of them to two fifths", partial(thinned, 0.4), "layer"),
        ("layers torn", "30 mm of them gone", partial(thinned, 0.0), "layer"),
        ("layers that are not there", "no dye at all", partial(watched, dyed=False), "layer"),
        (
            "blade half hidden",
            "its upper half behind something grey",
            partial(watched, upper),
            "blade|surface",
        ),
        ("blade hidden", "all of it", partial(watched, whole), "blade|surface"),
        (
            "a shadow over blade and crest",
            "half of the light, soft edges",
            partial(watched, shadowed),
            "light|blade|surface",
        ),
        ("a hand before the sand", "26 mm of the surface behind it", partial(watched, hand), "surface"),
    ]


def band_cases() -> list[Row]:
    """Motions and their bands."""
    return [
        ("one band", "outcrop at 80 mm", partial(banded, lambda u: 80.0), ""),
        (
            "a band that creeps on",
            "its outcrop rides by 1.6 mm a mm",
            partial(banded, lambda u: 60.0 + 1.6 * u),
            "",
        ),
        (
            "two bands at once",
            "a second one at half the reach",
            partial(banded, lambda u: 100.0, second=0.5),
            "mechanism|inclination",
        ),
        (
            "band along the blade",
            "outcrop 6 mm ahead of the face",
            partial(banded, lambda u: u + 6.0),
            "inclination",
        ),
        (
            "band that leaves the picture",
            "outcrop at 190 mm, sand seen to 110 mm",
            partial(banded, lambda u: 190.0, last_x=110.0),
            "outcrop is not",
        ),
        (
            "noise of 0.1 mm",
            "a tenth of the travel of an increment",
            partial(banded, lambda u: 80.0, noise=0.1),
            "",
        ),
        ("noise of 0.5 mm", "half of it", partial(banded, lambda u: 80.0, noise=0.5), "inclination"),
        (
            "no motion",
            "the blade stands, noise of 0.05 mm",
            partial(banded, lambda u: 80.0, count=0, noise=0.05, still=True),
            "",
        ),
    ]


def cases() -> Sequence[HardCase]:
    """Every hard case of tracers."""
    made = [
        HardCase(n, d, SEEN, run, 1.0, "of the limits", says or NO_WORDS)
        for n, d, run, says in photograph_cases()
    ]
    return made + [
        HardCase(n, d, BANDS, run, STDS, "std", says or NO_WORDS) for n, d, run, says in band_cases()
    ]


def draw(canvas: Canvas, case: HardCase, shown: Seen | Tracked) -> None:
    """The last photograph with what was found, or an increment's motion with its band."""
    ax = canvas.subplots()
    if isinstance(shown, Seen):
        half = shown.picture.reshape(SHAPE[0] // 2, 2, SHAPE[1] // 2, 2).mean(axis=(1, 3))
        grey = (16.0 * np.floor(half / 16.0)).astype(np.uint8)
        extent = (-0.5, SHAPE[1] - 0.5, SHAPE[0] - 0.5, -0.5)
        ax.imshow(np.repeat(grey[..., None], 3, axis=2), extent=extent, interpolation="none")
        ax.plot(*shown.surface[::4].T, ".", color=MODEL, markersize=2.0)
        for points in shown.layers:
            ax.plot(*points[::4].T, ".", color=MEASURED, markersize=2.0)
        ax.set_axis_off()
        return
    some = slice(None, None, 11)
    ax.quiver(*shown.points[some].T, *shown.motion[some].T, color=MUTED, angles="xy", width=0.002)
    if shown.true is not None:
        ax.plot(shown.true, [0, 30], color=MODEL, linewidth=2.0)
    for start, end, top in shown.found:
        ax.plot([start, end], [0, top], color=MEASURED, linewidth=1.0)
    ax.set_xlim(-2, 200)
    ax.set_ylim(-10, 40)
    ax.set_xlabel("x, mm")


PART = Part(
    "tracers",
    "Tracers",
    "Photographs are drawn exactly, 0.2 mm a px; orange: the surface found, blue: dyed layers. "
    "Motions are those "
    "of exact blocks; orange: the true band, blue: the bands found (outcrop as reported).",
    cases,
    draw,
)
