"""Material points tracked through a series; the reference is renewed only where correlation demands it."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ploughval.axes import Status
from ploughval.errors import CorrelationError
from ploughval.piv.correlate import check_images, check_points, make_recipe
from ploughval.piv.endings import name_failures
from ploughval.piv.guess import Greys, flow_at, median_of_nearest
from ploughval.piv.held import BORDER_PX, Current, Facing, Picture, Reference
from ploughval.piv.interpolate import SlopeFilter
from ploughval.piv.precision import Noise, judge_noise, predict_std, with_correlation
from ploughval.piv.refine import mismatch_px, noise_level, suspects
from ploughval.piv.state import FramePoints, State
from ploughval.piv.steady import CameraMovement
from ploughval.piv.subsets import Fit, Floats, displacement_of
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

Index = NDArray[np.intp]

RENEW = 0.85
"""A point's reference is renewed when its correlation falls below this share of its first one."""
WORN = 2
"""Frames in a row in which that must be so: one picture out of focus is no reason."""
RETRIES = 3
"""Frames in which a point that failed is tried again before it is given up."""
REFERENCES = 3
"""Pictures held as references."""
ROUNDS = 2
"""Times that windows are tried, from ever nearer neighbours."""
SPREAD = 8
"""Times that points which failed are tried again from the motions of neighbours, as long as some succeed."""
FLOW = 16
"""So many that fail still are worth dense flow."""
WHOLE_PX = 0.15
"""Where no window beside a band will do, a whole subset of this mismatch is refused, px."""
LEAST_FOLLOWED = 0.5
"""A picture in which a smaller share of the points is found is of no use: nothing is learned from it."""
LEAST_JUDGED = 8
"""Points from which a picture is judged so."""


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
        picture = Picture.taken(image, sand)
        self._hold(picture, points, np.zeros(count))
        self._state = State(
            position=points.copy(),
            last=points.copy(),
            motion=np.full((count, 2), np.nan),
            past=[points.copy()],
            reference=np.zeros(count, np.intp),
            params=np.zeros((count, 2, self._recipe.terms)),
            first_zncc=np.full(count, np.nan),
            failures=np.zeros(count, np.intp),
            window=np.full(count, WHOLE, np.intp),
            worn=np.zeros(count, np.intp),
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

    def advance(
        self,
        image: NDArray[np.generic],
        sand: NDArray[np.bool_],
        camera: CameraMovement | None = None,
    ) -> FramePoints:
        """Find the points in the next picture.

        Parameters
        ----------
        image : (H, W) uint8, uint16 or float
            The photograph.
        sand : (H, W) bool
            Its sand.
        camera : CameraMovement, optional
            How the camera has moved since the first picture, where it is known to have moved.

        Returns
        -------
        FramePoints
            Places as the camera stood in the first picture.
        """
        state = self._started()
        extent = next(iter(self._held.values())).picture.image.shape
        check_images(image, image, sand)
        if image.shape != extent:
            raise CorrelationError(f"the picture is {image.shape}; expected {extent} as in the first frame")
        self._frame += 1
        if camera is not None and np.isfinite(camera.shift_px[0]):
            state.camera, state.camera_std = camera.shift_px, camera.std_px if camera.shift_px.any() else 0.0
        current = Current(Picture.taken(image, sand), self._recipe.spline)
        count = len(state.position)
        fit = replace(Fit.empty(count, self._recipe.terms, Status.LOST), params=state.params.copy())
        alive = np.flatnonzero(state.failures <= RETRIES)
        std = np.full(count, np.nan)
        if alive.size:
            self._measure(fit, current, alive)
            std[alive] = self._std(fit, alive, current)
        position = self._positions(fit)
        presumed = np.where((fit.status == Status.OK)[:, None], position, state.position + self._expected())
        name_failures(fit, presumed, current.picture.sand, alive, self._recipe.subset)
        self._settle(fit, position, std, alive, current.picture)
        bad = fit.status != Status.OK
        position[bad], std[bad] = np.nan, np.nan
        zncc = np.where(np.isin(np.arange(count), alive), fit.zncc, np.nan)
        return FramePoints(position - state.camera, np.hypot(std, state.camera_std), zncc, fit.status)

    def _started(self) -> State:
        if self._state is None:
            raise CorrelationError("the tracker has no points; call start with the first picture")
        return self._state

    def _hold(self, picture: Picture, position: Floats, std: Floats) -> None:
        """Keep a picture of this frame as a reference."""
        self._held[self._frame] = Reference.held(self._frame, picture, position, std, self._recipe)

    def _facing(self, held: Reference, current: Current) -> Facing:
        return Facing.of(held, current, self._recipe, self._workers, self._noise.variance)

    def _expected(self) -> Floats:
        """Motion (N, 2) px since the last picture of use if points go on as before; zero where unknown."""
        state = self._started()
        return np.nan_to_num(state.motion) * (1 + state.missed) + state.camera - state.camera_before

    def _measure(self, fit: Fit, current: Current, alive: Index) -> None:
        """Match every living point from its last motion, then from its neighbours', then from dense flow."""
        state = self._started()
        expected = self._expected()
        new = alive[np.isnan(state.motion[alive, 0])]
        if new.size > len(alive) // 2:  # a series starts
            expected[new] = flow_at(Greys(state.grey, current.picture.grey), state.position[new])
        if not self._judged:
            self._judge_noise(current, alive, expected)
        whole = alive[state.window[alive] == WHOLE]
        self._try(fit, current, whole, expected[whole])
        self._try_again(fit, current, whole)
        self._narrow(fit, current, alive)
        step = self._positions(fit) - state.position
        step[fit.status != Status.OK] = np.nan
        # A point taken up again was presumed elsewhere; its window has its neighbours' motion anyway.
        wrong = outliers(state.position, step) & ((state.failures == 0) | (state.window == WHOLE))
        fit.status[wrong] = Status.OUTLIER

    def _try_again(self, fit: Fit, current: Current, whole: Index) -> None:
        """Match points that failed from the motions of those about them, outwards; once from dense flow."""
        state, flowed = self._started(), False
        for _ in range(SPREAD):
            failed = self._failed(fit, whole)
            if failed.size == 0:
                return
            known = np.flatnonzero(fit.status == Status.OK)
            steps = self._near_steps(fit, known, failed)
            for k in range(CANDIDATES):
                left = (fit.status[failed] != Status.OK) & np.isfinite(steps[:, k, 0])
                self._try(
                    fit,
                    current,
                    failed[left],
                    (steps[:, k] + state.last[failed] - state.position[failed])[left],
                )
            left_over = self._failed(fit, whole)
            if left_over.size == failed.size or left_over.size > FLOW:
                if flowed and left_over.size == failed.size:
                    return
                if not flowed and left_over.size:
                    flow = flow_at(Greys(state.grey, current.picture.grey), state.position[left_over])
                    self._try(fit, current, left_over, flow)
                    flowed = True

    def _failed(self, fit: Fit, index: Index) -> Index:
        """Points of an index that another start may help."""
        return index[np.isin(fit.status[index], (Status.LOW_CORRELATION, Status.NOT_CONVERGED))]

    def _judge_noise(self, current: Current, alive: Index, moved: Floats) -> None:
        """Take the noise of the pictures and the filter that suits it from the first pair that tells them."""
        first, state = self._held[0], self._started()
        current.reach((state.position + moved)[alive], self._margin)
        facing = self._facing(first, current)
        start = (state.position + moved - first.position)[alive] + facing.shift
        found = judge_noise(facing.pair, facing.places(alive), start, self._settings.noise_grey)
        if found is not None:
            (self._noise, slopes), self._judged = found, True
            self._recipe = replace(self._recipe, slopes=slopes)
            self._held[0] = first.refiltered(slopes)

    @property
    def _margin(self) -> float:
        """What may be read about the place where a point is expected, px."""
        return 2.0 * self._recipe.subset + BORDER_PX

    def _narrow(self, fit: Fit, current: Current, alive: Index) -> None:
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

    def _near_steps(self, fit: Fit, known: Index, index: Index) -> Floats:
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
        current: Current,
        index: Index,
        steps: Floats,
        level: Level,
        kept: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.bool_]:
        """Try windows; keeps what succeeds, and returns for which points it did."""
        state = self._started()
        done = np.zeros(index.size, bool)
        current.reach((state.last[index][:, None] + steps).reshape(-1, 2), self._margin)
        for frame, held in self._held.items():
            some = np.flatnonzero(state.reference[index] == frame)
            if some.size == 0:
                continue
            part = index[some]
            travelled = (state.last[part] - held.position[part])[:, None]
            facing = self._facing(held, current)
            candidates = steps[some] + travelled
            if kept is None:
                greys = Greys(held.picture.grey, current.picture.grey)
                ranks = rank_windows(greys, held.position[part], candidates, self._recipe.subset)
            else:
                ranks = np.where(kept[some, None], np.isfinite(candidates[:, :, :1]) * 2.0 - 1.0, -1.0)
            inward = facing.places(part), candidates + facing.shift
            found = match_windows(facing.pair, *inward, ranks, level)
            torn = torn_between(facing.pair, *inward, found, level)
            good = np.flatnonzero(found.fit.status == Status.OK)
            fit.put(part[good], facing.outward(found.fit.take(good)))
            fit.status[part[torn]] = Status.SHEARED
            state.window[part[good]] = found.window[good]
            done[some[good]] = True
        return done

    def _neighbour_motion(self, fit: Fit, failed: Index) -> Floats:
        """Median motion since the last frame of the nearest points that were found (F, 2), else NaN."""
        position = self._started().position
        valid = np.flatnonzero(fit.status == Status.OK)
        return median_of_nearest(position[valid], (self._positions(fit) - position)[valid], position[failed])

    def _try(self, fit: Fit, current: Current, index: Index, moved: Floats) -> None:
        """Match points from their last place plus a motion; keeps the better correlation of each."""
        state = self._started()
        if index.size == 0:
            return
        current.reach(state.position[index] + moved, self._margin)
        for frame, held in self._held.items():
            chosen = state.reference[index] == frame
            part = index[chosen]
            if part.size == 0:
                continue
            start = state.params[part].copy()
            here = displacement_of(start, held.position[part], self._recipe)
            start[:, :, 0] += state.position[part] + moved[chosen] - held.position[part] - here
            new = self._facing(held, current).match(part, start)
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

    def _std(self, fit: Fit, alive: Index, current: Current) -> Floats:
        """Standard deviation of a coordinate: this match and what the reference had gathered."""
        state = self._started()
        base = np.array([self._held[f].std[n] for f, n in zip(state.reference[alive], alive, strict=True)])
        # Residuals are alike whichever reference is matched: read them against the one that most points have.
        frames, users = np.unique(state.reference[alive], return_counts=True)
        facing = self._facing(self._held[int(frames[np.argmax(users)])], current)
        some = alive[state.reference[alive] == facing.reference.frame]
        inward = facing.inward(fit.take(some))
        noise = with_correlation(self._noise, facing.pair, facing.places(some), inward)
        own = predict_std(fit.take(alive), noise)
        return np.asarray(np.sqrt(np.mean(own**2, axis=1) + base**2))

    def _settle(self, fit: Fit, position: Floats, std: Floats, alive: Index, picture: Picture) -> None:
        """Carry the results into the state, renew references and count failures."""
        state = self._started()
        ok = alive[fit.status[alive] == Status.OK]
        bad = alive[fit.status[alive] != Status.OK]
        if self._of_no_use(fit, alive):
            state.missed, state.unused = state.missed + 1, state.unused + 1
            return
        presumed = np.nan_to_num(self._neighbour_motion(fit, bad))
        by_camera = state.camera - state.camera_before
        state.motion[ok] = (position[ok] - state.position[ok] - by_camera) / (1 + state.missed)
        state.camera_before = state.camera
        state.position[ok] = state.last[ok] = position[ok]
        seen = np.full_like(position, np.nan)
        seen[ok] = position[ok]
        state.past = [*state.past[-RETRIES:], seen]
        state.params[ok] = fit.params[ok]
        state.failures[ok] = 0
        state.failures[bad] += 1
        # A point that fails is presumed to go with its neighbours until it is taken up again or given up.
        state.position[bad] += presumed
        state.failures[bad[fit.status[bad] == Status.OUT_OF_PICTURE]] += RETRIES
        state.missed = state.unused = 0
        state.grey = picture.grey
        self._renew_worn(fit, position, std, ok, picture)

    def _of_no_use(self, fit: Fit, alive: Index) -> bool:
        """Whether so many points are missed at once that it must be the picture, not the sand."""
        state = self._started()
        followed = alive[state.failures[alive] == 0]
        found = np.count_nonzero(fit.status[followed] == Status.OK)
        few = found < LEAST_FOLLOWED * followed.size and followed.size >= LEAST_JUDGED
        return bool(few and state.unused < RETRIES)

    def _renew_worn(self, fit: Fit, position: Floats, std: Floats, ok: Index, picture: Picture) -> None:
        """Renew the references of points whose correlation has been low for a while."""
        state = self._started()
        new = ok[np.isnan(state.first_zncc[ok])]
        state.first_zncc[new] = fit.zncc[new]
        low = fit.zncc[ok] < RENEW * state.first_zncc[ok]
        state.worn[ok] = np.where(low, state.worn[ok] + 1, 0)
        self._renew(ok[state.worn[ok] >= WORN], position, std, ok, picture)

    def _renew(self, worn: Index, position: Floats, std: Floats, ok: Index, picture: Picture) -> None:
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

    def _rebase(self, index: Index, frame: int) -> None:
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
        state.worn[index] = 0
        state.window[index] = WHOLE
