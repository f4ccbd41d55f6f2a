"""An sdist holds what is tracked: it builds, tests and documents itself."""

import shutil
import subprocess
import tarfile

import pytest


@pytest.fixture(scope="module")
def names(sdist):
    with tarfile.open(sdist) as archive:
        return {member.name.partition("/")[2] for member in archive if member.isfile()}


def test_it_holds_what_building_and_testing_need(names):
    assert {"pyproject.toml", "hatch_build.py", "README.md", "LICENSE", "Makefile", ".ci/run"} <= names
    assert {"src/ploughval/py.typed", "tests/packaging/test_sdist.py", "data/example/test.toml"} <= names


def test_it_holds_every_tracked_file_and_no_other(names, root):
    if shutil.which("git") is None or not (root / ".git").exists():
        pytest.skip("no repository: nothing says what is tracked")
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=root, stdout=subprocess.PIPE, text=True, check=True).stdout
    tracked = {name for name in listed.split("\0") if name and (root / name).is_file()}
    assert names - {"PKG-INFO"} == tracked


def test_it_stays_below_sixteen_megabytes(sdist):
    assert sdist.stat().st_size < 16_000_000
