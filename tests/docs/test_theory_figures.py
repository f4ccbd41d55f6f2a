"""Figures that theory pages take from the measured tables are those of the tables."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ploughval.model import simulate
from ploughval.model.blocks import two_block_force
from ploughval.model.mechanism import initial_force
from ploughval.scene import Scene

ROOT = Path(__file__).parents[2]
REPORTS = ROOT / "reports"


def page(name):
    return (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")


def cells(name, head):
    """Rows of the page's table that begins with a head, as text."""
    _, _, rest = page(name).partition(f"| {head}")
    rows = rest.partition("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]


def rounds_to(shown, value):
    """Whether a number, rounded as one is shown, is that one."""
    digits = len(shown.partition(".")[2])
    return round(float(value), digits) == pytest.approx(float(shown))


def test_draws_of_the_inputs_leave_what_the_table_says():
    table = pd.read_csv(REPORTS / "speed-error" / "compare.csv").set_index("draws")
    rows = cells("theory-comparison", "draws |")
    assert [int(row[0]) for row in rows] == table.index.tolist()
    for draws, *shown in rows:
        measured = table.loc[int(draws), ["rms_error_percent", "p95_error_percent", "force_comparison_s"]]
        assert all(rounds_to(a, b) for a, b in zip(shown, measured, strict=True)), draws


def test_alignment_leaves_what_the_table_says():
    table = pd.read_csv(REPORTS / "speed-error" / "alignment.csv").set_index("case")
    rows = cells("theory-comparison", "error |")
    assert [row[0] for row in rows] == table.index.tolist()
    for case, *shown in rows:
        assert all(rounds_to(a, b) for a, b in zip(shown, table.loc[case], strict=True)), case


def test_bands_of_whole_sequences_are_covered_as_the_table_says():
    cases = pd.read_csv(REPORTS / "sequences" / "cases.csv").query("case != 'to reach'")
    weight = cases["increments with a band [1]"].astype(float)
    for std, row in (("one", "nineteen folders of whole sequences, within one"), ("two", "within two")):
        shown = [r for r in cells("theory-bands", "| increments") if r[0] == row][-1]
        for place, name in ((2, "beta"), (3, "outcrop")):
            share = cases[f"{name} of increments within {std} std [%]"].astype(float)
            assert rounds_to(shown[place].rstrip(" %"), (share * weight).sum() / weight.sum()), (row, name)
    assert len(cases) == 19


def test_bands_of_a_hundred_tests_are_covered_as_the_table_says():
    table = pd.read_csv(REPORTS / "validation" / "bands.csv")
    table = table[table["of"] == "increments"].set_index("quantity")
    rows = cells("theory-bands", "| increments")
    at = next(k for k, row in enumerate(rows) if row[0].startswith("photographs of a hundred"))
    for row, column in ((rows[at], "within_1"), (rows[at + 1], "within_2")):
        for place, name in enumerate(("beta", "outcrop", "velocity_x", "velocity_y"), start=2):
            assert rounds_to(row[place].rstrip(" %"), 100.0 * table.loc[name, column]), (column, name)
    assert int(rows[at][1].replace(" ", "")) == table.loc["beta", "count"]


def test_adding_nodes_changes_nothing_and_a_search_among_them_misses_what_the_page_says():
    table = pd.read_csv(REPORTS / "model" / "nodes.csv")
    text = page("theory-model-nodes")
    most = table[["polyline_switch_u_change_pct", "polyline_switch_P_change_pct"]].abs().max().max()
    assert most < float(re.search(r"changes the first switch by at most (\S+) %", text).group(1)) * 1.05
    widest = table[table["node_spacing_d"] == table["node_spacing_d"].max()]
    missed = widest["by_nodes_switch_u_error_pct"].abs().max()
    assert rounds_to(re.search(r"up to (\d+) % at 0\.62", text).group(1), missed)


def test_one_block_and_two_cost_what_the_table_says():
    rows = cells("theory-model-two-blocks", "$\\varphi$, ")
    assert len(rows) == 6
    for angles, *shown, _ in rows:
        phi, wall = map(float, angles.split(", "))
        costs = initial_force(1.0, 2.0, phi, wall), two_block_force(1.0, 2.0, phi, wall).force
        assert all(rounds_to(a, b) for a, b in zip(shown, costs, strict=True)), angles
    assert "at least 1.3 to 5.5 % too dear at $\\varphi_w = \\varphi / 3$ (25 to 40°)" in page(
        "theory-model-two-blocks"
    )
    excess = [
        100.0 * (initial_force(1.0, 2.0, phi, phi / 3) / two_block_force(1.0, 2.0, phi, phi / 3).force - 1.0)
        for phi in (25.0, 30.0, 35.0, 40.0)
    ]
    np.testing.assert_array_equal(np.round([min(excess), max(excess)], 1), [1.3, 5.5])


def test_the_least_softened_direction_has_the_first_switch_that_the_page_says():
    soil = {
        "unit_weight_kN_m3": 16.0,
        "peak_friction_deg": 50.0,
        "residual_friction_deg": 32.0,
        "mobilization_length_mm": 1.0,
    }
    tables = {"test": {"name": "page"}, "blade": {"depth_mm": 30.0, "width_mm": 1000.0}, "soil": soil}
    shown = re.search(
        r"at ([\d.]+) \$d\$ \(least force: ([\d.]+) \$d\$\), with .{,40}? = ([\d.]+) \(([\d.]+)\)",
        page("theory-model-march"),
    )
    assert shown is not None
    for direction, place, price in (
        ("least_softened", shown[1], shown[3]),
        ("least_force", shown[2], shown[4]),
    ):
        run = simulate(Scene.model_validate({**tables, "model": {"direction": direction}}))
        start = run.bands["u_start_mm"].iloc[1]
        force = np.interp(start - 1e-9, run.force["u_mm"], run.force["force_N"])
        assert rounds_to(place, start / 30.0)
        assert rounds_to(price, force / (0.5 * 16e-6 * 30.0**2 * 1000.0))
