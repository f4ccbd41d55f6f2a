"""Material points tracked through a series; the reference is renewed only where correlation demands it."""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ploughval.axes import Status
from ploughval.errors import CorrelationError
from ploughval.piv.correlate import check_images, check_points, make_recipe
from ploughval.piv.guess import Greys, flow_at, to_8bit
from ploughval.piv.interpolate import spline_coefficients
from ploughval.piv.precision import predict_std, suited_recipe
from ploughval.piv.split import REACH, make_candidates, near_motion, noise_level, split, suspects
from ploughval.piv.subsets import Fit, Floats, Pair, displacement_of, match, place_terms
from ploughval.piv.validate import gather, least_zncc, neighbours_of, outliers
from ploughval.scene import Piv

RENEW = 0.85
"""A point's reference is renewed when its correlation falls below this share of its first one."""
RETRIES = 3
"""Frames in which a point that failed is tried again before it is given up."""
REFERENCES = 3
"""Pictures held as references."""
SURFACE = 1.5
"""Sand that decorrelates within so many subsets of the surface or the blade has avalanched."""
BORDER_PX = 3
"""A point may stand this far outside the sand that was found."""


@dataclass(frozen=True, slots=True)
class FramePoints:
    """Tracked points in one frame.

    Attributes
    ----------
    position_px : (N, 2) float, px, NaN where not measured
    std_px : (N,) float, px, standard deviation of a coordinate, with what the renewed references gathered
    zncc : (N,) float, NaN where nothing was correlated
    status : (N,) int8, :class:`ploughval.axes.Status`
    """

    position_px: Floats
    std_px: Floats
    zncc: Floats
    status: NDArray[np.int8]


@dataclass(frozen=True, slots=True)
class _Reference:
    """A picture that points are matched against, and where they stood in it (NaN: not known)."""

    frame: int
    coefficients: NDArray[np.float32]
    mask: NDArray[np.uint8]
    position: Floats  # (N, 2) px
    std: Floats  # (N,) px


@dataclass(slots=True)
class _State:
    """What is known of N points after a frame."""

    position: Floats  # (N, 2) last measured
    motion: Floats  # (N, 2) px a frame, last measured
    reference: NDArray[np.intp]  # (N,) frame of the reference picture
    params: Floats  # (N, 2, terms) from that reference
    first_zncc: Floats  # (N,) correlation when the reference was taken, NaN before the first frame
    failures: NDArray[np.intp]  # (N,) frames in a row; beyond RETRIES: lost
    cut: NDArray[np.bool_]  # (N,) whether the last match needed a split subset
    missed: int = 0  # frames skipped or failed since `grey` was seen
    grey: NDArray[np.uint8] = field(default_factory=lambda: np.zeros((1, 1), np.uint8))


class Tracker:
    """Material points of frame 0 through a series of photographs.

    Parameters
    ----------
    settings : Piv
        ``subset_px``, ``order``, ``spline``, ``zncc_min``, ``noise_grey`` of test.toml.
    workers : int
        Threads; the numbers do not depend on it.
    """

    def __init__(self, settings: Piv, workers: int = 1) -> None:
        side = settings.subset_px + 1 - settings.subset_px % 2
        self._recipe = make_recipe(side, settings.order, settings.spline)
        self._settings = settings
        self._workers = workers
        self._held: dict[int, _Reference] = {}
        self._frame = 0
        self._suited = False  # whether the recipe has been fitted to the noise of the pictures
        self._state: _State | None = None

    def start(self, image: NDArray[np.generic], points_px: ArrayLike, sand: NDArray[np.bool_]) -> None:
        """Take the first picture (H, W), the points (N, 2) px in it and its sand (H, W) bool.

        Raises
        ------
        CorrelationError
            Shapes or types that cannot be tracked.
        """
        check_images(image, image, sand)
        points = check_points(points_px)
        count = len(points)
        self._frame = 0
        self._held = {}
        self._hold(self._coefficients(image), sand, points, np.zeros(count))
        self._state = _State(
            position=points.copy(),
            motion=np.zeros((count, 2)),
            reference=np.zeros(count, np.intp),
            params=np.zeros((count, 2, self._recipe.terms)),
            first_zncc=np.full(count, np.nan),
            failures=np.zeros(count, np.intp),
            cut=np.zeros(count, bool),
            grey=to_8bit(image),
        )

    def skip(self) -> FramePoints:
        """Pass over a frame that could not be read: every point is FRAME_MISSING."""
        state = self._started()
        self._frame += 1
        state.missed += 1
        status = np.full(len(state.position), Status.FRAME_MISSING, np.int8)
        status[state.failures > RETRIES] = Status.LOST
        nothing = np.full(len(status), np.nan)
        return FramePoints(np.full((len(status), 2), np.nan), nothing, nothing.copy(), status)

    def advance(self, image: NDArray[np.generic], sand: NDArray[np.bool_]) -> FramePoints:
        """Find the points in the next picture.

        Parameters
        ----------
        image : (H, W) uint8, uint16 or float
            The photograph.
        sand : (H, W) bool
            Its sand.

        Returns
        -------
        FramePoints
        """
        state = self._started()
        extent = next(iter(self._held.values())).mask.shape
        check_images(image, image, sand)
        if image.shape != extent:
            raise CorrelationError(f"the picture is {image.shape}; expected {extent} as in the first frame")
        self._frame += 1
        current = self._coefficients(image)
        grey = to_8bit(image)
        count = len(state.position)
        fit = Fit(state.params.copy(), np.zeros((count, 10)), np.full(count, Status.LOST, np.int8))
        alive = np.flatnonzero(state.failures <= RETRIES)
        std = np.full(count, np.nan)
        if alive.size:
            self._measure(fit, current, alive, Greys(state.grey, grey))
            std[alive] = self._std(fit, alive)
        position = self._positions(fit)
        self._name_failures(fit, position, sand, alive)
        self._settle(fit, position, std, alive, (current, sand))
        state.grey = grey
        bad = fit.status != Status.OK
        position[bad], std[bad] = np.nan, np.nan
        zncc = np.where(np.isin(np.arange(count), alive), fit.zncc, np.nan)
        return FramePoints(position, std, zncc, fit.status)

    def _started(self) -> _State:
        if self._state is None:
            raise CorrelationError("the tracker has no points; call start with the first picture")
        return self._state

    def _coefficients(self, image: NDArray[np.generic]) -> NDArray[np.float32]:
        return spline_coefficients(image, self._recipe.spline)

    def _hold(
        self, coefficients: NDArray[np.float32], sand: NDArray[np.bool_], position: Floats, std: Floats
    ) -> None:
        """Keep a picture of this frame as a reference."""
        mask = np.ascontiguousarray(sand, np.uint8)
        self._held[self._frame] = _Reference(self._frame, coefficients, mask, position.copy(), std.copy())

    def _measure(self, fit: Fit, current: NDArray[np.float32], alive: NDArray[np.intp], greys: Greys) -> None:
        """Match every living point from the flow, then from its last motion, then from its neighbours'."""
        state = self._started()
        flow = np.zeros_like(state.position)
        flow[alive] = flow_at(greys, state.position[alive])
        if not self._suited:
            first = self._held[0]
            pair = Pair(first.coefficients, current, first.mask, self._recipe, self._workers)
            self._recipe = suited_recipe(pair, state.position[alive], flow[alive])
            self._suited = True
        self._try(fit, current, alive, flow[alive])
        for attempt in range(4):
            failed = alive[np.isin(fit.status[alive], (Status.LOW_CORRELATION, Status.NOT_CONVERGED))]
            if attempt > 1 and failed.size:
                failed = failed[state.failures[failed] <= RETRIES]
            if failed.size == 0:
                break
            moved = state.motion[failed] if attempt == 0 else self._neighbour_motion(fit, failed)
            known = np.isfinite(moved).all(axis=1)
            self._try(fit, current, failed[known], moved[known])
        self._split(fit, current)
        step = self._positions(fit) - state.position
        step[fit.status != Status.OK] = np.nan
        wrong = outliers(state.position, step)
        fit.status[wrong] = Status.OUTLIER

    def _split(self, fit: Fit, current: NDArray[np.float32]) -> None:
        """Match points beside shear bands on what moves with them; their references are to be renewed."""
        state = self._started()
        level = noise_level(fit)
        index = suspects(fit, level)
        clean = np.setdiff1d(np.flatnonzero(fit.status == Status.OK), index)
        state.cut[:] = False
        if index.size == 0:
            return
        step = (self._positions(fit) - state.position)[clean]
        reach = REACH * self._recipe.subset
        place, moved = near_motion(state.position[clean], step, state.position[index], reach)
        for frame, held in self._held.items():
            chosen = state.reference[index] == frame
            part = index[chosen]
            travelled = (state.position[part] - held.position[part])[:, None]
            near = (place[chosen], moved[chosen] + travelled)
            tries = make_candidates(*near, fit.params[part], self._recipe.half)
            pair = Pair(held.coefficients, current, held.mask, self._recipe, self._workers)
            state.cut[split(pair, fit, held.position[part], part, tries, level)] = True

    def _neighbour_motion(self, fit: Fit, failed: NDArray[np.intp]) -> Floats:
        """Median motion since the last frame of the nearest points that were found (F, 2), else NaN."""
        state = self._started()
        valid = np.flatnonzero(fit.status == Status.OK)
        if valid.size < 3:
            return np.full((failed.size, 2), np.nan)
        step = (self._positions(fit) - state.position)[valid]
        both = np.concatenate([state.position[valid], state.position[failed]])
        near = neighbours_of(both, min(12, len(both) - 1))[valid.size :]
        around = gather(np.concatenate([step, np.full((failed.size, 2), np.nan)]), near)
        out = np.full((failed.size, 2), np.nan)
        some = np.isfinite(around[:, :, 0]).any(axis=1)
        out[some] = np.nanmedian(around[some], axis=1)
        return out

    def _try(self, fit: Fit, current: NDArray[np.float32], index: NDArray[np.intp], moved: Floats) -> None:
        """Match points from their last place plus a motion; keeps the better correlation of each."""
        state = self._started()
        for frame, held in self._held.items():
            chosen = state.reference[index] == frame
            part = index[chosen]
            if part.size == 0:
                continue
            start = state.params[part].copy()
            here = displacement_of(start, held.position[part], self._recipe)
            start[:, :, 0] += state.position[part] + moved[chosen] - held.position[part] - here
            pair = Pair(held.coefficients, current, held.mask, self._recipe, self._workers)
            new = match(pair, held.position[part], start)
            better = (fit.status[part] != Status.OK) & (
                (new.status == Status.OK) | (fit.status[part] == Status.LOST)
            )
            better &= (new.zncc > fit.zncc[part]) | (fit.status[part] == Status.LOST)
            fit.put(part[better], new.take(np.flatnonzero(better)))
        self._judge(fit)

    def _judge(self, fit: Fit) -> None:
        """Mark points whose correlation is too low against the others and against what chance reaches."""
        good = fit.status == Status.OK
        fit.status[good & ~(fit.zncc >= least_zncc(fit, self._settings.zncc_min))] = Status.LOW_CORRELATION

    def _positions(self, fit: Fit) -> Floats:
        """Places (N, 2) px that the parameters point to."""
        state = self._started()
        out = np.full_like(state.position, np.nan)
        for frame, held in self._held.items():
            part = np.flatnonzero(state.reference == frame)
            start = held.position[part]
            out[part] = start + displacement_of(fit.params[part], start, self._recipe)
        return out

    def _std(self, fit: Fit, alive: NDArray[np.intp]) -> Floats:
        """Standard deviation of a coordinate: this match and what the reference had gathered."""
        state = self._started()
        base = np.array([self._held[f].std[n] for f, n in zip(state.reference[alive], alive, strict=True)])
        own = predict_std(fit.take(alive), self._recipe, self._settings.noise_grey)
        return np.asarray(np.sqrt(np.mean(own**2, axis=1) + base**2))

    def _name_failures(
        self, fit: Fit, position: Floats, sand: NDArray[np.bool_], alive: NDArray[np.intp]
    ) -> None:
        """Say why points ended: out of the picture, outside the sand, avalanched."""
        state = self._started()
        height, width = sand.shape
        ok = fit.status == Status.OK
        guess = np.where(ok[:, None], position, state.position + state.motion)
        pixel = np.floor(np.nan_to_num(guess, nan=-1.0) + 0.5).astype(int)
        outside = ((pixel < 0) | (pixel >= [width, height])).any(axis=1)
        pixel = np.clip(pixel, 0, [width - 1, height - 1])
        living = np.zeros(len(ok), bool)
        living[alive] = True
        fit.status[living & (outside | (fit.status == Status.EDGE))] = Status.OUT_OF_PICTURE
        kernel = np.ones((2 * BORDER_PX + 1,) * 2, np.uint8)
        wide = cv2.dilate(np.ascontiguousarray(sand, np.uint8), kernel)
        fit.status[living & ~outside & ok & (wide[pixel[:, 1], pixel[:, 0]] == 0)] = Status.MASKED
        depth = cv2.distanceTransform(np.ascontiguousarray(sand, np.uint8), cv2.DIST_L2, 3)
        shallow = depth[pixel[:, 1], pixel[:, 0]] < SURFACE * self._recipe.subset
        decorrelated = np.isin(fit.status, (Status.LOW_CORRELATION, Status.NOT_CONVERGED, Status.OUTLIER))
        fit.status[living & decorrelated & shallow & ~sand.all()] = Status.AVALANCHED

    def _settle(
        self,
        fit: Fit,
        position: Floats,
        std: Floats,
        alive: NDArray[np.intp],
        picture: tuple[NDArray[np.float32], NDArray[np.bool_]],
    ) -> None:
        """Carry the results into the state, renew references and count failures."""
        state = self._started()
        ok = alive[fit.status[alive] == Status.OK]
        bad = alive[fit.status[alive] != Status.OK]
        presumed = np.nan_to_num(self._neighbour_motion(fit, bad))
        state.motion[ok] = (position[ok] - state.position[ok]) / (1 + state.missed)
        state.position[ok] = position[ok]
        state.params[ok] = fit.params[ok]
        state.failures[ok] = 0
        state.failures[bad] += 1
        # A point that fails is presumed to go with its neighbours until it is taken up again or given up.
        state.position[bad] += presumed
        state.failures[bad[np.isin(fit.status[bad], (Status.OUT_OF_PICTURE, Status.MASKED))]] += RETRIES
        state.missed = 0
        new = ok[np.isnan(state.first_zncc[ok])]
        state.first_zncc[new] = fit.zncc[new]
        # A subset that was cut holds two motions since its reference: a new one holds less of the second.
        worn = ok[state.cut[ok] | (fit.zncc[ok] < RENEW * state.first_zncc[ok])]
        self._renew(worn, position, std, ok, picture)

    def _renew(
        self,
        worn: NDArray[np.intp],
        position: Floats,
        std: Floats,
        ok: NDArray[np.intp],
        picture: tuple[NDArray[np.float32], NDArray[np.bool_]],
    ) -> None:
        """Give worn points a newer reference: one that is held and knows them, else this picture."""
        state = self._started()
        newest = self._held[max(self._held)]
        known = (state.reference[worn] < newest.frame) & np.isfinite(newest.std[worn])
        self._rebase(worn[known], newest.frame)
        worn = worn[~known]
        if worn.size == 0:
            return
        there, spread = np.full_like(position, np.nan), np.full_like(std, np.nan)
        there[ok], spread[ok] = position[ok], std[ok]
        if len(self._held) >= REFERENCES:
            users = {f: int(np.sum(state.reference[ok] == f)) for f in self._held}
            stale = min(users, key=lambda f: (users[f], f))
            left = np.flatnonzero((state.reference == stale) & (state.failures <= RETRIES))
            lost = left[~np.isfinite(spread[left])]
            state.failures[lost] = RETRIES + 1
            worn = np.union1d(worn, left[np.isfinite(spread[left])])
            del self._held[stale]
            state.reference[state.reference == stale] = self._frame
        self._hold(picture[0], picture[1], there, spread)
        self._rebase(worn, self._frame)

    def _rebase(self, index: NDArray[np.intp], frame: int) -> None:
        """Let points be matched against another held picture, keeping the place where they stand now."""
        state = self._started()
        if index.size == 0:
            return
        held = self._held[frame]
        terms = place_terms(held.position[index], self._recipe)
        state.params[index] = 0.0
        # A plain shift to where the point stands now; its gradient is found anew.
        state.params[index, :, 0] = (state.position[index] - held.position[index]) / terms[0][:, None]
        state.reference[index] = frame
        state.first_zncc[index] = np.nan
