"""The page: one file, true to its files, text never markup, chapters only where files are."""

import html
import json
import re
import shutil
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from ploughval.errors import ConfigError, DataError
from ploughval.report import write_report
from ploughval.scene import load_scene

HOSTILE = """<script>alert(1)</script>"><img src=x onerror=alert(2)> & {{ 7 * 7 }} $\\frac{$"""
SVG_NAMESPACE = "http://www.w3.org/2000/svg"


class Reader(HTMLParser):
    """Collects tags, attributes and the text of every table cell."""

    VOID = frozenset({"meta", "img", "link", "br", "input"})

    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.tags, self.attributes, self.open, self.rows, self._cell = [], [], [], [], None
        self.ids, self.unclosed = [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        self.ids += [value for name, value in attrs if name == "id"]
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self._cell = []

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        self.ids += [value for name, value in attrs if name == "id"]

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.unclosed.append(tag)
        if tag in ("td", "th") and self._cell is not None:
            self.rows[-1].append("".join(self._cell).strip())
            self._cell = None

    def handle_data(self, data):
        if self._cell is not None:
            self._cell.append(data)


def read(path):
    reader = Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    return reader


def chapters(path):
    return re.findall(r'<section id="([^"]+)"', path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def page(result_folder, tmp_path_factory):
    return write_report(result_folder, out=tmp_path_factory.mktemp("page") / "page.html")


def test_every_element_that_opens_closes_and_no_id_occurs_twice(page):
    reader = read(page)
    assert not reader.unclosed
    assert not reader.open
    assert len(reader.ids) == len(set(reader.ids))


def test_nothing_on_the_page_points_outside_it(page, foreign_scripts):
    reader = read(page)
    assert "link" not in reader.tags
    text = page.read_text(encoding="utf-8")
    assert foreign_scripts(text) == []
    assert set(re.findall(r"https?://[^\s\"'<>]*", text)) <= {SVG_NAMESPACE}
    references = [
        v for _, name, v in reader.attributes if name in ("src", "href", "xlink:href", "srcset", "data")
    ]
    assert references
    inside = {f"#{name}" for name in reader.ids}
    for reference in references:
        assert reference in inside or reference.startswith("data:image/")
    for place in re.findall(r"url\(([^)]*)\)", re.sub(r"<script.*?</script>", "", text, flags=re.S)):
        assert place in inside
    assert page.stat().st_size < 8e6


def test_same_files_give_the_same_bytes(page, result_folder, tmp_path):
    again = write_report(result_folder, out=tmp_path / "again.html")
    assert again.read_bytes() == page.read_bytes()


def test_numbers_of_the_metrics_table_are_those_of_the_file(page, result_folder):
    stored = json.loads((result_folder / "metrics.json").read_text())["metrics"]
    rows = {row[0]: row for row in read(page).rows if len(row) == 8}
    row = rows["First peak, N"]
    assert row[1] == "12.00 ± 0.16"  # to the second digit of the uncertainty
    assert row[2] == "12.34 ± 0.11"
    assert row[5] == "yes"
    assert rows["Outcrop x, mm"][5] == "no"
    assert rows["Line of action, mm"][5:] == ["unknown", "", "a"]
    assert "<li>the model has no line of action</li>" in page.read_text(encoding="utf-8")
    values = [float(v) for tag, name, v in read(page).attributes if tag == "data" and name == "value"]
    for metric in stored.values():
        for name in ("experiment", "model", "error"):
            assert metric[name] is None or metric[name] in values


def test_band_tables_hold_the_rows_of_both_files(page, result_folder):
    values = [float(v) for tag, name, v in read(page).attributes if tag == "data" and name == "value"]
    for name in ("bands.csv", "model/bands.csv"):
        table = pd.read_csv(result_folder / name)
        for column in ("u_start_mm", "beta_deg", "outcrop_x_mm", "slip_mm"):
            for value in table[column]:
                assert np.isclose(values, value, rtol=1e-12).any()


def test_lost_frame_is_named_with_its_reason(page):
    rows = [row for row in read(page).rows if row[:2] == ["5", "f005.png"]]
    assert rows
    assert all(row[-2:] == ["lost", "truncated file"] for row in rows)


def test_hostile_names_notes_and_reasons_stay_text(make_results, tmp_path, foreign_scripts):
    folder = make_results(tmp_path / "r", name=HOSTILE)
    record = json.loads((folder / "run.json").read_text())
    record["settings"]["test"]["notes"] = HOSTILE
    record["warnings"], record["frames"][5]["reason"] = [HOSTILE], HOSTILE
    (folder / "run.json").write_text(json.dumps(record))
    budget = pd.read_csv(folder / "budget.csv")
    budget.loc[0, "source"] = HOSTILE
    budget.to_csv(folder / "budget.csv", index=False)
    written = write_report(folder)
    reader = read(written)
    assert foreign_scripts(written.read_text(encoding="utf-8")) == []
    assert "img" not in reader.tags
    assert not [name for _, name, _ in reader.attributes if name.startswith("on")]
    assert html.escape(HOSTILE, quote=False).split("$")[0].split('"')[0] in written.read_text(
        encoding="utf-8"
    )
    assert "{{ 7 * 7 }}" in written.read_text(encoding="utf-8")


def test_hostile_names_stay_text_where_several_tests_share_a_figure(make_results, tmp_path, foreign_scripts):
    folders = [make_results(tmp_path / k, name=HOSTILE) for k in "ab"]
    written = write_report(folders, out=tmp_path / "several.html")
    reader = read(written)
    assert foreign_scripts(written.read_text(encoding="utf-8")) == []
    assert "img" not in reader.tags
    assert not reader.unclosed


@pytest.mark.parametrize(
    ("gone", "absent"),
    [
        (["force.csv", "model/force.csv", "model/bands.csv"], {"force"}),
        (["tracks.nc"], {"field", "shear"}),
        (["mobilised.csv"], {"friction"}),
        (["budget.csv"], {"budget"}),
        (["layers.csv", "model/layers.csv", "surface.csv"], {"layers"}),
        (["bands.csv", "model/bands.csv", "increments.csv"], {"bands"}),
        (["metrics.json"], {"agreement"}),
    ],
)
def test_chapter_is_absent_where_the_scene_does_not_call_for_it(gone, absent, page, own_folder):
    folder = own_folder
    before = chapters(page)
    record = json.loads((folder / "run.json").read_text())
    record["steps"] = []
    if "budget.csv" in gone:
        record["loadcells"] = None
    (folder / "run.json").write_text(json.dumps(record))
    for name in gone:
        (folder / name).unlink()
    after = chapters(write_report(folder))
    assert absent <= set(before)
    assert set(before) - set(after) == absent


def test_chapter_says_what_could_not_be_had_where_the_scene_called_for_it(own_folder):
    folder = own_folder
    (folder / "force.csv").unlink()
    (folder / "tracks.nc").unlink()
    text = write_report(folder).read_text(encoding="utf-8")
    assert "The measured force could not be had" in text
    assert "The displacement field could not be had" in text
    assert "The strain of the sand could not be had" in text


def test_folder_with_a_single_table_still_gives_a_page(result_folder, tmp_path):
    for name in ("force.csv", "surface.csv", "tracks.nc", "layers.csv"):
        folder = tmp_path / name
        folder.mkdir()
        shutil.copy(result_folder / name, folder)
        assert chapters(write_report(folder))


def test_page_of_a_model_run_alone_says_so(result_folder, tmp_path):
    shutil.copytree(result_folder / "model", tmp_path / "model")
    written = write_report(tmp_path)
    assert "Predicted only" in written.read_text(encoding="utf-8")
    assert set(chapters(written)) == {"player", "force", "layers", "bands"}


def test_several_tests_stand_side_by_side(make_results, tmp_path):
    folders = [make_results(tmp_path / name, name=name) for name in ("loose", "dense")]
    written = write_report(folders, out=tmp_path / "several.html")
    rows = read(written).rows
    assert ["Metric", "loose", "dense"] in rows
    peaks = [row for row in rows if row[0] == "First peak, N"]
    assert ["First peak, N", "12.00 ± 0.16", "12.00 ± 0.16"] in peaks
    assert write_report(folders).name == "comparison.html"


def test_test_folder_leads_to_its_results(make_results, tmp_path):
    make_results(tmp_path / "results")
    assert write_report(tmp_path) == tmp_path / "results" / "report.html"


def test_failed_write_leaves_the_old_page_and_no_scraps(result_folder, tmp_path, monkeypatch):
    target = tmp_path / "page.html"
    target.write_text("old")

    def refuse(*_):
        raise OSError("disk full")

    monkeypatch.setattr("os.replace", refuse)
    with pytest.raises(DataError, match="disk full"):
        write_report(result_folder, out=target)
    assert [p.name for p in tmp_path.iterdir()] == ["page.html"]
    assert target.read_text() == "old"


def test_no_folder_and_empty_folder_are_refused_with_what_to_do(tmp_path):
    with pytest.raises(ConfigError):
        write_report([])
    with pytest.raises(DataError, match="ploughval process"):
        write_report(tmp_path)


def test_broken_files_are_named_with_place_and_value(own_folder):
    folder = own_folder
    good = (folder / "force.csv").read_text()
    (folder / "force.csv").write_text(good.replace("10.1,0.1", "10.1,many"))
    with pytest.raises(DataError, match=r"force\.csv.*line 3, u_mm: got 'many'"):
        write_report(folder)
    (folder / "force.csv").write_text("time_s,u_mm\n1,2\n")
    with pytest.raises(DataError, match=r"columns force_N"):
        write_report(folder)
    (folder / "force.csv").write_text(good)
    (folder / "run.json").write_text('{"frames": [{"frame": "x"}]}')
    with pytest.raises(DataError, match=r"run\.json: frames\.0\.frame"):
        write_report(folder)


def test_tables_that_hold_a_header_alone_still_give_a_page(own_folder):
    folder = own_folder
    for table in folder.rglob("*.csv"):
        table.write_text(table.read_text().splitlines()[0] + "\n")
    (folder / "tracks.nc").unlink()
    text = write_report(folder).read_text(encoding="utf-8")
    assert "No shear band was found" in text
    assert "No stage after the blade moved has a line to show." in text


def test_tables_of_nan_still_give_a_page(own_folder):
    folder = own_folder
    for name in (
        "force.csv",
        "increments.csv",
        "blade.csv",
        "mobilised.csv",
        "surface.csv",
        "model/force.csv",
    ):
        table = pd.read_csv(folder / name)
        table[[c for c in table if c.endswith(("_N", "_mm", "_deg", "_s"))]] = np.nan
        table.to_csv(folder / name, index=False)
    before = {"agreement", "force", "layers", "bands", "field", "shear", "budget", "calibration", "quality"}
    before |= {"provenance", "player"}
    assert set(chapters(write_report(folder))) == before


def test_photograph_is_left_out_with_a_note_where_it_cannot_be_read_any_more(make_results, tmp_path):
    folder = make_results(tmp_path / "r", test_folder=tmp_path / "moved")
    text = write_report(folder).read_text(encoding="utf-8")
    assert "the test folder can no longer be read as it was" in text


def test_measured_layers_lie_over_the_photograph_where_it_can_be_read(make_results, tmp_path):
    photos = tmp_path / "photos"
    photos.mkdir()
    grains = np.random.default_rng(5)
    for frame in range(13):
        Image.fromarray(grains.integers(0, 255, (130, 480), dtype=np.uint8)).save(
            photos / f"f{frame:03d}.png"
        )
    (tmp_path / "test.toml").write_text(
        '[test]\nname = "d30"\n[blade]\ndepth_mm = 30.0\nwidth_mm = 218.0\n'
        '[camera]\nphotos = "photos/*.png"\nmm_per_px = 0.5\ntip_px = [30.0, 100.0]\n'
        "times = {start_s = 10.0, interval_s = 5.0}\n"
    )
    folder = make_results(tmp_path / "results", test_folder=tmp_path, stages=2)
    changed = write_report(folder).read_text(encoding="utf-8")
    assert "test.toml has changed since the run" in changed
    record = json.loads((folder / "run.json").read_text())
    record["settings_hash"] = load_scene(tmp_path).settings_hash
    (folder / "run.json").write_text(json.dumps(record))
    (photos / "f012.png").write_bytes(b"no longer a photograph")
    text = write_report(folder).read_text(encoding="utf-8")
    assert text.count("data:image/jpeg;base64,") == 1  # frame 6; frame 12 is broken
    assert "The photograph of frame 12 is not shown" in text


def test_a_name_without_an_ending_is_a_folder_for_the_page(result_folder, tmp_path):
    written = write_report([result_folder, result_folder], out=tmp_path / "both")
    assert written == tmp_path / "both" / "comparison.html"
    assert sorted(path.name for path in written.parent.iterdir()) == [
        "comparison.csv",
        "comparison.html",
        "comparison.json",
    ]
