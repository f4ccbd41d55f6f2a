"""The pictures that points of a series are matched against: frame 0 as long as it will do."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ploughval.piv.held import BORDER_PX, Current, Facing, Picture, Reference
from ploughval.piv.interpolate import SlopeFilter
from ploughval.piv.precision import Noise, judge_noise
from ploughval.piv.state import State
from ploughval.piv.subsets import Fit, Floats, Recipe
from ploughval.piv.validate import usual_zncc
from ploughval.piv.windows import WHOLE

Index = NDArray[np.intp]

RENEW = 0.85
"""A point's reference is renewed when its correlation falls below this share of its first one."""
WORN = 2
"""Frames in a row in which that must be so: one picture out of focus is no reason."""
FALL = 0.03
"""A correlation that fell by more than this share of the usual one since the last frame, and would be as near
to the least one after another such fall, calls for a newer reference at once."""
DIMMER = 0.1
"""A picture whose usual correlation is lower than the last one's by more is poor: no reference is made."""
RETRIES = 3
"""Frames in which a point that failed is tried again before it is given up."""
REFERENCES = 3
"""Pictures held as references."""


class References:
    """References of a series, and how subsets of it are matched.

    Parameters
    ----------
    recipe : Recipe
    workers : int
        Threads.
    zncc_min : float
        Least correlation of a valid vector, relative to what is usual.

    Attributes
    ----------
    held : dict of int -> Reference, by frame
    recipe : Recipe
    noise : Noise of the pictures, once two of them have told it
    """

    def __init__(self, recipe: Recipe, workers: int, zncc_min: float) -> None:
        self.recipe = replace(recipe, slopes=SlopeFilter.PLAIN)
        self.held: dict[int, Reference] = {}
        self.noise, self._judged = Noise(), False
        self._workers, self._zncc_min = workers, zncc_min
        self._usual = 0.0  # correlation in the last picture

    def snapshot(self) -> dict[str, Any]:
        """What was learned so far, without the pictures."""
        return {
            "slopes": self.recipe.slopes,
            "noise": self.noise,
            "judged": self._judged,
            "usual": self._usual,
            "held": {f: (held.position, held.std, held.slopes) for f, held in self.held.items()},
        }

    def restore(self, taken: Mapping[str, Any], pictures: Mapping[int, Picture]) -> None:
        """Go on from a snapshot, with the pictures of the frames that are held."""
        self.held = {}
        for frame, (position, std, slopes) in taken["held"].items():
            recipe = replace(self.recipe, slopes=slopes)
            self.held[frame] = Reference.held(frame, pictures[frame], position, std, recipe)
        self.recipe = replace(self.recipe, slopes=taken["slopes"])
        self.noise, self._judged, self._usual = taken["noise"], taken["judged"], taken["usual"]

    @property
    def margin_px(self) -> float:
        """How far about the place where a point is expected the newest picture may be read, px."""
        return 2.0 * self.recipe.subset + BORDER_PX

    def hold(self, frame: int, picture: Picture, position: Floats, std: Floats) -> None:
        """Keep a picture as a reference: places (N, 2) px of the points in it, std (N,); NaN: not known."""
        self.held[frame] = Reference.held(frame, picture, position, std, self.recipe)

    def facing(self, held: Reference, current: Current) -> Facing:
        """A reference and the newest picture, ready to be matched."""
        return Facing.of(held, current, self.recipe, self._workers, self.noise.variance)

    def judge_noise(self, current: Current, places: Floats, index: Index, given: float | None) -> None:
        """Take the noise of the pictures, and the filter that suits it, from the first pair that tells them.

        ``places`` (I, 2) px: where the points of an index are expected in the newest picture.
        """
        if self._judged:
            return
        first = self.held[0]
        current.reach(places, self.margin_px)
        facing = self.facing(first, current)
        start = places - first.position[index] + facing.shift
        found = judge_noise(facing.pair, facing.places(index), start, given)
        if found is not None:
            (self.noise, slopes), self._judged = found, True
            self.recipe = replace(self.recipe, slopes=slopes)
            self.held[0] = first.refiltered(slopes)

    def renew_worn(
        self, frame: int, picture: Picture, fit: Fit, state: State, found: tuple[Index, Floats, Floats]
    ) -> None:
        """Renew the references of points whose correlation has been low for a while, or is about to fail.

        ``found``: points that were found in this frame, places (N, 2) and std (N,) px of all.
        """
        ok, position, std = found
        new = ok[np.isnan(state.first_zncc[ok])]
        state.first_zncc[new] = fit.zncc[new]
        usual = usual_zncc(fit, self.noise.variance)
        poor = usual < self._usual - DIMMER
        self._usual = max(usual, self._usual - DIMMER)
        if poor:
            return
        low = fit.zncc[ok] < RENEW * state.first_zncc[ok]
        state.worn[ok] = np.where(low, state.worn[ok] + 1, 0)
        worn = ok[(state.worn[ok] >= WORN) | self._failing(fit.zncc[ok] / usual, state, ok)]
        newest = self.held[max(self.held)]
        known = (state.reference[worn] < newest.frame) & np.isfinite(newest.std[worn])
        self._rebase(state, worn[known], newest.frame)
        worn = worn[~known]
        if worn.size == 0:
            return
        there, spread = np.full_like(position, np.nan), np.full_like(std, np.nan)
        there[ok], spread[ok] = position[ok], std[ok]
        if len(self.held) >= REFERENCES:
            worn = np.union1d(worn, self._drop_stale(frame, state, spread))
        self.hold(frame, picture, there, spread)
        self._rebase(state, worn, frame)

    def _failing(self, share: Floats, state: State, ok: Index) -> NDArray[np.bool_]:
        """Which points of an index are about to correlate too little; ``share`` (I,): over what is usual."""
        fall = np.nan_to_num(state.share[ok] - share)
        state.share[ok] = share
        return np.asarray((fall > FALL) & (share - fall < self._zncc_min + FALL))

    def _drop_stale(self, frame: int, state: State, spread: Floats) -> Index:
        """Let go of the reference with the fewest points; returns those of them that the new one knows."""
        users = {f: int(np.sum(state.reference[state.failures <= RETRIES] == f)) for f in self.held}
        stale = min(users, key=lambda f: (users[f], f))
        left = np.flatnonzero((state.reference == stale) & (state.failures <= RETRIES))
        known = np.isfinite(spread[left])
        state.failures[left[~known]] = RETRIES + 1
        del self.held[stale]
        state.reference[state.reference == stale] = frame
        return left[known]

    def _rebase(self, state: State, index: Index, frame: int) -> None:
        """Let points be matched against another held picture, keeping the place where they stand now."""
        if index.size == 0:
            return
        held = self.held[frame]
        state.params[index] = 0.0
        # A plain shift to where the point stands now; its gradient is found anew.
        state.params[index, :, 0] = state.position[index] - held.position[index]
        state.reference[index] = frame
        state.first_zncc[index] = np.nan
        state.worn[index] = 0
        state.share[index] = np.nan
        state.window[index] = WHOLE
