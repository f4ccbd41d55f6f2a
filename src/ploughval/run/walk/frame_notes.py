"""What is wrong with single photographs: camera knocked, picture poor, doubled or out of order."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ploughval.changing import Changing
from ploughval.piv import CameraMovement
from ploughval.tracers import Sight

DRIFT_PX = 0.3
"""Still sand that creeps by more than this is said, and again when that has doubled."""
TURN_PX = 0.3
"""So is a turn, by what it moves the picture's corners."""
POOR = 0.75
"""Still sand that correlates by less than this share of what is usual in the series makes a picture poor."""
BACK_PX = 1.0
"""A blade that goes back by more than this says that frames are out of order."""


@dataclass(frozen=True, slots=True)
class Noted:
    """What is told of one photograph that was looked at.

    Attributes
    ----------
    frame : int
    texts : tuple of str
        Notes that stand by themselves.
    still : float
        Correlation of its still sand with the first photograph's; NaN: not known.
    missing : tuple of str
        What is wrong with fixed markers.
    """

    frame: int
    texts: tuple[str, ...]
    still: float
    missing: tuple[str, ...]


class FrameNotes(Changing):
    """Notes frame by frame, in order of time.

    Parameters
    ----------
    mm_per_px : float
        Scale of the photographs.
    shape : (H, W), px
    """

    CHANGES = ("_shift", "_step", "_drift_px", "_turn_px", "_blade_mm", "_by_markers")

    def __init__(self, mm_per_px: float, shape: tuple[int, int]) -> None:
        self._mm_per_px, self._reach_px = mm_per_px, math.hypot(*shape) / 2
        self._shift, self._step, self._drift_px, self._turn_px = np.zeros(2), np.zeros(2), DRIFT_PX, TURN_PX
        self._blade_mm = -np.inf
        self._by_markers = 0

    def add(self, frame: int, sight: Sight, camera: CameraMovement, *, doubled: bool) -> Noted:
        """Take in what one photograph shows, for :func:`texts_of` the series."""
        notes = ["the same picture as the frame before"] if doubled else []
        notes += self._camera_moved(camera)
        back = self._blade_mm - sight.blade_x_mm
        if back > BACK_PX * self._mm_per_px:
            notes.append(f"the blade stands {back:.2g} mm behind an earlier frame: are the times in order?")
        if np.isfinite(sight.blade_x_mm):
            self._blade_mm = max(self._blade_mm, sight.blade_x_mm)
        return Noted(frame, tuple(notes), float(camera.zncc), camera.missing)

    def _camera_moved(self, camera: CameraMovement) -> list[str]:
        if camera.markers or self._by_markers:
            return self._told_by_markers(camera)
        notes: list[str] = []
        step = camera.shift_px - self._shift
        if step.any():
            notes.append(f"the camera moved by ({step[0]:+.2f}, {step[1]:+.2f}) px: taken off all places")
        self._shift = camera.shift_px
        drift = float(np.hypot(*camera.drift_px))
        if drift > self._drift_px:
            notes.append(
                f"sand below the tip has crept by {drift:.2f} px since the first frame, or the camera has: "
                "not taken off"
            )
            self._drift_px = 2 * drift
        moves_px = abs(math.radians(camera.turn_deg)) * self._reach_px
        if moves_px > self._turn_px:
            self._turn_px = 2 * moves_px
            notes.append(
                f"the camera is turned by {camera.turn_deg:+.3f} degrees against the first frame, "
                f"{moves_px:.1f} px in the corners: not taken off"
            )
        return notes

    def _told_by_markers(self, camera: CameraMovement) -> list[str]:
        """What fixed markers say: knocks each, creep and turn when they have doubled."""
        notes = []
        if not camera.markers and self._by_markers:
            notes.append("too few fixed markers agree: from here the sand tells the camera's movement")
        self._by_markers = camera.markers
        step, moved = camera.shift_px - self._shift, float(np.hypot(*camera.shift_px))
        knocked = np.hypot(*(step - self._step)) > DRIFT_PX and np.hypot(*step) > DRIFT_PX
        self._shift, self._step = camera.shift_px, step
        turn_px = 0.0 if np.isnan(camera.turn_deg) else abs(math.radians(camera.turn_deg)) * self._reach_px
        if knocked or moved > self._drift_px or turn_px > self._turn_px:
            self._drift_px, self._turn_px = max(self._drift_px, 2 * moved), max(self._turn_px, 2 * turn_px)
            (x, y), turn = camera.shift_px, np.nan_to_num(camera.turn_deg)
            notes.append(
                f"by {camera.markers} fixed markers the camera has moved by ({x:+.2f}, {y:+.2f}) px and "
                f"turned by {turn:+.3f} degrees since the first frame: taken off all places"
            )
        return notes


def texts_of(noted: Sequence[Noted]) -> dict[int, list[str]]:
    """Notes of each frame that has some; lost markers and poor pictures from the whole series."""
    notes = {one.frame: list(one.texts) for one in noted if one.texts}
    seen = [one.frame for one in noted]
    lost: dict[str, list[int]] = {}
    for one in noted:
        for text in one.missing:
            lost.setdefault(text, []).append(one.frame)
    for text, frames in lost.items():
        notes.setdefault(frames[0], []).append(text + _how_long(frames, seen))
    still = {one.frame: one.still for one in noted if math.isfinite(one.still)}
    usual = float(np.median(list(still.values()))) if still else math.nan
    for frame, zncc in still.items():
        if zncc < POOR * usual:
            text = f"still sand correlates with frame 0 at {zncc:.2f} where {usual:.2f} is usual: "
            notes.setdefault(frame, []).append(text + "out of focus, over-exposed or covered?")
    return dict(sorted(notes.items()))


def _how_long(frames: list[int], seen: list[int]) -> str:
    """The rest of a note that would be the same in every one of these frames."""
    if len(frames) == 1:
        return ""
    if seen[-len(frames) :] == frames:
        return ", from here to the end"
    return f" (in {len(frames)} photographs, the last of them frame {frames[-1]})"
