"""Where the results of several tests go, and what is refused before anything runs."""

import os

import pytest

from ploughval.errors import ConfigError
from ploughval.run.many.places import refuse_doubles, result_folders


def refused(folders, out=None):
    with pytest.raises(ConfigError) as error:
        refuse_doubles(folders, result_folders(folders, out))
    return str(error.value)


def test_one_test_writes_straight_into_out():
    assert result_folders(["a"], "o") == ["o"]
    assert result_folders(["a", "b"], None) == [None, None]


def test_tests_of_one_name_get_a_result_folder_each_also_where_case_does_not_tell():
    names = [os.path.basename(place) for place in result_folders(["x/a", "y/A", "z/a-2", "w/a"], "o")]
    assert names == ["a", "A-2", "a-2-2", "a-3"]


def test_results_of_urls_go_to_urls():
    assert result_folders(["s3://b/x/a", "t/c"], "s3://o/r/") == ["s3://o/r/a", "s3://o/r/c"]


def test_a_test_given_by_its_settings_has_the_name_of_its_folder(tmp_path):
    assert result_folders([str(tmp_path / "a" / "test.toml"), "b"], "o")[0] == os.path.join("o", "a")


@pytest.mark.parametrize("again", ["a", "a/", "./a", "b/../a", "a/test.toml", "link"])
def test_a_test_given_twice_is_refused_however_it_is_named(tmp_path, monkeypatch, again):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "test.toml").touch()
    (tmp_path / "link").symlink_to("a")
    monkeypatch.chdir(tmp_path)
    for out in (None, "o"):
        message = refused(["a", "b", again], out)
        assert f"{again}: got the test a again" in message
        assert "1 fault" in message
    refuse_doubles(["a", "b"], [None, None])


def test_tests_that_are_not_there_are_told_apart_by_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refuse_doubles(["x", "y"], [None, None])
    assert "x again" in refused(["x", "y", "./x"])


def test_a_url_given_twice_is_refused_without_its_password():
    message = refused(["sftp://me:secret@h/a", "sftp://me:secret@h/a/"])
    assert "the test sftp://h/a again" in message
    assert "secret" not in message


def test_two_tests_whose_results_lie_in_one_folder_are_refused_with_both_names(tmp_path):
    folders = [tmp_path / "a", tmp_path / "b"]
    for folder in folders:
        folder.mkdir()
        (folder / "results").symlink_to(tmp_path / "shared")
    message = refused([str(folder) for folder in folders])
    assert f"{folders[1]}: got results in {folders[1] / 'results'}, where those of {folders[0]} go" in message
