"""What a test folder holds and what would be measured in it, without changing anything."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ploughval.errors import ConfigError, DataError, Fault, PloughvalError
from ploughval.loadcells import measure_force
from ploughval.photos import Calibration, FrameSeries, calibrate, open_frames
from ploughval.piv import correlate
from ploughval.scene import Scene, Step, load_scene
from ploughval.tracers import PointSet, Sight, Watcher, place_points


@dataclass(frozen=True, slots=True)
class Preview:
    """What was found in a test folder; the picture's parts are None without photographs."""

    name: str
    scene: Scene
    lines: tuple[str, ...]
    image: NDArray[np.generic] | None = None
    calibration: Calibration | None = None
    sight: Sight | None = None
    points: PointSet | None = field(default=None)


def preview(folder: Path | str) -> Preview:
    """Validate a test folder and look at its first photographs and its log.

    Parameters
    ----------
    folder : path-like
        Test folder.

    Returns
    -------
    Preview
        Lines of text to print and what the preview picture shows.

    Raises
    ------
    ConfigError
        All faults of settings, photographs and logs together.
    """
    scene = load_scene(folder)
    lines = [f"{scene.test.name}: steps {', '.join(step.value for step in scene.steps)}"]
    faults: list[Fault] = []
    shown: Preview | None = None
    if Step.CALIBRATION in scene.steps:
        try:
            shown = _photographs(scene, lines)
        except PloughvalError as error:
            faults.append(Fault("photographs", str(error), "photographs that can be measured"))
    if Step.FORCE in scene.steps:
        try:
            _force(scene, lines)
        except PloughvalError as error:
            faults.append(Fault("loadcells", str(error), "a log that can be used"))
    if faults:
        raise ConfigError(scene.source, faults)
    if shown is None:
        return Preview(scene.test.name, scene, tuple(lines))
    return Preview(
        scene.test.name, scene, tuple(lines), shown.image, shown.calibration, shown.sight, shown.points
    )


def _photographs(scene: Scene, lines: list[str]) -> Preview:
    frames = open_frames(scene)
    calibration = calibrate(scene, frames)
    height, width = frames.shape
    lines.append(f"photographs: {len(frames)} of {width} x {height} px, {_times(frames)}")
    lines += [f"  frame {frame}: {reason}" for frame, reason in sorted(frames.faults.items())]
    lines.append(
        f"calibration: {calibration.method}, {calibration.mm_per_px:.5g} mm/px, "
        f"relative std {calibration.scale_std:.2g}, residual {calibration.residual_px:.2g} px"
    )
    lines += _across(calibration)
    image = frames.read(0)
    sight = Watcher(scene, calibration).see(0, image)
    points = None
    if Step.TRACKS in scene.steps:
        points = place_points(sight.sand, calibration, scene)
        lines.append(
            f"points to track: {len(points.px)}, of them on layers: {np.isfinite(points.layer_mm).sum()}"
        )
        lines.append(_first_tracks(scene, frames, image, sight, points))
    return Preview(scene.test.name, scene, (), image, calibration, sight, points)


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


def _times(frames: FrameSeries) -> str:
    known = frames.time_s[np.isfinite(frames.time_s)]
    if not len(known):
        return "times unknown"
    std_s = np.nanmax(frames.time_std_s)
    uncertain = f", standard uncertainty up to {std_s:.2g} s" if std_s > 0 else ""
    return f"from {known[0]:g} to {known[-1]:g} s{uncertain}"


def _first_tracks(
    scene: Scene, frames: FrameSeries, image: NDArray[np.generic], sight: Sight, points: PointSet
) -> str:
    """Correlate the first two readable photographs and say how many points are valid."""
    for frame in range(1, len(frames)):
        try:
            second = frames.read(frame)
        except DataError:
            continue
        piv = scene.piv
        tracks = correlate(
            image,
            second,
            points.px,
            subset=piv.subset_px,
            order=piv.order,
            spline=piv.spline,
            mask=sight.sand,
        )
        share = 100.0 * float(np.mean(tracks.valid)) if len(tracks.valid) else 0.0
        moved = np.linalg.norm(tracks.displacement[tracks.valid], axis=1)
        most = f", largest displacement {moved.max():.1f} px" if len(moved) else ""
        return f"first tracks: frame 0 to {frame}: {share:.0f} % of the points valid{most}"
    return "first tracks: no second photograph can be read"


def _force(scene: Scene, lines: list[str]) -> None:
    force = measure_force(scene)
    record = force.record
    known = record["force_N"].notna()
    lines.append(
        f"load cells: {len(record)} rows, u to {record['u_mm'].max():.2f} mm, force to "
        f"{record.loc[known, 'force_N'].max():.3g} N, "
        f"{'friction compensated' if force.compensated else 'no friction compensation'}"
    )
    lines += [f"  {text}" for text in force.faults]
