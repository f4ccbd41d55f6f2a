"""A folder behind a URL and its copy: what changed is fetched, what is put appears whole."""

import shutil
from collections import namedtuple

import pytest

from ploughval.errors import DataError
from ploughval.run.remote.mirror import Entry, Mirror

fsspec = pytest.importorskip("fsspec")
local = pytest.importorskip("fsspec.implementations.local")


class Plain(local.LocalFileSystem):
    """A file system of files that grow bit by bit, as of a server that is reached by SFTP."""

    protocol = "plain"
    breaks = False

    @classmethod
    def _strip_protocol(cls, path):
        return super()._strip_protocol(str(path).removeprefix("plain://"))

    def put_file(self, path1, path2, callback=None, **kwargs):
        if not self.breaks:
            return super().put_file(path1, path2)
        with open(path2, "wb") as file:
            file.write(b"hal")
        raise OSError("connection reset")


@pytest.fixture
def there(tmp_path):
    folder = tmp_path / "there"
    (folder / "photos").mkdir(parents=True)
    (folder / "test.toml").write_bytes(b"a = 1")
    (folder / "photos" / "0 [1].png").write_bytes(b"picture")
    return folder


@pytest.fixture
def mirror(there, tmp_path):
    return Mirror(f"file://{there}", tmp_path / "here", tmp_path / "here.json")


def test_a_copy_has_the_bytes_and_only_what_changed_is_fetched_again(mirror, there):
    entries = mirror.files()
    assert set(entries) == {"test.toml", "photos/0 [1].png"}
    assert mirror.fetch(entries) == 2
    assert (mirror.here / "photos" / "0 [1].png").read_bytes() == b"picture"
    assert mirror.fetch(mirror.files()) == 0
    (there / "test.toml").write_bytes(b"a = 2, longer")
    assert mirror.fetch(mirror.files()) == 1
    assert (mirror.here / "test.toml").read_bytes() == b"a = 2, longer"


def test_two_names_that_are_one_to_the_disk_of_the_copy_are_refused(there, mirror):
    """Here by a link; elsewhere where a disk does not tell A from a."""
    (there / "PHOTOS").mkdir()
    (there / "PHOTOS" / "0 [1].png").write_bytes(b"another")
    (mirror.here / "photos").mkdir(parents=True)
    (mirror.here / "PHOTOS").symlink_to("photos")
    for _ in range(2):
        with pytest.raises(DataError, match=r"'PHOTOS/0 \[1\]\.png' and 'photos/0 .* are one name"):
            mirror.fetch(mirror.files())


def test_a_copy_that_was_changed_here_is_fetched_again(mirror):
    mirror.fetch(mirror.files())
    (mirror.here / "test.toml").write_bytes(b"other")
    assert mirror.fetch(mirror.files()) == 1
    assert (mirror.here / "test.toml").read_bytes() == b"a = 1"


def test_what_is_no_longer_named_is_removed_from_the_copy_alone(mirror, there):
    mirror.fetch(mirror.files())
    mirror.keep_only(["test.toml"])
    assert not (mirror.here / "photos" / "0 [1].png").exists()
    assert (there / "photos" / "0 [1].png").exists()


@pytest.mark.parametrize("name", ["../a", "/a", "a//b", "a/./b", "C:/a", "a\\b", "a/../../b", "a\0b", ""])
def test_a_name_that_leads_out_of_the_copy_is_refused(mirror, name, tmp_path):
    with pytest.raises(DataError, match="no name inside a folder"):
        mirror.fetch({name: Entry(1, "")})
    assert not mirror.here.exists()


def test_a_name_that_is_file_and_folder_at_once_is_refused(mirror):
    with pytest.raises(DataError, match="a file and a folder at once"):
        mirror.fetch({"a": Entry(1, ""), "a/b": Entry(1, "")})


def test_a_link_is_named_instead_of_followed(mirror, there):
    (there / "link.png").symlink_to("/etc/hostname")
    with pytest.raises(DataError, match=r"link\.png.*symbolic link"):
        mirror.fetch(mirror.files())


def test_too_little_room_is_told_before_anything_is_fetched(mirror, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage(9, 9, 3))
    with pytest.raises(DataError, match=r"3 bytes free for 12 bytes of .*TMPDIR"):
        mirror.fetch(mirror.files())
    assert not mirror.here.exists()


def test_a_file_that_comes_in_short_is_none(mirror):
    entries = mirror.files() | {"test.toml": Entry(500, "")}
    with pytest.raises(DataError, match="with 5 bytes; expected 500"):
        mirror.fetch(entries)
    assert not (mirror.here / "test.toml").exists()


def test_a_file_that_went_away_meanwhile_is_told(mirror, there):
    entries = mirror.files()
    (there / "test.toml").unlink()
    with pytest.raises(DataError, match="went away meanwhile"):
        mirror.fetch(entries)


def test_only_what_changed_is_put(mirror, there):
    mirror.fetch(mirror.files())
    (mirror.here / "new.csv").write_bytes(b"1")
    assert mirror.put(["new.csv", "test.toml"]) == 1
    assert (there / "new.csv").read_bytes() == b"1"
    assert mirror.put(["new.csv"]) == 0
    mirror.drop(["new.csv", "never.csv"])
    assert not (there / "new.csv").exists()
    assert mirror.put(["new.csv"]) == 1


def test_a_file_appears_whole_where_files_grow_bit_by_bit(there, tmp_path):
    fsspec.register_implementation("plain", Plain, clobber=True)
    mirror = Mirror(f"plain://{there}", tmp_path / "here", tmp_path / "here.json")
    mirror.fetch(mirror.files())
    (mirror.here / "test.toml").write_bytes(b"new settings")
    Plain.breaks = True
    try:
        with pytest.raises(DataError, match="connection reset"):
            mirror.put(["test.toml"])
    finally:
        Plain.breaks = False
    assert (there / "test.toml").read_bytes() == b"a = 1"
    assert sorted(path.name for path in there.iterdir()) == ["photos", "test.toml"]
    assert mirror.put(["test.toml"]) == 1
    assert (there / "test.toml").read_bytes() == b"new settings"
    assert sorted(path.name for path in there.iterdir()) == ["photos", "test.toml"]


def test_a_folder_that_is_not_there_holds_nothing(tmp_path):
    assert Mirror(f"file://{tmp_path}/none", tmp_path, tmp_path / "r.json").files() == {}
