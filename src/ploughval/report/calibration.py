"""The chapter on the calibration: residuals, scale across the photograph, uncertainty of a place."""

import numpy as np
from numpy.typing import NDArray

from ploughval.photos import Calibration
from ploughval.report.blocks import Cell, Chapter, Pen, Table, table_of, value_cell
from ploughval.report.figures import PictureMap, residual_figure, scale_figure
from ploughval.report.text import MISSING, number, with_std
from ploughval.results import CalibrationEntry, Results

_NODES = 41


def calibration_chapter(results: Results, pen: Pen) -> Chapter | None:
    """How places in the photograph become millimetres: a short table where only a scale was given."""
    entry, found = results.run.calibration, results.calibration
    if found is None or found.points.empty:
        return None if entry is None else Chapter("calibration", "Calibration", tables=[_short(entry)])
    points = found.points[["px_x", "px_y"]].to_numpy()
    residual = found.points[["residual_x_px", "residual_y_px"]].to_numpy()
    tip_px = found.to_px(np.zeros(2))
    scale, std = maps(found)
    low, high = float(np.nanmin(scale.values)), float(np.nanmax(scale.values))
    drawings = [
        pen.draw(
            residual_figure(points, residual, found.shape, tip_px),
            f"{len(points)} control points with their residuals; rms {number(found.residual_px, 2)} px.",
            "Where the points were read, and where camera and lens put them. Arrows that turn together are a "
            "lens or a point that is wrong; scattered ones are how well the points were read.",
            name="calibration-residuals",
            data=("calibration.json",),
        ),
        pen.draw(
            scale_figure(scale, std, points, found.shape, tip_px),
            f"Scale across the photograph, {number(low, 2)} to {number(high, 2)} per mille off the tip's; "
            f"standard uncertainty of a place up to {number(float(np.nanmax(std.values)), 2)} mm.",
            "Left: millimetres a pixel beside those at the tip. Right: standard uncertainty of a place, "
            "both components together; it grows away from the points.",
            name="calibration-scale",
            data=("calibration.json",),
        ),
    ]
    return Chapter(
        "calibration",
        "Calibration",
        lead=f"{found.method[:1].upper()}{found.method[1:]}.",
        drawings=drawings,
        tables=[_summary(found), table_of(found.points, "Points of the calibration", folded=True)],
    )


def maps(found: Calibration) -> tuple[PictureMap, PictureMap]:
    """Over the photograph: scale beside that at the tip, per mille; standard uncertainty of a place, mm."""
    height, width = found.shape
    x, y = np.linspace(0, width - 1, _NODES), np.linspace(0, height - 1, _NODES)
    px: NDArray[np.float64] = np.stack(np.meshgrid(x, y), axis=-1)
    scale = 1000 * (found.mm_per_px_at(px) / found.mm_per_px - 1)
    return PictureMap(x, y, scale), PictureMap(x, y, np.hypot(*np.moveaxis(found.std_mm(px), -1, 0)))


def _summary(found: Calibration) -> Table:
    rows = [
        *_scale_rows(found.mm_per_px, found.scale_std),
        [Cell("Residual of the points, px rms"), Cell(number(found.residual_px, 3), found.residual_px)],
        [Cell("Standard uncertainty of a coordinate, px"), value_cell(found.std_px, 2)],
    ]
    lens = found.model.lens
    if not lens.straight:
        corner = np.array([[0.0, 0.0], [found.shape[1] - 1.0, 0.0]])
        moved = np.hypot(*(corner - lens.undistort(corner)).T).max()
        rows.append([Cell("Displacement by the lens at the corners, px"), value_cell(float(moved), 3)])
    pane = found.model.pane
    if pane is not None:
        grown = 1000 * pane.thickness_mm / (pane.index * pane.distance_mm)
        rows.append([Cell("Enlargement by the window, ‰"), value_cell(float(grown), 3)])
    return Table("Calibration", ("", ""), rows)


def _short(entry: CalibrationEntry) -> Table:
    rows = [
        [Cell("Method"), Cell(entry.method or MISSING)],
        *_scale_rows(entry.mm_per_px, entry.scale_std or None),  # 0: nobody said how well it is known
    ]
    return Table("Calibration", ("", ""), rows)


def _scale_rows(mm_per_px: float | None, relative_std: float | None) -> list[list[Cell]]:
    std = None if mm_per_px is None or relative_std is None else mm_per_px * relative_std
    return [
        [Cell("Scale at the tip, mm per px"), Cell(with_std(mm_per_px, std), mm_per_px)],
        [
            Cell("Relative standard uncertainty of the scale"),
            Cell("not given" if relative_std is None else number(relative_std, 2), relative_std),
        ],
    ]
