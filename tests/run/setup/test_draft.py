"""A draft holds what the folder tells, asks what it does not, and is a scene once it is answered."""

import re
import tomllib

import numpy as np
import pytest
from PIL import Image

from ploughval.errors import ConfigError
from ploughval.run.setup.draft import draft_settings, write_draft
from ploughval.scene import load_scene

ANSWERS = {
    "depth_mm": "30.0",
    "width_mm": "218.0",
    "unit_weight_kN_m3": "15.7",
    "peak_friction_deg": "50.0",
    "residual_friction_deg": "32.0",
    "mm_per_px": "0.125",
    "tip_px": "[199.5, 599.5]",
    "spacing_mm": "150.0",
    "lower_to_tip_mm": "260.0",
}


def answered(text):
    """The draft with the known answers put in, as a user would."""
    text = text.replace('direction = "?"', 'direction = "right"')

    def put(match):
        return f"{match[1]} = {ANSWERS[match[1]]}" if match[1] in ANSWERS else match[0]

    return re.sub(r"^# (\w+) = (?:.* )?\?$", put, text, flags=re.MULTILINE)


def write_log(path, names="time_s,displacement_mm,moment_upper_Nm,moment_lower_Nm", *, rest_s=9.5):
    time = np.arange(0, 40, 0.1)
    u = np.clip(time - rest_s, 0, None) * 1.25  # 1.25 mm/s after rest
    noise = np.random.default_rng(2).normal(0, 1e-3, (3, time.size))
    rows = np.column_stack([time, u + noise[0], 3 + noise[1], 2 + noise[2]])
    path.parent.mkdir(exist_ok=True)
    np.savetxt(path, rows, fmt="%.5f", delimiter=",", header=names, comments="")


@pytest.fixture
def folder(tmp_path):
    """Photographs with a table of times, a log, two empty runs."""
    (tmp_path / "photos").mkdir()
    for k in range(3):
        Image.new("L", (64, 48)).save(tmp_path / "photos" / f"{k}.png")
    (tmp_path / "photos.csv").write_text("file,time_s\n0.png,10\n1.png,12\n2.png,14\n")
    write_log(tmp_path / "loadcells.csv")
    for k in range(2):
        write_log(tmp_path / "empty" / f"{k}.csv")
    return tmp_path


def test_the_draft_asks_for_what_only_the_user_knows(folder):
    path = write_draft(folder)
    with pytest.raises(ConfigError) as caught:
        load_scene(folder)
    assert {fault.place for fault in caught.value.faults} == {
        "blade.depth_mm",
        "blade.width_mm",
        "soil.unit_weight_kN_m3",
        "soil.peak_friction_deg",
        "soil.residual_friction_deg",
        "camera",  # no calibration yet
        "camera.direction",
        "loadcells.spacing_mm",
        "loadcells.lower_to_tip_mm",
    }
    asked = re.findall(r"^# (\w+) = (?:.* )?\?$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert set(asked) == set(ANSWERS)


def test_the_answered_draft_is_a_scene_of_the_files_that_are_there(folder):
    path = write_draft(folder)
    path.write_text(answered(path.read_text(encoding="utf-8")), encoding="utf-8")
    scene = load_scene(folder)
    assert scene.test.name == folder.name
    assert scene.camera.photos == "photos/*.png"
    assert scene.camera.times == "photos.csv"
    assert scene.loadcells.log == "loadcells.csv"
    assert scene.loadcells.empty == ("empty/*.csv",)
    assert scene.blade.speed_mm_s == pytest.approx(1.25, rel=2e-3)
    start, end = scene.loadcells.rest_s
    assert start == 0.0
    assert 5.0 < end <= 9.5, "the window ends before the blade moves and holds most of the rest"


def test_number_and_size_of_the_photographs_are_told(folder):
    assert "3 photographs of 64 x 48 px, 8 bit, grey" in draft_settings(folder)


def test_exif_times_are_used_where_they_are_true(tmp_path):
    for k in range(3):
        exif = Image.Exif()
        exif[0x8769] = {0x9003: f"2024:05:01 10:00:{4 * k:02d}"}
        Image.new("L", (64, 48)).save(tmp_path / f"IMG_{k}.JPG", exif=exif)
    settings = tomllib.loads(draft_settings(tmp_path))
    assert settings["camera"] == {"photos": "*.JPG", "times": "exif", "direction": "?"}
    assert "8 s from first to last" in draft_settings(tmp_path)
    write_log(tmp_path / "log.csv")
    assert tomllib.loads(draft_settings(tmp_path))["camera"]["clock_offset_s"] == "auto"


def test_the_times_of_an_animation_are_used(tmp_path):
    pictures = [Image.fromarray(np.full((20, 30), 9 * k, np.uint8)) for k in range(4)]
    pictures[0].save(tmp_path / "a.gif", save_all=True, append_images=pictures[1:], duration=250)
    text = draft_settings(tmp_path)
    assert "4 photographs of 30 x 20 px" in text
    assert 'times = "video"                 # shown over 0.75 s' in text


def test_a_frozen_camera_clock_is_not_used(tmp_path):
    exif = Image.Exif()
    exif[0x8769] = {0x9003: "2024:05:01 10:00:00"}
    for k in range(3):
        Image.new("L", (64, 48)).save(tmp_path / f"{k}.jpg", exif=exif)
    text = draft_settings(tmp_path)
    assert "times" not in tomllib.loads(text)["camera"]
    assert "no usable times" in text


def test_columns_of_another_name_are_recognised(folder):
    write_log(folder / "loadcells.csv", "Time (s),Disp [mm],Bending upper,Bending lower")
    settings = tomllib.loads(draft_settings(folder))
    assert settings["loadcells"]["columns"] == {
        "time_s": "Time (s)",
        "displacement_mm": "Disp [mm]",
        "moment_upper_Nm": "Bending upper",
        "moment_lower_Nm": "Bending lower",
    }
    assert settings["blade"]["speed_mm_s"] == pytest.approx(1.25, rel=2e-3)


def test_columns_that_are_not_clear_are_asked_with_what_is_there(folder):
    write_log(folder / "loadcells.csv", "time_s,displacement_mm,M1,M2")
    text = draft_settings(folder)
    assert "# moment_upper_Nm = ?" in text
    assert "'M1', 'M2'" in text
    assert tomllib.loads(text)["loadcells"]["columns"] == {
        "time_s": "time_s",
        "displacement_mm": "displacement_mm",
    }


def test_a_log_that_never_moves_says_so(folder):
    write_log(folder / "loadcells.csv", rest_s=100)
    text = draft_settings(folder)
    assert "# the displacement does not move" in text
    assert "rest_s" not in tomllib.loads(text)["loadcells"]


def test_a_board_is_offered_and_refused_until_its_numbers_are_given(folder):
    (folder / "calibration").mkdir()
    Image.new("L", (64, 48)).save(folder / "calibration" / "board.png")
    text = draft_settings(folder)
    offered = re.search(r"^# (board = .*)$", text, flags=re.MULTILINE)[1]
    assert tomllib.loads(offered)["board"]["picture"] == "calibration/board.png"
    assert tomllib.loads(text)["camera"]["photos"] == "photos/*.png"
    (folder / "test.toml").write_text(text.replace("# board = ", "board = "), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        load_scene(folder)
    places = {fault.place for fault in caught.value.faults}
    assert {f"camera.board.{key}" for key in ("kind", "columns", "rows", "spacing_mm")} <= places


def test_no_example_value_can_be_taken_for_an_answer(folder):
    """Every optional line, its comment sign taken away, is a guess from the files, a default or no TOML."""
    (folder / "photos.csv").unlink()
    defaults = {"thickness_mm", "mobilization_length_mm", "wall_friction_deg"}
    for line in re.findall(r"^# (\w+ = .*)$", draft_settings(folder), flags=re.MULTILINE):
        try:
            key = next(iter(tomllib.loads(line)))
        except tomllib.TOMLDecodeError:
            continue
        assert key in defaults | {"empty", "dyed", "clock_offset_s"}, line


@pytest.mark.parametrize("name", ['a "quoted" test', "tab\there", "Prüfung [1]", "back\\slash"])
def test_any_folder_name_gives_a_draft_that_can_be_read(tmp_path, name):
    place = tmp_path / name / "img [a]"
    place.mkdir(parents=True)
    Image.new("L", (64, 48)).save(place / "1.png")
    write_draft(tmp_path / name)
    path = tmp_path / name / "test.toml"
    path.write_text(answered(path.read_text(encoding="utf-8")), encoding="utf-8")
    scene = load_scene(tmp_path / name)
    assert scene.test.name == name
    assert [p.name for p in scene.matches(scene.camera.photos)] == ["1.png"]


def test_an_empty_folder_gives_a_draft_of_a_simulation(tmp_path):
    path = write_draft(tmp_path)
    path.write_text(answered(path.read_text(encoding="utf-8")), encoding="utf-8")
    assert load_scene(tmp_path).steps == ("model", "report")


def test_settings_that_are_there_are_never_written_over(folder):
    (folder / "test.toml").write_text("mine")
    with pytest.raises(ConfigError, match="a file that exists"):
        write_draft(folder)
    assert (folder / "test.toml").read_text() == "mine"


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="expected a folder"):
        write_draft(tmp_path / "gone")


def test_broken_files_do_not_stop_a_draft(folder):
    (folder / "photos" / "0.png").write_bytes(b"")
    (folder / "notes.txt").write_bytes(b"\xff\xfe\x00")
    (folder / "loadcells.csv").write_text("time_s,displacement_mm,moment_upper_Nm,moment_lower_Nm\n")
    text = draft_settings(folder)
    assert tomllib.loads(text)["loadcells"]["log"] == "loadcells.csv"
    assert "fewer than two" in text or "expected" in text
