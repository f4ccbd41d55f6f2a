"""What the page saves: SVG files that stand alone, CSV files with the numbers of the results."""

import csv
import io
import json
import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pandas as pd
import pytest

pytestmark = pytest.mark.browser
SVG = "{http://www.w3.org/2000/svg}"
HREF = "{http://www.w3.org/1999/xlink}href"
FILE_NAME = re.compile(r"[^\W_]+(-[^\W_]+)*\.(svg|csv)")  # letters, digits and single dashes
PARSED = "(text) => new DOMParser().parseFromString(text, 'image/svg+xml').documentElement.nodeName"
LEAST_PAUSE_MS = 120  # Chromium drops files of a page that saves more than ten within a second
FIRST_OF_A_FORMULA = tuple("=+-@\t")


@pytest.fixture
def page(one_page):
    return one_page


def saved(page, button):
    """Press a button from the keyboard; name and text of the file that comes."""
    fold = button.locator("xpath=ancestor::details")
    if fold.count():
        fold.evaluate("(fold) => { fold.open = true; }")
    page.wait_for_timeout(LEAST_PAUSE_MS)
    with page.expect_download() as waiting:
        button.press("Enter")
    download = waiting.value
    return download.suggested_filename, download.path().read_text(encoding="utf-8")


def rows_of(text):
    rows = list(csv.reader(io.StringIO(text.removeprefix("\ufeff"), newline="")))
    assert len({len(row) for row in rows}) == 1
    return rows


def is_number(cell):
    try:
        float(cell)
    except ValueError:
        return False
    return True


@pytest.mark.parametrize("name", ["one", "several"])
def test_every_figure_is_saved_as_a_file_that_stands_alone(visit, pages, hostile, tmp_path, name):
    page = visit(getattr(pages, name))
    buttons = page.locator("button[data-save=svg]").all()
    assert len(buttons) == page.locator("main figure > svg").count() > 3
    names = set()
    for button in buttons:
        file_name, text = saved(page, button)
        names.add(file_name)
        assert FILE_NAME.fullmatch(file_name), file_name
        assert "var(" not in text
        assert "NaN" not in text
        assert page.evaluate(PARSED, text) == "svg"
        root = ElementTree.fromstring(text)
        if name == "one":
            assert hostile in root.find(f"{SVG}title").text
        assert root.find(f"{SVG}desc").text.strip()
        assert not {f"{SVG}script", f"{SVG}foreignObject"} & {element.tag for element in root.iter()}
        known = {f"#{element.get('id')}" for element in root.iter() if element.get("id")}
        for element in root.iter():
            for reference in filter(None, (element.get("href"), element.get(HREF))):
                assert reference in known or reference.startswith("data:image/")
        assert set(re.findall(r"url\(&quot;?|url\(['\"]?(#[^'\")]*)", text)) - {""} <= known
        (tmp_path / file_name).write_text(text, encoding="utf-8")
    assert len(names) == len(buttons)
    sizes = {file_name: (tmp_path / file_name).stat().st_size for file_name in names}
    for file_name in (min(sizes, key=sizes.get), max(sizes, key=sizes.get)):
        drawn = visit(tmp_path / file_name)  # fails where the file says or asks for anything
        box = drawn.evaluate(
            "(() => { const b = document.documentElement.getBBox(); return [b.width, b.height]; })()"
        )
        assert min(box) > 40


def test_a_saved_figure_has_the_colours_of_the_light_page_in_the_dark_too(visit, pages):
    texts = []
    for scheme in ("light", "dark"):
        page = visit(pages.one, scheme=scheme)
        texts.append(saved(page, page.locator("button[data-save=svg]").first)[1])
    assert texts[0] == texts[1]


def test_every_table_is_saved_with_as_many_rows_and_no_formula(page):
    buttons = page.locator("button[data-save=table]").all()
    assert len(buttons) == page.locator("main .scroll table").count() > 5
    for button in buttons:
        file_name, text = saved(page, button)
        assert FILE_NAME.fullmatch(file_name), file_name
        rows = rows_of(text)
        shown = button.evaluate("(b) => b.closest('[data-name]').querySelectorAll('table tr').length")
        assert len(rows) == shown, file_name
        for cell in (cell for row in rows for cell in row):
            assert is_number(cell) or not cell.startswith(FIRST_OF_A_FORMULA), cell


def test_tables_hold_the_metrics_in_full_precision(page, pages):
    saved_numbers = set()
    for button in page.locator("#agreement button[data-save=table]").all():
        for row in rows_of(saved(page, button)[1]):
            saved_numbers |= {float(cell) for cell in row if is_number(cell)}
    stored = json.loads((pages.results / "metrics.json").read_text())["metrics"]
    for key, metric in stored.items():
        if metric["agrees"] is None:
            continue
        for side in ("experiment", "experiment_std", "model", "model_std", "error"):
            assert metric[side] in saved_numbers, (key, side)
        assert 2 * metric["validation_std"] in saved_numbers, key  # the page states 2 u_val


def test_a_hostile_text_is_saved_as_it_is_behind_an_apostrophe(page, hostile):
    button = page.locator("#quality button[data-save=table]").last
    cells = [cell for row in rows_of(saved(page, button)[1]) for cell in row]
    assert f"'{hostile}" in cells


@pytest.mark.parametrize(
    ("name", "file"), [("bands.csv", "bands.csv"), ("model/bands.csv", "model/bands.csv")]
)
def test_attached_tables_are_those_of_the_result_folder(page, pages, name, file):
    _, text = saved(page, page.locator(f"button[data-file='{name}']").first)
    found = pd.read_csv(io.StringIO(text))
    stored = pd.read_csv(pages.results / file)
    assert list(found) == list(stored)
    pd.testing.assert_frame_equal(found, stored, rtol=1e-8, check_dtype=False)


def test_the_thinned_force_keeps_its_highest_and_lowest_rows(page, pages):
    _, text = saved(page, page.locator("button[data-file='force.csv']").first)
    found, stored = pd.read_csv(io.StringIO(text)), pd.read_csv(pages.results / "force.csv")
    assert found["force_N"].max() == pytest.approx(stored["force_N"].max(), abs=0.01)
    assert found["force_N"].min() == pytest.approx(stored["force_N"].min(), abs=0.01)
    kept = np.isin(found["u_mm"].round(4), stored["u_mm"].round(4))
    assert kept.all()


def test_the_player_saves_its_frame_with_the_photograph(page, visit, tmp_path):
    page.locator("[data-player=slider]").fill("4")
    name, text = saved(page, page.locator("[data-player=save-svg]"))
    assert name.endswith("-frame-0004.svg")
    root = ElementTree.fromstring(text)
    assert "var(" not in text
    pictures = [element.get("href") or element.get(HREF) for element in root.iter(f"{SVG}image")]
    assert [address[:23] for address in pictures] == ["data:image/jpeg;base64,"]
    (tmp_path / name).write_text(text, encoding="utf-8")
    drawn = visit(tmp_path / name)
    assert drawn.locator("[data-layer=layers-measured]").count() == 1


def test_the_player_saves_the_lines_of_its_frame(page, pages):
    page.locator("[data-player=slider]").fill("4")
    name, text = saved(page, page.locator("[data-player=save-csv]"))
    assert name.endswith("-frame-0004-lines.csv")
    found = pd.read_csv(io.StringIO(text))
    assert set(found["frame"]) == {4}
    assert set(found["u_mm"]) == {20.0}
    layers = found[found["what"] == "layer, measured"]
    stored = pd.read_csv(pages.results / "layers.csv")
    stored = stored[stored["frame"] == 4]
    assert set(layers["layer_mm"]) == set(stored["layer"])
    for height, line in layers.groupby("layer_mm"):
        of = stored[stored["layer"] == height]
        known = np.interp(line["x_mm"], of["x_mm"], of["y_mm"])
        near = np.abs(known - line["y_mm"]) < 0.05
        assert near.mean() > 0.8  # the others stand on a step, where x decides


def test_the_player_saves_the_force_as_it_draws_it(page, pages):
    _, text = saved(page, page.locator("[data-player=save-force]"))
    found = pd.read_csv(io.StringIO(text))
    for side, file in (("measured", "force.csv"), ("predicted", "model/force.csv")):
        stored = pd.read_csv(pages.results / file)
        drawn = found[found["side"] == side].dropna(subset=["u_mm", "force_N"])
        assert drawn["force_N"].max() == pytest.approx(stored["force_N"].max(), abs=0.01)
        assert drawn["u_mm"].max() == pytest.approx(stored["u_mm"].max(), abs=0.01)
