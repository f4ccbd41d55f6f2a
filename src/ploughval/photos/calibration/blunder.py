"""A control point that contradicts the others: found, named, and its likely cause told (Baarda, 1968)."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import CalibrationError
from ploughval.photos.calibration.camera_fit import ASSUMED_STD_PX, CameraFit, PointSet, fit_camera, fit_terms
from ploughval.scene import Window

Array = NDArray[np.float64]

_CHANCE = 0.01  # to blame a point although none is wrong
_LEAST_PX, _MOST_PX = 0.5, 3.0  # a point nearer to where it should be is not called mistyped
_STDS = 10.0
_FIT_PX = 1.5  # rms within which points agree once a mistake is put right
_FIT_SHARE = 0.05  # or this share of what they were off by before: a lens may be left that five cannot show
_USELESS_PX = 10.0
_PRIOR = 4  # redundant coordinates that what is assumed of a reading is worth
_ORDINARY_LENS = 0.05  # displacement at the corners, of half the diagonal
_MOST_SWAPS = 30


def refuse_blunder(points: PointSet, fit: CameraFit | None, window: Window | None = None) -> None:
    """Refuse control points of which one, or a pair, contradicts the others.

    Parameters
    ----------
    points : PointSet
        The control points.
    fit : CameraFit or None
        Of all of them; None where no camera sees them all.
    window : Window or None
        The pane that the fit allows for.

    Raises
    ------
    CalibrationError
        Naming the point, what was expected there and what probably happened.
    """
    if len(points.px) < 5:
        return
    if len(points.px) == 5:
        _refuse_among_five(points, fit, window)
        return
    _refuse_single(points, fit, window)
    _refuse_swap(points, fit, window)
    if fit is not None and _rms(fit) > _USELESS_PX:
        raise CalibrationError(
            f"the control points contradict each other by {_rms(fit):.0f} px rms; expected less than "
            f"{_USELESS_PX:g} px. More than one of them must be wrong: check them all. A fish-eye lens does "
            "the same"
        )


def _refuse_single(points: PointSet, fit: CameraFit | None, window: Window | None) -> None:
    """F test of the fit without each point in turn, the lens chosen anew without it."""
    from scipy.stats import f as fisher

    most_px = _MOST_PX if fit is None else max(_FIT_PX, _FIT_SHARE * _rms(fit))
    found: list[tuple[float, int, Array]] = []
    for k in _worst(points, fit, window):
        try:
            rest = fit_camera(points.without(k), window)
        except CalibrationError:  # the others fix nothing without this point
            continue
        if _rms(rest) > most_px:
            continue
        left = _variance(rest, points)
        gain = (min(_chi2(points, rest.terms, window), np.inf if fit is None else fit.chi2) - rest.chi2) / 2
        off = float(np.hypot(*(rest.model.to_px(points.mm[k]) - points.px[k])))
        off = off if np.isfinite(off) else np.inf
        limit = float(np.clip(_STDS * rest.std_px, _LEAST_PX, _MOST_PX))
        chance = fisher.sf(gain / left, 2, rest.freedom + _PRIOR)
        if len(points.px) * chance < _CHANCE and off > limit:
            found.append((left, k, rest.model.to_mm(points.px[k])))
    if not found:
        return
    left, k, place = min(found, key=lambda item: item[0])
    if _lens_explains(points, window, 4 * left):
        return
    within_mm = 3 * _MOST_PX * np.hypot(*np.ptp(points.mm, axis=0)) / np.hypot(*np.ptp(points.px, axis=0))
    cause = _cause(points, k, place, float(within_mm))
    raise CalibrationError(
        f"{points.place(k)}: got {_shown(points, k)}; expected about "
        f"x_mm = {place[0]:.1f}, y_mm = {place[1]:.1f} at that px from the other {len(points.px) - 1} "
        f"points. {cause}Correct the point or take it out."
    )


def _variance(fit: CameraFit, points: PointSet) -> float:
    """Variance of a coordinate, with what is assumed of a reading: few residuals are small by luck."""
    assumed = ASSUMED_STD_PX**2 if points.std_px is None else 1.0
    return (fit.chi2 + _PRIOR * assumed) / (fit.freedom + _PRIOR)


def _chi2(points: PointSet, terms: tuple[int, ...], window: Window | None) -> float:
    """Sum of squares of a fit; infinite where there is none."""
    try:
        return fit_terms(points, terms, window).chi2
    except CalibrationError:
        return np.inf


def _worst(points: PointSet, fit: CameraFit | None, window: Window | None, count: int = 6) -> list[int]:
    """The points whose absence helps most, without and with the lens that the others may show."""
    lenses = {(), (0,), *(() if fit is None else (fit.terms,))} if len(points.px) > 6 else {()}
    gains = {
        k: min(_chi2(points.without(k), terms, window) for terms in lenses) for k in range(len(points.px))
    }
    return sorted(gains, key=gains.__getitem__)[:count]


def _refuse_swap(points: PointSet, fit: CameraFit | None, window: Window | None) -> None:
    """Two points whose places on the window are exchanged spoil any fit without one of them."""
    rms = np.inf if fit is None else _rms(fit)
    if len(points.px) > _MOST_SWAPS or rms < 2 * _FIT_PX:
        return
    fits = {pair: _rms_of(points.with_mm(mm), window) for pair, mm in _swaps(points)}
    best = min(fits, key=fits.__getitem__)
    if fits[best] < _FIT_PX and fits[best] < 0.1 * rms:
        i, j = best
        raise CalibrationError(
            f"{points.place(i)} and {points.place(j)}: got {_shown(points, i)} and {_shown(points, j)}; "
            f"expected them the other way round, for then all points agree within {fits[best]:.2f} px. "
            "Exchange their x_mm and y_mm."
        )


def _refuse_among_five(points: PointSet, fit: CameraFit | None, window: Window | None) -> None:
    """Five points have two redundant coordinates: enough to see a mistake, not to place a free one."""
    if fit is not None and (_rms(fit) < _MOST_PX or _lens_explains(points, window, _FIT_PX**2)):
        return
    repaired = []
    for k in range(5):
        for cause, mm in _repairs(points, k):
            changed = points.mm.copy()
            changed[k] = mm
            if _rms_of(points.with_mm(changed), window) < _FIT_PX:
                repaired.append(f"{cause} at {points.place(k)}: got {_shown(points, k)}")
    for (i, j), mm in _swaps(points):
        if _rms_of(points.with_mm(mm), window) < _FIT_PX:
            repaired.append(f"{points.place(i)} and {points.place(j)} are exchanged")
    if fit is None and not repaired:
        return  # what the fit itself says is the reason
    by = "" if fit is None else f" by {_rms(fit):.1f} px rms"
    head = f"the five control points contradict each other{by}"
    if repaired:
        raise CalibrationError(f"{head}; it looks as if {', or '.join(repaired)}. Correct it.")
    raise CalibrationError(
        f"{head}; expected less than {_MOST_PX:g} px. Which one is wrong five points cannot tell: check them "
        "all, or add a sixth."
    )


def _lens_explains(points: PointSet, window: Window | None, most: float) -> bool:
    """Whether an ordinary lens makes all points agree: then none is blamed."""
    if len(points.px) < 5:
        return False
    try:
        bent = fit_terms(points, (0,), window)
    except CalibrationError:
        return False
    return bool(abs(bent.model.lens.terms[0]) < _ORDINARY_LENS and bent.chi2 / bent.freedom <= most)


def _cause(points: PointSet, k: int, place: Array, within_mm: float) -> str:
    """What was probably done to a point, told by what puts it right."""
    for cause, mm in _repairs(points, k):
        if np.hypot(*(mm - place)) < within_mm:
            return f"It looks as if {cause}. "
    return ""


@dataclass(frozen=True, slots=True)
class _Slip:
    """A usual mistake, as what undoes it."""

    words: str
    factor: tuple[float, float]


_SLIPS = (
    _Slip("the sign of x_mm is wrong", (-1, 1)),
    _Slip("the sign of y_mm is wrong", (1, -1)),
    _Slip("the signs of x_mm and y_mm are wrong", (-1, -1)),
    _Slip("the point of x_mm stands one digit too far left", (10, 1)),
    _Slip("the point of x_mm stands one digit too far right", (0.1, 1)),
    _Slip("the point of y_mm stands one digit too far left", (1, 10)),
    _Slip("the point of y_mm stands one digit too far right", (1, 0.1)),
)


def _repairs(points: PointSet, k: int) -> Iterator[tuple[str, Array]]:
    """Usual mistakes at a point and the place on the window that each would have meant."""
    mm = points.mm[k]
    if mm[0] != mm[1]:
        yield "x_mm and y_mm are exchanged", mm[::-1]
    for slip in _SLIPS:
        meant = mm * slip.factor
        if (meant != mm).any():
            yield slip.words, meant


def _swaps(points: PointSet) -> Iterator[tuple[tuple[int, int], Array]]:
    """Places on the window with each pair exchanged."""
    for i, j in combinations(range(len(points.px)), 2):
        mm = points.mm.copy()
        mm[[i, j]] = mm[[j, i]]
        yield (i, j), mm


def _rms(fit: CameraFit) -> float:
    return float(np.sqrt(np.mean(np.sum(fit.residual_px**2, axis=1))))


def _rms_of(points: PointSet, window: Window | None) -> float:
    """Residual of changed points, px rms, with a lens where they may show one; infinite without a fit."""
    found = []
    for terms in ((), (0,)) if len(points.px) > 5 else ((),):
        try:
            found.append(_rms(fit_terms(points, terms, window)))
        except CalibrationError:
            continue
    return min(found, default=np.inf)


def _shown(points: PointSet, k: int) -> str:
    return str([*points.px[k].tolist(), *points.mm[k].tolist()])


def refuse_crossed(points: PointSet) -> None:
    """Refuse four points whose order around the window is not that in the photograph.

    A camera keeps it, or mirrors it as a whole; four points have nothing redundant that would tell otherwise.

    Raises
    ------
    CalibrationError
    """
    if len(points.px) != 4 or _same_order(points.px, points.mm):
        return
    swaps = [pair for pair, mm in _swaps(points) if _same_order(points.px, mm)]
    pairs = [f"{points.place(i)} and {points.place(j)}" for i, j in swaps]
    likely = f" {', or '.join(pairs)} may be exchanged." if pairs else ""
    raise CalibrationError(
        "control_points: the four do not stand in the same order around the window as in the photograph, as "
        f"they must for any camera.{likely} Check x_mm and y_mm of each"
    )


def _same_order(px: Array, mm: Array) -> bool:
    """Whether all triples of points turn the same way in both planes, or all the other way."""
    triples = [list(t) for t in combinations(range(len(px)), 3)]
    turns = [_turn(px[t]) * _turn(mm[t]) for t in triples]
    return min(turns) >= 0 or max(turns) <= 0  # points on a line turn no way: the fit refuses them


def _turn(triple: Array) -> float:
    a, b = triple[1:] - triple[0]
    return float(a[0] * b[1] - a[1] * b[0])
