"""Material points tracked through a series; the reference is renewed only where correlation demands it."""

from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ploughval.axes import Status
from ploughval.changing import packed, unpacked
from ploughval.errors import CorrelationError
from ploughval.piv.attempts import Attempts
from ploughval.piv.correlate import check_images, check_points, make_recipe
from ploughval.piv.endings import ENDS, Before, name_failures
from ploughval.piv.guess import Greys, flow_at
from ploughval.piv.held import Current, Picture
from ploughval.piv.movement import CameraMovement
from ploughval.piv.references import RETRIES, References
from ploughval.piv.state import FramePoints, State
from ploughval.piv.subsets import Fit, Floats
from ploughval.piv.windows import WHOLE
from ploughval.scene import Piv

Index = NDArray[np.intp]

LEAST_FOLLOWED = 0.5
"""A picture in which a smaller share of the points is found is of no use: nothing is learned from it."""
LEAST_JUDGED = 8
"""Points from which a picture is judged so."""
_PICTURES = ("grey", "sand")


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
        self._references = References(self._recipe, workers, settings.zncc_min)
        self._frame = 0
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
        self._references = References(self._recipe, self._workers, self._settings.zncc_min)
        picture = Picture.taken(image, sand)
        self._references.hold(0, picture, points, np.zeros(count))
        self._state = State(
            start=points.copy(),
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
            share=np.full(count, np.nan),
            ended=np.full(count, Status.LOST, np.int8),
            shallow=np.zeros(count, bool),
            sand=picture.sand,
            grey=picture.grey,
        )

    @property
    def reference_frames(self) -> tuple[int, ...]:
        """Frames that are held as references, in order."""
        return tuple(sorted(self._references.held))

    def snapshot(self) -> dict[str, Any]:
        """What was learned so far, without the pictures: for :meth:`restore`."""
        state, held = self._started(), self._references.held
        sands = {state.used: state.sand} | {frame: held[frame].picture.sand for frame in held}
        return {
            "frame": self._frame,
            "state": {
                f.name: deepcopy(getattr(state, f.name)) for f in fields(State) if f.name not in _PICTURES
            },
            "references": self._references.snapshot(),
            "sands": {frame: packed(sand) for frame, sand in sands.items()},
        }

    def restore(self, taken: Mapping[str, Any], read: Callable[[int], NDArray[np.generic]]) -> None:
        """Go on from a snapshot of a tracker with the same settings; its arrays become this tracker's own.

        Parameters
        ----------
        taken : mapping
            From :meth:`snapshot`.
        read : callable
            Gives the picture (H, W) of a frame, counted from the first one of the tracker.

        Raises
        ------
        KeyError, TypeError, ValueError
            When it is not such a snapshot.
        """
        pictures = {}
        for frame, sand in taken["sands"].items():
            image = read(frame)
            pictures[frame] = Picture.taken(image, unpacked(sand, image.shape))
        last = pictures[taken["state"]["used"]]
        self._references.restore(taken["references"], pictures)
        self._state = State(**taken["state"], sand=last.sand, grey=last.grey)
        self._frame = taken["frame"]

    def skip(self) -> FramePoints:
        """Pass over a frame that could not be read: every point is FRAME_MISSING."""
        state = self._started()
        self._frame += 1
        state.missed += 1
        status = np.full(len(state.position), Status.FRAME_MISSING, np.int8)
        given_up = state.failures > RETRIES
        status[given_up] = state.ended[given_up]
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
        extent = state.grey.shape
        check_images(image, image, sand)
        if image.shape != extent:
            raise CorrelationError(f"the picture is {image.shape}; expected {extent} as in the first frame")
        self._frame += 1
        if camera is not None:
            state.camera = camera
        alive = np.flatnonzero(state.failures <= RETRIES)
        current = Current(Picture.taken(image, sand), self._recipe.spline)
        attempts = Attempts(state, self._references, current, alive, self._settings.zncc_min)
        expected, std = self._expected(alive, current.picture), np.full(len(state.position), np.nan)
        if alive.size:
            places = (state.position + expected)[alive]
            self._references.judge_noise(current, places, alive, self._settings.noise_grey)
            attempts.run(expected)
            std = attempts.std()
        fit, position = attempts.fit, attempts.positions()
        presumed = np.where((fit.status == Status.OK)[:, None], position, state.position + expected)
        before = Before(state.last, state.sand, state.failures == 0, state.shallow)
        name_failures(fit, presumed, current.picture.sand, alive, self._recipe.subset, before)
        given_up = state.failures > RETRIES
        fit.status[given_up] = state.ended[given_up]
        self._settle(attempts, position, std, alive, current.picture)
        bad = fit.status != Status.OK
        position[bad], std[bad] = np.nan, np.nan
        zncc = np.full(len(std), np.nan)
        zncc[alive] = fit.zncc[alive]
        placed = state.camera.at_first(position)
        return FramePoints(placed, np.hypot(std, state.camera.std_at(placed)), zncc, fit.status)

    def _started(self) -> State:
        if self._state is None:
            raise CorrelationError("the tracker has no points; call start with the first picture")
        return self._state

    def _expected(self, alive: Index, picture: Picture) -> Floats:
        """Motion (N, 2) px since the last picture of use if points go on as before; flow at the start.

        docs/theory-sequences.md, Eq. (1).
        """
        state = self._started()
        by_camera = state.camera.since(state.camera_before, state.position)
        expected = np.nan_to_num(state.motion) * (1 + state.missed) + by_camera
        new = alive[np.isnan(state.motion[alive, 0])]
        if new.size > len(alive) // 2:
            expected[new] = flow_at(Greys(state.grey, picture.grey), state.position[new])
        return expected

    def _settle(
        self, attempts: Attempts, position: Floats, std: Floats, alive: Index, picture: Picture
    ) -> None:
        """Carry the results into the state, renew references and count failures."""
        state, fit = self._started(), attempts.fit
        ok = alive[fit.status[alive] == Status.OK]
        bad = alive[fit.status[alive] != Status.OK]
        if self._of_no_use(fit, alive):
            state.missed, state.unused = state.missed + 1, state.unused + 1
            return
        presumed = np.nan_to_num(attempts.neighbour_motion(bad))
        by_camera = state.camera.since(state.camera_before, state.position[ok])
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
        ending = bad[(state.failures[bad] > RETRIES) & np.isin(fit.status[bad], ENDS)]
        state.ended[ending] = fit.status[ending]
        state.missed = state.unused = 0
        state.grey, state.sand, state.used = picture.grey, picture.sand, self._frame
        self._references.renew_worn(self._frame, picture, fit, state, (ok, position, std))

    def _of_no_use(self, fit: Fit, alive: Index) -> bool:
        """Whether so many points are missed at once that it must be the picture, not the sand."""
        state = self._started()
        followed = alive[state.failures[alive] == 0]
        found = np.count_nonzero(fit.status[followed] == Status.OK)
        few = found < LEAST_FOLLOWED * followed.size and followed.size >= LEAST_JUDGED
        return bool(few and state.unused < RETRIES)
