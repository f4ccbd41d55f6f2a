"""Rows of camera, lens, exposure, scale and pattern."""

from collections import Counter
from collections.abc import Iterable

import numpy as np

from ploughval.photos import Calibration, FrameSeries
from ploughval.photos.pattern import Pattern
from ploughval.photos.reading.exif import Shot
from ploughval.run.findings import Findings
from ploughval.run.practice.rows import NAN, Group, Row, Source, told, untold
from ploughval.run.walk.noise import curve_from
from ploughval.run.walk.pattern import LEAST_ACROSS, grain_advice
from ploughval.scene import Camera, Scene
from ploughval.tracers.points import spacing_px

CAMERA, PATTERN = Group.CAMERA, Group.PATTERN
_EXPOSED = (
    ("focal_mm", "Focal length", "mm"),
    ("aperture", "Aperture", "f-number"),
    ("exposure_s", "Exposure", "s"),
    ("iso", "Sensitivity", "ISO"),
)


def camera_rows(scene: Scene, found: Findings) -> list[Row]:
    """Camera, lens, exposure, photographs, scale, movement."""
    camera, frames, calibration = scene.camera, found.frames, found.calibration
    if camera is None or frames is None or calibration is None:
        return []
    return [
        *_named(camera, frames.shots),
        *_exposed(camera, frames.shots),
        _stand_off(camera),
        told(CAMERA, "Lighting", camera.lighting, "Add lighting to [camera]."),
        *([Row(CAMERA, "Remark", Source.SETTING, text=camera.note)] if camera.note else []),
        *_photographs(camera, frames),
        *_field(camera, frames, calibration),
        *_scale(calibration),
        *_motion(scene, found, frames, calibration),
        *_movement(found),
    ]


def shot_of(shots: tuple[Shot, ...]) -> Shot:
    """What EXIF says of a series: the words that most photographs hold, and medians of the numbers."""

    def middle(values: Iterable[float | None]) -> float | None:
        known = [value for value in values if value is not None]
        return float(np.median(known)) if known else None

    return Shot(
        make=_most([shot.make for shot in shots]),
        model=_most([shot.model for shot in shots]),
        lens=_most([shot.lens for shot in shots]),
        focal_mm=middle(shot.focal_mm for shot in shots),
        aperture=middle(shot.aperture for shot in shots),
        exposure_s=middle(shot.exposure_s for shot in shots),
        iso=middle(shot.iso for shot in shots),
    )


def _most(values: list[str]) -> str:
    """The value that most frames hold; empty where none does."""
    known = Counter(value for value in values if value)
    return known.most_common(1)[0][0] if known else ""


def _named(camera: Camera, shots: tuple[Shot, ...]) -> list[Row]:
    """Camera and lens: as set, else by EXIF."""
    rows = []
    for item, keys, remedy in (
        ("Camera", ("make", "model"), "Add make and model to [camera]."),
        ("Lens", ("lens",), "Add lens to [camera]."),
    ):
        by_exif = [getattr(shot_of(shots), key) for key in keys]
        as_set = [getattr(camera, key) for key in keys]
        if any(as_set):
            parts, source = [s or e for s, e in zip(as_set, by_exif, strict=True)], Source.SETTING
        else:
            parts, source = by_exif, Source.EXIF
        text = " ".join(part for part in parts if part)
        if len(parts) > 1 and parts[1].startswith(parts[0]):
            text = parts[1]  # makers repeat their name in the model's
        rows.append(Row(CAMERA, item, source, text=text) if text else untold(CAMERA, item, remedy))
    return rows


def _exposed(camera: Camera, shots: tuple[Shot, ...]) -> list[Row]:
    """Focal length, aperture, exposure and sensitivity: as set, else by EXIF."""
    rows = []
    for key, item, unit in _EXPOSED:
        value = getattr(camera, key)
        by_exif = np.array([v for shot in shots if (v := getattr(shot, key)) is not None])
        if value is not None:
            rows.append(Row(CAMERA, item, Source.SETTING, float(value), unit=unit))
        elif by_exif.size:
            low, high = by_exif.min(), by_exif.max()
            note = "" if low == high else f"changes from {low:g} to {high:g} {unit} within the series"
            rows.append(Row(CAMERA, item, Source.EXIF, float(np.median(by_exif)), unit=unit, note=note))
        else:
            rows.append(untold(CAMERA, item, f"Add {key} to [camera].", unit))
    return rows


def _stand_off(camera: Camera) -> Row:
    item = "Lens to window"
    if camera.stand_off_mm is not None:
        return Row(CAMERA, item, Source.SETTING, camera.stand_off_mm, unit="mm")
    if camera.window is not None:
        std = camera.window.distance_std_mm or NAN
        note = "camera.window.distance_mm"
        return Row(CAMERA, item, Source.SETTING, camera.window.distance_mm, std, "mm", note=note)
    return untold(CAMERA, item, "Add stand_off_mm to [camera].", "mm")


def _photographs(camera: Camera, frames: FrameSeries) -> list[Row]:
    height, width = frames.shape
    text = f"{width} x {height} px, {frames.bits} bit, channel {camera.channel}"
    rows = [
        Row(CAMERA, "Photographs", Source.MEASURED, float(len(frames)), unit="1"),
        Row(CAMERA, "Size of a photograph", Source.MEASURED, text=text),
    ]
    step = np.diff(frames.time_s[np.isfinite(frames.time_s)])
    if not step.size:
        remedy = "Add times to [camera]."
        return [*rows, untold(CAMERA, "Interval between photographs", remedy, "s")]
    middle = float(np.median(step))
    std = float(np.nanmedian(frames.time_std_s)) * np.sqrt(2)
    rate = f"{1 / middle:.3g} photographs a second" if middle > 0 else ""
    even = "" if np.ptp(step) < 0.1 * middle else f"; intervals from {step.min():.3g} to {step.max():.3g} s"
    source = Source.SETTING if hasattr(camera.times, "interval_s") else Source.MEASURED
    row = Row(CAMERA, "Interval between photographs", source, middle, std or NAN, "s", note=rate + even)
    return [*rows, row]


def _field(camera: Camera, frames: FrameSeries, calibration: Calibration) -> list[Row]:
    """Field of view through the middle of the picture, or of the part of it that is used."""
    height, width = frames.shape
    x0, y0, x1, y1 = camera.view_px or (0, 0, width, height)
    middle = np.array([(x0 + x1 - 1) / 2, (y0 + y1 - 1) / 2])
    ends = [[x0 - 0.5, middle[1]], [x1 - 0.5, middle[1]], [middle[0], y0 - 0.5], [middle[0], y1 - 0.5]]
    left, right, top, bottom = calibration.to_mm(np.array(ends))
    note = "of view_px" if camera.view_px else ""
    return [
        Row(CAMERA, f"Field of view {way}", Source.MEASURED, float(np.hypot(*(b - a))), unit="mm", note=note)
        for way, a, b in (("across", left, right), ("down", top, bottom))
    ]


def _scale(calibration: Calibration) -> list[Row]:
    std = calibration.mm_per_px * calibration.scale_std
    how = f"at the tip, by {calibration.method}"
    doubt = "" if std > 0 else "; its uncertainty is not told: add mm_per_px_std to [camera]"
    source = Source.MEASURED if len(calibration.points) else Source.SETTING
    rows = [Row(CAMERA, "Scale", source, calibration.mm_per_px, std or NAN, "mm/px", note=how + doubt)]
    if len(calibration.points):
        note = f"rms of {len(calibration.points)} points"
        residual = calibration.residual_px
        rows.append(
            Row(CAMERA, "Residual of the calibration", Source.MEASURED, residual, unit="px", note=note)
        )
    return rows


def _motion(scene: Scene, found: Findings, frames: FrameSeries, calibration: Calibration) -> list[Row]:
    """How far the blade goes from one photograph to the next, and during an exposure."""
    u = found.frame_displacement_mm()
    step = np.diff(u[np.isfinite(u)])
    if not step.size:
        return []
    middle = float(np.median(step))
    note = f"{middle / calibration.mm_per_px:.3g} px"
    rows = [
        Row(CAMERA, "Travel between photographs", Source.MEASURED, middle, unit="mm", note=note),
    ]
    item = "Blur by motion during an exposure"
    exposure = _exposure(scene, frames)
    known = np.isfinite(u) & np.isfinite(frames.time_s)
    pace = np.diff(u[known]) / np.diff(frames.time_s[known]) if known.sum() > 1 else np.empty(0)
    speed = float(np.median(pace)) if pace.size else scene.blade.speed_mm_s
    if exposure is None or speed is None:
        needed = "exposure_s to [camera]" if exposure is None else "speed_mm_s to [blade]"
        return [*rows, untold(CAMERA, item, f"Add {needed}.", "px")]
    blur = exposure * speed / calibration.mm_per_px
    how = f"exposure times {speed:.3g} mm/s"
    return [*rows, Row(CAMERA, item, Source.MEASURED, blur, unit="px", note=how)]


def _exposure(scene: Scene, frames: FrameSeries) -> float | None:
    assert scene.camera is not None
    if scene.camera.exposure_s is not None:
        return scene.camera.exposure_s
    return shot_of(frames.shots).exposure_s


def _movement(found: Findings) -> list[Row]:
    """The camera's movement since the first photograph that was taken off."""
    item = "Movement of the camera, taken off"
    if found.window is None:
        return []
    shift = np.hypot(found.window.camera[:, 0], found.window.camera[:, 1])
    if not np.isfinite(shift).any():
        return [untold(CAMERA, item, "No photograph told it.", "px")]
    std = float(np.nanmedian(found.window.camera[:, 2])) or NAN
    note = (
        "the largest since the first photograph: knocks, or all that markers tell; slower movement of still "
        "sand is noted beside the photographs"
    )
    return [Row(CAMERA, item, Source.MEASURED, float(np.nanmax(shift)), std, "px", note=note)]


def pattern_rows(scene: Scene, found: Findings) -> list[Row]:
    """The sand's texture: grain size, contrast, noise, and whether subset and scale suit it."""
    if scene.camera is None or found.window is None or found.calibration is None:
        return []
    what = scene.camera.pattern
    source = Source.SETTING if what else Source.PROGRAM
    remedy = "" if what else "if grains were dyed or seeded: tell it in camera.pattern"
    rows = [Row(PATTERN, "Pattern", source, text=what or "the sand as it is", note=remedy)]
    pattern = found.pattern()
    if pattern is not None:
        rows += _grains(scene, pattern, found.calibration.mm_per_px)
    noise = curve_from(found.window.noise, found.window.noise_line)
    item = "Noise of the camera"
    if noise is None:
        text = "Needs two photographs that differ, with sand that stays still."
        return [*rows, untold(PATTERN, item, text, "grey levels")]
    grey = float(np.average(noise.grey, weights=noise.count))
    level, std = float(noise.level(np.array(grey))), float(np.median(noise.std_std))
    note = f"at the sand's mean grey of {grey:.3g}, from the difference of two photographs"
    return [*rows, Row(PATTERN, item, Source.MEASURED, level, std, "grey levels", note=note)]


def _grains(scene: Scene, pattern: Pattern, mm_per_px: float) -> list[Row]:
    subset, size, std = scene.piv.subset_px, pattern.size_px, pattern.size_std_px
    if not np.isfinite(size):
        remedy = "The texture is not told from noise, or wider than 64 px: check light, focus and scale."
        return [untold(PATTERN, "Grain size", remedy, "px")]
    squares = f"{pattern.squares} squares of {pattern.side_px} px"
    apart = f"the points stand {spacing_px(scene.piv) / size:.2g} grains apart"
    advice = grain_advice(size, subset) or apart
    how = f"width of the autocorrelation at half its height, {squares} of the first photograph; {advice}"
    scale_note = "without the uncertainty of the scale"
    across, wide = subset / size, pattern.across_px / pattern.down_px
    share = pattern.contrast_grey / pattern.mean_grey
    return [
        Row(PATTERN, "Grain size", Source.MEASURED, size, std, "px", note=how),
        Row(PATTERN, "Grain size in the sand", Source.MEASURED, size * mm_per_px, std * mm_per_px, "mm",
            note=scale_note),
        Row(PATTERN, "Grain size, across over down", Source.MEASURED, wide, unit="1",
            note="" if 0.8 < wide < 1.25 else "far from 1: light from one side, motion blur, or compression"),
        Row(PATTERN, "Grains across a subset", Source.MEASURED, across, across * std / size, "1",
            note="" if across >= LEAST_ACROSS else "fewer than 3: few grains tell one subset from another"),
        Row(PATTERN, "Contrast", Source.MEASURED, pattern.contrast_grey, unit="grey levels",
            note=f"standard deviation of the texture without noise, {100 * share:.0f} % of the mean grey"),
    ]  # fmt: skip
