"""A camera from points known in the photograph and on the window, with as many lens terms as they carry.

Least squares of errors in px, all parameters together; a term of the lens is taken where a likelihood-ratio
test says that it pays (docs/theory-calibration.md, section 3).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import CalibrationError
from ploughval.photos.calibration.camera_model import PARAMETERS, CameraModel
from ploughval.photos.calibration.homography import (
    direct_projection,
    inverse,
    normaliser,
    project,
    refuse_fold,
)
from ploughval.photos.calibration.lens import TERMS, Lens, bend, bend_by_terms, bend_slope
from ploughval.scene import Window

Array = NDArray[np.float64]
Terms = tuple[int, ...]

LEVEL = 0.01  # chance to take k1 of a lens that has none
LEVEL_MORE = 0.001  # and any term after it: taken wrongly they cost more, for few points hold them
LEAST_FREEDOM = 3  # redundant coordinates that must be left once a term is taken; 1 where their std is known
ASSUMED_STD_PX = 0.5  # of a coordinate where fewer are redundant and nothing is said
ASSUMED_K1_STD = 0.005  # of a lens that nothing is known of
_NOISE_FLOOR_PX = 1e-5  # below it points are exact, and rounding is not to be explained
_RADIAL, _TANGENTIAL = (0, 1, 2), (3, 4)


class TermTest(NamedTuple):
    """Whether terms of the lens pay: their names, the chance without them, and what was decided."""

    terms: tuple[str, ...]
    p_value: float
    taken: bool


@dataclass(frozen=True, slots=True, eq=False)
class PointSet:
    """Points in the photograph (N, 2) px and on the window (N, 2) mm.

    ``std_px`` (N,): standard uncertainty of a coordinate, None where it is not known; ``shape`` (H, W) of the
    photographs, px; ``numbers`` (N,): their places in the settings, None where all of them are here.
    """

    px: Array
    mm: Array
    shape: tuple[int, int]
    std_px: Array | None = None
    numbers: NDArray[np.int64] | None = None

    def without(self, index: int) -> "PointSet":
        """All but one of the points."""
        std = None if self.std_px is None else np.delete(self.std_px, index)
        numbers = np.delete(np.arange(len(self.px)) if self.numbers is None else self.numbers, index)
        return PointSet(np.delete(self.px, index, 0), np.delete(self.mm, index, 0), self.shape, std, numbers)

    def with_mm(self, mm: Array) -> "PointSet":
        """The same points at other places on the window."""
        return replace(self, mm=mm)

    def place(self, index: int) -> str:
        """Where a point stands in the settings."""
        return f"control_points.{index if self.numbers is None else self.numbers[index]}"

    @property
    def weight(self) -> Array:
        """Weight (N, 1) of each point's residual: 1 / std, or 1."""
        return np.ones((len(self.px), 1)) if self.std_px is None else 1 / self.std_px[:, None]


@dataclass(frozen=True, slots=True, eq=False)
class CameraFit:
    """A fitted camera and what its points say about it.

    Attributes
    ----------
    model : CameraModel
    residual_px : (N, 2) float, px
        Projected minus given.
    chi2 : float
        Weighted sum of squared residuals; px^2 where no standard uncertainty is known.
    terms : tuple of int
        Terms of the lens that are fitted, by their place in ``TERMS``.
    spread : (16, K) float, units of the parameters
        Changes of ``model.parameters`` by one standard deviation of K independent sources.
    tests : tuple of TermTest
    std_px : float, px
        Standard uncertainty of a coordinate that the spread stands for (its mean over the points).
    std_source : str
        Where that comes from.
    """

    model: CameraModel
    residual_px: Array
    chi2: float
    terms: Terms
    spread: Array
    tests: tuple[TermTest, ...] = ()
    std_px: float = np.nan
    std_source: str = ""

    @property
    def freedom(self) -> int:
        """Number of redundant coordinates."""
        return 2 * len(self.residual_px) - 8 - len(self.terms)

    @property
    def term_names(self) -> tuple[str, ...]:
        """Names of the lens terms that are fitted."""
        return tuple(TERMS[k] for k in self.terms)


def fit_camera(points: PointSet, window: Window | None = None) -> CameraFit:
    """Fit projection and lens, the latter with the terms that pay.

    Parameters
    ----------
    points : PointSet
        At least four, no three of which are on a line.
    window : Window or None
        The pane, for its refraction.

    Returns
    -------
    CameraFit

    Raises
    ------
    CalibrationError
        Points that fix nothing.
    """
    fit = fit_terms(points, (), window)
    tests: list[TermTest] = []
    aside = [] if _room(points, 9) else [_unknown_lens(points, fit, window)]
    while True:
        trials = [
            (added, trial) for added in _next_terms(fit.terms) if (trial := _try(points, fit, added, window))
        ]
        if not trials:
            break
        chances = [_chance(fit, larger, points.std_px is not None) for _, larger in trials]
        best = int(np.argmin(chances))
        taken = chances[best] < (LEVEL_MORE / len(trials) if fit.terms else LEVEL)
        tests.append(TermTest(tuple(TERMS[k] for k in trials[best][0]), chances[best], taken))
        if not taken:
            aside = [_left_out(fit, larger, points.std_px is not None) for _, larger in trials]
            break
        fit = trials[best][1]
    aside += window_sources(fit.model, window, lambda pane: fit_terms(points, fit.terms, pane).model)
    return _with_std(fit, points, tuple(tests), np.array(aside).reshape(-1, PARAMETERS).T)


def window_sources(
    model: CameraModel, window: Window | None, found: Callable[[Window], CameraModel]
) -> list[Array]:
    """What one standard uncertainty of each number of the window changes, the camera found anew with it."""
    if window is None:
        return []
    stds = {
        "thickness_mm": window.thickness_std_mm,
        "index": window.index_std,
        "distance_mm": window.distance_std_mm,
    }
    changed = [window.model_copy(update={k: getattr(window, k) + std}) for k, std in stds.items() if std > 0]
    return [found(pane).parameters - model.parameters for pane in changed]


def fit_terms(points: PointSet, terms: Terms, window: Window | None = None) -> CameraFit:
    """Fit projection and the named terms of the lens; the spread is for one unit of weight.

    Raises
    ------
    CalibrationError
        Points that fix nothing.
    """
    if window is None or window.points_on == "outside":
        return _fit_face(points, points.mm, terms, window)
    face = points.mm
    for _ in range(12):  # the window moves places by a hundredth: two digits a turn
        fit = _fit_face(points, face, terms, window)
        assert fit.model.pane is not None
        moved = fit.model.pane.front(points.mm)
        change, face = float(np.abs(moved - face).max()), moved
        if change < 1e-11 * np.ptp(face):
            break
    return fit


def _fit_face(points: PointSet, face: Array, terms: Terms, window: Window | None) -> CameraFit:
    """Fit with the points' places on the outer face given."""
    from scipy.optimize import least_squares

    lens = Lens.of_picture(points.shape)
    seen = (points.px - lens.centre_px) / lens.radius_px
    start = direct_projection(points.px, face)
    to_q = np.diag([1.0, 1, lens.radius_px])
    to_q[:2, 2] = -lens.centre_px
    to_mm = normaliser(face)
    first = to_q @ start @ inverse(to_mm)
    scaled, weight = project(to_mm, face), points.weight * lens.radius_px
    free = [*range(8), *(8 + k for k in terms)]

    def full(values: Array) -> Array:
        whole = np.zeros(13)
        whole[free] = values
        return whole

    def residual(values: Array) -> Array:
        return np.asarray(((_forward(full(values), scaled) - seen) * weight).ravel())

    def slope(values: Array) -> Array:
        return np.asarray(
            (_slopes(full(values), scaled)[..., free] * weight[..., None]).reshape(-1, len(free))
        )

    guess = np.concatenate([(first / first[2, 2]).ravel()[:8], np.zeros(len(terms))])
    found = least_squares(
        residual, guess, slope, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=100
    ).x
    values = full(found)
    matrix = np.append(values[:8], 1.0).reshape(3, 3)
    refuse_fold(matrix, scaled)
    model = CameraModel.of(inverse(to_q) @ matrix @ to_mm, Lens.of_picture(points.shape, values[8:]), window)
    off = residual(found).reshape(-1, 2)
    _, s, v = np.linalg.svd(slope(found), full_matrices=False)
    if s[-1] < 1e-12 * s[0]:
        raise CalibrationError("the control points do not fix a homography: spread them over the window")
    spread = np.zeros((13, len(free)))
    spread[free] = v.T / s
    return CameraFit(
        model=model,
        residual_px=off / points.weight,
        chi2=float(np.sum(off**2)),
        terms=terms,
        spread=_unscaled(spread, matrix, inverse(to_q), to_mm),
    )


def _forward(values: Array, scaled: Array) -> Array:
    matrix = np.append(values[:8], 1.0).reshape(3, 3)
    return bend(project(matrix, scaled), values[8:])


def _slopes(values: Array, scaled: Array) -> Array:
    """Derivatives (N, 2, 13) of the distorted places by all parameters."""
    matrix = np.append(values[:8], 1.0).reshape(3, 3)
    q = project(matrix, scaled)
    h = np.column_stack([scaled, np.ones(len(scaled))])
    u = h / (h @ matrix[2])[:, None]
    plain = np.zeros((len(scaled), 2, 8))
    plain[:, 0, 0:3] = plain[:, 1, 3:6] = u
    plain[:, :, 6:8] = -q[:, :, None] * u[:, None, :2]
    return np.concatenate([bend_slope(q, values[8:]) @ plain, bend_by_terms(q)], axis=-1)


def _unscaled(spread: Array, matrix: Array, left: Array, right: Array) -> Array:
    """Changes (16, K) of left @ matrix @ right over its last entry, and of the lens."""
    whole = left @ matrix @ right
    last = whole[2, 2]
    moved = np.vstack([spread, np.zeros((PARAMETERS - len(spread), spread.shape[1]))])
    for k, column in enumerate(spread.T):
        change = left @ np.append(column[:8], 0.0).reshape(3, 3) @ right
        moved[:8, k] = (change / last - whole * change[2, 2] / last**2).ravel()[:8]
    return moved


def _next_terms(terms: Terms) -> list[Terms]:
    """Terms that may be taken next: k1, then the next radial one or the tangential pair."""
    radial = [(k,) for k in _RADIAL if k not in terms][:1]
    return radial + ([_TANGENTIAL] if terms and not set(_TANGENTIAL) <= set(terms) else [])


def _try(points: PointSet, fit: CameraFit, added: Terms, window: Window | None) -> CameraFit | None:
    """The fit with more terms; None where too little is redundant, or where the lens would fold."""
    terms = tuple(sorted(fit.terms + added))
    if not _room(points, 8 + len(terms)):
        return None
    try:
        larger = fit_terms(points, terms, window)
    except CalibrationError:
        return None
    return None if larger.model.lens.folds() else larger


def _room(points: PointSet, parameters: int) -> bool:
    """Whether enough coordinates are redundant for so many parameters."""
    least = LEAST_FREEDOM if points.std_px is None else 1
    return 2 * len(points.px) - parameters >= least


def _ratio(small: CameraFit, large: CameraFit, known: bool) -> float:
    """By how much more terms lower chi2, in units of what is left to one coordinate."""
    left = large.chi2 / large.freedom
    left = max(1.0, left) if known else max(left, _NOISE_FLOOR_PX**2)
    return max(small.chi2 - large.chi2, 0.0) / left


def _chance(small: CameraFit, large: CameraFit, known: bool) -> float:
    """Chance that terms which mean nothing lower the residuals as much: F test; chi-square with known std.

    docs/theory-calibration.md, Eq. (3).
    """
    from scipy.stats import chi2, f

    added, ratio = len(large.terms) - len(small.terms), _ratio(small, large, known)
    return float(chi2.sf(ratio, added) if known else f.sf(ratio / added, added, large.freedom))


def _left_out(small: CameraFit, large: CameraFit, known: bool) -> Array:
    """What terms that were not taken may still mean: their change, less what noise alone makes of it.

    docs/theory-calibration.md, Eq. (4).
    """
    added, ratio = len(large.terms) - len(small.terms), _ratio(small, large, known)
    share = np.sqrt(max(0.0, 1 - added / ratio)) if ratio > 0 else 0.0
    return np.asarray(share * (large.model.parameters - small.model.parameters))


def _unknown_lens(points: PointSet, fit: CameraFit, window: Window | None) -> Array:
    """What a lens would change that too few points cannot show."""
    lens = Lens.of_picture(points.shape, np.array([ASSUMED_K1_STD, 0, 0, 0, 0]))
    straight = PointSet(lens.undistort(points.px), points.mm, points.shape, points.std_px)
    bent = fit_terms(straight, (), window).model.parameters
    bent[8] = ASSUMED_K1_STD
    return np.asarray(bent - fit.model.parameters)


def _with_std(fit: CameraFit, points: PointSet, tests: tuple[TermTest, ...], aside: Array) -> CameraFit:
    """The fit with its spread scaled to the points' standard uncertainty."""
    from scipy.stats import chi2

    unit = float(np.sqrt(fit.chi2 / fit.freedom)) if fit.freedom > 0 else 0.0
    few = np.sqrt(fit.freedom / (fit.freedom - 2)) if fit.freedom > 2 else 1.0  # std of Student's t
    if points.std_px is not None:
        widen = unit * few if fit.freedom and chi2.sf(fit.chi2, fit.freedom) < LEVEL else 1.0
        source = "as given" if widen == 1 else f"{widen:.2g} times what was given, for so the residuals say"
        std = widen * float(np.sqrt(np.mean(points.std_px**2)))
    elif fit.freedom >= LEAST_FREEDOM:
        widen, std = unit * few, unit
        source = "from the residuals"
    else:
        widen = std = max(unit, ASSUMED_STD_PX)
        source = "assumed, for too few points are redundant"
    spread = np.hstack([widen * fit.spread, aside])
    return CameraFit(fit.model, fit.residual_px, fit.chi2, fit.terms, spread, tests, std, source)
