"""Texts of a user, wherever they come from, reach a page as text and a spreadsheet as words."""

import csv
import json
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from broken.base import make_sound
from ploughval.report import write_report
from ploughval.report.captions import Captioned, write_captions
from ploughval.run import process_folder

HOSTILE = '"><img src=x onerror=alert(1)></script><script>alert(2)</script><svg onload=f(3)> javascript:f(4)'
FILE = '<img src=x onerror=alert(5)>&"javascript:'
EXIF = {0x010F: HOSTILE, 0x0110: HOSTILE}
LENS, SERIAL = 0xA434, 0xA431


class Live(HTMLParser):
    """Collects what a browser would run or fetch."""

    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.found, self.scripts, self.texts = [], 0, []

    def handle_starttag(self, tag, attrs):
        self.scripts += tag == "script"
        self.found += [(tag, name) for name, _ in attrs if name.startswith("on")]
        self.found += [(tag, value) for _, value in attrs if (value or "").strip().startswith("javascript:")]
        self.found += [(tag, value) for name, value in attrs if name == "src" and value == "x"]

    def handle_data(self, data):
        self.texts.append(data)


def live(page):
    reader = Live()
    reader.feed(page)
    return reader


def quoted(text):
    return json.dumps(text)


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """Results of a test with hostile name, notes, lens, file names, EXIF, log columns and log properties."""
    nptdms = pytest.importorskip("nptdms")
    folder = tmp_path_factory.mktemp("hostile") / "test"
    make_sound(folder)
    log = pd.read_csv(folder / "loadcells.csv").rename(columns={"moment_upper_Nm": HOSTILE})
    with nptdms.TdmsWriter(folder / "log.tdms") as writer:
        about = {"operator": HOSTILE, "unit_string": "", "description": HOSTILE}
        channels = [nptdms.ChannelObject(HOSTILE, name, log[name].to_numpy(), about) for name in log]
        writer.write_segment([nptdms.RootObject({"name": HOSTILE}), *channels])
    times = pd.read_csv(folder / "photos.csv")
    for frame, name in enumerate(times["file"]):
        path = folder / "photos" / name
        with Image.open(path) as picture:
            exif = picture.getexif()
            exif.update(EXIF)
            exif.get_ifd(0x8769).update({LENS: HOSTILE, SERIAL: HOSTILE})
            picture.save(path.with_name(f"{frame}{FILE}.png"), exif=exif)
        path.unlink()
    times.assign(file=[f"{frame}{FILE}.png" for frame in range(len(times))]).to_csv(
        folder / "photos.csv", index=False
    )
    text = (folder / "test.toml").read_text()
    text = text.replace('name = "sound"', f"name = {quoted(HOSTILE)}")
    text = text.replace('notes = "', f"notes = {quoted(HOSTILE)[:-1]} ")
    text = text.replace('log = "loadcells.csv"', 'log = "log.tdms"\nempty = []').replace(
        'empty = ["empty/*.csv"]\n', ""
    )
    text = text.replace("[tracers]", f"[loadcells.columns]\nmoment_upper_Nm = {quoted(HOSTILE)}\n\n[tracers]")
    text = text.replace("[camera]", f"[camera]\nlens = {quoted(HOSTILE)}")
    (folder / "test.toml").write_text(text)
    return process_folder(folder).results


def test_texts_of_settings_file_names_logs_and_exif_stay_text_on_the_page(hostile, foreign_scripts):
    record = json.loads((hostile / "run.json").read_text())
    assert record["test"] == HOSTILE
    assert record["exif"]["make"] == HOSTILE
    assert record["frames"][0]["file"].endswith(f"0{FILE}.png")
    page = write_report(hostile).read_text(encoding="utf-8")
    assert foreign_scripts(page) == []
    seen = live(page)
    assert seen.found == []
    assert any(HOSTILE in text for text in seen.texts)


def test_texts_stay_text_on_the_page_of_several_tests(hostile, foreign_scripts, tmp_path):
    page = write_report([hostile, hostile], out=tmp_path / "several.html").read_text(encoding="utf-8")
    assert foreign_scripts(page) == []
    assert live(page).found == []


def test_a_test_whose_name_is_a_formula_is_a_word_in_the_table_of_several(make_results, tmp_path):
    folders = [make_results(tmp_path / name, name="=cmd|' /C calc'!A0") for name in "ab"]
    write_report(folders, out=tmp_path / "several.html")
    table = pd.read_csv(tmp_path / "several.csv", keep_default_na=False)
    assert any(name.startswith("'=cmd") for name in table["test"])
    assert (
        not table.select_dtypes(exclude="number")
        .map(lambda cell: cell.startswith(("=", "+", "-", "@")))
        .any(axis=None)
    )
    assert np.isfinite(pd.to_numeric(table["value"], errors="coerce")).any()


def test_a_caption_that_is_a_formula_is_a_word(tmp_path):
    figure = Captioned("force", "@SUM(A1)", "", "=1+1", "+A1", ("force.csv",), (84.0, 60.0))
    write_captions([figure], tmp_path, subject="=1", source="x")
    with (tmp_path / "captions.csv").open(newline="") as file:
        row = next(csv.DictReader(file))
    assert (row["chapter"], row["caption"], row["alternative_text"]) == ("'@SUM(A1)", "'=1+1", "'+A1")
    assert row["width_mm"] == "84.0"
