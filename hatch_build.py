"""What a wheel holds of benchmarks/: the scripts of ``ploughval bench``, and what they import of one another.

Studies, peers and pages of reports stay behind: no command of an installed ploughval calls them.
"""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class BenchScripts(BuildHookInterface):  # type: ignore[type-arg]
    """Adds them to the wheel; the option ``scripts`` names where the search begins, with wildcards."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called by hatchling ahead of a build; an editable install runs the scripts where they are."""
        if version == "editable":
            return
        folder = Path(self.root) / "benchmarks"
        for path in needed(folder, self.config["scripts"]):
            build_data["force_include"][str(path)] = (
                f"ploughval/benchmarks/{path.relative_to(folder).as_posix()}"
            )


def needed(folder: Path, scripts: list[str]) -> list[Path]:
    """Files of the scripts and of everything in the folder that they import, directly or not.

    Raises
    ------
    FileNotFoundError
        Where nothing answers to one of the scripts' names.
    """
    found: set[Path] = set()
    for pattern in scripts:
        matches = set(folder.glob(pattern))
        if not matches:
            raise FileNotFoundError(
                f"{folder / pattern}: no such script; mend hooks.custom in pyproject.toml"
            )
        found |= matches
    waiting = sorted(found)
    while waiting:
        new = set(_imported(waiting.pop(), folder)) - found
        found |= new
        waiting += new
    return sorted(found)


def _imported(path: Path, folder: Path) -> Iterator[Path]:
    """Files of the folder that a file names in its imports, with the packages they lie in."""
    package = path.parent.relative_to(folder).parts
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else ()
            base = ".".join([*above, *([node.module] if node.module else [])])
            names = [base, *(f"{base}.{alias.name}" for alias in node.names)]
        else:
            continue
        for name in names:
            parts = name.split(".")
            for count in range(1, len(parts) + 1):
                place = folder.joinpath(*parts[:count])
                yield from (p for p in (place.with_suffix(".py"), place / "__init__.py") if p.is_file())
