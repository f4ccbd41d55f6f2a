"""The wedge's magenta line, found as a dyed layer, against tracked points and against its colour."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from drawing.png import save_light
from drawing.style import BLUE, ORANGE, style
from ploughval.axes import Status
from ploughval.piv import FramePoints, Tracker
from ploughval.scene import Piv, Tracers
from ploughval.tracers.dye import DyeFollower
from ploughval.tracers.light import LightMeter
from ploughval.tracers.view import View
from sequences.rows import Row, rms

Floats = NDArray[np.float64]

_SPOTS_PX = ((0, 43.8), (35, 42.0), (60, 38.7), (100, 33.5), (150, 27.3), (200, 17.5), (233, 8.0))
_THICKNESS_PX = 4.0
_HEIGHT_MM = 100.0  # the name of the line
_READ = (
    (6, 60),
    (112, 175),
)  # columns; between them a brown patch hides the line, beyond it leaves the picture


@dataclass(frozen=True, slots=True)
class Plain:
    """One millimetre a pixel, y up from the lowest row."""

    height: int
    mm_per_px: float = 1.0

    def to_mm(self, px: Floats) -> Floats:
        """Pixels to millimetres."""
        px = np.asarray(px, float)
        return np.stack([px[..., 0], self.height - 1 - px[..., 1]], axis=-1)

    def to_px(self, mm: Floats) -> Floats:
        """Millimetres to pixels."""
        return self.to_mm(mm)


def line_by_colour(picture: NDArray[np.uint8], about: Floats) -> Floats:
    """Row of the line in each column, (W,): the centre, near ``about``, of what is magenta."""
    blue, green, red = cv2.split(picture.astype(np.float64))
    magenta = gaussian_filter1d((red + blue) / 2 - green, 3.0, axis=1)
    rows = np.arange(len(magenta))[:, None]
    near = np.abs(rows - np.clip(about, 0, len(magenta) - 1)) <= 6
    floor = np.where(near, magenta, np.inf).min(axis=0)
    peak = np.where(near, magenta, -np.inf).max(axis=0)
    weight = np.where(near, np.maximum(magenta - (floor + peak) / 2, 0.0), 0.0)
    total = weight.sum(axis=0)
    seen = np.isfinite(total) & (total > 0)  # elsewhere the line has left the picture
    centre = (weight * rows).sum(axis=0) / np.where(seen, total, 1.0)
    return np.where(seen, centre, about)


def dyed_line(folder: Path, picture_to: Path | None) -> list[Row]:
    """Follow the line through twenty photographs."""
    colour = [cv2.imread(str(path)) for path in sorted((folder / "images").glob("*.jpg"))]
    green = [np.ascontiguousarray(picture[..., 1]) for picture in colour]
    columns = np.arange(float(green[0].shape[1]))
    truth = [line_by_colour(colour[0], np.interp(columns, *np.array(_SPOTS_PX, float).T))]
    for picture in colour[1:]:
        smooth = gaussian_filter1d(truth[-1], 8.0)
        truth.append(line_by_colour(picture, smooth - 0.7))
    tracked = _tracked(green, truth[0])
    found = _dyed(green, truth[0], tracked)
    if picture_to is not None:
        _draw(colour[-1], found[-1], tracked[-1].position_px, picture_to / "wedge-line.png")
    return _rows(found, truth, tracked)


def _tracked(pictures: Sequence[NDArray[np.uint8]], line: Floats) -> list[FramePoints]:
    """Points of the line in the first photograph, tracked through the others."""
    columns = np.arange(20.0, 220.0, 4.0)
    points = np.column_stack([columns, np.interp(columns, np.arange(len(line)), line)])
    everywhere = np.ones(pictures[0].shape, np.bool_)
    tracker = Tracker(Piv(subset_px=25))
    tracker.start(pictures[0], points, everywhere)
    return [tracker.advance(picture, everywhere) for picture in pictures[1:]]


def _dyed(
    pictures: Sequence[NDArray[np.uint8]], line: Floats, tracked: Sequence[FramePoints]
) -> list[Floats]:
    """The line as the follower of dyed layers finds it, (K, 2) px in each photograph after the first."""
    shape = pictures[0].shape
    view = View(shape, Plain(shape[0]))
    look = SimpleNamespace(light=np.ones(shape[1]), top=np.full(shape[1], -30.0))
    tracers = Tracers(layers_mm=(_HEIGHT_MM,), dyed=True, thickness_mm=_THICKNESS_PX)
    follower = DyeFollower(view, tracers, pictures[0], look, {_HEIGHT_MM: line})
    meter = LightMeter(pictures[0])
    top, found = np.full(shape[1], -30.0), []
    for picture, points in zip(pictures[1:], tracked, strict=True):
        known = points.position_px[points.status == Status.OK]
        layers = follower.follow(picture, meter.compare(picture), top, -20.0, carried={_HEIGHT_MM: known})
        points_mm = layers[_HEIGHT_MM]
        found.append(Plain(shape[0]).to_px(points_mm[:, :2]))
    return found


def _rows(found: Sequence[Floats], truth: Sequence[Floats], tracked: Sequence[FramePoints]) -> list[Row]:
    columns = np.arange(float(len(truth[0])))
    off, apart = [], []
    for line, true, points in zip(found, truth[1:], tracked, strict=True):
        known = line[np.isfinite(line[:, 0])]
        read = known[_inside(known[:, 0])]
        off.append(read[:, 1] - np.interp(read[:, 0], columns, true))
        ok = points.position_px[points.status == Status.OK]
        ok = ok[_inside(ok[:, 0])]
        if len(known) > 1:
            apart.append(ok[:, 1] - np.interp(ok[:, 0], *known[np.argsort(known[:, 0])].T))
    error, gap = np.concatenate(off), np.concatenate(apart)
    late = np.concatenate(apart[-5:])
    return [
        Row("dyed line, points found", float(len(error)), "1"),
        Row("dyed line against its colour, median |d|", float(np.median(np.abs(error))), "px"),
        Row("dyed line against its colour, 95 %", float(np.quantile(np.abs(error), 0.95)), "px"),
        Row("tracked points of the line against the dyed line, rms", rms(gap), "px"),
        Row("the same in the last five photographs", rms(late), "px"),
    ]


def _inside(column: Floats) -> NDArray[np.bool_]:
    return np.any([(column >= first) & (column < last) for first, last in _READ], axis=0)


def _draw(picture: NDArray[np.uint8], line: Floats, points: Floats, path: Path) -> None:
    height, width = picture.shape[:2]
    with style():
        figure = Figure(figsize=(width / 25, height / 25))
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        ax.imshow(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))
        ax.plot(*line.T, color=BLUE, linewidth=1.2)
        ax.plot(*points.T, "o", color=ORANGE, markersize=2.5)
        ax.set_xlim(0, width)
        ax.set_ylim(height, 0)
        ax.set_axis_off()
        save_light(figure, path)
