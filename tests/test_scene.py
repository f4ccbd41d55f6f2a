"""A test.toml is either a scene whose steps follow from it, or refused with all its faults at once."""

import pytest
from pydantic import ValidationError

from ploughval.errors import ConfigError
from ploughval.scene import Camera, Interval, Scene, Soil, Step, load_scene

TEST = '[test]\nname = "t"\n[blade]\ndepth_mm = 30\nwidth_mm = 218.0\n'
SOIL = "[soil]\nunit_weight_kN_m3 = 16\npeak_friction_deg = 50\nresidual_friction_deg = 32\n"
WINDOW = 'window = {thickness_mm = 12, distance_mm = 900, points_on = "inside"}\n'
CAMERA = '[camera]\nphotos = "photos/*.png"\nmm_per_px = 0.125\ntip_px = [199.5, 599.5]\n'
CELLS = (
    '[loadcells]\nlog = "loadcells.csv"\nempty = ["empty/*.csv"]\nspacing_mm = 150\nlower_to_tip_mm = 260\n'
)
TRACERS = "[tracers]\nlayers_mm = [5, 10]\n"


@pytest.fixture
def load(tmp_path):
    """Load a test.toml of this text from a folder that holds the files it names."""
    for name in ("photos/a.png", "loadcells.csv", "empty/1.csv", "photos.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("x")

    def run(text, *, encoding="utf-8") -> Scene:
        (tmp_path / "test.toml").write_bytes(text.encode(encoding) if isinstance(text, str) else text)
        return load_scene(tmp_path)

    return run


@pytest.fixture
def refused(load):
    """The faults of a text that is refused, by place."""

    def run(text, **options):
        with pytest.raises(ConfigError) as caught:
            load(text, **options)
        assert "test.toml" in str(caught.value).splitlines()[0]
        found = {fault.place: str(fault) for fault in caught.value.faults}
        assert len(found) == len(caught.value.faults)
        return found

    return run


def test_a_full_test_takes_every_step(load):
    scene = load(TEST + SOIL + CAMERA + CELLS + "[tracers]\nlayers_mm = [5, 10]\ndyed = [true, false]\n")
    assert scene.steps == tuple(Step)
    assert scene.tracers.dyed_layers_mm == (5.0,)


@pytest.mark.parametrize(
    ("text", "absent"),
    [
        (TEST + SOIL + CAMERA + TRACERS, {"force", "dye"}),
        (TEST + SOIL + CAMERA + CELLS, {"layers", "dye"}),
        (TEST + CAMERA + CELLS + TRACERS, {"model", "compare", "dye"}),
        (TEST + SOIL + CAMERA + CELLS + TRACERS + "[model]\nrun = false\n", {"model", "compare", "dye"}),
        (
            TEST + SOIL + CAMERA + CELLS + TRACERS + "[piv]\ntrack = false\n",
            {"tracks", "layers", "bands", "dye"},
        ),
    ],
)
def test_a_step_that_nothing_calls_for_is_left_out(load, text, absent):
    assert set(Step) - set(load(text).steps) == absent


def test_a_test_without_photographs_measures_force_alone(load):
    assert load(TEST + CELLS).steps == (Step.FORCE, Step.REPORT)


def test_a_scene_of_soil_alone_is_simulated(load):
    assert load(TEST + SOIL).steps == (Step.MODEL, Step.REPORT)
    assert load(TEST + SOIL + TRACERS).steps == (Step.MODEL, Step.REPORT)


def test_defaults_follow_the_contract(load):
    scene = load(TEST + SOIL + CAMERA)
    assert scene.soil.slope_of_repose_deg == 32.0
    assert scene.soil.wall_friction_deg == 0.0
    assert scene.soil.softens
    assert scene.camera.direction == "right"
    assert scene.camera.times is None
    assert scene.piv.subset_px == 31


def test_times_may_be_a_file_exif_or_an_interval(load):
    assert load(TEST + CAMERA + 'times = "exif"\n').camera.times == "exif"
    assert load(TEST + CAMERA + 'times = "photos.csv"\n').camera.times == "photos.csv"
    times = load(TEST + CAMERA + "times = {start_s = 10, interval_s = 2.0}\n").camera.times
    assert times == Interval(start_s=10.0, interval_s=2.0)


def test_the_hash_follows_the_settings_and_not_the_folder(load, tmp_path):
    first = load(TEST + SOIL).settings_hash
    assert load(TEST + "# a comment\n" + SOIL).settings_hash == first
    assert load(TEST + SOIL + "repose_deg = 33\n").settings_hash != first


def test_settings_cannot_be_changed(load):
    with pytest.raises(ValidationError, match="frozen"):
        load(TEST + SOIL).blade.depth_mm = 3.0


def test_a_byte_order_mark_and_crlf_are_read(load):
    assert load((TEST + SOIL).replace("\n", "\r\n"), encoding="utf-8-sig").blade.depth_mm == 30.0


def test_a_file_is_taken_for_its_folder(load, tmp_path):
    scene = load(TEST + CELLS)
    assert load_scene(tmp_path / "test.toml") == scene
    assert scene.path("loadcells.csv") == tmp_path / "loadcells.csv"


def test_faults_of_every_kind_are_told_together(refused):
    found = refused(
        '[test]\nname = ""\n[blade]\ndepth_cm = 3.0\nwidth_mm = -1\nspeeed_mm_s = 1\n'
        "[soil]\nunit_weight_kN_m3 = 16\npeak_friction_deg = 40\nresidual_friction_deg = 50\n"
        "repose_deg = nan\n"
        '[camera]\nphotos = "pictures/*.png"\nmm_per_px = 0.1\ntimes = "gone.csv"\nchannel = "grau"\n'
        '[loadcells]\nlog = "../loadcells.csv"\nspacing_mm = inf\nrest_s = [9, 1]\n'
        "[tracers]\nlayers_mm = [5, 5]\ndyed = [true]\n"
    )
    assert set(found) == {
        "test.name",
        "blade.depth_cm",
        "blade.width_mm",
        "blade.speeed_mm_s",
        "soil.residual_friction_deg",
        "soil.repose_deg",
        "camera.photos",
        "camera.times",
        "camera.channel",
        "camera.tip_px",
        "loadcells.log",
        "loadcells.spacing_mm",
        "loadcells.lower_to_tip_mm",
        "loadcells.rest_s",
        "tracers.layers_mm",
        "tracers.dyed",
    }


@pytest.mark.parametrize(
    ("line", "place", "told"),
    [
        ("[blade]\ndepth_cm = 3.0", "blade.depth_cm", "mm, not cm: write depth_mm = 30."),
        ("[blade]\ndepth_m = 0.03", "blade.depth_m", "mm, not m: write depth_mm = 30."),
        ("[blade]\ndepth_in = 2", "blade.depth_in", "mm, not in: write depth_mm = 50.8."),
        ("[blade]\ndepth = 3.0", "blade.depth", "The unit belongs to the name: write depth_mm."),
        ("[blade]\nspeed_mm_min = 60", "blade.speed_mm_min", "write speed_mm_s = 1."),
        ("[blade]\nDepth_mm = 30", "blade.Depth_mm", "expected depth_mm"),
        ("[blade]\nthicknes_mm = 3", "blade.thicknes_mm", "expected thickness_mm"),
        ("[box]\nspeed_mm_s = 3", "box.speed_mm_s", "It belongs in [blade]"),
        ("[soil]\nunit_weight_g_cm3 = 1.6", "soil.unit_weight_g_cm3", "write unit_weight_kN_m3 = 15.6906."),
        ("[soil]\npeak_friction_rad = 0.5", "soil.peak_friction_rad", "write peak_friction_deg = 28.6479."),
        ("[bandz]\nmin_slip_mm = 1", "bandz", "expected bands"),
        ("[loadcells.columns]\ntime = 't'", "loadcells.columns.time", "write time_s"),
        ("[quux]\na = 1", "quux", "expected one of test, blade"),
    ],
)
def test_an_unknown_key_is_told_with_the_one_that_was_meant(refused, line, place, told):
    found = refused(line + "\n")
    assert told in found[place]
    assert "does not exist" in found[place]
    meant = told.split("write ")[-1].split(" ")[0].strip(".")
    assert f"{place.rpartition('.')[0]}.{meant}" not in found, "a key that was meant is not missing as well"


BOARD = 'board = {kind = "dots", picture = "b.png", columns = 9, rows = 5, spacing_mm = 10}'


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        ("mm_per_px = 0.1\ntravel_px = [90, 50]", "none without board"),
        (BOARD + "\ntravel_px = [10, 50]", "a place to the right of tip_px"),
        (BOARD + '\ndirection = "left"\ntravel_px = [90, 50]', "a place to the left of tip_px"),
    ],
)
def test_a_line_of_travel_that_cannot_be_is_refused(refused, lines, told):
    found = refused(TEST + SOIL + f'[camera]\nphotos = "p/*.png"\ntip_px = [50, 50]\n{lines}\n')
    assert told in found["camera.travel_px"]


def test_folder_and_source_are_no_keys(refused):
    assert set(refused('folder = "/"\nsource = "x"\n' + TEST + SOIL)) == {"folder", "source"}


@pytest.mark.parametrize(
    ("text", "place", "told"),
    [
        (TEST.replace("30", "nan") + SOIL, "blade.depth_mm", "got nan; expected a finite number"),
        (TEST.replace("30", "-inf") + SOIL, "blade.depth_mm", "got -inf; expected a finite number"),
        (
            TEST.replace("30", "0") + SOIL,
            "blade.depth_mm",
            "got 0; expected more than 0. depth_mm: depth of the tip",
        ),
        (TEST.replace("30", "1e10") + SOIL, "blade.depth_mm", "expected at most 10000"),
        (TEST.replace("30", "1" * 400) + SOIL, "blade.depth_mm", "expected"),
        (TEST.replace("30", "true") + SOIL, "blade.depth_mm", "got true; expected a number"),
        (
            TEST.replace("30", "'30'") + SOIL,
            "blade.depth_mm",
            "got '30'; expected a number. Write it without quotes",
        ),
        (TEST.replace("30", "1979-05-27") + SOIL, "blade.depth_mm", "expected a number"),
        (TEST.replace('"t"', "5") + SOIL, "test.name", "got 5; expected text in quotes"),
        (TEST + SOIL + "[piv]\ntrack = 1\n", "piv.track", "got 1; expected true or false"),
        (TEST + SOIL + "[piv]\nsubset_px = 31.5\n", "piv.subset_px", "got 31.5; expected a whole number"),
        (TEST + SOIL + "[piv]\norder = 7\n", "piv.order", "got 7; expected 0, 1 or 2"),
        (TEST + SOIL.replace("50", "95"), "soil.peak_friction_deg", "got 95; expected less than 90"),
        (TEST + SOIL + "wall_friction_deg = 45\n", "soil.wall_friction_deg", "got 45; expected less than 40"),
        (TEST + CAMERA + "clock_offset_s = 'atuo'\n", "camera.clock_offset_s", "expected a number or 'auto'"),
        (
            TEST + CAMERA + "times = {start_s = 1}\n",
            "camera.times.interval_s",
            "got nothing; expected a value",
        ),
        (TEST + CAMERA + "times = {start_s = 1, interval_s = 0}\n", "camera.times.interval_s", "more than 0"),
        (TEST + CAMERA + "view_px = [1, 2, 3]\n", "camera.view_px", "expected 4 values"),
        (TEST + CAMERA + WINDOW.replace("12", "1e9"), "camera.window.thickness_mm", "expected at most 1000"),
        (TEST + CAMERA + WINDOW.replace("900", "1e-9"), "camera.window.distance_mm", "expected at least 1"),
        (TEST + CAMERA + "markers = {radius_px = 1e9}\n", "camera.markers.radius_px", "at most 10000"),
        (TEST + CAMERA + "markers = {radius_px = 1e-9}\n", "camera.markers.radius_px", "at least 2"),
        (TEST + CAMERA + "board = {}\n", "camera", "got mm_per_px and board; expected exactly one of"),
        ("blade = 3\n" + TEST.split("[blade]")[0] + SOIL, "blade", "got 3; expected a table"),
        (SOIL, "blade", "got nothing; expected a value. Add [blade] with depth_mm, width_mm."),
        (TEST, "test.toml", "at least one of [camera], [loadcells] and [soil]"),
        (TEST + CELLS + TRACERS, "tracers", "expected [camera] or [soil] too"),
        (
            TEST + SOIL + TRACERS.replace("10", "31"),
            "tracers.layers_mm",
            "got 31; expected heights above the",
        ),
        (TEST + CAMERA.split("mm_per_px")[0], "camera", "got none; expected exactly one of mm_per_px"),
    ],
)
def test_an_impossible_value_is_told_with_what_was_expected(refused, text, place, told):
    assert told in refused(text)[place]


def test_control_points_are_judged_one_by_one(refused):
    points = 'control_points = [[1, 2, 3], [1, 2, 3, 4, 5], [1, 2, 3, "x"]]\n'
    found = refused(TEST + '[camera]\nphotos = "photos/*.png"\n' + points)
    assert "expected 4 values" in found["camera.control_points.0"]
    assert "expected 4 values" in found["camera.control_points.1"]
    assert "got 'x'; expected a number" in found["camera.control_points.2.3"]
    assert "got 3 points; expected at least 4" in found["camera.control_points"]


@pytest.mark.parametrize(
    "name",
    [
        "../secret.csv",
        "/etc/passwd",
        "a/../../b.csv",
        "C:\\\\data\\\\log.csv",
        "C:/log.csv",
        "empty\\\\1.csv",
        " ",
        "a\\u0000b",
    ],
)
def test_a_path_out_of_the_folder_is_refused(refused, name):
    found = refused(TEST + CELLS.replace("loadcells.csv", name))
    assert "expected a path inside the test folder" in found["loadcells.log"]


@pytest.mark.parametrize("pattern", ["photos/*.jpg", "**.png", "photos", "photos/[.png"])
def test_a_pattern_that_matches_nothing_is_refused_with_what_is_there(refused, pattern):
    found = refused(TEST + CAMERA.replace("photos/*.png", pattern))
    assert "expected at least one file that matches" in found["camera.photos"]
    assert "holds" in found["camera.photos"]


def test_a_missing_file_is_told_with_its_likeness(refused):
    found = refused(TEST + CELLS.replace("loadcells.csv", "load_cells.csv"))
    assert "expected an existing file" in found["loadcells.log"]
    assert "loadcells.csv" in found["loadcells.log"].split("holds")[1]


def test_a_name_with_brackets_is_a_name_before_it_is_a_pattern(load, tmp_path):
    (tmp_path / "photos" / "img[1].png").write_text("x")
    scene = load(TEST + CAMERA.replace("*.png", "img[1].png"))
    assert [p.name for p in scene.matches(scene.camera.photos)] == ["img[1].png"]


@pytest.mark.parametrize(
    ("data", "place", "told"),
    [
        (b"[test]\nname = \xff\xfe\n", "file", "UTF-8"),
        (b"[test]\nname = 'a'\n[blade]\ndepth_mm = 30,5\n", "line 4", "depth_mm = 30,5"),
        (b"[test]\n[test]\n", "line 2", "[test]"),
        (b"a = " + b"[" * 5000, "file", "brackets in brackets"),
        (b"a = [", "file", "TOML"),
    ],
)
def test_a_file_that_is_not_toml_is_refused_by_its_line(refused, data, place, told):
    assert told in refused(data)[place]


def test_models_made_in_code_refuse_conflicts_too():
    with pytest.raises(ValidationError, match="at most peak_friction_deg"):
        Soil(unit_weight_kN_m3=16.0, peak_friction_deg=30.0, residual_friction_deg=32.0)
    with pytest.raises(ValidationError, match="exactly one of"):
        Camera(photos="*.png")


@pytest.mark.parametrize(
    "weird", ['""', '"x"', "-1", "true", "nan", "[]", "[[]]", "{}", "{a = 1}", "1979-05-27", "[{}, 1]"]
)
def test_whatever_stands_at_a_key_the_answer_is_a_scene_or_all_faults(load, weird):
    rules = TEST + SOIL + CAMERA + CELLS + "[tracers]\nlayers_mm = [5]\n[model]\nrun = true\n"
    extra = {
        "camera": ("times", "board", "control_points", "view_px", "clock_offset_s"),
        "loadcells": ("rest_s", "columns"),
    }
    lines = rules.splitlines()
    for k, line in enumerate(lines):
        if line.startswith("["):
            table = line.strip("[]")
            tries = [[*lines[: k + 1], f"{key} = {weird}", *lines[k + 1 :]] for key in extra.get(table, ())]
            whole = [f"{table} = {weird}", *(x for x in lines if x not in block(lines, k))]
            tries.append(whole)
        else:
            tries = [[*lines[:k], f"{line.split(' = ')[0]} = {weird}", *lines[k + 1 :]]]
        for text in tries:
            found = faults_of(load, "\n".join(text))
            assert all(fault.place and fault.value and fault.expected for fault in found)


def faults_of(load, text):
    """Faults of a text, or none where it is a scene; any other error goes through."""
    try:
        load(text)
    except ConfigError as error:
        return error.faults
    return ()


def block(lines, start):
    """A table's header and its lines."""
    end = next((k for k in range(start + 1, len(lines)) if lines[k].startswith("[")), len(lines))
    return lines[start:end]


def test_a_link_out_of_the_folder_is_refused_and_one_within_is_followed(load, refused, tmp_path):
    photograph = tmp_path / "photos" / "linked.png"
    photograph.symlink_to(next(p for p in (tmp_path / "photos").iterdir()))
    assert photograph in load(TEST + CAMERA).matches("photos/*.png")
    photograph.unlink()
    photograph.symlink_to("/etc/hostname")
    told = str(refused(TEST + CAMERA))
    assert "camera.photos: got 'photos/linked.png', which lies outside the test folder" in told
    assert "Copy the files into the test folder" in told


def test_layers_without_end_are_refused(refused):
    heights = ", ".join(str(k / 1000) for k in range(2000))
    text = TEST + SOIL + TRACERS.replace("[5, 10]", f"[{heights}]")
    assert "expected at most 1000 values" in str(refused(text))
