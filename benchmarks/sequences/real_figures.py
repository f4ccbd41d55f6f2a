"""Pictures of real series with what was found laid over them."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from drawing.png import save_light
from drawing.style import BLUE, GREEN, GREY, ORANGE, VERMILION, style
from ploughval.axes import Status
from ploughval.piv import FramePoints
from ploughval.scene import load_scene

_WALL_FRAMES = (0, 3, 6, 9, 13, 17)


def draw_wall(folder: Path, results: Path, path: Path) -> None:
    """Wall, surface and dark layer over six photographs."""
    scene = load_scene(folder)
    assert scene.camera is not None
    assert scene.camera.mm_per_px is not None
    assert scene.camera.tip_px is not None
    scale, (x0, y0) = scene.camera.mm_per_px, scene.camera.tip_px
    tables = {name: pd.read_csv(results / f"{name}.csv") for name in ("blade", "surface", "layers")}
    with style():
        figure = Figure(figsize=(10.4, 9.0), layout="constrained")
        for ax, frame in zip(figure.subplots(6, 1), _WALL_FRAMES, strict=True):
            picture = cv2.imread(str(sorted((folder / "photos").iterdir())[frame]))
            ax.imshow(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))
            here = {name: table[table["frame"] == frame] for name, table in tables.items()}
            for name, colour in (("surface", ORANGE), ("layers", BLUE)):
                rows = here[name]
                ax.plot(x0 - rows["x_mm"] / scale, y0 - rows["y_mm"] / scale, color=colour, linewidth=0.9)
            ax.axvline(
                x0 - float(here["blade"]["blade_x_mm"].iloc[0]) / scale, color=VERMILION, linewidth=0.9
            )
            ax.set_xlim(90, 1440)
            ax.set_ylim(200, 25)
            ax.set_title(f"photograph {frame}", fontsize=8)
            ax.set_axis_off()
        save_light(figure, path, dpi=75)


def draw_tracks(
    pictures: Sequence[NDArray[np.generic]],
    points: NDArray[np.float64],
    seen: Sequence[FramePoints],
    path: Path,
    *,
    zoom: float = 1.0,
) -> None:
    """Ways of the points over the last picture: still, moved, and where those that were lost began."""
    place = np.array([points, *(s.position_px for s in seen)])
    ok = seen[-1].status == Status.OK
    height, width = pictures[-1].shape
    inches = min(10.4, width * zoom / 100)
    with style():
        figure = Figure(figsize=(inches, inches * height / width))
        ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        ax.imshow(pictures[-1], cmap="gray")
        ax.plot(*points[~ok].T, "x", color=VERMILION, markersize=3, linewidth=0.6)
        ax.plot(*place[:, ok].transpose(2, 0, 1), color=ORANGE, linewidth=0.7)
        ax.plot(*place[-1, ok].T, ".", color=GREEN, markersize=2)
        ax.set_xlim(0, width)
        ax.set_ylim(height, 0)
        ax.set_axis_off()
        save_light(figure, path, facecolor=GREY)
