"""What the photographs themselves show of direction, blade, depth and scale, against the settings."""

import numpy as np
import pandas as pd

from ploughval.photos import Calibration, FrameSeries
from ploughval.photos.reading.decode import read_header
from ploughval.run.setup.check_findings import Ledger, Level
from ploughval.run.setup.guess_scale import guess_scale
from ploughval.run.setup.guesses import BladeFound, guess
from ploughval.scene import Scene

_FACE_PX, _FACE_DEPTHS = 6.0, 0.06
_DEPTH_SHARE = 0.15
_SCALE_SHARE, _SCALE_STDS = 0.01, 4.0


def check_guesses(
    scene: Scene, frames: FrameSeries, calibration: Calibration, log: pd.DataFrame | None, ledger: Ledger
) -> None:
    """Say where a sure guess contradicts the settings."""
    sound = [k for k in range(len(frames)) if k not in frames.faults]
    pages = frames.pages or (0,) * len(frames)
    bits = read_header(frames.paths[sound[0]]).bits if sound else 8
    found = guess([(frames.paths[k], pages[k]) for k in sound], bits).renumbered(sound)
    blade = found.blade
    if blade is None or not blade.sure:
        return
    if blade.direction != calibration.direction:
        text = (
            f"{calibration.direction}; the blade is seen to go {blade.way_px:.0f} px to the {blade.direction}"
        )
        remedy = "Correct the direction; with control points, the sign of x_mm."
        ledger.note(Level.LOST, "test.toml", "camera.direction", text, str(blade.direction), remedy)
        return
    _check_scale(scene, frames, calibration, log, ledger, blade)
    if blade.frames[0] != 0:  # the first photograph, at rest, cannot be read
        return
    depth_px = scene.blade.depth_mm / calibration.mm_per_px
    tip = calibration.to_px(np.zeros(2))
    if abs(blade.face_px - tip[0]) > max(_FACE_PX, _FACE_DEPTHS * depth_px):
        expected = f"about x = {blade.face_px:.0f} px, where the face of the body that travels is seen"
        ledger.note(Level.LOST, "test.toml", "camera.tip_px", f"x = {tip[0]:.0f} px", expected)
    if found.tip_sure and found.depth_px and abs(found.depth_px - depth_px) > _DEPTH_SHARE * depth_px:
        text = f"{scene.blade.depth_mm:g} mm, which is {depth_px:.0f} px"
        expected = f"about {found.depth_px:.0f} px from the surface at rest to the tip, as it is seen"
        remedy = "Check depth_mm and mm_per_px."
        ledger.note(Level.LOST, "test.toml", "blade.depth_mm", text, expected, remedy)


def _check_scale(
    scene: Scene,
    frames: FrameSeries,
    calibration: Calibration,
    log: pd.DataFrame | None,
    ledger: Ledger,
    blade: BladeFound,
) -> None:
    """The blade's travel in the photographs against that in the log."""
    if log is None or scene.camera is None or scene.camera.times == "video":
        return
    offset = scene.camera.clock_offset_s
    time_s = frames.time_s[blade.frames] - (0.0 if offset == "auto" else offset)
    record = (log["time_s"].to_numpy(float), log["u_mm"].to_numpy(float))
    scale = guess_scale(time_s, blade.travel_px, *record, one_clock=offset != "auto")
    if scale is None or not scale.sure:
        return
    off = scale.mm_per_px / calibration.mm_per_px - 1
    std = float(np.hypot(scale.std / scale.mm_per_px, calibration.scale_std))
    if abs(off) > max(_SCALE_SHARE, _SCALE_STDS * std):
        text = f"{calibration.mm_per_px:.5g} mm/px"
        expected = f"{scale.mm_per_px:.4g} mm/px by the blade's travel in the log (std {scale.std:.1g})"
        remedy = "Check the calibration and the displacement sensor."
        ledger.note(Level.LOST, "test.toml", "camera.mm_per_px", text, expected, remedy)
    if offset != "auto" and scale.clock_offset_s != 0:
        seconds = offset + scale.clock_offset_s
        expected = f'about {seconds:.1f} s, where the blade moves in both, or "auto"'
        ledger.note(Level.LOST, "test.toml", "camera.clock_offset_s", f"{offset:g} s", expected)
