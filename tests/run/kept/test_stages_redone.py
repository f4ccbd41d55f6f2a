"""A changed setting or file redoes exactly what depends on it, and the record says what and why."""

import json
import shutil
from dataclasses import replace

import pytest
from PIL import Image

from ploughval.run import process_folder
from ploughval.synth import EXAMPLE, make_folder

ALL = {"force", "photographs", "bands", "compare", "report"}


def page(results):
    """In place of the report: the same page every time."""
    (results / "report.html").write_text("<p>page</p>")
    return results / "report.html"


@pytest.fixture(scope="module")
def processed(tmp_path_factory):
    """A test folder with results, the numbers of which every case starts from."""
    folder = tmp_path_factory.mktemp("redone") / "test"
    photographs = {"frames": 3, "displacement_mm": 8.0, "mm_per_px": 0.4, "ahead_mm": 60.0}
    make_folder(
        folder, replace(EXAMPLE, seed=2, rate_hz=10.0, rest_s=3.0, layers_mm=(10.0, 20.0), **photographs)
    )
    with (folder / "test.toml").open("a") as file:
        file.write("\n[compare]\ndraws = 16\n\n[piv]\nspacing_px = 30.0\n")
    outcome = process_folder(folder, page=page)
    assert outcome.complete
    assert outcome.reused == ()
    return folder


def setting(table, line):
    """A change that puts a line at the head of a table, in place of the key's own line where it has one."""

    def change(folder):
        path, key = folder / "test.toml", line.split("=")[0]
        lines = [old for old in path.read_text().split("\n") if not old.startswith(key)]
        if f"[{table}]" not in lines:
            lines += [f"[{table}]"]
        lines.insert(lines.index(f"[{table}]") + 1, line)
        path.write_text("\n".join(lines))

    return change


def a_number(name):
    """A change of the last number in the middle row of a table of the folder."""

    def change(folder):
        path = folder / name
        lines = path.read_text().split("\n")
        head, _, last = lines[len(lines) // 2].rpartition(",")
        lines[len(lines) // 2] = f"{head},{float(last) + 0.01:.6f}"
        path.write_text("\n".join(lines))

    return change


def photograph(folder):
    path = sorted((folder / "photos").iterdir())[-1]
    with Image.open(path) as image:
        darker = image.point(lambda grey: max(grey - 1, 0))
    darker.save(path)


def comment(folder):
    path = folder / "test.toml"
    path.write_text(path.read_text() + "# a comment\n")


def beside(folder):
    (folder / "notes.txt").write_text("beside the test")


def fitted(folder):
    (folder / "results" / "fit.json").write_text("{}")


CASES = {
    "nothing": (lambda folder: None, set()),
    "a file that the test does not name": (beside, set()),
    "a comment": (comment, {"report"}),
    "a fit, which the page shows": (fitted, {"report"}),
    "test.notes": (setting("test", 'notes = "other"'), {"report"}),
    "report.frames_shown": (setting("report", "frames_shown = 2"), {"report"}),
    "what the camera was": (setting("camera", 'make = "Other"'), {"report"}),
    "soil": (setting("soil", "residual_friction_deg = 32.0"), {"compare", "report"}),
    "model": (setting("model", "tolerance = 0.002"), {"compare", "report"}),
    "box": (setting("box", "length_mm = 380.0"), {"compare", "report"}),
    "compare": (setting("compare", "draws = 20"), {"compare", "report"}),
    "bands": (setting("bands", "min_slip_mm = 50.0"), {"bands", "compare", "report"}),
    "the clocks": (setting("camera", "clock_offset_s = 0.5"), {"bands", "compare", "report"}),
    "loadcells": (setting("loadcells", "bandwidth_Hz = 2.0"), {"force", "compare", "report"}),
    "a row of the log": (a_number("loadcells.csv"), {"force", "compare", "report"}),
    "an empty run": (a_number("empty/run1.csv"), {"force", "compare", "report"}),
    "piv": (setting("piv", "subset_px = 29"), {"photographs", "bands", "compare", "report"}),
    "tracers": (
        setting("tracers", "layers_mm = [10.0, 15.0]"),
        {"photographs", "bands", "compare", "report"},
    ),
    "a photograph": (photograph, {"photographs", "bands", "compare", "report"}),
    "blade": (setting("blade", "depth_mm = 29.0"), ALL),
}


@pytest.mark.parametrize(("change", "redone"), CASES.values(), ids=CASES.keys())
def test_a_change_redoes_what_depends_on_it_and_nothing_else(processed, tmp_path, change, redone):
    folder = shutil.copytree(processed, tmp_path / "test")
    change(folder)
    outcome = process_folder(folder, page=page)
    assert ALL - set(outcome.reused) == redone
    notes = json.loads((folder / "results" / "run.json").read_text())["stages"]
    assert {stage for stage in ALL if notes[stage]["done"] == "run"} == ALL - set(outcome.reused)
    assert all(notes[stage]["why"].startswith("changed: ") for stage in redone)
    assert notes["model"]["done"] == "run"
