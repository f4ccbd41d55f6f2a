"""Tables that go with the page: those of the result folder, whole or as drawn, and no formula of a user's."""

import csv
import io
import json
import math
import re

import numpy as np
import pandas as pd
import pytest

from ploughval.report.attached import MOST_BYTES, attached, csv_text
from ploughval.report.blocks import Chapter, Drawing
from ploughval.report.page import single_page
from ploughval.report.thinning import MOST_POINTS
from ploughval.results import read_results


def rows(text):
    return list(csv.reader(io.StringIO(text, newline="")))


def of(folder, *names):
    chapter = Chapter("a", "A", drawings=[Drawing("", "", "a", names)])
    return attached(read_results(folder), [chapter])


def test_a_small_table_is_attached_cell_by_cell_as_it_stands_in_its_file(result_folder):
    for name in ("bands.csv", "increments.csv", "model/bands.csv"):
        with (result_folder / name).open(newline="") as file:
            assert rows(of(result_folder, name)[name].text) == list(csv.reader(file))
    assert of(result_folder, "model/bands.csv")["model/bands.csv"].name == "model-bands.csv"


def test_what_is_no_table_or_is_not_there_is_not_attached(result_folder):
    assert of(result_folder, "tracks.nc", "no.csv", "fit.json") == {}


def test_a_table_too_long_for_a_page_stays_in_the_folder(own_folder):
    lines = (own_folder / "surface.csv").read_text().splitlines()
    many = [lines[0]] + lines[1:] * (MOST_BYTES // len("\n".join(lines[1:])) + 1)
    (own_folder / "surface.csv").write_text("\n".join(many) + "\n")
    assert of(own_folder, "surface.csv") == {}


def test_a_table_too_long_even_as_drawn_stays_in_the_folder(own_folder):
    head = "frame,u_mm,layer,source,points,mean_mm,rms_mm,validation_std_mm,extra_mm"
    row = "7,12.3456789,5,tracks,100,0.0123456789,0.0123456789,0.0123456789,0"
    (own_folder / "layer_distances.csv").write_text("\n".join([head, *[row] * 5000]) + "\n")
    assert of(own_folder, "layer_distances.csv") == {}
    (own_folder / "layer_distances.csv").write_text("\n".join([head, *[row] * 500]) + "\n")
    got = of(own_folder, "layer_distances.csv")["layer_distances.csv"]
    assert got.note == ("layer_distances.csv: the columns that are drawn; all of it is in the result folder.")
    assert rows(got.text)[1] == row.split(",")[:-1]


def test_a_long_force_history_is_attached_as_drawn_with_its_extremes_and_says_so(own_folder):
    u = np.linspace(0, 60, 40_000)
    force = pd.read_csv(own_folder / "force.csv").iloc[np.zeros(len(u), int)].reset_index(drop=True)
    force["u_mm"], force["force_N"] = u, 8 + np.sin(u)
    force.loc[23_456, "force_N"], force.loc[23_500, "force_N"] = 31.25, -2.5
    force.to_csv(own_folder / "force.csv", index=False)
    got = of(own_folder, "force.csv")["force.csv"]
    head, *body = rows(got.text)
    assert len(body) <= MOST_POINTS + 2
    assert got.note == f"force.csv: {len(body)} of 40000 rows; all of it is in the result folder."
    shown = [float(row[head.index("force_N")]) for row in body]
    assert (max(shown), min(shown)) == (31.25, -2.5)
    places = [float(row[head.index("u_mm")]) for row in body]
    assert places == sorted(places)
    assert set(places) <= set(force["u_mm"])  # rows of the file, none made up


def test_metrics_are_attached_with_every_part_in_full_precision(result_folder):
    stored = json.loads((result_folder / "metrics.json").read_text())["metrics"]
    head, *body = rows(of(result_folder, "metrics.json")["metrics.json"].text)
    assert [row[0] for row in body] == list(stored)
    for row, metric in zip(body, stored.values(), strict=True):
        for name in ("experiment", "experiment_std", "model", "model_std", "error", "validation_std"):
            text = row[head.index(name)]
            assert (float(text) if text else None) == metric[name]
        assert row[head.index("agrees")] == {True: "yes", False: "no", None: ""}[metric["agrees"]]


def test_the_prediction_is_attached_as_it_is_drawn(own_folder):
    record = json.loads((own_folder / "run.json").read_text())
    record["settings"].setdefault("soil", {})["wall_friction_deg"] = 20.0
    (own_folder / "run.json").write_text(json.dumps(record))
    head, *body = rows(of(own_folder, "model/force.csv")["model/force.csv"].text)
    P = pd.read_csv(own_folder / "model" / "force.csv")["force_N"]
    got = [float(row[head.index("force_N")]) for row in body]
    np.testing.assert_allclose(got, P * math.cos(math.radians(20.0)), rtol=1e-12)


@pytest.mark.parametrize(
    "text", ["=1+1", "+A1", "-A1", "@SUM(A1)", "\t=1", "\r=1", "-", "--1", "=cmd|' /C calc'!A0"]
)
def test_a_text_that_a_spreadsheet_would_run_gets_an_apostrophe(text):
    assert rows(csv_text([[text]])) == [["'" + text]]


@pytest.mark.parametrize("text", ["-0.5", "+1e-6", "1.25", "-.5", "", "nan", "measured, twice", 'a "b"', "β"])
def test_numbers_and_other_texts_are_left_as_they_are(text):
    assert rows(csv_text([[text, "x"]])) == [[text, "x"]]


def test_no_text_of_a_table_can_end_the_element_that_holds_it(own_folder):
    hostile = '</script><script>alert(1)</script><!--"\u2028'
    budget = pd.read_csv(own_folder / "budget.csv")
    budget.loc[0, "source"] = hostile
    budget.to_csv(own_folder / "budget.csv", index=False)
    page = single_page(read_results(own_folder))
    block = re.search(r'<script type="application/json" id="attached">(.*?)</script>', page, re.S).group(1)
    assert hostile in rows(json.loads(block)["budget.csv"]["text"])[1]
    assert "<script>alert" not in page


def test_every_figure_and_table_of_the_page_has_a_control_and_no_two_share_a_name(result_folder):
    page = single_page(read_results(result_folder))
    figures = re.findall(r'<figure data-name="([a-z0-9-]+)">', page)
    tables = re.findall(r'class="table[^"]*" data-name="([a-z0-9-]+)"', page)
    assert len(figures) > 5
    assert len(tables) > 5
    assert page.count('data-save="svg"') == len(figures) == page.count("<figure")
    assert page.count('data-save="table"') == len(tables) == page.count("<tbody>")
    block = json.loads(re.search(r'id="attached">(.*?)</script>', page, re.S).group(1))
    asked = set(re.findall(r'data-file="([^"]+)"', page))
    assert asked
    assert asked == set(block)
    names = [*figures, *tables, *(entry["name"].removesuffix(".csv") for entry in block.values())]
    csvs = [*tables, *(entry["name"].removesuffix(".csv") for entry in block.values())]
    assert len(set(csvs)) == len(csvs)
    assert len(set(figures)) == len(figures)
    assert all(names)
