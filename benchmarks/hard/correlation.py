"""Hard cases of correlation: pairs of exact pictures of sand, spoiled, against the motion that was drawn."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import cv2
import numpy as np
from numpy.typing import NDArray

from hard.cases import Canvas, Happened, HardCase, Part
from ploughval.axes import Status
from ploughval.piv import Tracks, correlate
from ploughval.report.figures.style import MEASURED, MODEL
from ploughval.synth.sand import Grains, sand_texture

Floats = NDArray[np.float64]
Picture = NDArray[np.generic]
Motion = Callable[[Floats], Floats]
Spoil = Callable[[Floats, np.random.Generator], Picture]

SHAPE = (300, 400)
MIDDLE = (np.array(SHAPE[::-1]) - 1) / 2
SUBSET, STEP = 31, 10
WRONG_PX = 0.5  # half a pixel off, and more than the stated deviation allows, is wrong
STDS = 5.0
GRAIN_PX = 2.0  # mean radius of the grains
BAND_ANGLE, JUMP_PX = np.radians(25.0), 5.4
SHIFT = (1.3, -0.6)
MUST = "no vector called valid is wrong by more than 0.5 px and 5 std"


@dataclass(frozen=True, slots=True)
class Pair:
    """Two pictures, the motion between them, and which pixels of the first may be used.

    ``reach_px``: grains are rigid, so that next to a band sand moves as its grain does; what moves so within
    this distance is right.
    """

    first: Picture
    second: Picture
    motion: Motion
    mask: NDArray[np.bool_] | None = None
    reach_px: float = 0.0


@dataclass(frozen=True, slots=True)
class Drawn:
    """The second picture, and its points: valid, refused, wrong."""

    picture: Floats
    points: Floats
    kind: NDArray[np.int8]
    vector: Floats


@lru_cache(maxsize=1)
def grains() -> Grains:
    """Sand that reaches 120 px beyond the picture."""
    return sand_texture(np.random.default_rng(7), SHAPE, margin_px=120, grey=(60, 220))


def shifted(points: Floats, shift: tuple[float, float] = SHIFT) -> Floats:
    """A translation, px."""
    return np.tile(np.array(shift), (len(points), 1))


def deformed(points: Floats, stretch: float = 0.0, angle_deg: float = 0.0) -> Floats:
    """A stretch along x, then a turn, about the middle, px."""
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    gradient = np.array([[c, -s], [s, c]]) @ np.diag([1.0 + stretch, 1.0]) - np.eye(2)
    return np.asarray((points - MIDDLE) @ gradient.T)


def slid(points: Floats, width: float) -> Floats:
    """A shear band through the middle: a jump of 5.4 px along it, tanh over a width, px."""
    side = (points - MIDDLE) @ [-np.sin(BAND_ANGLE), -np.cos(BAND_ANGLE)]
    share = 0.5 * (1.0 + np.tanh(2.0 * side / width))
    return np.asarray(JUMP_PX * share[:, None] * [np.cos(BAND_ANGLE), -np.sin(BAND_ANGLE)])


def rounded(picture: Floats, rng: np.random.Generator, noise: float = 1.0) -> Picture:
    """Eight bit, with noise."""
    return np.clip(np.round(picture + rng.normal(0, noise, picture.shape)), 0, 255).astype(np.uint8)


def pair(motion: Motion, first: Spoil = rounded, second: Spoil = rounded) -> Pair:
    """Sand before and after a motion, each picture spoiled in its way."""
    sand, rng = grains(), np.random.default_rng(3)
    moved = sand.moved(motion(sand.positions_px))
    pictures = [p.picture(SHAPE).astype(np.float64) for p in (sand, moved)]
    return Pair(first(pictures[0], rng), second(pictures[1], rng), motion)


def faint(picture: Floats, rng: np.random.Generator) -> Picture:
    """A tenth of the contrast, noise of 4 grey levels."""
    return rounded(140 + 0.1 * (picture - 140), rng, 4.0)


def relit(picture: Floats, rng: np.random.Generator) -> Picture:
    """Less light, an offset, and half as much again from one side to the other."""
    slope = 1.0 + 0.5 * (np.arange(SHAPE[1]) - MIDDLE[0]) / SHAPE[1]
    return rounded(0.7 * picture * slope + 20.0, rng)


def blurred(picture: Floats, rng: np.random.Generator) -> Picture:
    """Out of focus: 1.5 px standard deviation."""
    return rounded(cv2.GaussianBlur(picture, (0, 0), 1.5), rng)


def smeared(picture: Floats, rng: np.random.Generator) -> Picture:
    """Moved by 9 px while it was exposed."""
    return rounded(cv2.blur(picture, (9, 1)), rng)


def jpeg(picture: Floats, rng: np.random.Generator) -> Picture:
    """JPEG of quality 50."""
    coded = cv2.imencode(".jpg", rounded(picture, rng), [cv2.IMWRITE_JPEG_QUALITY, 50])[1]
    return np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE))


def burnt(picture: Floats, rng: np.random.Generator) -> Picture:
    """Twice the light: most of it white."""
    return rounded(2.0 * picture, rng)


def three_levels(picture: Floats, rng: np.random.Generator) -> Picture:
    """Sixteen bit with three grey levels."""
    levels = np.digitize(picture, np.quantile(picture, [1 / 3, 2 / 3]))
    return (10_000 + 20_000 * levels).astype(np.uint16)


def swamped(picture: Floats, rng: np.random.Generator) -> Picture:
    """Noise of 60 grey levels."""
    return rounded(picture, rng, 60.0)


def flat(picture: Floats, rng: np.random.Generator) -> Picture:
    """No sand at all: grey 128 and noise of 2."""
    return rounded(np.full_like(picture, 128.0), rng, 2.0)


def other(picture: Floats, rng: np.random.Generator) -> Picture:
    """Other sand."""
    return rounded(np.roll(picture[::-1, ::-1], 37, axis=0), rng)


def repeated(period: int, shift: tuple[float, float]) -> Pair:
    """A printed pattern that repeats every ``period`` px, moved by more than half of that."""
    tile = sand_texture(np.random.default_rng(3), (period, period), margin_px=0, grey=(60, 220))
    steps = np.array(
        [(i, j) for i in range(-4, SHAPE[1] // period + 5) for j in range(-4, SHAPE[0] // period + 5)]
    )
    places = (tile.positions_px[None] + period * steps[:, None]).reshape(-1, 2)
    all_of = [np.tile(values, len(steps)) for values in (tile.radii_px, tile.areas_px, tile.greys)]
    sheet, rng = Grains(places, *all_of), np.random.default_rng(3)
    pictures = [rounded(p.picture(SHAPE).astype(float), rng) for p in (sheet, sheet.moved(np.array(shift)))]
    return Pair(*pictures, partial(shifted, shift=shift))


def sheared(width: float) -> Pair:
    """Sand before and after a shear band."""
    return replace(pair(partial(slid, width=width)), reach_px=GRAIN_PX)


def tiny() -> Pair:
    """The middle 20 x 20 px of a pair."""
    whole = pair(shifted)
    cut = (slice(140, 160), slice(190, 210))
    return Pair(whole.first[cut], whole.second[cut], shifted)


def half_in_air() -> Pair:
    """Sand below a sloping line that the mask follows; air that stands still above it."""
    x, y = np.meshgrid(np.arange(SHAPE[1]), np.arange(SHAPE[0]))
    whole, rng = pair(shifted), np.random.default_rng(9)
    air = 60 + 40 * np.sin(0.3 * x) * np.sin(0.2 * y)
    first_sand = y > 100 + 0.25 * x
    second_sand = (y - SHIFT[1]) > 100 + 0.25 * (x - SHIFT[0])
    first = np.where(first_sand, whole.first, rounded(air, rng))
    second = np.where(second_sand, whole.second, rounded(air, rng))
    return Pair(first, second, shifted, first_sand)


def measure(made: Callable[[], Pair], least: float) -> Happened:
    """Correlate, and count what is called valid and wrong; ``least``: share that must be measured."""
    given = made()
    axes = (np.arange(8.0, side - 7, STEP) for side in given.first.shape[::-1])
    points = np.stack([a.ravel() for a in np.meshgrid(*axes)], axis=1)
    if given.mask is not None:
        points = points[given.mask[points[:, 1].astype(int), points[:, 0].astype(int)]]
    tracks = correlate(given.first, given.second, points, subset=SUBSET, mask=given.mask)
    return counted(given, points, tracks, least)


def counted(given: Pair, points: Floats, tracks: Tracks, least: float) -> Happened:
    """Error, coverage and share of valid vectors; wrong ones are never owned up to by a status."""
    truth = given.motion(points)
    gone = points + truth
    room = SUBSET // 2 + 1
    here = (
        np.ones(len(points), bool)
        if min(given.first.shape) < 4 * room
        else inside(points, room) & inside(gone, room)
    )
    error = np.where(tracks.valid[:, None], tracks.displacement - truth, np.nan)
    off = beyond(given, points, tracks.displacement) > np.maximum(WRONG_PX, STDS * tracks.std)
    wrong = np.flatnonzero(off.any(axis=1))
    valid, share = tracks.valid & here, float(np.mean(tracks.valid[here]))
    counts = {s: int(np.sum(tracks.status == s)) for s in Status if s != Status.OK}
    told = tuple(f"{s.name.lower()}: {n} of {len(points)} points" for s, n in counts.items() if n)
    if valid.any():
        worst = float(np.percentile(np.abs(error[valid]), 99))
        one = float(np.mean(np.abs(error[valid]) <= tracks.std[valid]))
        what = (
            f"{100 * share:.3g} % of the points inside valid, error "
            f"{np.sqrt(np.mean(error[valid] ** 2)):.2g} px rms, "
            f"99 % within {worst:.2g} px, {100 * one:.0f} % within one std, {len(wrong)} wrong"
        )
    else:
        what = f"no point inside valid, {len(wrong)} wrong"
    broken = () if share >= least else (f"less than {100 * least:.0f} % measured",)
    kind = np.where(tracks.valid, 1, 0).astype(np.int8)
    kind[wrong] = 2
    drawn = Drawn(halved(given.second), points, kind, np.nan_to_num(tracks.displacement))
    return Happened(float(len(wrong)), what, told if len(wrong) == 0 else (), broken, drawn)


def beyond(given: Pair, points: Floats, found: Floats) -> Floats:
    """How far vectors (N, 2) lie outside what moves within the reach of their points, px; NaN as found."""
    turns = np.linspace(0.0, 2.0 * np.pi, 9)[:-1]
    around = [np.zeros(2), *(given.reach_px * np.column_stack([np.cos(turns), np.sin(turns)]))]
    truth = np.array([given.motion(points + step) for step in around])
    return np.maximum(np.maximum(truth.min(axis=0) - found, found - truth.max(axis=0)), 0.0)


def halved(picture: Picture) -> Floats:
    """A picture of half the size where it has more than a hundred rows."""
    grey = np.asarray(picture, float)
    height, width = grey.shape
    return grey if height < 100 else grey.reshape(height // 2, 2, width // 2, 2).mean(axis=(1, 3))


def inside(points: Floats, room: float) -> NDArray[np.bool_]:
    """Points that keep ``room`` px from the picture's edges."""
    return np.asarray((points >= room).all(axis=1) & (points <= np.array(SHAPE[::-1]) - 1 - room).all(axis=1))


Row = tuple[str, str, Callable[[], Pair], float]


def moved_pairs() -> list[Row]:
    """Large motions and poor light: name, what is done, pair, least share of points that must be measured."""
    bands = [
        (f"shear band {w:g} px wide", f"jump of 5.4 px, tanh over {w:g} px", partial(sheared, w), 0.8)
        for w in (12.0, 4.0, 1.0)
    ]
    turned = [
        (f"turn of {a} degrees", "about the middle", partial(pair, partial(deformed, angle_deg=a)), least)
        for a, least in ((10, 0.9), (20, 0.9), (30, 0.9))
    ]
    return [
        ("contrast of 10 %, noise of 4", "both pictures", partial(pair, shifted, faint, faint), 0.9),
        *bands,
        (
            "60 px",
            "translation of 60.3, -23.2 px, twice the subset",
            partial(pair, partial(shifted, shift=(60.3, -23.2))),
            0.9,
        ),
        *turned,
        ("stretch of 20 %", "along x", partial(pair, partial(deformed, stretch=0.2)), 0.9),
        (
            "other light",
            "second picture: 0.7 of the light, offset of 20, slope of 50 %",
            partial(pair, shifted, rounded, relit),
            0.9,
        ),
        ("one picture out of focus", "blur of 1.5 px", partial(pair, shifted, rounded, blurred), 0.5),
        (
            "one picture smeared",
            "9 px of motion while exposed",
            partial(pair, shifted, rounded, smeared),
            0.5,
        ),
    ]


def poor_pairs() -> list[Row]:
    """Pictures that tell little."""
    return [
        ("JPEG of quality 50", "both pictures", partial(pair, shifted, jpeg, jpeg), 0.9),
        ("saturated", "twice the light, both pictures", partial(pair, shifted, burnt, burnt), 0.9),
        (
            "sixteen bit, three levels",
            "both pictures",
            partial(pair, shifted, three_levels, three_levels),
            0.9,
        ),
        ("noise of 60 grey levels", "both pictures", partial(pair, shifted, swamped, swamped), 0.5),
        (
            "repeated pattern of 40 px",
            "moved by 32 px: 8 px back looks the same",
            partial(repeated, 40, (32.0, -2.2)),
            0.0,
        ),
        (
            "repeated pattern, one whole period",
            "moved by 40 px: standstill looks the same",
            partial(repeated, 40, (40.0, 0.0)),
            0.0,
        ),
        ("no texture", "grey 128, noise of 2", partial(pair, shifted, flat, flat), 0.0),
        ("other sand", "the pictures have nothing in common", partial(pair, shifted, rounded, other), 0.0),
        ("picture of 20 x 20 px", "smaller than a subset", tiny, 0.0),
        ("subsets half in air", "a sloping surface, the mask follows it", half_in_air, 0.9),
    ]


def cases() -> Sequence[HardCase]:
    """Every hard pair."""
    says = r"\d+ of \d+ points"
    return [
        HardCase(
            name,
            done,
            MUST + (f"; at least {100 * least:.0f} % measured" if least else "; refused with a reason"),
            partial(measure, made, least),
            0.0,
            "wrong vectors",
            says,
        )
        for name, done, made, least in (*moved_pairs(), *poor_pairs())
    ]


def draw(canvas: Canvas, case: HardCase, shown: Drawn) -> None:
    """The second picture with points that are valid, refused and wrong."""
    ax = canvas.subplots()
    ax.imshow(painted(shown), interpolation="none")
    ax.set_axis_off()


def painted(shown: Drawn) -> NDArray[np.uint8]:
    """The picture (H, W, 3) in twelve greys, with points painted as small marks of pixels."""
    low, high = shown.picture.min(), max(shown.picture.max(), shown.picture.min() + 1e-9)
    grey = 90 + 15 * np.floor(11.99 * (shown.picture - low) / (high - low))
    image = np.repeat(np.clip(grey, 0, 255)[..., None], 3, axis=2).astype(np.uint8)
    scale = 2.0 if len(shown.picture) >= 100 else 1.0
    where = np.where(shown.kind[:, None] > 0, shown.points + shown.vector, shown.points) / scale
    for kind, name, before, after in ((1, MEASURED, 0, 2), (0, MODEL, 0, 2), (2, MODEL, 4, 5)):
        colour = np.array([int(name[k : k + 2], 16) for k in (1, 3, 5)], np.uint8)
        for x, y in np.rint(where[shown.kind == kind]).astype(int):
            image[max(y - before, 0) : y + after, max(x - before, 0) : x + after] = colour
    return image


PART = Part(
    "correlation",
    "Correlation",
    "Pictures of exactly drawn sand and a known motion, subsets of 31 px. A blue point is valid and stands "
    "where it was found in the second picture; an orange one was refused; a large orange square is wrong.",
    cases,
    draw,
)
