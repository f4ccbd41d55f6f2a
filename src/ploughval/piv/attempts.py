"""One picture of a series: every living point matched, from better and better first guesses."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ploughval.axes import Status
from ploughval.piv.curvature import miss_of_neighbours
from ploughval.piv.guess import Greys, flow_at, median_of_nearest
from ploughval.piv.held import Current, Facing, Reference
from ploughval.piv.precision import Noise, predict_std, with_correlation
from ploughval.piv.references import References
from ploughval.piv.refine import mismatch_px, noise_level, refine, suspects
from ploughval.piv.refuse import ASTRAY_PX
from ploughval.piv.state import State
from ploughval.piv.subsets import Description, Fit, Floats, displacement_of
from ploughval.piv.validate import judge_correlation, neighbours_of, outliers
from ploughval.piv.windows import (
    CANDIDATES,
    REACH,
    WHOLE,
    Level,
    margin_of,
    match_windows,
    motions_about,
    rank_windows,
    shapes_of,
    torn_between,
)

Index = NDArray[np.intp]

SPREAD = 8
"""Times that points which failed are tried again from the motions of neighbours, as long as some succeed."""
FLOW = 16
"""So many that fail still are worth dense flow, whatever succeeded."""
ROUNDS = 2
"""Times that windows are tried, from ever nearer neighbours."""
WHOLE_PX = 0.15
"""Where no window beside a band will do, a whole subset of this mismatch is refused, px."""
MIXED_PX = 0.5
"""A subset whose residuals answer to so much motion holds two, if it moves otherwise than its neighbours."""
LEAST_REFINED = 12
"""Points that share a reference, so that their neighbours can tell bands and curvature."""


class Attempts:
    """Matches the living points of a series in its newest picture.

    Parameters
    ----------
    state : State
        What is known of the points; only ``window`` is changed.
    references : References
    current : Current
        The newest picture.
    alive : (A,) int
        Points that are not lost.
    zncc_min : float
        Least correlation of a valid vector, relative to what is usual.

    Attributes
    ----------
    fit : Fit
        What was matched; status LOST where nothing was.
    """

    def __init__(
        self, state: State, references: References, current: Current, alive: Index, zncc_min: float
    ) -> None:
        self._state, self._references, self._current = state, references, current
        self._alive, self._zncc_min = alive, zncc_min
        self._subset = references.recipe.subset
        empty = Fit.empty(len(state.position), references.recipe.terms, Status.LOST)
        self.fit = Fit(state.params.copy(), empty.stats, empty.status)

    def run(self, expected: Floats) -> None:
        """Match from the motion that is expected (N, 2) px, then from neighbours' and from flow; refine."""
        state, fit = self._state, self.fit
        whole = self._alive[state.window[self._alive] == WHOLE]
        self._try(whole, expected[whole])
        self._try_again(whole)
        self._refine(whole)
        self._narrow()
        self._refuse_mixed()
        now = self.positions()
        now[fit.status != Status.OK] = np.nan
        # A point taken up again was presumed elsewhere; its window has its neighbours' motion anyway.
        wrong = outliers(state.position, now - state.position)
        wrong &= (state.failures == 0) | (state.window == WHOLE)
        if wrong.any():  # unless it was the frame before that was wrong
            wrong &= outliers(state.start, now - state.start)
        fit.status[wrong] = Status.OUTLIER

    def positions(self) -> Floats:
        """Places (N, 2) px that the parameters point to."""
        out = np.full_like(self._state.position, np.nan)
        for held, part in self._by_reference(np.arange(len(out))):
            start = held.position[part]
            out[part] = start + displacement_of(self.fit.params[part], start, self._references.recipe)
        return out

    def std(self) -> Floats:
        """Standard deviation (N,) px of a coordinate: this match and what the reference had gathered.

        docs/theory-sequences.md, Eq. (2).
        """
        out = np.full(len(self.fit.status), np.nan)
        noise = self._noise()
        for held, part in self._by_reference(self._alive):
            own = predict_std(self.fit.take(part), noise)
            out[part] = np.sqrt(np.mean(own**2, axis=1) + held.std[part] ** 2)
        return out

    def neighbour_motion(self, index: Index) -> Floats:
        """Median motion since the last frame of the nearest points that were found (I, 2), else NaN."""
        position = self._state.position
        valid = np.flatnonzero(self.fit.status == Status.OK)
        moved = (self.positions() - position)[valid]
        return median_of_nearest(position[valid], moved, position[index])

    def _by_reference(self, index: Index) -> Iterator[tuple[Reference, Index]]:
        """Points of an index, by the picture that they are matched against."""
        for frame, held in self._references.held.items():
            part = index[self._state.reference[index] == frame]
            if part.size:
                yield held, part

    def _facing(self, held: Reference) -> Facing:
        return self._references.facing(held, self._current)

    def _noise(self) -> Noise:
        """Noise of the pair, with the correlation of residuals.

        They are alike whichever reference is matched, and are read against the one that most points have.
        """
        groups = list(self._by_reference(self._alive))
        held, part = max(groups, key=lambda group: group[1].size)
        facing = self._facing(held)
        inward = facing.inward(self.fit.take(part))
        return with_correlation(self._references.noise, facing.pair, facing.places(part), inward)

    def _failed(self, index: Index) -> Index:
        """Points of an index that another start may help."""
        return index[np.isin(self.fit.status[index], (Status.LOW_CORRELATION, Status.NOT_CONVERGED))]

    def _try(self, index: Index, moved: Floats) -> None:
        """Match points from their last place plus a motion; keeps the better correlation of each."""
        state, fit = self._state, self.fit
        if index.size == 0:
            return
        self._current.reach(state.position[index] + moved, self._references.margin_px)
        motion = np.zeros_like(state.position)
        motion[index] = moved
        for held, part in self._by_reference(index):
            start = state.params[part].copy()
            here = displacement_of(start, held.position[part], self._references.recipe)
            start[:, :, 0] += state.position[part] + motion[part] - held.position[part] - here
            new = self._facing(held).match(part, start)
            first = fit.status[part] == Status.LOST
            better = first | ((fit.status[part] != Status.OK) & (new.status == Status.OK))
            better &= first | (new.zncc > fit.zncc[part])
            fit.put(part[better], new.take(np.flatnonzero(better)))
        judge_correlation(fit, self._zncc_min, self._references.noise.variance)

    def _try_again(self, whole: Index) -> None:
        """Match points that failed from the motions of those about them, outwards; once from dense flow."""
        state, fit, flowed = self._state, self.fit, False
        for _ in range(SPREAD):
            failed = self._failed(whole)
            if failed.size == 0:
                return
            steps = self._near_steps(np.flatnonzero(fit.status == Status.OK), failed)
            moved = steps + (state.last - state.position)[failed][:, None]
            for k in range(CANDIDATES):
                left = (fit.status[failed] != Status.OK) & np.isfinite(steps[:, k, 0])
                self._try(failed[left], moved[left, k])
            left = self._failed(whole)
            stuck = left.size == failed.size
            if left.size and not flowed and (stuck or left.size > FLOW):
                self._try(left, flow_at(Greys(state.grey, self._current.picture.grey), state.position[left]))
                flowed = True
            elif stuck:
                return

    def _refine(self, whole: Index) -> None:
        """Follow curvature and shear bands where whole plain subsets do not describe the motion.

        Where not one of them matched, nothing tells what undisturbed subsets leave: it is another scene.
        """
        if not (self.fit.status[whole] == Status.OK).any():
            return
        for held, part in self._by_reference(whole):
            if part.size < LEAST_REFINED:
                continue
            facing = self._facing(held)
            inward, places = facing.inward(self.fit.take(part)), facing.places(part)
            noise = with_correlation(self._references.noise, facing.pair, places, inward)
            refine(facing.pair, inward, places, self._zncc_min, noise, neighbours_of(places))
            self.fit.put(part, facing.outward(inward))

    def _narrow(self) -> None:
        """Match points beside shear bands on small windows that move with them."""
        state, fit, alive = self._state, self.fit, self._alive
        whole = state.window == WHOLE
        clean = np.flatnonzero((fit.status == Status.OK) & whole)
        moved = (self.positions() - state.position)[clean]
        shapes = shapes_of(self._subset, margin_of(moved))
        usual = float(np.percentile(fit.zncc[clean], 75)) if clean.size else 1.0
        level = Level(noise_level(fit), usual, shapes)
        doubtful = np.union1d(suspects(fit, level.residual), np.flatnonzero(~whole))
        left = np.intersect1d(doubtful, alive)
        steps = self._near_steps(np.setdiff1d(clean, left), left)
        failed = (fit.status[left] != Status.OK) | ~whole[left]
        torn = np.isfinite(steps[:, 1, 0]) | failed
        left, steps = left[torn], steps[torn]
        trusted = np.setdiff1d(clean, left)
        same = np.arange(shapes.sides.size) == state.window[left][:, None]
        done = self._windows(left, steps, level, same)
        found, left = left[done], left[~done]
        for _ in range(ROUNDS):
            steps = self._near_steps(np.union1d(trusted, found), left)
            done = self._windows(left, steps, level)
            found, left = np.union1d(found, left[done]), left[~done]
            if left.size == 0 or not done.any():
                break
        good = whole[left] & (fit.status[left] == Status.OK)
        good &= mismatch_px(fit, level.residual)[left] < WHOLE_PX
        torn = np.isfinite(self._near_steps(np.union1d(trusted, found), left)[:, 1, 0])
        fit.status[left[~good & torn]] = Status.SHEARED
        fit.status[left[~good & ~torn & ~whole[left]]] = Status.LOW_CORRELATION

    def _refuse_mixed(self) -> None:
        """Mark subsets in which two things move: their residuals are not explained, and others go otherwise.

        Sand that changes its looks leaves residuals as well, but goes with its neighbours.
        """
        fit = self.fit
        mixed = (fit.status == Status.OK) & (mismatch_px(fit, noise_level(fit)) > MIXED_PX)
        for held, part in self._by_reference(self._alive):
            if not mixed[part].any():
                continue
            facing = self._facing(held)
            inward, places = facing.inward(fit.take(part)), facing.places(part)
            apart = np.abs(miss_of_neighbours(facing.pair, inward, places, neighbours_of(places)))
            banded = np.isin(fit.description[part], (Description.BAND, Description.SIDE))
            wrong = mixed[part] & (banded | (apart > ASTRAY_PX).any(axis=1))
            fit.status[part[wrong]] = Status.SHEARED

    def _near_steps(self, known: Index, index: Index) -> Floats:
        """Motions (I, K, 2) of known neighbours since each point was last measured, NaN: no more."""
        state = self._state
        now = self.positions()
        known = known[self.fit.status[known] == Status.OK]
        out = np.full((index.size, CANDIDATES, 2), np.nan)
        for ago, past in enumerate(reversed(state.past)):
            some = np.flatnonzero(state.failures[index] == ago)
            there = known[np.isfinite(past[known, 0])]
            if some.size:
                moved, places = (now - past)[there], state.last[index[some]]
                out[some] = motions_about(past[there], moved, places, REACH * self._subset)
        return out

    def _windows(
        self, index: Index, steps: Floats, level: Level, kept: NDArray[np.bool_] | None = None
    ) -> NDArray[np.bool_]:
        """Try windows; keeps what succeeds, and returns for which points it did."""
        state, fit, current = self._state, self.fit, self._current
        done = np.zeros(index.size, bool)
        current.reach((state.last[index][:, None] + steps).reshape(-1, 2), self._references.margin_px)
        for held, part in self._by_reference(index):
            some = np.flatnonzero(np.isin(index, part))
            facing = self._facing(held)
            candidates = steps[some] + (state.last[part] - held.position[part])[:, None]
            if kept is None:
                greys = Greys(held.picture.grey, current.picture.grey)
                ranks = rank_windows(greys, held.position[part], candidates, level.shapes)
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
