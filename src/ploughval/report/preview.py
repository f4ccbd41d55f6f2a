"""The picture of `ploughval check`, written beside nothing that belongs to the test."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ploughval.errors import ConfigError, DataError, Fault
from ploughval.report.figures import preview_figure
from ploughval.report.figures.style import saved
from ploughval.report.text import slug

if TYPE_CHECKING:
    from ploughval.run.preview import Preview

FORMATS = (".png", ".svg", ".pdf")


def write_preview(found: "Preview", picture: Path | None = None) -> Path:
    """Write the preview of a test folder as a picture.

    Parameters
    ----------
    found : Preview
        What :func:`ploughval.run.preview.preview` saw; it must hold a photograph.
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
    if found.image is None or found.calibration is None:
        raise DataError("the preview holds no photograph to show")
    if picture is None:
        picture = Path(tempfile.mkdtemp(prefix="ploughval-check-")) / f"{slug(found.name)}.png"
    if picture.suffix.lower() not in FORMATS:
        fault = Fault("picture", repr(picture.name), f"a name ending in {', '.join(FORMATS)}")
        raise ConfigError("check", [fault])
    scene, sight, points = found.scene, found.sight, found.points
    figure = preview_figure(
        found.image,
        found.calibration,
        np.empty((0, 2)) if points is None else points.px,
        () if scene.tracers is None else scene.tracers.layers_mm,
        None if sight is None else sight.surface_mm,
        None if scene.camera is None else scene.camera.tip_px,
        sand=None if sight is None else sight.sand,
        extent_x_mm=scene.box.length_mm or 4 * scene.blade.depth_mm,
    )
    return saved(figure, picture)
