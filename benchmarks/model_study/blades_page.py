"""Numbers that the page of the model study names on inclined blades and on two blocks."""

import numpy as np
import pandas as pd

Tables = dict[str, pd.DataFrame]


def inclined(tables: Tables) -> dict[str, object]:
    """Inclination of the face."""
    table = tables["inclinations"]
    smooth = table[table["wall_friction_deg"] == 0.0].set_index("inclination_deg")
    values: dict[str, object] = {"lean_runs": len(table)}
    for name, angle in (("back50", -50.0), ("back30", -30.0), ("lean0", 0.0), ("ahead20", 20.0)):
        row = smooth.loc[angle]
        values |= {f"{name}_K": row["K0"], f"{name}_l1": row["length_1_d"], f"{name}_p1": row["peak_1_P0"]}
        values |= {f"{name}_beta": row["beta_0_deg"], f"{name}_t0": row["trough_0_P0"]}
    return values


def two_blocks(tables: Tables) -> dict[str, object]:
    """One block and two."""
    table = tables["two-blocks"].set_index(["sand", "wall_friction_deg", "mechanism"])
    values: dict[str, object] = {}
    for wall in (5, 10, 20, 25):
        one, two = (table.loc[("50/32", float(wall), name)] for name in ("one_block", "two_blocks"))
        for key in ("first_K", "trough_K", "switch_1_d", "switch_K", "mean_K"):
            values |= {f"one{wall}_{key}": one[key], f"two{wall}_{key}": two[key]}
            values[f"less{wall}_{key}"] = 100.0 * (1.0 - two[key] / one[key])
        values[f"bent{wall}"] = 100.0 * two["bent_share"]
    rough = tables["two-blocks"].query("wall_friction_deg > 0").groupby("mechanism")["ms"].median()
    values |= {"two_ms": rough["two_blocks"], "one_ms": rough["one_block"]}
    return values | held_joints(tables["two-block-joints"]) | beside_smooth(tables["two-block-smooth"])


def held_joints(table: pd.DataFrame) -> dict[str, object]:
    """How far a joint that is held lasts, and what an interface of peak friction leaves of the saving."""
    values: dict[str, object] = {}
    for wall in (10, 20):
        rows = table[table["wall_friction_deg"] == wall]
        lost = rows[~np.isfinite(rows["held_K"])]
        values[f"held{wall}_u"] = lost["u_d"].iloc[0]
        softened = rows[rows["u_d"] > 0.3]
        saving = softened["one_block_K"] - softened["two_blocks_K"]
        share = 100.0 * (softened["one_block_K"] - softened["strong_interface_K"]) / saving
        at = int(np.argmin(np.abs(softened["u_d"] - 1.0)))
        values |= {f"strong{wall}": share.iloc[at], f"joint{wall}": softened["joint_ahead_d"].iloc[at]}
        values |= {f"joint{wall}_from": softened["joint_ahead_d"].min()}
        values |= {f"joint{wall}_to": softened["joint_ahead_d"].max()}
    return values


def beside_smooth(table: pd.DataFrame) -> dict[str, object]:
    """Two blocks beside a smooth blade."""
    one, two = table.iloc[0], table.iloc[1]
    return {
        "smooth_u1": one["switch_1_d"],
        "smooth_u2": two["switch_1_d"],
        "smooth_K1": one["switch_K"],
        "smooth_K2": two["switch_K"],
    }
