"""The picture of `ploughval check`, written beside nothing that belongs to the test."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ploughval.errors import ConfigError, DataError, Fault
from ploughval.report.figures.preview import Shown, preview_figure
from ploughval.report.figures.style import saved
from ploughval.report.text import slug

if TYPE_CHECKING:
    from ploughval.run.setup.preview import Preview

FORMATS = (".png", ".svg", ".pdf")


def write_preview(found: "Preview", picture: Path | None = None) -> Path:
    """Write the preview of a test folder as a picture.

    Parameters
    ----------
    found : Preview
        What ``ploughval.run.setup.preview.preview`` saw; it must hold a photograph.
    picture : path, optional
        PNG, SVG or PDF file; absent: a PNG in a new temporary folder, for the test folder is not changed.

    Returns
    -------
    Path
        The picture.

    Raises
    ------
    ConfigError
        A format that cannot be written.
    DataError
        No photograph in the preview, or the disk refuses.
    """
    if picture is not None and picture.suffix.lower() not in FORMATS:
        fault = Fault("picture", repr(picture.name), f"a name ending in {', '.join(FORMATS)}")
        raise ConfigError("check", [fault])
    figure = preview_figure(shown_of(found))
    if picture is None:
        picture = Path(tempfile.mkdtemp(prefix="ploughval-check-")) / f"{slug(found.name)}.png"
    return saved(figure, picture)


def shown_of(found: "Preview") -> Shown:
    """What of a preview is drawn.

    Raises
    ------
    DataError
        No photograph in it.
    """
    seen, scene = found.seen, found.scene
    if seen.image is None or scene is None:
        raise DataError("the preview holds no photograph to show")
    camera, calibration = scene.camera, seen.calibration
    moved = np.empty((0, 2))
    if seen.tracks is not None:
        moved = np.where(seen.tracks.valid[:, None], seen.tracks.displacement, np.nan)
    points = None if calibration is None else calibration.points
    given = np.empty((0, 2))
    if calibration is None and camera is not None and camera.control_points:
        given = np.array(camera.control_points, float)[:, :2]
    return Shown(
        image=seen.image,
        calibration=calibration,
        regions=None if seen.sight is None else seen.sight.regions,
        points_px=np.empty((0, 2)) if seen.points is None else seen.points.px,
        tracked_px=seen.tracked_px,
        moved_px=moved,
        layers_mm=() if scene.tracers is None else scene.tracers.layers_mm,
        surface_mm=None if seen.sight is None else seen.sight.surface_mm,
        tip_px=None if camera is None or camera.tip_px is None else np.array(camera.tip_px),
        fitted_px=np.empty((0, 2)) if points is None else points[["px_x", "px_y"]].to_numpy(float),
        residual_px=np.empty((0, 2))
        if points is None
        else points[["residual_x_px", "residual_y_px"]].to_numpy(float),
        given_px=given,
        markers_px=seen.markers_px,
        missing_px=seen.missing_px,
        extent_x_mm=_extent_mm(found),
    )


def _extent_mm(found: "Preview") -> float:
    """How far ahead of the blade there may be sand: to the end of the box, else of the photograph."""
    seen, scene = found.seen, found.scene
    if scene is not None and scene.box.length_mm is not None:
        return scene.box.length_mm
    if seen.image is None or seen.calibration is None:
        return 0.0
    return float(seen.image.shape[1] * seen.calibration.mm_per_px)
