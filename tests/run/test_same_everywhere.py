"""The same bytes of every result, wherever, however and by how many threads a test is processed."""

import json
import locale
import os
import shutil
import subprocess
import sys
import time

import cv2
import pandas as pd
import pytest

from broken.base import make_sound, result_bytes
from ploughval import process
from ploughval.run import process_folder

ELSEWHERE = ("folder", "code_hash", "timings_s", "stages", "reused")
"""Keys of run.json that say where, by which code, how fast, and by what kept stages a test was processed."""
COMMA = {"decimal_point": ",", "thousands_sep": ".", "grouping": [3, 3, 0]}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A made test with photographs, a model, and a log by date and time over a change of summer time."""
    folder = tmp_path_factory.mktemp("same") / "test"
    make_sound(folder)
    settings = (folder / "test.toml").read_text()
    (folder / "test.toml").write_text(settings.replace("[model]\nrun = false\n", ""))
    log = pd.read_csv(folder / "loadcells.csv")
    moments = pd.Timestamp("2026-03-29 01:59:55") + pd.to_timedelta(log["time_s"].round(3), unit="s")
    log.assign(time_s=moments.dt.strftime("%Y-%m-%d %H:%M:%S.%f")).to_csv(
        folder / "loadcells.csv", index=False
    )
    return folder


@pytest.fixture(scope="module")
def usual(folder, tmp_path_factory):
    """Results of one thread, by the absolute path."""
    out = tmp_path_factory.mktemp("usual") / "out"
    process(folder, out=out, workers=1)
    return files_of(out)


def files_of(out):
    """Bytes of every result file, and what run.json holds, key by key."""
    files = result_bytes(out)
    record = json.loads(files["run.json"])
    del files["run.json"]
    return files | {f"run.json: {key}": value for key, value in record.items() if key not in ELSEWHERE}


def differing(first, second):
    return sorted(name for name in first.keys() | second.keys() if first.get(name) != second.get(name))


def reversed_order(monkeypatch):
    """Folders that list their files the other way round."""
    listdir, scandir = os.listdir, os.scandir

    class Backwards:
        def __init__(self, place):
            with scandir(place) as entries:
                self._entries = iter(sorted(entries, key=lambda entry: entry.name, reverse=True))

        def __iter__(self):
            return self._entries

        def __next__(self):
            return next(self._entries)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            return None

        def close(self):
            return None

    monkeypatch.setattr(os, "listdir", lambda place=".": sorted(listdir(place), reverse=True))
    monkeypatch.setattr(os, "scandir", lambda place=".": Backwards(place))


def test_the_log_crosses_the_change_of_summer_time(usual):
    force = pd.read_csv(pd.io.common.BytesIO(usual["force.csv"]))
    assert force["time_s"].diff().dropna().between(0.099, 0.101).all()
    assert usual["run.json: complete"]
    assert usual["metrics.json"].count(b"experiment_std") > 5


def test_threads_order_of_files_time_zone_locale_and_working_folder_change_no_byte(
    folder, usual, tmp_path, monkeypatch
):
    reversed_order(monkeypatch)
    assert next(os.scandir(folder)).name == max(os.listdir(folder))
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    monkeypatch.setattr(locale, "localeconv", lambda: COMMA)
    monkeypatch.chdir(folder.parent)
    mask, threads = os.umask(0o077), cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        process_folder(folder.name, out=tmp_path / "out", workers=3)
    finally:
        os.umask(mask)
        cv2.setNumThreads(threads)
        monkeypatch.undo()
        time.tzset()
    assert differing(usual, files_of(tmp_path / "out")) == ["report.html"]  # which is not written here


def test_another_process_hash_seed_blas_and_path_change_no_byte(folder, usual, tmp_path):
    copy = tmp_path / "real" / "test"
    for path in sorted(folder.rglob("*"), reverse=True):  # files made in the other order
        if path.is_file():
            place = copy / path.relative_to(folder)
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, place)
    link = tmp_path / "link to the test"
    link.symlink_to(copy, target_is_directory=True)
    comma = [name for name in ("de_DE.UTF-8", "fr_FR.UTF-8") if _has_locale(name)]
    environment = os.environ | {
        "PYTHONHASHSEED": "4711",
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        "TZ": "Asia/Kathmandu",
        "LC_ALL": comma[0] if comma else "C",
    }
    line = ["process", "../link to the test", "--out", "../out", "--workers", "2"]
    (tmp_path / "cwd").mkdir()
    done = subprocess.run(
        [sys.executable, "-m", "ploughval.cli", *line],
        cwd=tmp_path / "cwd",
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert differing(usual, files_of(tmp_path / "out")) == []


def _has_locale(name):
    before = locale.setlocale(locale.LC_ALL)
    try:
        locale.setlocale(locale.LC_ALL, name)
    except locale.Error:
        return False
    locale.setlocale(locale.LC_ALL, before)
    return True
