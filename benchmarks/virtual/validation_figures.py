"""Figures of the material-point run as an experiment: histories of both sides; errors in their own scale."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from drawing.png import save_light
from drawing.style import BLACK, BLUE, GREY, ORANGE, VERMILION, style
from ploughval.scene import load_scene

_COLOURS = {"least_force": BLUE, "least_softened": VERMILION}
_STAGES_MM = (24.0, 45.0)
_EXTENT_MM = (-10.0, 160.0, -8.0, 62.0)
_PREDICTED = "#56B4E9"
_WIDEST = 12.0  # validation uncertainties that are drawn


def draw_histories(virtual: Path, results: Mapping[str, Path], path: Path) -> None:
    """Force, inclination of the band and friction on it over the travel."""
    first = next(iter(results.values()))
    soil = load_scene(first.parent, files=False).soil
    with style():
        figure = Figure(figsize=(9.0, 7.2), layout="constrained")
        force, beta, friction = figure.subplots(3, 1, sharex=True, height_ratios=(1.3, 1.0, 1.0))
        record = pd.read_csv(first / "force.csv")
        record = record[record["u_mm"] > 0.02]
        force.plot(record["u_mm"], record["force_N"], color=BLACK, lw=1.0, label="material points, cells")
        own = pd.read_csv(next(virtual.glob("*_bands.csv")))
        edges = 1e3 * np.append(own["u0_m"], own["u1_m"].iloc[-1])
        beta.stairs(own["inclination_deg"], edges, baseline=None, color=GREY, label="its own particles")
        seen = pd.read_csv(first / "increments.csv").query("band >= 0")
        beta.errorbar(
            seen["u_mm"] + seen["du_mm"] / 2,
            seen["beta_deg"],
            yerr=2 * seen["beta_std_deg"],
            fmt="o",
            color=BLACK,
            markersize=2.5,
            linewidth=0.7,
            label="photographs, two std",
        )
        for rule, place in results.items():
            model = pd.read_csv(place / "model" / "force.csv")
            force.plot(model["u_mm"], model["force_N"], color=_COLOURS[rule], label=f"model, {rule}")
            beta.plot(model["u_mm"], model["beta_deg"], color=_COLOURS[rule])
        table = pd.read_csv(first / "mobilised.csv").query("status == 'ok'")
        friction.errorbar(
            table["u_mm"],
            table["phi_deg"],
            yerr=2 * table["phi_std_deg"],
            fmt="o",
            color=ORANGE,
            markersize=3,
            linewidth=0.7,
        )
        for level in (soil.peak_friction_deg, soil.residual_friction_deg):
            friction.axhline(level, color=GREY, lw=0.8, ls="--")
        force.set_ylabel("force, N (a metre of width)")
        beta.set_ylabel("inclination of the\nband, degrees")
        beta.set_ylim(10, 60)
        friction.set_ylabel("friction from force,\nband and surface, degrees")
        friction.set_xlabel("u, mm")
        force.legend(frameon=False, fontsize=8)
        beta.legend(frameon=False, fontsize=8)
        _save(figure, path, 85)


def draw_verdicts(metrics: pd.DataFrame, rules: Sequence[str], path: Path) -> None:
    """Error over its standard uncertainty, a row a metric, a mark a rule; the band is what agrees."""
    judged = metrics[[f"{rule} agrees" for rule in rules]].notna().any(axis=1)
    table = metrics[judged]
    rows = np.arange(len(table))[::-1]
    with style():
        figure = Figure(figsize=(7.6, 1.0 + 0.2 * len(table)), layout="constrained")
        ax = figure.subplots()
        ax.axvspan(-2, 2, color="0.92", lw=0)
        ax.axvline(0, color=GREY, lw=0.7)
        for rule, mark, lift in zip(rules, ("o", "s"), (0.16, -0.16), strict=True):
            error = table[f"{rule} error"].astype(float)
            z = (error / table[f"{rule} validation_std"].astype(float)).to_numpy()
            beyond = np.abs(z) > _WIDEST
            ax.plot(
                z.clip(-_WIDEST, _WIDEST), rows + lift, mark, color=_COLOURS[rule], label=rule, clip_on=False
            )
            for value, row in zip(z[beyond], rows[beyond], strict=True):
                side = np.sign(value) * _WIDEST
                ax.annotate(f"{value:.0f}", (side, row + lift), xytext=(-5 * np.sign(value), 0),
                            textcoords="offset points", va="center", fontsize=6.5, color=_COLOURS[rule],
                            ha="right" if value > 0 else "left")  # fmt: skip
        ax.set_yticks(rows, table.index)
        ax.tick_params(axis="y", length=0, labelsize=7)
        ax.grid(axis="y", linewidth=0.3, color="0.9")
        ax.set_xlim(-_WIDEST, _WIDEST)
        ax.set_ylim(-0.8, len(table) - 0.2)
        ax.set_xlabel("E over its standard uncertainty; grey: agrees")
        ax.legend(frameon=False, fontsize=8, loc="lower right")
        _save(figure, path, 85)


def draw_layers(folder: Path, results: Mapping[str, Path], path: Path) -> None:
    """Photographs at two stages, a column a rule: what was measured, and what the model predicts."""
    scene = load_scene(folder, files=False)
    (left, top), scale = scene.camera.tip_px, scene.camera.mm_per_px
    blade = pd.read_csv(next(iter(results.values())) / "blade.csv")
    with style():
        figure = Figure(figsize=(9.0, 4.7), layout="constrained")
        for row, u in zip(figure.subplots(2, 2, sharex=True, sharey=True), _STAGES_MM, strict=True):
            frame = int((blade["u_mm"] - u).abs().argmin())
            grey = cv2.imread(str(folder / "photos" / f"{frame:04d}.png"), cv2.IMREAD_GRAYSCALE)
            small = cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
            height, width = grey.shape
            place = (-left * scale, (width - left) * scale, (top - height) * scale, top * scale)
            for ax, (rule, results_of_rule) in zip(row, results.items(), strict=True):
                ax.imshow(small, cmap="gray", vmin=0, vmax=330, extent=place)
                for table, colour in (("", ORANGE), ("model/", _PREDICTED)):
                    for name in ("layers", "surface"):
                        lines = pd.read_csv(results_of_rule / f"{table}{name}.csv").query(f"frame == {frame}")
                        keys = ["layer", "source"] if name == "layers" else ["frame"]
                        for _, line in lines.groupby(keys):
                            ax.plot(line["x_mm"], line["y_mm"], color=colour, lw=0.9)
                ax.set_xlim(_EXTENT_MM[:2])
                ax.set_ylim(_EXTENT_MM[2:])
                ax.set_ylabel("mm" if rule == next(iter(results)) else "")
                ax.set_title(f"u = {blade['u_mm'][frame]:.1f} mm; blue: model, {rule}; orange: measured")
        _save(figure, path, 75)


def _save(figure: Figure, path: Path, dpi: int) -> None:
    """A PNG of few colours: a quarter of the size."""
    save_light(figure, path, dpi=dpi)
