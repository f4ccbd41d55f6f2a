"""Scripts of .ci as modules, and what pyproject.toml states."""

import sys
import tomllib
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def script(monkeypatch):
    """Load a script by its name."""
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    monkeypatch.syspath_prepend(str(ROOT / ".ci"))

    def loaded(name):
        loader = SourceFileLoader(f"ci_{name}", str(ROOT / ".ci" / name))
        module = module_from_spec(spec_from_loader(loader.name, loader))
        monkeypatch.setitem(sys.modules, loader.name, module)
        loader.exec_module(module)
        monkeypatch.setattr("sys.argv", [name])
        return module

    return loaded


@pytest.fixture
def extras():
    """Extras of pyproject.toml that serve who uses ploughval, not who works on it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return set(project["optional-dependencies"]) - {"test", "dev", "docs", "mutation"}
