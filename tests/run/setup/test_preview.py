"""A check names every fault at once, says how grave each is, and changes nothing in the folder."""

import hashlib
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from ploughval.report.preview import shown_of
from ploughval.run.setup.check_findings import Level
from ploughval.run.setup.draft import write_draft
from ploughval.run.setup.preview import preview
from ploughval.scene import load_scene

DATA = Path(__file__).parents[3] / "data"


@pytest.fixture
def folder(tmp_path):
    """A copy of the example without its truth."""
    out = tmp_path / "test"
    shutil.copytree(DATA / "example", out, ignore=shutil.ignore_patterns("truth"))
    return out


def edit(folder, *changes):
    path = folder / "test.toml"
    text = path.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")


def places(found, level):
    return {finding.fault.place for finding in found.findings if finding.level is level}


def digests(folder):
    return {p: hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.rglob("*") if p.is_file()}


def spoil_files(folder):
    """An empty photograph, a truncated one, a missing one, a spoiled log and a spoiled empty run."""
    photos = folder / "photos"
    (photos / "0003.png").write_bytes(b"")
    data = (photos / "0005.png").read_bytes()
    (photos / "0005.png").write_bytes(data[: len(data) // 5])
    (photos / "0007.png").unlink()
    rows = (folder / "loadcells.csv").read_text().splitlines()
    rows[800] = f"x,{rows[800]}"
    del rows[1000:1100]
    (folder / "loadcells.csv").write_text("\n".join(rows) + "\n")
    (folder / "empty" / "run1.csv").write_text("nonsense\n")


def test_a_sound_test_has_no_findings(folder):
    before = digests(folder)
    found = preview(folder)
    assert found.findings == ()
    assert found.worst is None
    assert found.seen.sight is not None
    assert len(found.seen.points.px) == 781
    assert digests(folder) == before, "nothing in the folder is changed"


def test_real_photographs_have_no_findings():
    found = preview(DATA / "real-wall-push")
    assert found.worst in (None, Level.REMARK)
    assert found.seen.calibration is not None


def test_faults_of_all_files_are_named_at_once(folder):
    spoil_files(folder)
    found = preview(folder)
    assert found.worst is Level.LOST
    assert places(found, Level.LOST) == {
        "camera.photos, frame 3",
        "camera.photos, frame 5",
        "camera.times",
        "loadcells.log",
        "loadcells.empty",
    }
    texts = "\n".join(map(str, found.findings))
    for part in ("0003.png", "0005.png", "0007.png", "line 801", "1 gap in time", "run1.csv"):
        assert part in texts


def test_refused_settings_hide_no_fault_of_the_files(folder):
    spoil_files(folder)
    edit(
        folder,
        ("depth_mm = 30.0", "depht_mm = 30.0"),
        ("width_mm = 218.0", 'width_mm = "wide"'),
        ("spacing_mm = 150.0", "spacing_cm = 15.0"),
        ("mm_per_px = 0.3\n", ""),
    )
    found = preview(folder)
    assert found.worst is Level.REFUSED
    assert places(found, Level.REFUSED) == {
        "blade.depht_mm",
        "blade.width_mm",
        "loadcells.spacing_cm",
        "camera",
    }
    assert {"camera.photos, frame 3", "camera.times", "loadcells.log", "loadcells.empty"} <= places(
        found, Level.LOST
    )
    assert found.seen.image is not None, "the photograph is still shown"


def test_a_folder_without_settings_is_refused_with_the_way_to_write_them(tmp_path):
    found = preview(tmp_path)
    assert found.worst is Level.REFUSED
    assert "ploughval init" in str(found.findings[0])


def test_times_that_cannot_be_used_hide_nothing_else(folder):
    (folder / "photos.csv").write_text("file,time_s\n0000.png,soon\n", encoding="utf-8")
    edit(folder, ("[loadcells]", "view_px = [0, 0, 9999, 200]\n\n[loadcells]"))
    found = preview(folder)
    texts = "\n".join(str(f) for f in found.findings if f.level is Level.REFUSED)
    assert "times that are not numbers" in texts or "soon" in texts
    assert "camera.view_px" in texts


@pytest.mark.parametrize(
    ("change", "place", "expected"),
    [
        (('direction = "right"', 'direction = "left"'), "camera.direction", "right"),
        (("mm_per_px = 0.3", "mm_per_px = 0.31"), "camera.mm_per_px", "0.3"),
        (("clock_offset_s = 0.0", "clock_offset_s = 7.0"), "camera.clock_offset_s", "0.0"),
        (("depth_mm = 30.0", "depth_mm = 40.0"), "blade.depth_mm", "100 px"),
        (("tip_px = [56.7, 213.5]", "tip_px = [66.7, 213.5]"), "camera.tip_px", "57"),
    ],
)
def test_settings_that_the_photographs_contradict_are_named(folder, change, place, expected):
    """The values that are expected are those of the recipe of the example."""
    edit(folder, change)
    finding = next(f for f in preview(folder).findings if f.fault.place == place)
    assert finding.level is Level.LOST
    assert expected in finding.fault.expected


def test_every_unanswered_question_of_a_draft_is_named_and_the_answered_draft_passes(folder):
    original = load_scene(folder)
    (folder / "test.toml").unlink()
    write_draft(folder)
    path = folder / "test.toml"
    text = path.read_text(encoding="utf-8")
    asked = set(re.findall(r"^# (\w+) = (?:.* )?\?$", text, flags=re.MULTILINE))
    refused = places(preview(folder), Level.REFUSED)
    assert {place.rpartition(".")[2] for place in refused - {"camera"}} == asked - {"mm_per_px", "tip_px"}
    assert "camera" in refused, "no calibration yet"

    def answer(match):
        guess = (match[2] or "").strip()
        tables = (original.blade, original.soil, original.camera, original.loadcells)
        value = next(getattr(t, match[1]) for t in tables if hasattr(t, match[1]))
        return f"{match[1]} = {guess or value}"

    path.write_text(re.sub(r"^# (\w+) = (.* )?\?$", answer, text, flags=re.MULTILINE), encoding="utf-8")
    scene = load_scene(folder)
    assert scene.camera.direction == original.camera.direction
    assert scene.camera.mm_per_px == pytest.approx(0.3, rel=0.01)
    np.testing.assert_allclose(scene.camera.tip_px, original.camera.tip_px, atol=3.0)
    assert scene.blade.depth_mm == pytest.approx(30.0, rel=0.03)
    assert preview(folder).worst in (None, Level.REMARK)


def test_painted_markers_that_are_not_there_are_named(folder):
    edit(
        folder,
        (
            "[loadcells]",
            "[camera.markers]\nradius_px = 6.0\nfixed_px = [[300, 40], [400, 40], [500, 40]]\n\n[loadcells]",
        ),
    )
    found = preview(folder)
    lost = places(found, Level.LOST)
    assert {f"camera.markers.fixed_px.{k}" for k in range(3)} <= lost
    np.testing.assert_allclose(found.seen.missing_px, [[300, 40], [400, 40], [500, 40]])


def test_a_mistyped_control_point_is_named_and_the_points_are_shown_as_given(folder):
    """Scale and tip of the example as five points, the third with a wrong number."""
    px = [(100.0, 20.0), (500.0, 20.0), (500.0, 220.0), (100.0, 220.0), (300.0, 120.0), (200.0, 60.0)]
    points = [[x, y, round((x - 56.7) * 0.3, 3), round((213.5 - y) * 0.3, 3)] for x, y in px]
    points[2][2] += 30.0
    edit(
        folder,
        ("mm_per_px = 0.3\n", f"control_points = {points}\n"),
        ("tip_px = [56.7, 213.5]", "#"),
    )
    found = preview(folder)
    assert found.worst is Level.REFUSED
    assert "control_points.2" in "\n".join(map(str, found.findings))
    assert found.seen.calibration is None
    np.testing.assert_allclose(shown_of(found).given_px, px)


def test_photographs_outside_of_the_log_are_counted(folder):
    """Photographs from 10 to 65 s, one each 1.8966 s; the log ends at 66 s."""
    edit(folder, ("clock_offset_s = 0.0", "clock_offset_s = -10.0"))
    texts = [f.fault.value for f in preview(folder).findings if f.fault.place == "camera.clock_offset_s"]
    assert any(text.startswith("5 of 30 photographs") for text in texts)


def test_a_lost_first_photograph_is_refused_once_and_makes_no_contradiction(folder):
    """The log has the blade under way in the second photograph."""
    (folder / "photos" / "0000.png").write_bytes(b"")
    found = preview(folder)
    assert places(found, Level.REFUSED) == {"camera.photos, frame 0"}
    assert "camera.tip_px" not in places(found, Level.LOST)


def test_sand_without_texture_is_said(folder):
    from PIL import Image, ImageFilter

    for path in (folder / "photos").iterdir():
        Image.open(path).filter(ImageFilter.GaussianBlur(12)).save(path)
    texts = [str(f) for f in preview(folder).findings if f.level is Level.LOST]
    assert any("first tracks" in text and "piv.track" in text for text in texts)


def test_calibration_tables_of_the_cells_are_judged(folder):
    (folder / "loads.csv").write_text("load_N,arm_mm,upper\n0,0,1\n10,0,3\n", encoding="utf-8")
    edit(folder, ("[tracers]", '[loadcells.calibration]\nfiles = ["loads.csv"]\n\n[tracers]'))
    found = preview(folder)
    assert found.worst is Level.REFUSED
    refused = [f for f in found.findings if f.level is Level.REFUSED]
    assert any("no column lower" in str(f) for f in refused)


def test_findings_are_plain_texts_for_json(folder):
    spoil_files(folder)
    for finding in preview(folder).findings:
        row = finding.to_json()
        assert set(row) == {"level", "file", "place", "value", "expected", "remedy"}
        assert all(isinstance(value, str) for value in row.values())


def lean_findings(found):
    return [f for f in found.findings if f.fault.place == "blade.inclination_deg"]


def test_a_blade_that_leans_is_told_once_where_photographs_are_read(folder):
    edit(folder, ("thickness_mm = 5.0", "thickness_mm = 5.0\ninclination_deg = 12.0"))
    said = lean_findings(preview(folder))
    assert len(said) == 1
    assert said[0].level is Level.LOST
    assert "leans 12 degrees ahead" in said[0].fault.value
    assert "take [camera] out" in said[0].fault.remedy


def test_a_blade_that_leans_is_no_fault_without_photographs(folder):
    text = (folder / "test.toml").read_text()
    start, end = text.index("[camera]"), text.index("[loadcells]")
    text = (text[:start] + text[end:]).replace("dyed = true", "dyed = false")
    (folder / "test.toml").write_text(
        text.replace("depth_mm = 30.0", "depth_mm = 30.0\ninclination_deg = -5.0")
    )
    assert lean_findings(preview(folder)) == []


def test_an_upright_blade_does_not_lean(folder):
    assert lean_findings(preview(folder)) == []


def grain_remarks(found):
    return [f for f in found.findings if f.fault.place == "grains"]


def test_the_size_of_the_grains_is_told(folder):
    found = preview(folder)
    line = next(text for text in found.lines if text.startswith("grains: "))
    assert 3.0 < float(line.split()[1]) < 4.5  # drawn with 2.5 to 6 px at 1 / e^2: 0.83 of that
    assert grain_remarks(found) == []


def test_grains_that_are_too_coarse_for_the_subset_are_remarked(folder):
    edit(folder, ("[camera]", "[piv]\nsubset_px = 9\n\n[camera]"))
    (remark,) = grain_remarks(preview(folder))
    assert remark.level is Level.REMARK
    assert "set piv.subset_px to 13 or more" in remark.fault.value
