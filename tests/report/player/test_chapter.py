"""The player's chapter: there when something can be shown, silent about nothing, bounded in weight."""

import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest

from ploughval.report.page import single_page
from ploughval.report.photographs import open_photographs
from ploughval.report.player import chapter as module
from ploughval.report.player import player_chapter
from ploughval.report.player.coding import unpack_lines
from ploughval.report.player.frames import spread
from ploughval.results import read_results

HOSTILE = "</script><img src=x onerror='window.__hit=1'>&\"<b>"


def chapter_of(folder):
    results = read_results(folder)
    return player_chapter(results, open_photographs(results))


def data_of(chapter):
    return json.loads(re.search(r'id="player-data">(.*?)</script', str(chapter.player), flags=re.S).group(1))


def toggles(chapter):
    return re.findall(r'data-player="toggle-([a-z-]+)"', str(chapter.player))


def test_the_chapter_stands_after_the_verdict(result_folder):
    order = re.findall(r'<section id="([^"]+)"', single_page(read_results(result_folder)))
    assert order[0] in ("short", "agreement")
    assert order[1] == "player"


def test_every_frame_of_the_ledger_is_there_with_its_travel_and_force(result_folder):
    data = data_of(chapter_of(result_folder))
    frames = data["frames"]
    assert [frame["n"] for frame in frames] == list(range(13))
    assert [frame["u"] for frame in frames] == pytest.approx(np.linspace(0, 60, 13), abs=1e-3)
    force = pd.read_csv(result_folder / "force.csv").set_index("u_mm")["force_N"]
    assert frames[6]["P"] == pytest.approx(force.loc[30.0], abs=1e-4)
    assert frames[5]["why"] == "truncated file"
    assert all(not frame["why"] for frame in frames if frame["n"] != 5)


def test_notes_of_the_ledger_go_with_their_frame(own_folder):
    record = json.loads((own_folder / "run.json").read_text())
    record["frames"][7]["notes"] = ["the camera was knocked", HOSTILE]
    (own_folder / "run.json").write_text(json.dumps(record))
    frames = data_of(chapter_of(own_folder))["frames"]
    assert frames[7]["note"] == f"the camera was knocked; {HOSTILE}"
    assert "note" not in frames[6]


def test_the_drawing_without_scripts_shows_the_last_frame_and_its_lines(result_folder):
    markup = str(chapter_of(result_folder).player)
    stage = re.search(r"<svg data-player=\"stage\".*?</svg>", markup, flags=re.S).group(0)
    assert 'data-frame="12"' in stage
    assert set(re.findall(r'data-layer="([a-z-]+)"', stage)) >= {
        "layers-measured",
        "layers-predicted",
        "surface",
        "bands",
        "blade",
    }
    assert ">predicted<" in stage
    assert ">measured<" in stage


def test_the_drawing_without_scripts_has_its_photograph_once(make_pictured):
    folder = make_pictured()
    chapter = chapter_of(folder)
    data = data_of(chapter)
    assert str(chapter.player).count("<image ") == 1
    # Frame 5 was lost for another reason than its file: its photograph can be looked at.
    assert [k for k, frame in enumerate(data["frames"]) if "p" not in frame] == [data["still"]]
    assert data["frames"][data["still"]]["n"] == 12


def test_a_photograph_that_cannot_be_read_is_named_with_its_reason(make_pictured):
    folder = make_pictured()
    (folder.parent / "photos" / "f003.png").write_bytes(b"no longer a photograph")
    frames = data_of(chapter_of(folder))["frames"]
    assert "p" not in frames[3]
    assert "not a picture" in frames[3]["unread"]
    assert not frames[3]["why"]  # the run had it
    assert frames[3]["L"]


def test_without_photographs_the_sand_is_a_shape_and_the_page_says_why(make_results, tmp_path):
    chapter = chapter_of(make_results(tmp_path / "r", test_folder=tmp_path / "moved"))
    assert "photograph" not in toggles(chapter)
    assert any("can no longer be read" in note for note in chapter.notes)
    assert 'data-layer="sand"' in str(chapter.player)


def test_a_model_run_alone_shows_the_predicted_panel_alone(result_folder, tmp_path):
    shutil.copytree(result_folder / "model", tmp_path / "model")
    chapter = chapter_of(tmp_path)
    assert data_of(chapter)["panels"] == ["predicted"]
    assert "layers-measured" not in toggles(chapter)
    assert "tracks" not in toggles(chapter)


def test_a_test_without_a_model_shows_the_measured_panel_alone(own_folder):
    shutil.rmtree(own_folder / "model")
    chapter = chapter_of(own_folder)
    assert data_of(chapter)["panels"] == ["measured"]
    assert "layers-predicted" not in toggles(chapter)


def test_without_a_force_there_is_no_chart(own_folder):
    (own_folder / "force.csv").unlink()
    (own_folder / "model" / "force.csv").unlink()
    chapter = chapter_of(own_folder)
    assert data_of(chapter)["force"] is None
    assert 'data-player="force"' not in str(chapter.player)
    assert 'data-player="save-force"' not in str(chapter.player)


def test_without_frames_and_model_there_is_no_chapter(own_folder):
    for name in ("layers.csv", "surface.csv", "tracks.nc", "blade.csv", "run.json", "model/layers.csv"):
        (own_folder / name).unlink()
    assert chapter_of(own_folder) is None


def test_hostile_reasons_files_and_sources_stay_text(own_folder):
    record = json.loads((own_folder / "run.json").read_text())
    record["frames"][5]["reason"] = HOSTILE
    record["frames"][12]["file"] = HOSTILE
    (own_folder / "run.json").write_text(json.dumps(record))
    layers = pd.read_csv(own_folder / "layers.csv")
    layers["source"] = HOSTILE
    layers.to_csv(own_folder / "layers.csv", index=False)
    chapter = chapter_of(own_folder)
    markup = str(chapter.player)
    assert "<img" not in markup
    assert "<b>" not in markup
    assert markup.count("</script") == 1
    data = data_of(chapter)
    assert data["frames"][5]["why"] == HOSTILE
    assert [HOSTILE, 5.0] in data["tags"]


def test_the_same_results_give_the_same_bytes(make_pictured):
    folder = make_pictured()
    assert str(chapter_of(folder).player) == str(chapter_of(folder).player)


def test_many_frames_are_thinned_at_even_travel_and_the_page_says_so(own_folder, monkeypatch):
    monkeypatch.setattr(module, "MOST_FRAMES", 5)
    chapter = chapter_of(own_folder)
    data = data_of(chapter)
    assert [frame["n"] for frame in data["frames"]] == [0, 3, 6, 9, 12]
    assert any("5 of 13 frames" in note for note in chapter.notes)
    assert unpack_lines(data["frames"][2]["L"], data["tolerance"])


def test_more_photographs_than_the_page_holds_are_left_out_and_named(make_pictured, monkeypatch):
    monkeypatch.setattr(module, "MOST_PICTURES", 4)
    chapter = chapter_of(make_pictured())
    data = data_of(chapter)
    held = [k for k, frame in enumerate(data["frames"]) if "p" in frame or k == data["still"]]
    assert held == [0, 4, 8, 12]
    assert any("4 of 12 photographs" in note for note in chapter.notes)


def test_the_weight_is_bounded_for_any_number_of_frames(make_results, tmp_path):
    """A thousand frames of 4 layers: what the player holds is bounded by its budgets, not by the test."""
    folder = make_results(tmp_path / "r")
    rng = np.random.default_rng(2)
    frames = 1000
    x = np.arange(0.0, 150.0, 3.0)
    shape = (frames, 4, x.size)
    columns = {
        "frame": np.broadcast_to(np.arange(frames)[:, None, None], shape).ravel(),
        "u_mm": np.broadcast_to(np.linspace(0, 60, frames)[:, None, None], shape).ravel(),
        "layer": np.broadcast_to(np.arange(5.0, 25.0, 5.0)[None, :, None], shape).ravel(),
        "x_mm": np.broadcast_to(x, shape).ravel(),
    }
    table = pd.DataFrame({**columns, "source": "tracks", "std_mm": 0.02})
    table["y_mm"] = table["layer"] + rng.normal(0, 0.05, len(table))
    table.to_csv(folder / "layers.csv", index=False, float_format="%.6g")
    chapter = chapter_of(folder)
    assert len(data_of(chapter)["frames"]) <= module.MOST_FRAMES
    assert len(str(chapter.player)) < 2.5e6


def test_frames_without_a_travel_are_spread_between_their_neighbours():
    travel = [0.0, 1.0, float("nan"), 3.0, 4.0]
    assert spread(travel, 5) == [0, 1, 2, 3, 4]
    assert spread(travel, 3) == [0, 2, 4]
    assert spread([float("nan")] * 4, 2) == [0, 3]
