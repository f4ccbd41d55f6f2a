"""Settings that are not there, no file, or too long are refused before they are read."""

import os

import pytest

from ploughval.errors import ConfigError
from ploughval.scene import load_scene


def test_a_folder_without_settings_is_told_how_to_get_them(tmp_path):
    with pytest.raises(ConfigError, match=r"ploughval init"):
        load_scene(tmp_path)
    for absent in (tmp_path / "gone" / "test.toml", "a\0b"):
        with pytest.raises(ConfigError):
            load_scene(absent)


def test_a_folder_that_is_not_there_is_not_said_to_want_a_test_toml_beside_it(tmp_path):
    with pytest.raises(ConfigError, match="got nothing; expected a test folder") as caught:
        load_scene(tmp_path / "d30-10")
    assert "ploughval init" not in str(caught.value)
    assert "Check the name" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("a." * 100_000 + "b = 1", "line 1: got"),
        ("[blade]\n[" + '"a" . ' * 40 + "b]", "line 2: got"),
        ("# " + "sand\n# " * 2_000_000, "holds 14 MB; expected at most 8.39 MB"),
    ],
)
def test_a_text_that_would_take_the_parsers_memory_is_refused_before_it(tmp_path, text, told):
    (tmp_path / "test.toml").write_text(text)
    with pytest.raises(ConfigError, match=told):
        load_scene(tmp_path)


@pytest.mark.parametrize("made", ["pipe", "directory", "loop", "device"])
def test_settings_that_are_no_file_are_refused_unopened(tmp_path, made):
    path = tmp_path / "test.toml"
    {
        "pipe": lambda: os.mkfifo(path),
        "directory": path.mkdir,
        "loop": lambda: path.symlink_to("test.toml"),
        "device": lambda: path.symlink_to("/dev/zero"),
    }[made]()
    with pytest.raises(ConfigError, match=r"test\.toml"):
        load_scene(tmp_path)
