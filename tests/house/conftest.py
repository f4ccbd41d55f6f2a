"""Every file of Python in the repository, read and parsed once."""

import ast
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROOMS = ("src", "benchmarks", "tests")


@dataclass(frozen=True)
class Source:
    """One file: its name from the repository's root, its text, its tree, and what is defined in it."""

    name: str
    text: str
    tree: ast.Module
    nodes: list[ast.AST]

    @property
    def functions(self) -> list[ast.FunctionDef]:
        return [node for node in self.nodes if isinstance(node, ast.FunctionDef)]


@pytest.fixture(scope="session")
def root():
    return ROOT


@pytest.fixture(scope="session")
def sources():
    return [read(path) for room in ROOMS for path in sorted((ROOT / room).rglob("*.py"))]


def read(path):
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    kinds = (ast.FunctionDef, ast.Import, ast.ImportFrom)
    nodes = [node for node in ast.walk(tree) if isinstance(node, kinds)]
    return Source(path.relative_to(ROOT).as_posix(), text, tree, nodes)
