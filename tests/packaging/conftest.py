"""A wheel and an sdist of the tree, built once a test run of each worker."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def root():
    return ROOT


@pytest.fixture(scope="session")
def wheel(tmp_path_factory):
    return built("build_wheel", tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="session")
def sdist(tmp_path_factory):
    return built("build_sdist", tmp_path_factory.mktemp("sdist"))


def built(what, place):
    """What hatchling makes of the tree; it works in the current directory."""
    from hatchling import build

    before = Path.cwd()
    os.chdir(ROOT)
    try:
        return place / getattr(build, what)(str(place))
    finally:
        os.chdir(before)
