"""Figures of the model study on the blade: inclination, and one or two blocks beside a rough one."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drawing.style import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION
from model_study.blades import DEPTH_MM, LAYERS_D, SCALE, SHOWN_D
from ploughval.model import History

NAMES = {"one_block": ("one block", BLUE), "two_blocks": ("two blocks", VERMILION)}
Histories = dict[tuple[float, str], History]


def inclinations(table: pd.DataFrame) -> Figure:
    """First force, teeth and heights of the switches against the inclination of the face."""
    figure = Figure(figsize=(10.2, 3.7), layout="constrained")
    force, length, height = figure.subplots(1, 3)
    for wall, line, fill in ((0.0, "-", None), (10.0, ":", "white")):
        rows = table[table["wall_friction_deg"] == wall]
        angle = rows["inclination_deg"]
        force.semilogy(angle, rows["K0"], "o" + line, color=BLUE, mfc=fill, label=f"wall friction {wall:g}°")
        for k, colour, marker in ((1, BLUE, "o"), (2, ORANGE, "s"), (3, GREEN, "^")):
            name = f"tooth {k}, wall friction {wall:g}°"
            length.plot(angle, rows[f"length_{k}_d"], marker + line, color=colour, mfc=fill, label=name)
            name = f"switch {k}, wall friction {wall:g}°"
            height.plot(angle, rows[f"peak_{k}_P0"], marker + line, color=colour, mfc=fill, label=name)
    force.set(title="(a) first force", ylabel="P0 / (unit weight d²/2)", yticks=[3, 5, 10, 20])
    force.yaxis.set_major_formatter("{x:g}")
    force.yaxis.set_minor_formatter("")
    length.set(title="(b) lengths of the teeth", ylabel="displacement, d", ylim=(0, 5))
    height.set(title="(c) forces at the switches", ylabel="force, P0", ylim=(0, 5))
    for ax in (force, length, height):
        ax.axvline(0.0, color=GREY, lw=0.7, ls=(0, (3, 3)), zorder=0)
        ax.set_xlabel("inclination, degrees (positive: over the sand)")
    force.legend(frameon=False, fontsize=7.0, loc="upper left")
    length.legend(frameon=False, fontsize=7.0, loc="upper left")
    return figure


def block_forces(histories: Histories, table: pd.DataFrame) -> Figure:
    """Force of one and of two blocks; first force and first switch against wall friction."""
    figure = Figure(figsize=(10.2, 3.8), layout="constrained")
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.5, 1.0, 1.0))
    for (wall, name), history in histories.items():
        text, colour = NAMES[name]
        u, K = history.marched.rows[:, 0] / DEPTH_MM, history.force["force_N"] / SCALE
        left.plot(
            u, K, color=colour, ls="-" if wall == 20.0 else ":", label=f"{text}, wall friction {wall:g}°"
        )
    left.set(title="(a) force", xlabel="displacement u, d", ylabel="P / (unit weight d²/2)", ylim=(0, 58))
    left.legend(frameon=False, fontsize=7.5, loc="upper left")
    dense = table[table["sand"] == "50/32"]
    for name, (text, colour) in NAMES.items():
        rows = dense[dense["mechanism"] == name]
        middle.plot(rows["wall_friction_deg"], rows["first_K"], "o-", color=colour, label=text)
        right.plot(rows["wall_friction_deg"], rows["switch_1_d"], "o-", color=colour, label=text)
    middle.set(title="(b) first force", ylabel="P / (unit weight d²/2)", ylim=(0, None))
    right.set(title="(c) first switch", ylabel="displacement, d", ylim=(0, None))
    for ax in (middle, right):
        ax.set_xlabel("wall friction angle, degrees")
        ax.legend(frameon=False, fontsize=8.0, loc="upper left")
    return figure


def block_layers(histories: Histories) -> Figure:
    """Layers, surface, bands and interface of one and of two blocks, beside two rough blades."""
    figure = Figure(figsize=(10.2, 5.6), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for ax, letter, ((wall, name), history) in zip(axes.T.flat, "acbd", histories.items(), strict=True):
        _section(ax, history)
        ax.set_title(f"({letter}) {NAMES[name][0]}, wall friction {wall:g}°")
    for ax in axes[1]:
        ax.set_xlabel("x, d")
    for ax in axes[:, 0]:
        ax.set_ylabel("y, d")
    return figure


def _section(ax: Axes, history: History) -> None:
    """One section through the sand at the displacement shown."""
    u = SHOWN_D * DEPTH_MM
    row = history.marched.rows[int(np.searchsorted(history.marched.rows[:, 0], u, side="right")) - 1]
    joint, outcrop = row[8:10] / DEPTH_MM, row[4:6] / DEPTH_MM
    surface = history.surface(u) / DEPTH_MM
    layers = history.layers([h * DEPTH_MM for h in LAYERS_D], [u], [0])
    for k, (_, line) in enumerate(layers.groupby("layer")):
        x, y = line["x_mm"] / DEPTH_MM, line["y_mm"] / DEPTH_MM
        ax.plot(x, y, color=(SKY, GREEN)[k % 2])
    ax.plot(*surface.T, color=BLACK, lw=1.3)
    ax.plot([SHOWN_D, SHOWN_D], [0.0, surface[0, 1] + 0.15], color=BLACK, lw=3.0, solid_capstyle="butt")
    ax.plot([SHOWN_D, joint[0], outcrop[0]], [0.0, joint[1], outcrop[1]], color=VERMILION)
    if joint[0] > SHOWN_D + 1e-9:
        ax.plot([surface[0, 0], joint[0]], [surface[0, 1], joint[1]], color=VERMILION, ls=(0, (4, 2)))
    ax.set(xlim=(1.0, 4.6), ylim=(-0.05, 2.0), aspect="equal")
