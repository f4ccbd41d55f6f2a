"""The page of several tests: groups by rule, numbers as in its files, text never markup, 2 to 50 tests."""

import json
import re
import shutil
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest

from ploughval.report import write_report
from ploughval.report.blocks import Pen
from ploughval.report.several import find_several
from ploughval.report.several.overview import overview_chapter
from ploughval.report.several.side_by_side import forces_chapter
from ploughval.results import read_results


class Cells(HTMLParser):
    """Rows of all tables, and the tags that were met."""

    def __init__(self, path):
        super().__init__()
        self.rows, self.tags, self.values, self._open = [], set(), [], False
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
            self._open = True
        if tag == "data":
            self.values.append(float(dict(attrs)["value"]))

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self.rows[-1][-1] = self.rows[-1][-1].strip()
            self._open = False

    def handle_data(self, data):
        if self._open:
            self.rows[-1][-1] += data

    def row(self, first):
        return next(row for row in self.rows if row and row[0] == first)


USED = ("run.json", "metrics.json", "force.csv", "bands.csv", "model/force.csv", "model/bands.csv")


@pytest.fixture
def tests(result_folder, tmp_path):
    """Makes result folders that differ in depth and by a factor on every measured metric."""

    def make(specification):
        folders = []
        for number, (depth, factor) in enumerate(specification):
            folder = tmp_path / f"r{number}"
            (folder / "model").mkdir(parents=True, exist_ok=True)
            for name in USED:
                shutil.copy(result_folder / name, folder / name)
            record = json.loads((folder / "run.json").read_text())
            record["test"] = f"t{number}"
            record["settings"]["blade"]["depth_mm"] = depth
            record["inputs"] = {"loadcells.csv": f"{number:064x}"}
            (folder / "run.json").write_text(json.dumps(record))
            record = json.loads((folder / "metrics.json").read_text())
            for name, power in (("first_peak_N", 2), ("mean_force_N", 2), ("peak_spacing_mm", 1)):
                metric = record["metrics"][name]
                scale = (depth / 30.0) ** power
                for side in ("experiment", "experiment_std", "model", "model_std", "validation_std"):
                    metric[side] *= scale * (factor if side == "experiment" else 1.0)
                metric["error"] = metric["model"] - metric["experiment"]
            (folder / "metrics.json").write_text(json.dumps(record))
            folders.append(folder)
        return folders

    return make


REPEATS = [(30.0, 1.0), (30.1, 1.02), (29.9, 0.97), (30.0, 1.01)]


def test_equal_tests_are_one_group_and_the_varying_key_is_named(tests, tmp_path):
    folders = tests([*REPEATS, (45.0, 1.0), (45.0, 0.99)])
    page = Cells(write_report(folders, out=tmp_path / "page.html"))
    assert page.row("A")[1] == "4"
    assert page.row("A")[-1] == "t0, t1, t2, t3"
    assert page.row("B")[1:3] == ["2", "45"]
    assert "Between groups differs: blade.depth_mm." in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_repeatability_on_the_page_is_that_of_the_four_values(tests, tmp_path):
    page = write_report(tests(REPEATS), out=tmp_path / "page.html")
    depths, factors = np.array(REPEATS).T
    values = 12.0 * (depths / 30) ** 2 * factors  # metrics of the made folder: 12.00 N at 30 mm
    row = next(r for r in Cells(page).rows if r[0] == "First peak, N" and len(r) == 9)
    assert row[1] == "4"
    assert float(row[2]) == pytest.approx(values.mean(), rel=1e-3)
    assert float(row[3].split()[0]) == pytest.approx(values.std(ddof=1), rel=1e-2)
    record = json.loads((tmp_path / "page.json").read_text())
    (found,) = [one for one in record["repeatability"] if one["metric"] == "first_peak_N"]
    assert found["tests"] == ["t0", "t1", "t2", "t3"]
    assert found["values"] == pytest.approx(values)
    assert found["pooled"]["std"] == pytest.approx(values.std(ddof=1))


def test_every_number_of_the_page_is_in_the_table_beside_it(tests, tmp_path):
    page = write_report(tests([*REPEATS, (45.0, 1.0), (60.0, 0.99)]), out=tmp_path / "page.html")
    table = pd.read_csv(tmp_path / "page.csv")
    known = np.sort(table["value"].to_numpy(float))
    # Changes over depth are slopes times the range of ln d, a rounding to nine digits apart.
    slopes = table[table["quantity"].str.contains("slope", na=False)]["value"].to_numpy(float)
    spans = np.array([1.0, np.log(60.0 / 29.9)])
    known = np.sort(np.concatenate([known, *(slopes * span for span in spans)]))
    for value in Cells(page).values:
        nearest = known[np.clip(np.searchsorted(known, value) + np.array([-1, 0]), 0, known.size - 1)]
        assert np.isclose(nearest, value, rtol=1e-7, atol=1e-9).any(), value
    assert list(table.columns) == ["chapter", "group", "test", "metric", "unit", "quantity", "value"]


def test_depth_chapter_says_flat_and_gives_the_power(tests, tmp_path):
    folders = tests([(20.0, 1.0), (30.0, 1.004), (40.0, 0.997), (60.0, 1.002)])
    page = write_report(folders, out=tmp_path / "page.html")
    record = json.loads((tmp_path / "page.json").read_text())
    trends = {trend["metric"]: trend for trend in record["depth"]}
    assert trends["first_peak_N"]["verdict"] == "none"
    power = trends["first_peak_N"]["power"]
    assert power["slope_low"] < 2.0 < power["slope_high"]
    assert trends["first_peak_N"]["predicted_power"] == pytest.approx(2.0)
    # Outcrop stays at 150 mm whatever the depth: in depths it falls, and the model's does, too.
    assert trends["outcrop_x_mm"]["power"]["slope"] == pytest.approx(0.0, abs=1e-9)
    assert trends["outcrop_x_mm"]["verdict"] != "none"
    assert 'id="depth"' in page.read_text(encoding="utf-8")


def test_no_chapter_on_depth_or_repeats_where_tests_call_for_none(tests, tmp_path):
    text = write_report(tests(REPEATS[:2]), out=tmp_path / "a.html").read_text(encoding="utf-8")
    assert 'id="depth"' not in text
    assert 'id="repeatability"' in text
    other = tests([(30.0, 1.0), (40.0, 1.0)])
    text = write_report(other, out=tmp_path / "b.html").read_text(encoding="utf-8")
    assert 'id="repeatability"' not in text
    assert "No test repeats another" in text


def test_tests_without_force_metrics_or_settings_are_normal(tests, tmp_path):
    folders = tests([*REPEATS, (30.0, 1.0), (30.0, 1.0)])
    (folders[1] / "force.csv").unlink()
    (folders[2] / "metrics.json").unlink()
    (folders[3] / "run.json").unlink()
    for name in ("force.csv", "metrics.json", "model/force.csv"):
        (folders[4] / name).unlink()
    found = find_several([read_results(folder) for folder in folders])
    # Test 3 states no settings, and belongs to no group of the others.
    assert {group.members for group in found.grouping.groups} == {(0, 1, 2, 4, 5), (3,)}
    (label,) = found.histories
    assert found.histories[label].tests == (0, 2, 5)
    first = next(repeat for repeat in found.repeats[label] if repeat.metric == "first_peak_N")
    assert first.tests == (0, 1, 5)
    assert write_report(folders, out=tmp_path / "page.html").is_file()


def test_repeats_over_travels_of_different_length_are_named(tests):
    folders = tests([(30.0, 1.0)] * 3)

    def faults():
        return overview_chapter(find_several([read_results(folder) for folder in folders])).faults

    assert not faults()
    force = pd.read_csv(folders[1] / "force.csv")
    end = force["u_mm"].max()
    force[force["u_mm"] < 0.5 * end].to_csv(folders[1] / "force.csv", index=False)
    (said,) = faults()
    assert "group A" in said
    assert f"to {end:.3g} mm" in said


def test_a_force_that_cannot_be_divided_stays_off_the_axis_of_those_that_are(tests):
    """Newtons on an axis of P / P0 would say that one test's force is many times that of the others."""
    folders = tests([(30.0, 1.0), (30.0, 1.0)])
    for name in ("metrics.json", "model/force.csv"):
        (folders[1] / name).unlink()
    chapter = forces_chapter(find_several([read_results(folder) for folder in folders]), Pen())
    assert [drawing.caption.split(",")[0] for drawing in chapter.drawings] == [
        "Force measured",
        "Force predicted",
    ]
    assert "of t0." in chapter.drawings[0].svg
    assert not any("t1" in drawing.svg for drawing in chapter.drawings)
    assert [note.split(":")[0] for note in chapter.notes] == ["t1"]


def test_notes_of_the_tests_are_text_of_the_page_long_ones_cut(tests, tmp_path):
    folders = tests(REPEATS[:2])
    for folder, text in zip(folders, ("made <b>sand</b>", "word " * 200), strict=True):
        run = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        run["settings"]["test"] = {"notes": text}
        (folder / "run.json").write_text(json.dumps(run), encoding="utf-8")
    page = write_report(folders, out=tmp_path / "several.html").read_text(encoding="utf-8")
    assert "made &lt;b&gt;sand&lt;/b&gt;" in page
    assert "word …" in page
    assert "word " * 61 not in page  # 300 characters are sixty words


def test_the_same_folder_twice_is_one_test_and_said(tests, tmp_path):
    (folder,) = tests(REPEATS[:1])
    text = write_report([folder, folder], out=tmp_path / "page.html").read_text(encoding="utf-8")
    assert "was measured from the same files as" in text
    assert 'id="repeatability"' not in text


def test_fifty_tests_give_one_page_no_wider_than_paper(tests, tmp_path):
    rng = np.random.default_rng(2)
    folders = tests([(d, rng.normal(1, 0.01)) for d in (20.0, 30.0, 40.0, 50.0, 60.0) for _ in range(10)])
    page = Cells(write_report(folders, out=tmp_path / "page.html"))
    assert max(len(row) for row in page.rows) <= 10
    names = {f"t{number}" for number in range(50)}
    assert names <= {row[0] for row in page.rows if row}
    record = json.loads((tmp_path / "page.json").read_text())
    assert len(record["groups"]) == 5
    assert record["repeatability_over_groups"][0]["dof"] == 45


def test_hostile_names_stay_text_in_groups_and_files(tests, tmp_path, foreign_scripts):
    hostile = """<script>alert(1)</script>"><img src=x onerror=alert(2)> {{ 7 * 7 }} $\\frac{$"""
    folders = tests([*REPEATS, (45.0, 1.0)])
    for folder in folders:
        record = json.loads((folder / "run.json").read_text())
        record["test"] = hostile
        record["settings"]["soil"]["repose_deg"] = hostile
        (folder / "run.json").write_text(json.dumps(record))
        record = json.loads((folder / "metrics.json").read_text())
        record["metrics"][hostile] = record["metrics"]["first_peak_N"] | {"unit": hostile}
        (folder / "metrics.json").write_text(json.dumps(record))
    page = write_report(folders, out=tmp_path / "page.html")
    tags = Cells(page).tags
    assert "img" not in tags
    assert foreign_scripts(page.read_text(encoding="utf-8")) == []
    assert "{{ 7 * 7 }}" in page.read_text(encoding="utf-8")
    assert (pd.read_csv(tmp_path / "page.csv")["metric"] == hostile).any()


def test_same_files_give_the_same_bytes(tests, tmp_path):
    folders = tests([*REPEATS, (45.0, 1.0)])
    for name in ("a", "b"):
        write_report(folders, out=tmp_path / f"{name}.html")
    for kind in ("html", "json", "csv"):
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_numbers_never_take_the_name_of_the_page(tests, tmp_path):
    page = write_report(tests(REPEATS[:2]), out=tmp_path / "page.csv")
    assert page.read_text(encoding="utf-8").lstrip().startswith("<!doctype html>")
    assert (tmp_path / "page.csv.csv").is_file()
    assert (tmp_path / "page.json").is_file()


def test_alternative_texts_are_there_for_every_figure(tests, tmp_path):
    text = write_report(tests([*REPEATS, (45.0, 1.0), (60.0, 1.0)]), out=tmp_path / "page.html").read_text()
    figures = re.findall(r"<svg [^>]*role=\"img\"[^>]*>", text)
    assert len(figures) >= 6
    assert all(re.search(r'aria-label="[^"]{20,}"', figure) for figure in figures)


def test_the_head_names_the_test_on_which_the_model_agrees_least(tests, tmp_path):
    folders = tests([*REPEATS, (45.0, 1.0)])
    for folder in folders:
        record = json.loads((folder / "metrics.json").read_text())
        for metric in record["metrics"].values():
            metric["agrees"] = None if metric["agrees"] is None else True
        (folder / "metrics.json").write_text(json.dumps(record))
    page = write_report(folders, out=tmp_path / "even.html").read_text(encoding="utf-8")
    assert "agree where fewest do" not in page
    record = json.loads((folders[1] / "metrics.json").read_text())
    judged = [name for name, metric in record["metrics"].items() if metric["agrees"] is not None]
    for name in judged[:-1]:
        record["metrics"][name]["agrees"] = False
    (folders[1] / "metrics.json").write_text(json.dumps(record))
    page = write_report(folders, out=tmp_path / "odd.html").read_text(encoding="utf-8")
    assert "agree where fewest do<small>test t1</small>" in page
    assert f"<dd>1 / {len(judged)}</dd>" in page
