"""Places named by URL: what cannot be used is said, and no secret is."""

import subprocess
import sys
from dataclasses import replace

import pytest

from ploughval.errors import DataError, MissingExtraError
from ploughval.run.urls import answering, file_system, is_url, shown, without_secrets
from ploughval.synth import EXAMPLE, make_folder

SECRET = "sftp://me:hunter2@host:22/data/a"


def test_neither_user_nor_password_is_shown():
    assert shown(SECRET) == "sftp://host:22/data/a"
    assert shown("s3://bucket/a/") == "s3://bucket/a"
    assert "hunter2" not in without_secrets(f"cannot open {SECRET}: hunter2 refused", SECRET)


@pytest.mark.parametrize("password", ["hun/ter2", "hun#ter2", "hun?ter2", "@ter2"])
def test_nor_is_one_whose_signs_should_have_been_encoded(password):
    url = f"ftp://me:{password}@host/a"
    told = [shown(url), without_secrets(f"no {url}: {password}", url)]
    if password != "@ter2":  # as no URL may have it, and no driver gets to see it
        with pytest.raises(DataError, match="names no file system") as caught:
            file_system(url)
        told.append(str(caught.value))
    assert [text for text in told if "hun" in text or "ter2" in text] == []


def test_signs_of_a_path_and_a_port_are_no_login():
    assert shown("s3://bucket/a@b") == "s3://bucket/a@b"
    assert shown("sftp://me:secret@host:22/a@b") == "sftp://host:22/a@b"
    assert shown("sftp://host:22/a@b") == "sftp://host:22/a@b"


def test_an_error_of_a_url_that_is_none_is_told():
    assert without_secrets("no s3://[x/a", "s3://[x/a") == "no s3://[x/a"


@pytest.mark.parametrize("place", ["C:/a", "a/b", "s3:/bucket/a", "//host/share", ""])
def test_paths_are_no_urls(place):
    assert not is_url(place)


def test_what_a_driver_raises_is_told_without_the_password():
    with pytest.raises(DataError) as caught, answering(SECRET):
        raise RuntimeError(f"auth failed for {SECRET} with hunter2")
    assert "RuntimeError: auth failed for sftp://host:22/data/a" in str(caught.value)
    assert "hunter2" not in str(caught.value)


def test_without_the_extra_its_line_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "fsspec", None)
    with pytest.raises(MissingExtraError, match=r"ploughval\[cluster\]"):
        file_system("s3://bucket/a")


@pytest.mark.parametrize("url", ["nothing://a", "simplecache::file:///a", "file:///a?token=hunter2"])
def test_a_url_of_no_plain_folder_is_refused(url):
    pytest.importorskip("fsspec")
    with pytest.raises(DataError, match="names no file system") as caught:
        file_system(url)
    assert "hunter2" not in str(caught.value)


def test_a_driver_that_is_not_installed_is_named(monkeypatch):
    fsspec = pytest.importorskip("fsspec")

    def missing(_):
        raise ImportError("Install s3fs to access S3")

    monkeypatch.setattr(fsspec.core, "url_to_fs", missing)
    with pytest.raises(DataError, match=r"s3:// needs a driver.*Install s3fs"):
        file_system("s3://bucket/a")


def test_without_url_and_scheduler_nothing_of_the_extra_is_imported(tmp_path):
    make_folder(tmp_path / "test", replace(EXAMPLE, photographs=False, loadcells=False, displacement_mm=3.0))
    code = (
        "import sys\n"
        "from ploughval.run.many.pool import Hearers\n"
        "from ploughval.run.process import process_folder\n"
        "from ploughval.run.workers import run_all\n"
        "ended = []\n"
        "run_all(process_folder, [sys.argv[1]], Hearers(lambda index, result: ended.append(result)))\n"
        "assert ended[0].complete, ended\n"
        "print([name for name in ('dask', 'distributed', 'fsspec') if name in sys.modules])\n"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "test")]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.strip() == "[]"
