"""The photographs of a test as `ploughval check` sees them: files, times, calibration, first frames."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.errors import ConfigError, DataError, PloughvalError
from ploughval.photos import Calibration, FrameSeries, calibrate, open_frames
from ploughval.photos.pattern import Pattern, pattern_of, texture_of
from ploughval.piv import Tracks, correlate
from ploughval.run.doubts import lean_doubt
from ploughval.run.setup.check_findings import Ledger, Level
from ploughval.run.setup.check_guesses import check_guesses
from ploughval.run.setup.check_settings import Settings
from ploughval.run.walk.first_frame import first_frame
from ploughval.run.walk.pattern import grain_advice
from ploughval.run.walk.steadied import FixedMarkers
from ploughval.scene import Scene, Step
from ploughval.tracers import PointSet, Sight, Watcher, place_points

Image = NDArray[np.uint8] | NDArray[np.uint16]
Floats = NDArray[np.float64]

_LEAST_VALID = 0.5  # of the points, in the first photographs
_SMALL = 0.4  # of the usual size of a file
_TO_TRY = 3
_MOST_TRACKS = 1000  # points that are correlated for the preview, chosen evenly


@dataclass(slots=True)
class Seen:
    """What the photographs show; None where it could not be had."""

    frames: FrameSeries | None = None
    image: Image | None = None
    calibration: Calibration | None = None
    sight: Sight | None = None
    points: PointSet | None = None
    tracked_px: Floats = field(default_factory=lambda: np.empty((0, 2)))  # points of the first tracks
    tracks: Tracks | None = None
    markers_px: Floats = field(default_factory=lambda: np.empty((0, 2)))  # where they were found
    missing_px: Floats = field(default_factory=lambda: np.empty((0, 2)))  # where they were sought in vain


def check_photographs(settings: Settings, ledger: Ledger, lines: list[str], log: pd.DataFrame | None) -> Seen:
    """Open the photographs, calibrate, and look at the first ones; ``log``: the force record."""
    scene, seen = settings.scene, Seen()
    if scene.camera is None:
        return seen
    scene, seen.frames = _opened(scene, ledger)
    if seen.frames is None:
        return seen
    if "blade" in settings.sound:
        _say_lean(scene, ledger)
    _say_frames(scene, seen.frames, ledger, lines)
    _say_outside(scene, seen.frames, log, ledger)
    if "camera" in settings.sound:
        seen.calibration = _calibrated(scene, seen.frames, ledger, lines)
    first = _first(scene, seen, log, ledger)
    _try_some(seen.frames, ledger)
    if seen.image is None:
        return seen
    if "camera" in settings.sound:
        _find_markers(scene, seen, ledger, lines)
    if settings.complete and seen.calibration is not None:
        _look(scene, seen, first, ledger, lines)
        check_guesses(scene, seen.frames, seen.calibration, log, ledger)
    return seen


def _opened(scene: Scene, ledger: Ledger) -> tuple[Scene, FrameSeries | None]:
    """The photographs; where times or view are refused, without them, and a scene without them."""
    camera = scene.camera
    assert camera is not None
    for relaxed in ({}, {"times": None}, {"view_px": None}, {"times": None, "view_px": None}):
        if relaxed and all(getattr(camera, key) is None for key in relaxed):
            continue
        try:
            part = scene.model_copy(update={"camera": camera.model_copy(update=relaxed)})
            return part, open_frames(part)
        except PloughvalError as error:
            path = getattr(error, "path", None)
            file = "test.toml" if isinstance(error, ConfigError) or path is None else Path(path).name
            ledger.refuse(error, file, "camera.photos", "a series of photographs that can be measured")
    return scene, None


def _say_lean(scene: Scene, ledger: Ledger) -> None:
    """A blade that leans: the tracers suppose an upright face."""
    text = lean_doubt(scene.blade.inclination_deg)
    if text:
        remedy = (
            "Compare the picture of this check with the photograph; where the face is not found, take "
            "[camera] out: force and model do without it."
        )
        ledger.note(
            Level.LOST, "test.toml", "blade.inclination_deg", text, "an upright blade, 0 degrees", remedy
        )


def _say_frames(scene: Scene, frames: FrameSeries, ledger: Ledger, lines: list[str]) -> None:
    height, width = frames.shape
    lines.append(f"photographs: {len(frames)} of {width} x {height} px, {_times(frames)}")
    table = scene.camera.times_file if scene.camera else None
    for frame, reason in sorted(frames.faults.items()):
        place = f"camera.photos, frame {frame}"
        ledger.note(Level.LOST, frames.name(frame), place, reason, "a photograph that can be used")
    for name in frames.missing:
        expected, remedy = "the photograph", "Copy it into the folder, or take its row out."
        ledger.note(Level.LOST, table or "", "camera.times", f"{name}, which is not there", expected, remedy)
    for text in frames.notes:
        ledger.note(Level.REMARK, "", "camera.photos", text)


def _times(frames: FrameSeries) -> str:
    known = frames.time_s[np.isfinite(frames.time_s)]
    if not len(known):
        return "times unknown"
    std_s = np.nanmax(frames.time_std_s)
    uncertain = f", standard uncertainty up to {std_s:.2g} s" if std_s > 0 else ""
    return f"from {known[0]:g} to {known[-1]:g} s{uncertain}"


def _say_outside(scene: Scene, frames: FrameSeries, log: pd.DataFrame | None, ledger: Ledger) -> None:
    """Photographs before or after the log: no displacement will be known of them."""
    offset = scene.camera.clock_offset_s if scene.camera else 0.0
    if log is None or offset == "auto" or log.empty:
        return
    time_s, start, end = frames.time_s - offset, log["time_s"].iloc[0], log["time_s"].iloc[-1]
    outside = np.flatnonzero((time_s < start) | (time_s > end))
    if outside.size:
        first = frames.name(int(outside[0]))
        text = f"{outside.size} of {len(frames)} photographs lie outside of the log, as {first}"
        expected = f"times from {start + offset:.6g} to {end + offset:.6g} s"
        remedy = 'Check clock_offset_s, or set it to "auto".'
        ledger.note(Level.LOST, "test.toml", "camera.clock_offset_s", text, expected, remedy)


def _calibrated(scene: Scene, frames: FrameSeries, ledger: Ledger, lines: list[str]) -> Calibration | None:
    try:
        calibration = calibrate(scene, frames)
    except PloughvalError as error:
        ledger.refuse(error, "test.toml", "camera", "a calibration that holds")
        return None
    scale = f"{calibration.mm_per_px:.5g} mm/px"
    known = (
        f"relative std {calibration.scale_std:.2g}" if calibration.scale_std > 0 else "its std is not given"
    )
    fit = f", residual {calibration.residual_px:.2g} px" if len(calibration.points) else ""
    lines.append(f"calibration: {calibration.method}, {scale}, {known}{fit}")
    lines += _residuals(calibration) + _across(calibration)
    return calibration


def _residuals(calibration: Calibration) -> list[str]:
    """The points that fit worst."""
    points = calibration.points
    if points.empty:
        return []
    off = np.hypot(*points[["residual_x_px", "residual_y_px"]].to_numpy(float).T)
    worst = np.argsort(-off, kind="stable")[:3]
    said = "; ".join(
        f"{off[k]:.2f} px at ({points['px_x'].iloc[k]:.0f}, {points['px_y'].iloc[k]:.0f})" for k in worst
    )
    return [f"  {len(points)} points, the largest residuals: {said}"]


def _across(calibration: Calibration) -> list[str]:
    """Scale and uncertainty over the photograph, where they differ from place to place."""
    if calibration.points.empty and calibration.model.window is None:
        return []
    height, width = calibration.shape
    x, y = np.meshgrid(np.linspace(0, width - 1, 9), np.linspace(0, height - 1, 9))
    px = np.stack([x, y], axis=-1)
    scale = 1000 * (calibration.mm_per_px_at(px) / calibration.mm_per_px - 1)
    std_mm = np.hypot(*np.moveaxis(calibration.std_mm(px), -1, 0))
    return [
        f"  over the photograph: scale {scale.min():+.1f} to {scale.max():+.1f} per mille of the tip's, "
        f"standard uncertainty of a place {std_mm.min():.2g} to {std_mm.max():.2g} mm"
    ]


def _first(scene: Scene, seen: Seen, log: pd.DataFrame | None, ledger: Ledger) -> int:
    """Number of the photograph that shows the test at rest; it is read."""
    frames, calibration = seen.frames, seen.calibration
    assert frames is not None
    try:
        scale = calibration.mm_per_px if calibration is not None else 1.0
        first = first_frame(scene, frames, scale, lambda: log if calibration is not None else None)
        seen.image = frames.read(first)
        return first
    except DataError as error:
        expected = "a first photograph that can be read: it shows the test at rest"
        ledger.refuse(error, frames.name(0), "camera.photos, frame 0", expected)
    for frame in range(1, len(frames)):
        try:
            seen.image = frames.read(frame)
            return frame
        except DataError:
            continue
    return 0


def _try_some(frames: FrameSeries, ledger: Ledger) -> None:
    """Decode the last photograph, and those whose files are much smaller than is usual: cut short?"""
    sizes = np.array([path.stat().st_size if path.is_file() else 0 for path in frames.paths], float)
    single = not any(frames.pages)
    small = np.flatnonzero(sizes < _SMALL * np.median(sizes)).tolist() if single else []
    for frame in dict.fromkeys([*small[:_TO_TRY], len(frames) - 1]):
        if frame in frames.faults:
            continue
        try:
            frames.read(frame)
        except DataError as error:
            text = str(error).split(f"frame {frame}: ", 1)[-1]
            place, expected = f"camera.photos, frame {frame}", "a photograph that can be decoded in full"
            ledger.note(
                Level.LOST, frames.name(frame), place, text, expected, "Copy it from the camera again."
            )


def _find_markers(scene: Scene, seen: Seen, ledger: Ledger, lines: list[str]) -> None:
    """Painted markers in the first photograph."""
    camera = scene.camera
    if camera is None or camera.markers is None or seen.image is None:
        return
    first = FixedMarkers(camera, seen.image).watch.first
    given = np.array(camera.marker_places_px, float)
    seen.markers_px, seen.missing_px = first.px[first.found], given[~first.found]
    lines.append(f"markers: {int(first.found.sum())} of {len(given)} found")
    points = len(camera.control_points or ())
    for k, why in enumerate(first.reasons):
        if why:
            place = f"camera.control_points.{k}" if k < points else f"camera.markers.fixed_px.{k - points}"
            expected = f"a {camera.markers.kind} of radius {camera.markers.radius_px:g} px"
            ledger.note(Level.LOST, "test.toml", place, why, expected)


def _look(scene: Scene, seen: Seen, first: int, ledger: Ledger, lines: list[str]) -> None:
    """Blade, sand, surface, dyed layers and points of the first photograph, and the first tracks."""
    assert seen.image is not None
    assert seen.calibration is not None
    assert seen.frames is not None
    try:
        seen.sight = Watcher(scene, seen.calibration).see(first, seen.image)
    except PloughvalError as error:
        ledger.refuse(error, "test.toml", "camera", "a photograph in which the test can be seen")
        return
    if scene.camera is not None and scene.camera.markers is not None:
        markers = FixedMarkers(scene.camera, seen.image)
        markers.hide(seen.sight.regions, markers.at_start())
    for text in seen.sight.reasons:
        what, _, why = text.partition(": ")
        partly = what in ("surface", "light")
        ledger.note(Level.REMARK if partly else Level.LOST, seen.frames.name(first), what, why)
    if Step.TRACKS in scene.steps:
        _first_tracks(scene, seen, first, ledger, lines)


def _first_tracks(scene: Scene, seen: Seen, first: int, ledger: Ledger, lines: list[str]) -> None:
    """Place the points, and correlate the first two readable photographs."""
    frames, sight, image = seen.frames, seen.sight, seen.image
    assert frames is not None
    assert sight is not None
    assert image is not None
    assert seen.calibration is not None
    sand = sight.sand
    points = seen.points = place_points(sand, seen.calibration, scene)
    lines.append(
        f"points to track: {len(points.px)}, of them on layers: {np.isfinite(points.layer_mm).sum()}"
    )
    if not len(points.px):
        expected = "sand ahead of the blade: check tip_px, depth_mm, mm_per_px and direction"
        ledger.note(Level.LOST, frames.name(first), "points", "no place for one in the sand", expected)
        return
    _say_grains(scene, frames.name(first), pattern_of(texture_of(image, sand)), ledger, lines)
    for frame in range(first + 1, len(frames)):
        try:
            second = frames.read(frame)
        except DataError:
            continue
        piv = scene.piv
        options: dict[str, Any] = {"subset": piv.subset_px, "order": piv.order, "spline": piv.spline}
        seen.tracked_px = points.px[:: -(-len(points.px) // _MOST_TRACKS)]
        seen.tracks = correlate(image, second, seen.tracked_px, mask=sand, **options)
        lines.append(_tracks_text(seen.tracks, first, frame))
        share = float(np.mean(seen.tracks.valid))
        if share < _LEAST_VALID:
            text = f"{100 * share:.0f} % of the points can be followed to frame {frame}"
            remedy = "Is the sand's texture seen? Try a larger piv.subset_px, or piv.track = false."
            ledger.note(Level.LOST, frames.name(frame), "first tracks", text, "most of them", remedy)
        return
    ledger.note(Level.LOST, "", "camera.photos", "no second photograph that can be read", "at least two")


def _say_grains(scene: Scene, name: str, pattern: Pattern | None, ledger: Ledger, lines: list[str]) -> None:
    """How large the sand's grains are, and whether pixels and subset suit them."""
    if pattern is None:
        return
    subset = scene.piv.subset_px
    if not np.isfinite(pattern.size_px):
        text = "their size is not told from noise, or is beyond 64 px"
        ledger.note(Level.REMARK, name, "grains", text, "a texture that is seen: check light and focus")
        return
    lines.append(
        f"grains: {pattern.size_px:.1f} px wide, {subset / pattern.size_px:.1f} across a subset, contrast "
        f"{pattern.contrast_grey:.3g} at a mean of {pattern.mean_grey:.3g} grey levels"
    )
    advice = grain_advice(pattern.size_px, subset)
    if advice:
        text = f"{pattern.size_px:.1f} px wide; {advice}"
        ledger.note(Level.REMARK, name, "grains", text, f"3 px to a third of the subset, {subset} px")


def _tracks_text(tracks: Tracks, first: int, frame: int) -> str:
    share = 100.0 * float(np.mean(tracks.valid))
    moved = np.linalg.norm(tracks.displacement[tracks.valid], axis=1)
    most = f", largest displacement {moved.max():.1f} px" if len(moved) else ""
    return f"first tracks: frame {first} to {frame}: {share:.0f} % of {len(tracks.valid)} points valid{most}"
