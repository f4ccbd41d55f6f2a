"""Figures as files for a paper: sizes, type, words, bytes, and what is said when they cannot be written."""

import csv
import json
import os
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from ploughval.cli import app
from ploughval.errors import ConfigError, DataError
from ploughval.report import figure_files, write_figures
from ploughval.report.page import single_page
from ploughval.results import read_results

SVG = "{http://www.w3.org/2000/svg}"
MM_PER_PT = 25.4 / 72


@pytest.fixture(scope="module")
def column(result_folder, tmp_path_factory):
    """Files of a column's width, by name."""
    out = tmp_path_factory.mktemp("column")
    return {path.name: path for path in write_figures(result_folder, out, width_mm=84.0)}


@pytest.fixture(scope="module")
def captions(column):
    with column["captions.csv"].open(encoding="utf-8", newline="") as file:
        return {row["figure"]: row for row in csv.DictReader(file)}


def test_every_figure_of_the_page_is_written_under_its_name(result_folder, column):
    named = re.findall(r'<figure data-name="([a-z0-9-]+)"', single_page(read_results(result_folder)))
    assert len(named) == len(set(named))
    assert {*named, "figure-8"} == {Path(name).stem for name in column if name.endswith(".svg")}


def test_svg_and_png_are_as_wide_as_asked(column, captions):
    for name in captions:
        root = ET.parse(column[f"{name}.svg"]).getroot()
        assert float(root.get("width").removesuffix("pt")) * MM_PER_PT == pytest.approx(84.0, abs=0.01)
        with Image.open(column[f"{name}.png"]) as picture:
            across, dots = picture.width, picture.info["dpi"][0]
        assert dots == pytest.approx(300, abs=0.1)  # PNG holds whole dots per metre
        assert across / 300 * 25.4 == pytest.approx(84.0, abs=25.4 / 300)


def test_captions_hold_words_data_and_size_of_every_figure(column, captions, result_folder):
    files = {Path(name).stem for name in column} - {"captions"}
    assert set(captions) == files
    for row in captions.values():
        assert row["caption"].strip()
        assert row["alternative_text"].strip()
        assert row["width_mm"] == "84.0"
        assert row["data"].split(), row["figure"]
        assert all((result_folder / name).is_file() for name in row["data"].split())
    text = column["captions.md"].read_text(encoding="utf-8")
    assert all(f"### {name}\n" in text for name in files)


def test_files_say_of_what_test_and_settings_they_are(column, captions, result_folder):
    results = read_results(result_folder)
    root = ET.parse(column["force.svg"]).getroot()
    assert root.findtext(f"{SVG}title") == f"{results.name}: force"
    assert root.findtext(f"{SVG}desc") == captions["force"]["alternative_text"]
    with Image.open(column["force.png"]) as picture:
        assert picture.text["Title"] == f"{results.name}: force"
        assert results.run.settings_hash[:12] in picture.text["Source"]


def test_ground_is_white_and_outlines_need_no_font(column, captions):
    for name in captions:
        assert "<text" not in column[f"{name}.svg"].read_text(encoding="utf-8")
        with Image.open(column[f"{name}.png"]) as picture:
            grey = np.asarray(picture.convert("L"))
        assert grey[0, 0] == 255, name
        assert grey[-1, -1] == 255, name


def test_nothing_is_cut_off_at_a_column(column, captions):
    # A label beyond the edge would leave ink in the outermost rows and columns of dots.
    for name in captions:
        with Image.open(column[f"{name}.png"]) as picture:
            grey = np.asarray(picture.convert("L"))
        edges = np.concatenate([grey[0], grey[-1], grey[:, 0], grey[:, -1]])
        assert edges.min() > 200, name


def test_the_same_results_give_the_same_bytes(result_folder, column, tmp_path, monkeypatch):
    chosen = (figure_files.force_chapter, figure_files.layers_chapter)
    monkeypatch.setattr(figure_files, "FIGURED", chosen)
    for path in write_figures(result_folder, tmp_path, width_mm=84.0):
        if path.suffix in (".svg", ".png"):
            assert path.read_bytes() == column[path.name].read_bytes(), path.name


def test_a_page_is_wider_than_a_column_with_type_of_the_same_size(result_folder, tmp_path, monkeypatch):
    monkeypatch.setattr(figure_files, "FIGURED", (figure_files.mound_chapter, figure_files.force_chapter))
    sizes = {}
    for width in (90.0, 180.0):
        files = write_figures(result_folder, tmp_path / f"{width:g}", width_mm=width)
        root = ET.parse(next(path for path in files if path.name == "force.svg")).getroot()
        sizes[width] = float(root.get("width").removesuffix("pt")) * MM_PER_PT
    assert sizes == pytest.approx({90.0: 90.0, 180.0: 180.0}, abs=0.01)


def test_a_hostile_name_stays_text(make_results, tmp_path, monkeypatch):
    monkeypatch.setattr(figure_files, "FIGURED", (figure_files.force_chapter,))
    name = '</title><script>alert(1)</script> | `x` _y_ & \x00\x1b "z" $\\frac$\n# head'
    folder = make_results(tmp_path / "r", name=name)
    files = {path.name: path for path in write_figures(folder, tmp_path / "out")}
    root = ET.parse(files["force.svg"]).getroot()
    assert root.findtext(f"{SVG}title").startswith("</title><script>alert(1)</script> | `x` _y_ &")
    assert not list(root.iter(f"{SVG}script"))
    head = files["captions.md"].read_text(encoding="utf-8").splitlines()
    assert head[0].startswith("# Figures: \\</title\\>\\<script\\>")
    assert not any(line.startswith("# head") for line in head)


def test_several_tests_are_written_as_their_comparison(make_results, tmp_path):
    folders = [make_results(tmp_path / name / "results", name=name) for name in ("a", "b")]
    files = write_figures(folders, tmp_path / "out", width_mm=174.0)
    assert {"forces-measured.svg", "forces-predicted.png", "captions.md"} <= {path.name for path in files}


def test_only_named_files_are_touched(result_folder, tmp_path, monkeypatch):
    monkeypatch.setattr(figure_files, "FIGURED", (figure_files.force_chapter,))
    (tmp_path / "notes.txt").write_text("mine")
    files = write_figures(result_folder, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"notes.txt", *(path.name for path in files)}


def test_a_file_in_the_way_is_one_message(result_folder, tmp_path):
    target = tmp_path / "taken"
    target.write_text("")
    with pytest.raises(DataError, match="it is a file; expected a folder that can be written to") as told:
        write_figures(result_folder, target)
    assert str(target) in str(told.value)


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_a_folder_without_leave_is_one_message(result_folder, tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(DataError, match="expected a folder that can be written to"):
        write_figures(result_folder, tmp_path / "out")


@pytest.mark.parametrize("width", [10.0, 1000.0, float("nan")])
def test_a_width_that_no_paper_has_is_refused_before_anything_is_written(result_folder, tmp_path, width):
    with pytest.raises(ConfigError, match="width_mm"):
        write_figures(result_folder, tmp_path / "out", width_mm=width)
    assert not (tmp_path / "out").exists()


def test_no_folder_at_all_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="at least one"):
        write_figures([], tmp_path)


def test_the_command_writes_page_and_figures(result_folder, tmp_path, monkeypatch):
    monkeypatch.setattr(figure_files, "FIGURED", (figure_files.force_chapter,))
    monkeypatch.setattr("ploughval.report.page.single_page", lambda *_: "page")
    asked = [
        "report",
        str(result_folder),
        "--out",
        str(tmp_path / "r.html"),
        "--figures",
        str(tmp_path / "f"),
    ]
    said = CliRunner().invoke(app, [*asked, "--width", "174", "--json"])
    assert said.exit_code == 0, said.output
    named = json.loads(said.stdout)["figures"]
    assert {Path(name).name for name in named} == {path.name for path in (tmp_path / "f").iterdir()}
    assert "width_mm" in (tmp_path / "f" / "captions.csv").read_text()
    assert (tmp_path / "r.html").read_text() == "page"
