"""Cases for speed against error of displacement measurement: exact pictures of sand with a known motion.

The motion acts on the middles of rigid Gaussian grains in the reference picture, so the truth at a point of
the reference is the motion at that point. Nothing is interpolated. Errors are pooled over both components.
"""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache, partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from ploughval.synth.sand import Grains, sand_texture

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Motion = Callable[[Floats], Floats]

SHAPE = (768, 1024)
"""Height and width of every picture, px."""
MIDDLE = (np.array(SHAPE[::-1]) - 1) / 2
SUBSET = 31
STEP = 16
SEED = 2024
MARGIN_PX = 200.0
"""How far the sand reaches beyond the picture: more than any case moves it in."""
PIVOT_GREY = 140.0
"""Grey level about which contrast is changed: the mean of the sand."""
ROUNDING = 1 / np.sqrt(12)
"""Standard deviation of rounding to whole grey levels."""
BAND_ANGLE = np.deg2rad(25.0)
JUMP_PX = 5.4
AMPLITUDE_PX = 0.5
SHIFTS = (0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0)


class Profile(StrEnum):
    """How the displacement goes from one side of a band to the other."""

    TANH = "tanh"
    ERF = "erf"
    RAMP = "ramp"


@dataclass(frozen=True, slots=True)
class Case:
    """A motion of the sand, and how the two pictures are lit and disturbed."""

    name: str
    motion: Motion
    """Displacement (N, 2) px at points (N, 2) px of the reference, x first."""
    noise: float = 0.0
    """Standard deviation of the grey noise of each picture."""
    contrast: float = 1.0
    gain: float = 1.0
    """Factor on the light of the second picture."""
    offset: float = 0.0
    """Grey levels added to the second picture."""
    light_slope: float = 0.0
    """Relative change of the second picture's light from its left edge to its right edge."""
    side: Callable[[Floats], Floats] | None = None
    """Distance from the middle line of a shear band, (N,) px."""
    period: Callable[[Floats], Floats] | None = None
    """Period of the sinusoid, (N,) px."""


@dataclass(frozen=True, slots=True)
class Metrics:
    """Measured displacements against the truth; NaN where a case does not tell."""

    points: int
    """Points whose subset lies inside both pictures; all the rest is about these."""
    valid: float
    """Share of the counted points that are called valid."""
    bias_px: float
    """Greatest mean error of a component."""
    random_px: float
    """Standard deviation of the error about its mean."""
    rmse_px: float
    p99_px: float
    """99th percentile of the error of a component, without sign."""
    bound_px: float
    """Cramer-Rao bound of a component for pure translation, both pictures noisy and rounded."""
    times_bound: float
    near_rmse_px: float
    """Points closer to a band's middle line than half a subset."""
    near_valid: float
    elsewhere_rmse_px: float
    elsewhere_valid: float
    star_period_px: float
    """Period at which 90 % of the sinusoid's amplitude is measured; infinity: at none."""
    within_1_std: float
    """Share of the errors within one predicted standard deviation (68 % when it is right)."""
    within_2_std: float


def translate(points: Floats, x: float, y: float) -> Floats:
    """Displacement of a plain translation, px."""
    return np.tile([float(x), float(y)], (len(points), 1))


def deform(points: Floats, stretch: float, shear: float, angle_deg: float) -> Floats:
    """Displacement of a stretch along x, a shear of x along y, then a turn, about the middle, px."""
    turn = np.deg2rad(angle_deg)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    gradient = rotation @ np.array([[1.0 + stretch, shear], [0.0, 1.0]]) - np.eye(2)
    return np.asarray((points - MIDDLE) @ gradient.T)


def band_side(points: Floats, angle: float = BAND_ANGLE) -> Floats:
    """Distance above an inclined line through the middle of the picture, px."""
    return np.asarray((points - MIDDLE) @ [-np.sin(angle), -np.cos(angle)])


def slide(points: Floats, width: float, profile: Profile, angle: float = BAND_ANGLE) -> Floats:
    """Displacement of a block above an inclined line along that line, px.

    The jump of 5.4 px is spread as tanh(s / (width / 2)); other profiles have the same distance between 10 %
    and 90 % of the jump.
    """
    s = band_side(points, angle) / width
    share = {
        Profile.TANH: lambda: np.tanh(2.0 * s),
        Profile.ERF: lambda: erf(s / 0.60615),
        Profile.RAMP: lambda: np.clip(s / 0.68663, -1.0, 1.0),
    }[profile]()
    return np.asarray(JUMP_PX / 2 * (1.0 + share)[:, None] * [np.cos(angle), -np.sin(angle)])


def star_period(points: Floats) -> Floats:
    """Period of the star's sinusoid: 10 px at the left edge of the picture, 150 px at the right, px."""
    return np.asarray(np.clip(10.0 + 140.0 * points[:, 0] / SHAPE[1], 10.0, None))


def star_motion(points: Floats) -> Floats:
    """Displacement along y that is a sinusoid of y, its period growing with x, px."""
    phase = 2 * np.pi * (points[:, 1] - MIDDLE[1]) / star_period(points)
    return np.stack([np.zeros(len(points)), AMPLITUDE_PX * np.cos(phase)], axis=1)


def translation_cases(noises: Sequence[float] = (0.0, 3.0)) -> list[Case]:
    """Sweep of 0 to 1 px along x with half of that along y, for each noise."""
    return [
        Case(f"shift {shift:.2f} noise {noise:g}", partial(translate, x=shift, y=shift / 2), noise)
        for noise in noises
        for shift in SHIFTS
    ]


def affine_case() -> Case:
    """2 % stretch, 3 % shear and 1.5 degrees about the middle of the picture."""
    return Case("affine", partial(deform, stretch=0.02, shear=0.03, angle_deg=1.5))


def far_cases() -> list[Case]:
    """Translations of 17 and 60 px."""
    return [
        Case("far 17 px", partial(translate, x=17.3, y=-3.2)),
        Case("far 60 px", partial(translate, x=60.3, y=-23.2)),
    ]


def rotation_case() -> Case:
    """Turn of 15 degrees about the middle of the picture."""
    return Case("rotation 15 deg", partial(deform, stretch=0.0, shear=0.0, angle_deg=15.0))


def light_case() -> Case:
    """Less light, an offset and a slope of the light in the second picture only."""
    motion = partial(translate, x=0.25, y=0.125)
    return Case("light", motion, 3.0, gain=0.7, offset=20.0, light_slope=0.3)


def hard_case() -> Case:
    """10 % contrast with noise of 4 grey levels."""
    return Case("hard", partial(translate, x=0.25, y=0.125), 4.0, 0.1)


def band_cases(
    widths: Sequence[float] = (12.0, 4.0), profiles: Sequence[Profile] = tuple(Profile), noise: float = 0.0
) -> list[Case]:
    """Shear bands: a jump of 5.4 px, inclined by 25 degrees, through the middle of the picture."""
    return [
        Case(
            f"band {width:g} px {profile.value}" + (f" noise {noise:g}" if noise else ""),
            partial(slide, width=width, profile=profile),
            noise,
            side=band_side,
        )
        for profile in profiles
        for width in widths
    ]


def star_case(noise: float = 0.0) -> Case:
    """Sinusoid of 0.5 px whose period grows from 10 to 150 px."""
    return Case("star" + (f" noise {noise:g}" if noise else ""), star_motion, noise, period=star_period)


def all_cases() -> list[Case]:
    """Every case, in the order of the table."""
    return [
        *translation_cases(), affine_case(), *far_cases(), rotation_case(), light_case(), hard_case(),
        *band_cases(), *band_cases(profiles=(Profile.TANH,), noise=3.0), star_case(), star_case(3.0),
    ]  # fmt: skip


@lru_cache(maxsize=2)
def texture(seed: int = SEED) -> Grains:
    """Sand that every case of a seed moves."""
    return sand_texture(np.random.default_rng([seed, 0]), SHAPE, margin_px=MARGIN_PX)


def make_pair(case: Case, seed: int = SEED) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Reference and current picture of a case, 8 bit; each with its own noise."""
    grains = texture(seed)
    rng = np.random.default_rng([seed, 1, zlib.crc32(case.name.encode())])
    moved = grains.moved(case.motion(grains.positions_px))
    first = PIVOT_GREY + case.contrast * (grains.picture(SHAPE).astype(np.float64) - PIVOT_GREY)
    second = PIVOT_GREY + case.contrast * (moved.picture(SHAPE).astype(np.float64) - PIVOT_GREY)
    second = second * light_over(case, np.arange(SHAPE[1])) + case.offset
    return developed(first, case.noise, rng), developed(second, case.noise, rng)


def light_over(case: Case, x: NDArray[np.generic]) -> Floats:
    """Factor on the second picture's light at columns ``x``."""
    return np.asarray(case.gain * (1.0 + case.light_slope * (x - MIDDLE[0]) / SHAPE[1]))


def developed(light: Floats, noise: float, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Picture with noise, rounded to 8 bit."""
    return np.clip(np.round(light + rng.normal(0.0, noise, light.shape)), 0, 255).astype(np.uint8)


def grid_points(step: int = STEP, margin: int = 24) -> Floats:
    """Points on a square grid that keep ``margin`` px from the picture's edges, (N, 2) px, x first."""
    axes = (np.arange(margin, n - margin, step, dtype=np.float64) for n in SHAPE[::-1])
    return np.stack([axis.ravel() for axis in np.meshgrid(*axes)], axis=1)


def counted_points(case: Case, points: Floats, subset: int = SUBSET, room: float = 2.0) -> Bools:
    """Points whose subset, and the subset as moved, lies inside the picture with ``room`` px to spare."""
    inside = np.ones(len(points), dtype=np.bool_)
    half, last = subset // 2, np.array(SHAPE[::-1]) - 1.0
    for corner in ((-half, -half), (-half, half), (half, -half), (half, half)):
        here = points + np.array(corner, dtype=np.float64)
        for place in (here, here + case.motion(here)):
            inside &= ((place >= room) & (place <= last - room)).all(axis=1)
    return inside


@lru_cache(maxsize=4)
def slope_sums(seed: int, subset: int) -> Floats:
    """Sum of the exact picture's squared slopes over the subset about each pixel, (2, H, W), x first."""
    grains, sums = texture(seed), []
    for along in ((0.05, 0.0), (0.0, 0.05)):
        ahead, behind = (grains.moved(sign * np.array(along)).picture(SHAPE) for sign in (1.0, -1.0))
        square = np.pad(((ahead.astype(np.float64) - behind) / 0.1) ** 2, subset // 2 + 1)
        total = square.cumsum(axis=0).cumsum(axis=1)
        end, start = slice(subset, subset + SHAPE[0]), slice(0, SHAPE[0])
        right, left = slice(subset, subset + SHAPE[1]), slice(0, SHAPE[1])
        sums.append(total[end, right] - total[start, right] - total[end, left] + total[start, left])
    return np.stack(sums)


def bound_px(case: Case, points: Floats, subset: int = SUBSET, seed: int = SEED) -> Floats:
    """Cramer-Rao bound for pure translation at each point, (N, 2) px; both pictures noisy and rounded.

    The noise of the second picture counts in units of the first one's light.
    """
    column, row = np.clip(np.rint(points).T.astype(int), 0, np.array(SHAPE[::-1])[:, None] - 1)
    sums = slope_sums(seed, subset)[:, row, column].T * case.contrast**2
    noise = np.hypot(case.noise, ROUNDING)
    both = noise * np.sqrt(1.0 + 1.0 / light_over(case, points[:, 0]) ** 2)
    return np.asarray(both[:, None] / np.sqrt(sums))


def score(
    case: Case,
    points: Floats,
    displacement: Floats,
    valid: Bools,
    std: Floats | None = None,
    *,
    subset: int = SUBSET,
    seed: int = SEED,
) -> Metrics:
    """Measured displacements of a case against the truth.

    Parameters
    ----------
    case : Case
        The truth.
    points, displacement : (N, 2) float, px
        Where in the reference, and how far it moved, x first and y down.
    valid : (N,) bool
        What the method itself vouches for; vectors that are not finite are never valid.
    std : (N, 2) float, px, optional
        Predicted standard deviation.
    subset : int, px
        Side of the subsets: sets which points count, which are near a band, and the bound.
    seed : int
        Of the pictures.
    """
    counted = counted_points(case, points, subset)
    used = valid & counted & np.isfinite(displacement).all(axis=1)
    if not used.any():
        nothing = [float("nan")] * 13
        return Metrics(int(counted.sum()), 0.0, *nothing)
    error = (displacement - case.motion(points))[used]
    bound = root_mean_square(bound_px(case, points[used], subset, seed))
    bias = float(np.abs(error.mean(axis=0)).max())
    spread = float(np.sqrt(np.mean(np.var(error, axis=0))))
    near, near_valid, elsewhere, elsewhere_valid = split_by_band(case, points, counted, used, error, subset)
    within = (
        [float("nan")] * 2
        if std is None
        else [float(np.mean(np.abs(error) <= k * std[used])) for k in (1, 2)]
    )
    return Metrics(
        int(counted.sum()), float(used.sum() / counted.sum()), bias, spread,
        root_mean_square(error), float(np.percentile(np.abs(error), 99)), bound, spread / bound,
        near, near_valid, elsewhere, elsewhere_valid,
        star_resolution(case, points, displacement, counted, used), *within,
    )  # fmt: skip


def root_mean_square(error: Floats) -> float:
    """Root of the mean square; NaN of nothing."""
    return float(np.sqrt(np.mean(error**2))) if error.size else float("nan")


def split_by_band(
    case: Case, points: Floats, counted: Bools, used: Bools, error: Floats, subset: int
) -> tuple[float, float, float, float]:
    """Error and share of valid points near a band, then elsewhere; NaN without a band."""
    if case.side is None:
        return (float("nan"),) * 4
    near = np.abs(case.side(points)) < subset / 2
    here = near[used]
    return (
        root_mean_square(error[here]), share(used & near, counted & near),
        root_mean_square(error[~here]), share(used & ~near, counted & ~near),
    )  # fmt: skip


def share(part: Bools, whole: Bools) -> float:
    """How much of a choice of points is in another; NaN of none."""
    return float(part.sum() / whole.sum()) if whole.any() else float("nan")


def star_resolution(
    case: Case, points: Floats, displacement: Floats, counted: Bools, used: Bools, gain: float = 0.9
) -> float:
    """Period above which at least ``gain`` of the sinusoid's amplitude is measured, px; NaN without one.

    The measured displacement is regressed on the true one in bins of period; a bin with fewer than half of
    its points valid counts as not measured.
    """
    if case.period is None:
        return float("nan")
    periods, truth = case.period(points), case.motion(points)[:, 1]
    edges = np.arange(10.0, 151.0, 7.0)
    middles, gains = [], []
    for low, high in pairwise(edges):
        here = (periods >= low) & (periods < high)
        if not (counted & here).any():
            continue
        chosen = used & here
        middles.append(float(periods[counted & here].mean()))
        measured = share(chosen, counted & here) >= 0.5
        slope = displacement[chosen, 1] @ truth[chosen] / np.sum(truth[chosen] ** 2) if measured else 0.0
        gains.append(float(slope))
    return crossing(np.array(middles), np.array(gains), gain)


def crossing(places: Floats, values: Floats, level: float) -> float:
    """Place above which values stay at or over a level, interpolated; infinity when the last one is below."""
    below = np.flatnonzero(values < level)
    if below.size == 0:
        return float(places[0])
    last = int(below[-1])
    if last + 1 == len(places):
        return float("inf")
    part = (level - values[last]) / (values[last + 1] - values[last])
    return float(places[last] + part * (places[last + 1] - places[last]))
