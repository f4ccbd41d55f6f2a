"""The end of a run: what became of each stage, and a page that stands where nothing on it has changed."""

import json

import numpy as np
import pytest

from ploughval.run.findings import Findings
from ploughval.run.finish import QUICK, RESUMED, clear, finish, reused, stage_notes
from ploughval.run.kept.store import Key, Store
from ploughval.scene import load_scene

KEY, OTHER = Key.of(code="1"), Key.of(code="2")
SETTINGS = """
[test]
name = "sand"
[blade]
depth_mm = 30.0
width_mm = 218.0
[soil]
unit_weight_kN_m3 = 15.7
peak_friction_deg = 40.0
residual_friction_deg = 33.0
"""


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "test.toml").write_text(SETTINGS)
    return load_scene(tmp_path)


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / "results"
    folder.mkdir()
    (folder / "metrics.json").write_text("{}")
    return folder


def test_each_stage_says_what_became_of_it_and_why(results):
    Store(results).save("force", KEY, {"x": np.ones(1)})
    Store(results).save("bands", OTHER, {"x": np.ones(1)})
    kept = Store(results)
    for stage in ("force", "bands", "window"):
        kept.load(stage, KEY)
    notes = stage_notes(Findings(timings_s={"force": 1.0, "model": 0.1}), kept)
    assert notes == {
        "force": {"done": "reused", "why": "same inputs, settings and code"},
        "bands": {"done": "run", "why": "changed: code"},
        "photographs": {"done": "run", "why": "nothing was kept"},
        "model": {"done": "run", "why": QUICK},
    }
    assert reused(kept) == ("force",)


def test_a_walk_that_went_on_from_pieces_says_so(results):
    kept = Store(results)
    kept.save("walked", KEY, {"x": np.ones(1)})
    for stage in ("window", "walked"):
        kept.load(stage, KEY)
    notes = stage_notes(Findings(), kept)
    assert notes == {"photographs": {"done": "run", "why": RESUMED}}
    assert reused(kept) == ()


def test_the_page_is_made_when_something_on_it_has_changed_and_only_then(scene, results):
    made = []

    def page(folder):
        made.append(json.loads((folder / "run.json").read_text())["stages"]["report"]["done"])
        (folder / "report.html").write_text(f"page {len(made)}")
        return folder / "report.html"

    def again(seconds):
        kept = Store(results)
        clear(results, kept)
        assert not (results / "report.html").exists()
        path = finish(scene, Findings(timings_s={"model": seconds}), kept, page)
        return path.read_text()

    assert again(1.0) == "page 1"
    assert again(2.0) == "page 1"
    (results / "metrics.json").write_text('{"metrics": {}}')
    assert again(3.0) == "page 2"
    assert again(3.0) == "page 2"
    (results / "fit.json").write_text("{}")
    assert again(3.0) == "page 3"
    assert made == ["run", "run", "run"]


def test_a_page_that_cannot_be_read_is_made_again(scene, results):
    def page(folder):
        (folder / "report.html").write_text("page")
        return folder / "report.html"

    finish(scene, Findings(), Store(results), page)
    (path,) = (results / ".store").glob("page-*.npz")
    path.write_bytes(path.read_bytes()[:-30])
    kept = Store(results)
    assert finish(scene, Findings(), kept, page).read_text() == "page"
    assert kept.told["page"] == (False, "what was kept cannot be read")


def test_what_killed_runs_left_is_gone_before_a_run_begins(results):
    dead = [results / ".a.part-abcdefgh.csv", results / ".store" / ".b.part-abcdefgh.npz"]
    dead.append(results / "model" / ".force.part-abcdefgh.csv")
    for path in (*dead, results / "run.json", results / "report.html"):
        path.parent.mkdir(exist_ok=True)
        path.write_text("x")
    clear(results, Store(results))
    assert [path.name for path in results.rglob("*") if path.is_file()] == ["metrics.json"]
