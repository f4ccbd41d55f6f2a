"""Material points tracked through a series; the reference is renewed only where correlation demands it."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ploughval.axes import Status
from ploughval.errors import CorrelationError
from ploughval.piv.correlate import check_images, check_points, make_recipe
from ploughval.piv.endings import name_failures
from ploughval.piv.guess import Greys, flow_at, median_of_nearest, to_8bit
from ploughval.piv.interpolate import SlopeFilter, filtered, plain_planes, spline_coefficients
from ploughval.piv.precision import Noise, judge_noise, predict_std, with_correlation
from ploughval.piv.prepare import whole_grey
from ploughval.piv.refine import mismatch_px, noise_level, suspects
from ploughval.piv.state import FramePoints, Picture, Reference, State
from ploughval.piv.subsets import ALL_SEEN, Fit, Floats, Pair, displacement_of, match
from ploughval.piv.validate import judge_correlation, outliers
from ploughval.piv.windows import (
    CANDIDATES,
    REACH,
    WHOLE,
    Level,
    match_windows,
    motions_about,
    rank_windows,
    shapes_of,
    torn_between,
)
from ploughval.scene import Piv

RENEW = 0.85
"""A point's reference is renewed when its correlation falls below this share of its first one."""
RETRIES = 3
"""Frames in which a point that failed is tried again before it is given up."""
REFERENCES = 3
"""Pictures held as references."""
ROUNDS = 2
"""Times that windows are tried, from ever nearer neighbours."""
WHOLE_PX = 0.15
"""Where no window beside a band will do, a whole subset of this mismatch is refused, px."""


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
        self._held: dict[int, Reference] = {}
        self._frame = 0
        self._noise, self._judged = Noise(), False  # of the pictures, when two of them have been seen
        self._state: State | None = None

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
        self._noise, self._judged = Noise(), False
        self._recipe = replace(self._recipe, slopes=SlopeFilter.PLAIN)
        picture = self._picture(image, sand)
        self._hold(picture, points, np.zeros(count))
        self._state = State(
            position=points.copy(),
            last=points.copy(),
            motion=np.zeros((count, 2)),
            past=[points.copy()],
            reference=np.zeros(count, np.intp),
            params=np.zeros((count, 2, self._recipe.terms)),
            first_zncc=np.full(count, np.nan),
            failures=np.zeros(count, np.intp),
            window=np.full(count, WHOLE, np.intp),
            grey=picture.grey,
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
        extent = next(iter(self._held.values())).picture.sand.shape
        check_images(image, image, sand)
        if image.shape != extent:
            raise CorrelationError(f"the picture is {image.shape}; expected {extent} as in the first frame")
        self._frame += 1
        current = self._picture(image, sand)
        count = len(state.position)
        fit = replace(Fit.empty(count, self._recipe.terms, Status.LOST), params=state.params.copy())
        alive = np.flatnonzero(state.failures <= RETRIES)
        std = np.full(count, np.nan)
        if alive.size:
            self._measure(fit, current, alive, Greys(state.grey, current.grey))
            std[alive] = self._std(fit, alive, current)
        position = self._positions(fit)
        presumed = np.where((fit.status == Status.OK)[:, None], position, state.position + state.motion)
        name_failures(fit, presumed, current.sand, alive, self._recipe.subset)
        self._settle(fit, position, std, alive, current)
        state.grey = current.grey
        bad = fit.status != Status.OK
        position[bad], std[bad] = np.nan, np.nan
        zncc = np.where(np.isin(np.arange(count), alive), fit.zncc, np.nan)
        return FramePoints(position, std, zncc, fit.status)

    def _started(self) -> State:
        if self._state is None:
            raise CorrelationError("the tracker has no points; call start with the first picture")
        return self._state

    def _picture(self, image: NDArray[np.generic], sand: NDArray[np.bool_]) -> Picture:
        whole, usable = whole_grey(image)
        mask = np.ascontiguousarray(np.asarray(sand) & (usable != 0), np.uint8)
        return Picture(whole, spline_coefficients(whole, self._recipe.spline), to_8bit(whole), mask)

    def _hold(self, picture: Picture, position: Floats, std: Floats) -> None:
        """Keep a picture of this frame as a reference."""
        planes = filtered(plain_planes(picture.image, self._recipe.spline), self._recipe.slopes)
        self._held[self._frame] = Reference(self._frame, picture, planes, position.copy(), std.copy())

    def _pair(self, held: Reference, current: Picture) -> Pair:
        known = held.planes, held.picture.sand, current.coefficients, ALL_SEEN
        return Pair(*known, self._recipe, self._workers, self._noise.variance)

    def _measure(self, fit: Fit, current: Picture, alive: NDArray[np.intp], greys: Greys) -> None:
        """Match every living point from the flow, then from its last motion, then from its neighbours'."""
        state = self._started()
        flow = np.zeros_like(state.position)
        flow[alive] = flow_at(greys, state.position[alive])
        if not self._judged:
            self._judge_noise(current, alive, flow)
        whole = alive[state.window[alive] == WHOLE]
        self._try(fit, current, whole, flow[whole])
        for attempt in range(2):
            failed = whole[np.isin(fit.status[whole], (Status.LOW_CORRELATION, Status.NOT_CONVERGED))]
            if failed.size == 0:
                break
            moved = state.motion[failed] if attempt == 0 else self._neighbour_motion(fit, failed)
            known = np.isfinite(moved).all(axis=1)
            self._try(fit, current, failed[known], moved[known])
        self._narrow(fit, current, alive)
        step = self._positions(fit) - state.position
        step[fit.status != Status.OK] = np.nan
        # A point taken up again was presumed elsewhere; its window has its neighbours' motion anyway.
        wrong = outliers(state.position, step) & ((state.failures == 0) | (state.window == WHOLE))
        fit.status[wrong] = Status.OUTLIER

    def _judge_noise(self, current: Picture, alive: NDArray[np.intp], flow: Floats) -> None:
        """Take the noise of the pictures and the filter that suits it from the first pair that tells them."""
        first = self._held[0]
        moved = (self._started().position - first.position + flow)[alive]
        pair, place = self._pair(first, current), first.position[alive]
        found = judge_noise(pair, place, moved, self._settings.noise_grey)
        if found is not None:
            (self._noise, slopes), self._judged = found, True
            self._recipe = replace(self._recipe, slopes=slopes)
            self._held[0] = replace(first, planes=filtered(first.planes, slopes))

    def _narrow(self, fit: Fit, current: Picture, alive: NDArray[np.intp]) -> None:
        """Match points beside shear bands on small windows that move with them."""
        state = self._started()
        whole = state.window == WHOLE
        clean = np.flatnonzero((fit.status == Status.OK) & whole)
        level = Level(noise_level(fit), float(np.percentile(fit.zncc[clean], 75)) if clean.size else 1.0)
        doubtful = np.union1d(suspects(fit, level.residual), np.flatnonzero(~whole))
        left = np.intersect1d(doubtful, alive)
        steps = self._near_steps(fit, np.setdiff1d(clean, left), left)
        failed = (fit.status[left] != Status.OK) | ~whole[left]
        torn = np.isfinite(steps[:, 1, 0]) | failed
        left, steps = left[torn], steps[torn]
        trusted = np.setdiff1d(clean, left)
        same = np.arange(len(shapes_of(self._recipe.subset)[0])) == state.window[left][:, None]
        done = self._windows(fit, current, left, steps, level, same)
        found = left[done]
        left = left[~done]
        for _ in range(ROUNDS):
            steps = self._near_steps(fit, np.union1d(trusted, found), left)
            done = self._windows(fit, current, left, steps, level)
            found, left = np.union1d(found, left[done]), left[~done]
            if left.size == 0 or not done.any():
                break
        good = whole[left] & (fit.status[left] == Status.OK)
        good &= mismatch_px(fit, level.residual)[left] < WHOLE_PX
        torn = np.isfinite(self._near_steps(fit, np.union1d(trusted, found), left)[:, 1, 0])
        fit.status[left[~good & torn]] = Status.SHEARED
        fit.status[left[~good & ~torn & ~whole[left]]] = Status.LOW_CORRELATION

    def _near_steps(self, fit: Fit, known: NDArray[np.intp], index: NDArray[np.intp]) -> Floats:
        """Motions (I, K, 2) of known neighbours since each point was last measured, NaN: no more."""
        state = self._started()
        now = self._positions(fit)
        known = known[fit.status[known] == Status.OK]
        reach = REACH * self._recipe.subset
        out = np.full((index.size, CANDIDATES, 2), np.nan)
        for ago, past in enumerate(reversed(state.past)):
            some = np.flatnonzero(state.failures[index] == ago)
            there = known[np.isfinite(past[known, 0])]
            if some.size == 0:
                continue
            out[some] = motions_about(past[there], (now - past)[there], state.last[index[some]], reach)
        return out

    def _windows(
        self,
        fit: Fit,
        current: Picture,
        index: NDArray[np.intp],
        steps: Floats,
        level: Level,
        kept: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.bool_]:
        """Try windows; keeps what succeeds, and returns for which points it did."""
        state = self._started()
        done = np.zeros(index.size, bool)
        for frame, held in self._held.items():
            some = np.flatnonzero(state.reference[index] == frame)
            if some.size == 0:
                continue
            part = index[some]
            travelled = (state.last[part] - held.position[part])[:, None]
            pair = self._pair(held, current)
            candidates = steps[some] + travelled
            if kept is None:
                greys = Greys(held.picture.grey, current.grey)
                ranks = rank_windows(greys, held.position[part], candidates, self._recipe.subset)
            else:
                ranks = np.where(kept[some, None], np.isfinite(candidates[:, :, :1]) * 2.0 - 1.0, -1.0)
            found = match_windows(pair, held.position[part], candidates, ranks, level)
            torn = torn_between(pair, held.position[part], candidates, found, level)
            good = np.flatnonzero(found.fit.status == Status.OK)
            fit.put(part[good], found.fit.take(good))
            fit.status[part[torn]] = Status.SHEARED
            state.window[part[good]] = found.window[good]
            done[some[good]] = True
        return done

    def _neighbour_motion(self, fit: Fit, failed: NDArray[np.intp]) -> Floats:
        """Median motion since the last frame of the nearest points that were found (F, 2), else NaN."""
        position = self._started().position
        valid = np.flatnonzero(fit.status == Status.OK)
        return median_of_nearest(position[valid], (self._positions(fit) - position)[valid], position[failed])

    def _try(self, fit: Fit, current: Picture, index: NDArray[np.intp], moved: Floats) -> None:
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
            pair = self._pair(held, current)
            new = match(pair, held.position[part], start)
            better = (fit.status[part] != Status.OK) & (
                (new.status == Status.OK) | (fit.status[part] == Status.LOST)
            )
            better &= (new.zncc > fit.zncc[part]) | (fit.status[part] == Status.LOST)
            fit.put(part[better], new.take(np.flatnonzero(better)))
        self._judge(fit)

    def _judge(self, fit: Fit) -> None:
        """Mark points whose correlation is too low against the others and against what chance reaches."""
        judge_correlation(fit, self._settings.zncc_min, self._noise.variance)

    def _positions(self, fit: Fit) -> Floats:
        """Places (N, 2) px that the parameters point to."""
        state = self._started()
        out = np.full_like(state.position, np.nan)
        for frame, held in self._held.items():
            part = np.flatnonzero(state.reference == frame)
            start = held.position[part]
            out[part] = start + displacement_of(fit.params[part], start, self._recipe)
        return out

    def _std(self, fit: Fit, alive: NDArray[np.intp], current: Picture) -> Floats:
        """Standard deviation of a coordinate: this match and what the reference had gathered."""
        state = self._started()
        base = np.array([self._held[f].std[n] for f, n in zip(state.reference[alive], alive, strict=True)])
        # Residuals are alike whichever reference is matched: read them against the one that most points have.
        frames, users = np.unique(state.reference[alive], return_counts=True)
        held = self._held[int(frames[np.argmax(users)])]
        some = alive[state.reference[alive] == held.frame]
        noise = with_correlation(self._noise, self._pair(held, current), held.position[some], fit.take(some))
        own = predict_std(fit.take(alive), noise)
        return np.asarray(np.sqrt(np.mean(own**2, axis=1) + base**2))

    def _settle(
        self,
        fit: Fit,
        position: Floats,
        std: Floats,
        alive: NDArray[np.intp],
        picture: Picture,
    ) -> None:
        """Carry the results into the state, renew references and count failures."""
        state = self._started()
        ok = alive[fit.status[alive] == Status.OK]
        bad = alive[fit.status[alive] != Status.OK]
        presumed = np.nan_to_num(self._neighbour_motion(fit, bad))
        state.motion[ok] = (position[ok] - state.position[ok]) / (1 + state.missed)
        state.position[ok] = state.last[ok] = position[ok]
        seen = np.full_like(position, np.nan)
        seen[ok] = position[ok]
        state.past = [*state.past[-RETRIES:], seen]
        state.params[ok] = fit.params[ok]
        state.failures[ok] = 0
        state.failures[bad] += 1
        # A point that fails is presumed to go with its neighbours until it is taken up again or given up.
        state.position[bad] += presumed
        state.failures[bad[np.isin(fit.status[bad], (Status.OUT_OF_PICTURE, Status.MASKED))]] += RETRIES
        state.missed = 0
        new = ok[np.isnan(state.first_zncc[ok])]
        state.first_zncc[new] = fit.zncc[new]
        worn = ok[fit.zncc[ok] < RENEW * state.first_zncc[ok]]
        self._renew(worn, position, std, ok, picture)

    def _renew(
        self,
        worn: NDArray[np.intp],
        position: Floats,
        std: Floats,
        ok: NDArray[np.intp],
        picture: Picture,
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
        self._hold(picture, there, spread)
        self._rebase(worn, self._frame)

    def _rebase(self, index: NDArray[np.intp], frame: int) -> None:
        """Let points be matched against another held picture, keeping the place where they stand now."""
        state = self._started()
        if index.size == 0:
            return
        held = self._held[frame]
        state.params[index] = 0.0
        # A plain shift to where the point stands now; its gradient is found anew.
        state.params[index, :, 0] = state.position[index] - held.position[index]
        state.reference[index] = frame
        state.first_zncc[index] = np.nan
        state.window[index] = WHOLE
