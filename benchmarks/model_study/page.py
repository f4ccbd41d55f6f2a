"""The page of the model study: the numbers that its text names, all read from the tables beside it."""

import math
import re

import numpy as np
import pandas as pd

from model_study import blades_page as blades
from model_study.runs import DEPTH_MM, RULES_TRAVEL_D, TRAVEL_D, directions

Tables = dict[str, pd.DataFrame]
COLUMNS = {
    "history": "",
    "first_peak_K": "first peak K",
    "trough_K": "trough K",
    "trough_u_mm": "at u, mm",
    "switch_K": "switch K",
    "switch_u_mm": "at u, mm",
    "second_trough_K": "second trough K",
    "beta_0_deg": "first band, degrees",
    "beta_1_deg": "second band, degrees",
    "mean_K": "mean K",
}
DECIMALS = {"trough_u_mm": 1, "switch_u_mm": 1, "beta_0_deg": 0, "beta_1_deg": 0}


def fill(template: str, tables: Tables) -> str:
    """The page: sections whose tables are missing left out, every field replaced by its number."""
    there = {"directions": len(directions()) > 1, "virtual": "virtual" in tables}
    values = {**numerical(tables), **physical(tables), **outcrop_rules(tables)}
    values |= blades.inclined(tables) | blades.two_blocks(tables)
    if there["directions"]:
        values.update(direction_rules(tables))
    if there["virtual"]:
        values.update(virtual_run(tables))

    def keep(match: re.Match[str]) -> str:
        return match[2] if there[match[1]] else ""

    text = re.sub(r"<!-- if (\w+) -->\n(.*?)<!-- end -->\n", keep, template, flags=re.DOTALL)
    return text.format_map(values)


def nearest(table: pd.DataFrame, column: str, value: float) -> pd.Series:
    """The row whose column is closest to a value."""
    return table.loc[(table[column] - value).abs().idxmin()]


def numerical(tables: Tables) -> dict[str, object]:
    """Section 1."""
    table, nodes = tables["increments"], tables["nodes"]
    dense = table[table["sand"] == "50/32"]
    default, coarse = (nearest(dense, "increment_d", step) for step in (0.005, 0.05))
    finest = nodes[nodes["increment_d"] == nodes["increment_d"].min()]
    error = finest["by_nodes_switch_u_error_pct"].abs()
    spacing = finest["node_spacing_d"]
    wide = 0.15  # spacing above which single bands are missed
    step16 = nodes[nodes["increment_d"] == 1 / 16]
    power = np.polyfit(np.log(dense["increment_d"]), np.log(dense["force_rms_error_pct"]), 1)[0]
    return {
        "node_most": spacing.max(),
        "node_least": spacing.min(),
        "node_from": spacing[spacing > wide].min(),
        "poly_worst": nodes[["polyline_switch_u_change_pct", "polyline_switch_P_change_pct"]]
        .abs()
        .max()
        .max(),
        "nodes_coarse": error[spacing > wide].max(),
        "nodes_fine": error[spacing <= wide].max(),
        "nodes_step16": abs(nearest(step16, "node_spacing_d", 0.0)["by_nodes_switch_u_error_pct"]),
        "power": power,
        "default_u": default["switch_u_error_pct"],
        "default_P": default["force_rms_error_pct"],
        "default_ms": default["time_ms"],
        "coarse_u": coarse["switch_u_error_pct"],
        "coarse_P": coarse["force_rms_error_pct"],
        "coarse_ms": coarse["time_ms"],
    }


def rule_of(tables: Tables, rule: str, sand: str) -> pd.Series:
    """One line of the table of rules."""
    rules = tables["rules"]
    return rules[(rules["rule"] == rule) & (rules["sand"] == sand)].iloc[0]


def outcrop_rules(tables: Tables) -> dict[str, object]:
    """Section 2."""
    lines = {
        f"{short}_{sand[:2]}": rule_of(tables, rule, sand)
        for short, rule in (("stay", "stationary"), ("ride", "riding"))
        for sand in ("50/32", "36/32")
    }
    values: dict[str, object] = {name: int(line["bands"]) - 1 for name, line in lines.items()}
    values.update({f"{name}_u": line["switch_1_d"] for name, line in lines.items()})
    values.update({f"{name}_mean": line["mean_P_P0"] for name, line in lines.items()})
    return {**values, "rules_travel": RULES_TRAVEL_D}


def direction_rules(tables: Tables) -> dict[str, object]:
    """Section 3."""
    values: dict[str, object] = {}
    for short, rule in (("least", "least_force"), ("soft", "least_softened")):
        line = rule_of(tables, rule, "50/32")
        values |= {f"{short}_beta": line["beta_0_deg"], f"{short}_reach": line["reach_0_d"]}
        values |= {f"{short}_u": line["switch_1_d"], f"{short}_P": line["peak_1_P0"]}
        values |= {f"{short}_mean": line["mean_P_P0"], f"{short}_first": line["first_P_P0"]}
        values[f"{short}_u36"] = rule_of(tables, rule, "36/32")["switch_1_d"]
    shares = [rule_of(tables, rule, "50/32")["switch_1_d"] for rule in ("least_softened", "least_force")]
    return {**values, "soft_share": 100.0 * shares[0] / shares[1]}


def physical(tables: Tables) -> dict[str, object]:
    """Sections 4 and 5."""
    table = tables["influences"]

    def at(parameter: str, value: float, column: str) -> float:
        return float(nearest(table[table["parameter"] == parameter], "value", value)[column])

    def spread(rows: pd.DataFrame, *columns: str) -> float:
        """At least the last digit of the tables."""
        return max(float((rows[list(columns)].max() - rows[list(columns)].min()).max()), 1e-5)

    lengths = [f"length_{k}_d" for k in (1, 2, 3)]
    base = table[table["parameter"] == "depth_mm"].pipe(nearest, "value", DEPTH_MM)
    by = dict(iter(table.groupby("parameter")))
    soft = by["softening_d"]
    flat, beyond = soft[soft["value"] <= base["slip_0_d"]], soft[soft["value"] > base["slip_0_d"]]
    values: dict[str, object] = {f"l{k}": base[f"length_{k}_d"] for k in (1, 2, 3)}
    values |= {f"p{k}": base[f"peak_{k}_P0"] for k in (1, 2, 3)}
    values |= {"t0": base["trough_0_P0"], "slip0": base["slip_0_d"], "travel": TRAVEL_D}
    values |= {
        "grow1": base["length_2_d"] - base["length_1_d"],
        "grow2": base["length_3_d"] - base["length_2_d"],
    }
    named = {"peak": "peak_friction_deg", "res": "residual_friction_deg", "wall": "wall_friction_deg"}
    wanted = {"peak": (34, 54), "res": (24, 48), "wall": (0, 10, 15), "rep": (20, 50)}
    named["rep"] = "repose_deg"
    for short, points in wanted.items():
        values |= {f"{short}{v}": at(named[short], v, "length_1_d") for v in points}
    up, down = by["surface_slope_deg"]["value"].max(), by["surface_slope_deg"]["value"].min()
    values |= {"slope_up": up, "slope_down": down}
    values |= {
        "flat_to": flat["value"].max(),
        "flat_spread": spread(flat, "length_1_d"),
        "long_at": beyond["value"].min(),
        "long_u": beyond.iloc[beyond["value"].argmin()]["length_1_d"],
        "depth_spread": spread(by["depth_mm"], *lengths),
        "gamma_spread": spread(by["unit_weight_kN_m3"], *lengths),
        "slope_up_l2": at("surface_slope_deg", up, "length_2_d"),
        "slope_down_l2": at("surface_slope_deg", down, "length_2_d"),
        "step_up": at("step_height_d", 0.5, "length_1_d"),
        "step_down": at("step_height_d", -0.5, "length_1_d"),
        "t0_p34": at("peak_friction_deg", 34.0, "trough_0_P0"),
        "t0_p54": at("peak_friction_deg", 54.0, "trough_0_P0"),
        "t0_deep": at("depth_mm", 1e4, "trough_0_P0"),
        "t0_3mm": at("depth_mm", 3.0, "trough_0_P0"),
        "t0_1mm": at("depth_mm", 1.0, "trough_0_P0"),
        "p1_wall15": at("wall_friction_deg", 15.0, "peak_1_P0"),
        "P0_wall15": at("wall_friction_deg", 15.0, "P0_N_per_m") / at("wall_friction_deg", 0.0, "P0_N_per_m"),
        "p1_rep20": at("repose_deg", 20.0, "peak_1_P0"),
        "p1_rep50": at("repose_deg", 50.0, "peak_1_P0"),
        "p1_slope10": at("surface_slope_deg", 10.0, "peak_1_P0"),
        "p1_slopem4": at("surface_slope_deg", -4.0, "peak_1_P0"),
    }
    return {**values, **ratio(tables["friction-map"])}


def ratio(table: pd.DataFrame) -> dict[str, object]:
    """Spread of the first switch at one ratio of strengths."""
    near = table[(table["passive_ratio"] - 2.0).abs() < 0.02]
    low, high = near.loc[near["switch_1_d"].idxmin()], near.loc[near["switch_1_d"].idxmax()]
    return {
        "map_runs": len(table),
        "ratio_low": low["switch_1_d"],
        "ratio_high": high["switch_1_d"],
        "ratio_low_peak": low["peak_friction_deg"],
        "ratio_high_peak": high["peak_friction_deg"],
    }


def virtual_run(tables: Tables) -> dict[str, object]:
    """Section 6."""
    table, friction = tables["virtual"].set_index("history"), tables["virtual-friction"]
    speed = tables["virtual-speed"].iloc[0]
    short = {
        "mp": "material points",
        "lf": "least_force",
        "ls": "least_softened",
        "ar": "direction after Arthur",
        "da": "least_force, friction after Davis",
        "bo": "least_softened, friction after Davis",
    }
    values: dict[str, object] = {"virtual_table": markdown(tables["virtual"])}
    for name, line in short.items():
        row = table.loc[line]
        values |= {f"{name}_first": row["first_peak_K"], f"{name}_switch": row["switch_K"]}
        values |= {f"{name}_u": row["switch_u_mm"], f"{name}_mean": row["mean_K"]}
        values[f"{name}_trough"] = row["trough_u_mm"]
        values |= {f"{name}_beta{k}": row[f"beta_{k}_deg"] for k in (0, 1)}
    run, paper = table.loc[short["mp"]], table.loc[short["lf"]]

    def share(line: str, column: str) -> float:
        return 100.0 * (paper[column] - table.loc[short[line], column]) / (paper[column] - run[column])

    slipping = friction[friction["event"] == ""]
    second = friction[(friction["event"] == "") & (friction["u_mm"] > run["switch_u_mm"])]
    event = friction.set_index("event")["friction_deg"]
    first_peak = run["first_peak_K"]
    excess = [speed["peak_excess_square_pct"], speed["peak_excess_linear_pct"]]
    return values | {
        "lf_gap": paper["switch_u_mm"] - run["switch_u_mm"],
        "ls_gap": run["switch_u_mm"] - table.loc[short["ls"], "switch_u_mm"],
        "ls_share": share("ls", "switch_u_mm"),
        "da_share": share("da", "switch_u_mm"),
        "da_shareK": share("da", "switch_K"),
        "davis_peak": speed["davis_peak_deg"],
        "davis_residual": speed["davis_residual_deg"],
        "fr_mean": slipping["friction_deg"].mean(),
        "fr_std": slipping["friction_deg"].std(),
        "fr_first": event["first peak"],
        "fr_second": event["second peak"],
        "settled": second["u_mm"].min(),
        "inertia": speed["steady_inertia_K"],
        "low_excess": excess[0],
        "high_excess": excess[1],
        "fast_excess": speed["faster_peak_excess_pct"],
        "first_low": first_peak * (1.0 - excess[1] / 100.0),
        "first_high": first_peak * (1.0 - excess[0] / 100.0),
    }


def markdown(table: pd.DataFrame) -> str:
    """The readings as a table."""
    lines = ["| " + " | ".join(COLUMNS.values()) + " |", "|---" + "|--:" * (len(COLUMNS) - 1) + "|"]
    for _, row in table.iterrows():
        cells = [str(row["history"])]
        for column in list(COLUMNS)[1:]:
            value = row[column]
            cells.append("" if math.isnan(value) else f"{value:.{DECIMALS.get(column, 2)}f}")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)
