"""Figures of the material-point run: bands over the blade's travel, and findings laid over photographs."""

from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drawing.png import save_light
from drawing.style import BLACK, BLUE, GREEN, ORANGE, VERMILION, save, style
from ploughval.scene import load_scene

_SHOWN_U_MM = (10.0, 24.0, 30.0, 45.0)
_EXTENT_MM = (-12.0, 125.0, -14.0, 68.0)


def draw_bands(true: pd.DataFrame, found: pd.DataFrame, stem: Path) -> None:
    """Place and inclination over the blade's travel: the run's own, and those found in its photographs."""
    with style():
        figure = Figure(figsize=(8.6, 3.6), layout="constrained")
        left, right = figure.subplots(1, 2)
        middle = found["u_mm"] + found["du_mm"] / 2
        seen = found["band"] >= 0
        for ax, value, std, title in (
            (left, "ahead_mm", "ahead_std_mm", "band at 0.8 depths above the tip: ahead of the blade, mm"),
            (right, "beta_deg", "beta_std_deg", "inclination, degrees"),
        ):
            stairs = true[value].to_numpy()
            edges = np.append(true["u0_mm"], true["u1_mm"].iloc[-1])
            ax.stairs(stairs, edges, baseline=None, color=BLACK, label="the run, from its particles")
            ax.errorbar(
                middle[seen],
                found[value][seen],
                yerr=2 * found[std][seen],
                fmt="o",
                color=BLUE,
                markersize=3,
                linewidth=0.8,
                label="found in photographs, two std",
            )
            ax.axvline(25.5, color=VERMILION, linewidth=0.8, linestyle=":")
            ax.set_ylim(0.5 * stairs.min(), 1.2 * stairs.max())
            ax.set_title(title)
            ax.set_xlabel("u, mm")
        left.legend(frameon=False, fontsize=7)
        save(figure, stem)


def draw_overlays(folder: Path, results: Path, path: Path) -> None:
    """Surface, layers and band over photographs at several displacements."""
    blade = pd.read_csv(results / "blade.csv")
    with style():
        figure = Figure(figsize=(10.5, 6.6), layout="constrained")
        for ax, u in zip(figure.subplots(2, 2).flat, _SHOWN_U_MM, strict=True):
            frame = int((blade["u_mm"] - u).abs().argmin())
            _overlay(ax, folder, results, frame)
            ax.set_title(f"u = {blade['u_mm'][frame]:.1f} mm", fontsize=8)
        save_light(figure, path, dpi=90)


def _overlay(ax: Axes, folder: Path, results: Path, frame: int) -> None:
    scene = load_scene(folder)
    assert scene.camera is not None
    scale, (x0, y0) = scene.camera.mm_per_px, scene.camera.tip_px
    image = cv2.imread(str(sorted((folder / "photos").iterdir())[frame]), cv2.IMREAD_GRAYSCALE)
    height, width = image.shape
    rim = (-0.5, width - 0.5, height - 0.5, -0.5)
    extent = [(rim[0] - x0) * scale, (rim[1] - x0) * scale, (y0 - rim[2]) * scale, (y0 - rim[3]) * scale]
    ax.imshow(image, cmap="gray", extent=extent, vmin=0, vmax=255)
    surface = _of(results / "surface.csv", frame)
    ax.plot(surface["x_mm"], surface["y_mm"], color=ORANGE, linewidth=1.0)
    for (_, source), rows in _of(results / "layers.csv", frame).groupby(["layer", "source"]):
        colour = GREEN if source == "tracks" else BLUE
        ax.plot(rows["x_mm"], rows["y_mm"], ".", color=colour, markersize=1.0)
    increments = _of(results / "increments.csv", frame)
    for row in increments[increments["band"] >= 0].itertuples():
        slope = np.tan(np.radians(row.beta_deg))
        ax.plot([row.u_mm, row.outcrop_x_mm], [0, (row.outcrop_x_mm - row.u_mm) * slope], color=VERMILION)
    ax.set_xlim(*_EXTENT_MM[:2])
    ax.set_ylim(*_EXTENT_MM[2:])
    ax.set_aspect("equal")


def _of(path: Path, frame: int) -> pd.DataFrame:
    table = pd.read_csv(path)
    return table[table["frame"] == frame]
