"""The pages on settings and files name what there is, and nothing that is not."""

import fnmatch
import importlib.util
import json
import re
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr

from ploughval.axes import ForceStatus, Status
from ploughval.results.catalogue import FILES, VARIABLES
from ploughval.run import results as written

DOCS = Path(__file__).resolve().parents[2] / "docs"
FORMATS = (DOCS / "file-formats.md").read_text(encoding="utf-8")
NOT_OF_A_RUN = {"comparison.html", "comparison.json", "comparison.csv"}
FIT = {"fit.json", "fit_force.csv", "fit_profiles.csv", "fit_landscape.csv"}


@pytest.fixture(scope="module")
def make_tables():
    spec = importlib.util.spec_from_file_location("make_tables", DOCS / "make_tables.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def section(title):
    """A chapter of file-formats.md."""
    return re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", FORMATS, re.MULTILINE | re.DOTALL)[1]


def keys_on_page(title):
    """Keys in the first column of a chapter's table; ".x" goes on from the key before."""
    found = []
    for row in re.findall(r"^\| (`.*?) \| ", section(title), re.MULTILINE):
        for name in re.findall(r"`([^`]+)`", row):
            found.append(found[-1].rpartition(".")[0] + name if name.startswith(".") else name)
    return found


def keys_of(value, path=""):
    """Paths of the leaves of a JSON value; [] for the parts of a list of tables."""
    if isinstance(value, dict) and value:
        for key, inner in value.items():
            yield from keys_of(inner, f"{path}.{key}".lstrip("."))
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        yield from keys_of(value[0], path + "[]")
    else:
        yield path


def pattern(key):
    return key.replace("[]", "[[][]]").replace("NAME", "*")


@pytest.mark.parametrize("page", ["test-toml.md", "file-formats.md"])
def test_tables_of_the_page_are_made_from_the_code(make_tables, page):
    text = (DOCS / page).read_text(encoding="utf-8")
    assert text == make_tables.remade(text), "run: python docs/make_tables.py"
    assert "<!-- made by" in text


def test_every_file_of_a_result_folder_is_on_the_page_and_no_other():
    named = set(re.findall(r"`([\w/]+\.(?:csv|json|nc|html))`", section("The result folder")))
    assert named == set(written.FILES) | FIT | NOT_OF_A_RUN


def test_a_processed_test_has_no_file_that_the_page_does_not_name(followed):
    results = followed.folder / "d30-01" / "results"
    files = {p.relative_to(results).as_posix() for p in results.rglob("*") if p.is_file()}
    ours = {f for f in files if not f.startswith((".store/", "export/"))}
    assert ours <= set(written.FILES) | FIT | NOT_OF_A_RUN
    assert {"force.csv", "tracks.nc", "softening.csv", "cell_models.csv", "fit.json"} <= ours


def test_columns_of_every_table_stand_in_the_catalogue_in_their_order(followed):
    results = followed.folder / "d30-01" / "results"
    there = [name for name in FILES if (results / name).is_file()]
    assert len(there) == len(FILES)
    for name in there:
        header = list(pd.read_csv(results / name, nrows=0).columns)
        assert header == [column.name for column in FILES[name].columns], name


def test_variables_of_the_tracks_stand_in_the_catalogue_with_their_units(followed):
    with xr.open_dataset(followed.folder / "d30-01" / "results" / "tracks.nc", decode_times=False) as tracks:
        assert set(tracks.variables) == set(VARIABLES)
        for name, variable in VARIABLES.items():
            assert tracks[name].dims == variable.dims
            assert tracks[name].attrs.get("units", "1") == variable.unit


@pytest.mark.parametrize("name", ["metrics.json", "run.json", "calibration.json", "fit.json"])
def test_keys_of_the_json_files_are_those_of_the_page(followed, name):
    there = set(keys_of(json.loads((followed.folder / "d30-01" / "results" / name).read_text())))
    told = [pattern(key) for key in keys_on_page(name)]
    assert [k for k in there if not any(fnmatch.fnmatchcase(k, p) for p in told)] == []
    assert [p for p in told if not fnmatch.filter(there, p)] == []


def test_every_status_is_explained():
    text = section("tracks.nc")
    assert [s.meaning for s in Status if f"| `{s.meaning}` |" not in text] == []
    assert [s.value for s in ForceStatus if f"| `{s.value}` |" not in text] == []
    shown = set(re.findall(r"^\| `(\w+)` \| [^|]*\|$", text, re.MULTILINE))
    assert shown == {s.meaning for s in Status} | {s.value for s in ForceStatus}
