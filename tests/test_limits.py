"""Files beyond a limit, and what is no file, are refused before they are read."""

import os

import pytest

from ploughval.errors import DataError
from ploughval.limits import read_limited, refuse_large


def test_a_file_within_the_limit_is_read(tmp_path):
    (tmp_path / "a").write_bytes(b"12345")
    assert read_limited(tmp_path / "a", 5, "Part it.") == b"12345"


def test_a_larger_file_is_refused_with_its_size_the_limit_and_the_remedy(tmp_path):
    with (tmp_path / "a").open("wb") as file:
        file.truncate(1 << 40)  # a hole
    with pytest.raises(DataError, match=r"/a: holds 1.1 TB; expected at most 1.07 GB. Part it"):
        refuse_large(tmp_path / "a", 1 << 30, "Part it")


@pytest.mark.parametrize("kind", ["pipe", "directory", "device"])
def test_what_is_no_file_is_never_opened(tmp_path, kind):
    path = tmp_path / "a"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "directory":
        path.mkdir()
    else:
        path.symlink_to("/dev/zero")
    with pytest.raises(DataError, match="is no file but a directory, pipe or device"):
        read_limited(path, 10, "Part it.")
