"""Staging of a test: what its settings name and no more, within limits, told by its URL."""

import pytest

from ploughval.errors import ConfigError, DataError, PloughvalError
from ploughval.limits import FILE_BYTES, SETTINGS_BYTES
from ploughval.run.remote import staging
from ploughval.run.remote.mirror import Mirror
from ploughval.run.remote.staging import Staged, matches, wanted_files

fsspec = pytest.importorskip("fsspec")

SETTINGS = """
[camera]
photos = "photos/*.png"
times = "photos.csv"
[loadcells]
log = "loadcells.csv"
empty = ["empty/*.csv", "../elsewhere.csv"]
"""
FILES = ("photos.csv", "photos/1.png", "photos/2.png", "loadcells.csv", "empty/a.csv")
OTHERS = ("photos/1.txt", "photos/raw/1.png", "truth/layers.csv", "results/run.json", "notes.docx")


@pytest.fixture
def folder(tmp_path):
    root = tmp_path / "test"
    for name in (*FILES, *OTHERS):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(name)
    (root / "test.toml").write_text(SETTINGS)
    (tmp_path / "elsewhere.csv").write_text("outside")
    return root


def staged(folder, tmp_path, out=None):
    return Staged(f"file://{folder}", out, tmp_path / "scratch")


def files_in(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_only_what_the_settings_name_is_fetched(folder, tmp_path):
    test = staged(folder, tmp_path)
    test.bring()
    assert files_in(test.folder) == {"test.toml", *FILES}
    assert not test.out.exists() or not files_in(test.out)
    test.remove()
    assert not list((tmp_path / "scratch").iterdir())


def test_a_photograph_that_went_away_goes_from_the_copy_too(folder, tmp_path):
    staged(folder, tmp_path).bring()
    (folder / "photos" / "2.png").unlink()
    test = staged(folder, tmp_path)
    test.bring()
    assert files_in(test.folder) == {"test.toml", *FILES} - {"photos/2.png"}


def test_settings_of_a_bare_or_broken_file_are_fetched_alone(folder, tmp_path):
    (folder / "test.toml").write_text("[camera\n")
    test = staged(folder, tmp_path)
    test.bring()
    assert files_in(test.folder) == {"test.toml"}


def test_a_folder_without_settings_is_named_by_its_url(tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(ConfigError, match=r"file://.*/empty/test\.toml: 1 fault"):
        staged(tmp_path / "empty", tmp_path).bring()


def test_a_folder_without_settings_is_not_listed(tmp_path, monkeypatch):
    (tmp_path / "large").mkdir()
    monkeypatch.setattr(Mirror, "files", lambda *_: pytest.fail("listed"))
    with pytest.raises(ConfigError, match=r"/large/test\.toml"):
        staged(tmp_path / "large", tmp_path).bring()


def test_the_settings_themselves_may_be_named(folder, tmp_path):
    assert staged(folder / "test.toml", tmp_path).folder == staged(folder, tmp_path).folder


@pytest.mark.parametrize(("limit", "name"), [("SETTINGS_BYTES", "test.toml"), ("FILE_BYTES", "photos/1.png")])
def test_what_is_too_large_is_refused_before_it_is_fetched(folder, tmp_path, monkeypatch, limit, name):
    (folder / name).write_bytes(b" " * 200 + (folder / name).read_bytes())
    monkeypatch.setattr(staging, limit, 199)
    test = staged(folder, tmp_path)
    with pytest.raises(DataError, match=rf"{name}: holds \d+ bytes; expected at most 199 bytes"):
        test.bring()
    assert not (test.folder / name).exists()


def test_tables_of_times_have_the_limit_of_settings():
    data = {"camera": {"photos": "*.png", "times": "t.csv"}}
    assert wanted_files(data, ["a.png", "t.csv"]) == {"a.png": FILE_BYTES, "t.csv": SETTINGS_BYTES}


@pytest.mark.parametrize(
    ("pattern", "found"),
    [
        ("**/*.png", True),
        ("a/**/c.png", True),
        ("a/*.png", False),
        ("./a//b/[c-d].png", True),
        ("a/b/C.png", False),
    ],
)
def test_patterns_find_what_they_find_in_a_folder(pattern, found):
    assert matches("a/b/c.png", pattern) is found


def test_an_error_names_the_url_and_no_copy_of_any_machine(folder, tmp_path):
    test = staged(folder, tmp_path)
    other = Staged(f"file://{folder}", None, tmp_path / "other scratch")
    with pytest.raises(PloughvalError) as caught, test.named():
        raise DataError(f"like {other.folder / 'photos' / '1.png'}", path=test.folder / "photos" / "2.png")
    assert str(caught.value).startswith(f"file://{folder}/photos/2.png: like ")
    assert f"file://{folder}/photos/1.png" in str(caught.value)
    assert "ploughval-" not in str(caught.value)


def test_two_result_folders_of_one_test_have_copies_of_their_own(folder, tmp_path):
    first, second = (staged(folder, tmp_path, f"file://{tmp_path}/{name}") for name in ("a", "b"))
    assert first.folder != second.folder


@pytest.mark.parametrize("out", ["", "/empty"])
def test_results_are_not_put_over_the_tests_own_files(folder, tmp_path, out):
    (folder / "test.toml").write_text(SETTINGS.replace("loadcells.csv", f"{out}/force.csv".strip("/")))
    (folder / out.strip("/") / "force.csv").write_text("measured")
    with pytest.raises(ConfigError, match=r"--out: got file://.* apart from the test's own force\.csv"):
        staged(folder, tmp_path, f"file://{folder}{out}").bring()


def test_a_local_test_needs_no_copy_for_results_on_the_same_machine(folder, tmp_path):
    test = Staged(folder, f"file://{tmp_path}/out", tmp_path / "scratch")
    assert (test.is_remote, test.out) == (False, tmp_path / "out")
