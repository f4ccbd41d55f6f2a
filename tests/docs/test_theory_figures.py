"""Figures that theory pages take from the measured tables are those of the tables."""

import re
from pathlib import Path

import pandas as pd
import pytest

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
