"""Figures of the model study: labels on the lines."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from drawing.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, label

PANELS = {
    "peak_friction_deg": "peak friction angle, degrees",
    "residual_friction_deg": "residual friction angle, degrees",
    "wall_friction_deg": "wall friction angle, degrees",
    "repose_deg": "angle of repose, degrees",
    "softening_d": "softening length, d",
    "depth_mm": "depth d, mm (softening over 1 mm)",
    "surface_slope_deg": "slope of the initial surface, degrees",
    "step_height_d": "step in the surface 2 d ahead, d",
}
FLOOR_PCT = 1e-6  # changes below this are drawn here
LOGARITHMIC = ("softening_d", "depth_mm")
REFERENCE = {
    "peak_friction_deg": 50.0,
    "residual_friction_deg": 32.0,
    "wall_friction_deg": 0.0,
    "repose_deg": 32.0,
    "softening_d": 1.0 / 30.0,
    "depth_mm": 30.0,
    "surface_slope_deg": 0.0,
    "step_height_d": 0.0,
}


def numerics(increments: pd.DataFrame, nodes: pd.DataFrame) -> Figure:
    """Error against increment, node spacing and time."""
    figure = Figure(figsize=(10.2, 3.7), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    styles = {"50/32": (BLUE, "o"), "36/32": (VERMILION, "s")}
    for sand, (colour, marker) in styles.items():
        rows = increments[increments["sand"] == sand]
        left.loglog(rows["increment_d"], rows["switch_u_error_pct"], marker, ls="-", color=colour)
        left.loglog(
            rows["increment_d"], rows["force_rms_error_pct"], marker, ls=":", color=colour, mfc="white"
        )
        right.loglog(rows["time_ms"], rows["switch_u_error_pct"], marker, ls="-", color=colour)
        right.loglog(rows["time_ms"], rows["force_rms_error_pct"], marker, ls=":", color=colour, mfc="white")
    left.axvline(0.005, color=GREY, lw=0.8)
    label(left, 0.005, 1.5, "default\ntolerance", GREY, xytext=(-4, 0), ha="right")
    left.set(title="(a) the increment sets the error", xlabel="increment, d", ylabel="error, %")
    for ax in (left, right):
        ax.plot([], [], "o-", color=BLUE, label="50/32: first switch")
        ax.plot([], [], "o:", color=BLUE, mfc="white", label="50/32: force, rms")
        ax.plot([], [], "s-", color=VERMILION, label="36/32: first switch")
        ax.plot([], [], "s:", color=VERMILION, mfc="white", label="36/32: force, rms")
    left.legend(frameon=False, fontsize=7.5, loc="lower right")
    steps = sorted(nodes["increment_d"].unique(), reverse=True)
    for step, colour, marker, y in zip(
        steps, (SKY, ORANGE, VERMILION), "^so", (4.0, 0.022, 0.003), strict=True
    ):
        rows = nodes[nodes["increment_d"] == step]
        error = rows["by_nodes_switch_u_error_pct"].abs()
        middle.loglog(rows["node_spacing_d"], error, marker, ls="-", lw=0.6, color=colour)
        label(middle, rows["node_spacing_d"].min(), y, f"increment d/{1 / step:.0f}", colour, xytext=(0, 4))
    change = np.maximum(nodes["polyline_switch_u_change_pct"].abs(), FLOOR_PCT)
    middle.loglog(nodes["node_spacing_d"], change, "d", color=BLUE)
    label(
        middle,
        0.012,
        3.0 * FLOOR_PCT,
        "shipped, exact on the polyline: below 10⁻⁶ %",
        BLUE,
        xytext=(0, 6),
    )
    label(middle, 0.012, 60.0, "bands to nodes only, as in the paper:", BLACK, xytext=(0, 0))
    middle.set(
        title="(b) node spacing: no error is left",
        xlabel="node spacing, d",
        ylabel="error of the first switch, %",
        ylim=(0.3 * FLOOR_PCT, 2e2),
    )
    right.set(title="(c) error against time, u = 3.5 d", xlabel="time of one run, ms", ylabel="error, %")
    return figure


def rules(histories: pd.DataFrame) -> Figure:
    """Force and inclination of the band for the two rules of the outcrop."""
    return two_rules(histories, {"stationary": BLUE, "riding": VERMILION}, "outcrop\n")


def direction_rules(histories: pd.DataFrame, names: tuple[str, ...]) -> Figure:
    """Force and inclination of the band for the rules of the direction."""
    return two_rules(histories, dict(zip(names, (BLUE, GREEN, PURPLE), strict=False)), "")


def two_rules(histories: pd.DataFrame, colours: dict[str, str], prefix: str) -> Figure:
    """Force above, inclination of the band below, for two sands."""
    figure = Figure(figsize=(10.2, 4.6), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True, height_ratios=(1.6, 1.0))
    for column, sand in enumerate(("50/32", "36/32")):
        ends = {}
        for rule, colour in colours.items():
            rows = histories[(histories["rule"] == rule) & (histories["sand"] == sand)]
            axes[0, column].plot(rows["u_d"], rows["P_P0"], color=colour)
            axes[1, column].plot(rows["u_d"], rows["beta_deg"], color=colour)
            ends[rule] = rows.iloc[-1]
        order = sorted(ends, key=lambda rule: ends[rule]["P_P0"])
        for place, rule in enumerate(order):
            end, up = ends[rule], 7 if place else -7
            text, colour = prefix + rule.replace("_", " "), colours[rule]
            label(axes[0, column], end["u_d"], end["P_P0"], text, colour, xytext=(4, up))
        order = sorted(ends, key=lambda rule: ends[rule]["beta_deg"])
        for place, rule in enumerate(order):
            end, up = ends[rule], 4 if place else -4
            text, colour = rule.replace("_", " "), colours[rule]
            label(axes[1, column], end["u_d"], end["beta_deg"], text, colour, xytext=(4, up))
        name = "dense sand, 50/32 degrees" if sand == "50/32" else "looser sand, 36/32 degrees"
        axes[0, column].set(title=f"({'ab'[column]}) {name}", xlim=(0, 7.4))
        axes[1, column].set(xlabel="displacement u, d")
    axes[0, 0].set_ylabel("force, P0")
    axes[1, 0].set_ylabel("band angle, degrees")
    return figure


def influences(
    table: pd.DataFrame, lines: dict[str, tuple[str, str, str]], ylabel: str, top: float
) -> Figure:
    """Small multiples: some columns against every parameter; lines: column -> label, colour, marker."""
    figure = Figure(figsize=(10.2, 5.4), layout="constrained")
    axes = figure.subplots(2, 4, sharey=True)
    for k, (name, title) in enumerate(PANELS.items()):
        ax, rows = axes.flat[k], table[table["parameter"] == name]
        for column, (_, colour, marker) in lines.items():
            ax.plot(rows["value"], rows[column], marker, ls="-", color=colour)
        ax.axvline(REFERENCE[name], color=GREY, lw=0.7, ls=(0, (3, 3)), zorder=0)
        if name in LOGARITHMIC:
            ax.set_xscale("log")
        ax.set(xlabel=title, ylim=(0, top))
        ax.text(0.03, 0.98, f"({'abcdefgh'[k]})", transform=ax.transAxes, va="top", fontsize=9)
        if k % 4 == 0:
            ax.set_ylabel(ylabel)
    handles = [axes.flat[0].lines[k] for k in range(len(lines))]
    names = [text for text, _, _ in lines.values()]
    figure.legend(handles, names, loc="outside upper center", ncols=len(lines), frameon=False, fontsize=8.5)
    return figure


def friction_map(table: pd.DataFrame) -> Figure:
    """First switch over the friction angles, and against the ratio of the passive coefficients."""
    figure = Figure(figsize=(10.2, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    grid = table.pivot_table(index="residual_friction_deg", columns="peak_friction_deg", values="switch_1_d")
    x, y = grid.columns.to_numpy(), grid.index.to_numpy()
    levels = np.arange(0.0, 2.21, 0.2)
    filled = left.contourf(x, y, grid.to_numpy(), levels=levels, cmap="cividis")
    drawn = left.contour(x, y, grid.to_numpy(), levels=levels[1:], colors="white", linewidths=0.6)
    left.clabel(drawn, fmt="%.1f", fontsize=7.5)
    left.plot(50.0, 32.0, "o", color=VERMILION, ms=6)
    label(left, 50.0, 32.0, "50/32", BLACK, xytext=(7, 0), fontweight="bold")
    figure.colorbar(filled, ax=left, label="first switch, d")
    left.set(
        title="(a) first switch over both friction angles",
        xlabel="peak friction angle, degrees",
        ylabel="residual friction angle, degrees",
    )
    points = right.scatter(
        table["passive_ratio"],
        table["switch_1_d"],
        c=table["peak_friction_deg"],
        s=3.0,
        cmap="cividis",
        rasterized=True,
    )
    figure.colorbar(points, ax=right, label="peak friction angle, degrees")
    right.set(
        title="(b) mostly the ratio of peak to residual passive force",
        xlabel="passive coefficient at peak / at residual friction",
        ylabel="first switch, d",
        ylim=(0, None),
        xlim=(1, None),
    )
    return figure


VIRTUAL = {
    "material points": ("material points", BLACK, "-"),
    "least_force": ("model, as in the paper", BLUE, "-"),
    "least_softened": ("direction: least softened force", GREEN, "-"),
    "least_force, friction after Davis": ("friction after Davis (1968)", VERMILION, "-"),
    "least_softened, friction after Davis": ("both", ORANGE, "--"),
}


def virtual(histories: pd.DataFrame, mobilised: pd.DataFrame, davis: tuple[float, ...]) -> Figure:
    """The material-point run beside the model: force, and friction mobilised in the run."""
    figure = Figure(figsize=(10.2, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.7, 1.0))
    for name, (text, colour, dash) in VIRTUAL.items():
        rows = histories[histories["history"] == name]
        front = name == "material points"
        left.plot(
            rows["u_mm"],
            rows["K"],
            color=colour,
            ls=dash,
            lw=2.2 if front else 1.3,
            zorder=3 if front else 2,
            label=text,
        )
    left.set(
        title="(a) force",
        xlabel="displacement u, mm",
        ylabel="K = P / (unit weight d² / 2)",
        xlim=(0, 50),
        ylim=(0, 15.5),
    )
    left.legend(frameon=False, fontsize=8, loc="upper left", ncols=2)
    for value, text in ((50.0, "peak, 50"), (32.0, "residual, 32")):
        right.axhline(value, color=GREY, lw=0.8)
        label(right, 50.0, value, text, GREY, xytext=(0, 5), ha="right")
    for value, text in zip(davis, ("peak after Davis", "residual after Davis"), strict=True):
        right.axhline(value, color=PURPLE, lw=0.8, ls="--")
        label(right, 3.0, value, text, PURPLE, xytext=(0, -6))
    plain = mobilised[mobilised["event"] == ""]
    peaks = mobilised[mobilised["event"].isin(["first peak", "second peak"])]
    right.plot(plain["u_mm"], plain["friction_deg"], "o", color=BLACK)
    right.plot(peaks["u_mm"], peaks["friction_deg"], "^", color=VERMILION, ms=6)
    for _, row in peaks.iterrows():
        text = "first peak" if row["event"] == "first peak" else "second band\ntaking over"
        label(
            right,
            row["u_mm"],
            row["friction_deg"],
            text,
            VERMILION,
            xytext=(6, 0),
            va="bottom" if row["u_mm"] < 5.0 else "top",
        )
    right.set(
        title="(b) friction that balances the run's own blocks",
        xlabel="displacement u, mm",
        ylabel="mobilised friction angle, degrees",
        ylim=(24, 53),
        xlim=(-1, 51),
    )
    return figure
