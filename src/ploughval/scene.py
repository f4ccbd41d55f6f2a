"""test.toml as frozen, validated settings; decides which steps a test needs."""

import hashlib
import json
import re
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from ploughval.errors import ConfigError, DataError, Fault
from ploughval.limits import SETTINGS_BYTES, read_limited
from ploughval.scene_base import Table
from ploughval.scene_camera import Board, Camera, Interval, Window
from ploughval.scene_cells import CellCalibration, LoadCells, LogColumns, Staircase
from ploughval.scene_faults import (
    file_faults,
    find_files,
    known_keys,
    not_files,
    number,
    rename_keys,
    setting_faults,
    table_of,
)
from ploughval.scene_tables import (
    Bands,
    Blade,
    Box,
    Compare,
    ModelTable,
    Piv,
    Report,
    Soil,
    TestTable,
    Tracers,
)

__all__ = [
    "Bands",
    "Blade",
    "Board",
    "Box",
    "Camera",
    "CellCalibration",
    "Compare",
    "Interval",
    "LoadCells",
    "LogColumns",
    "ModelTable",
    "Piv",
    "Report",
    "Scene",
    "Soil",
    "Staircase",
    "Step",
    "Table",
    "TestTable",
    "Tracers",
    "Window",
    "load_scene",
]


_DEEP = re.compile(r"""(?:[\w"'-]+[ \t]*\.[ \t]*){30}""")
"""A key of tables in tables: the parser's memory grows with the square of their number."""


class Step(StrEnum):
    """The steps of a run, in their order; a scene asks for some of them."""

    CALIBRATION = "calibration"
    BLADE = "blade"
    FORCE = "force"
    SURFACE = "surface"
    TRACKS = "tracks"
    LAYERS = "layers"
    DYE = "dye"
    BANDS = "bands"
    MODEL = "model"
    COMPARE = "compare"
    REPORT = "report"


class Scene(Table):
    """One test: the settings of its test.toml and the folder it stands in."""

    folder: Path = Field(Path(), exclude=True)
    source: Path = Field(Path("test.toml"), exclude=True)
    test: TestTable
    blade: Blade
    box: Box = Box()
    soil: Soil | None = None
    camera: Camera | None = None
    loadcells: LoadCells | None = None
    tracers: Tracers | None = None
    piv: Piv = Piv()
    bands: Bands = Bands()
    model: ModelTable = ModelTable()
    compare: Compare = Compare()
    report: Report = Report()

    @classmethod
    def conflicts(cls, values: Mapping[str, Any]) -> list[Fault]:
        """Tables that need each other; layers above the surface."""
        there = [k for k in ("camera", "loadcells", "soil") if values.get(k) is not None]
        if not there:
            return [Fault("", "nothing to do", "at least one of [camera], [loadcells] and [soil]")]
        if values.get("tracers") is not None and there == ["loadcells"]:
            return [
                Fault("tracers", "layers", "[camera] or [soil] too", "Nothing else shows or predicts them.")
            ]
        lean = number(_inside(values, "blade"), "inclination_deg", 0.0)
        if lean and _inside(values, "model").get("mechanism") == "two_blocks":
            return [Fault("model.mechanism", "'two_blocks'", "'one_block' for a blade that leans")]
        depth = number(_inside(values, "blade"), "depth_mm")
        layers = _inside(values, "tracers").get("layers_mm")
        uneven = _inside(values, "model").get("initial_surface_mm") is not None
        if depth is None or uneven or not isinstance(layers, list | tuple):
            return []
        above = [h for h in layers if isinstance(h, int | float) and h > depth > 0]
        expected = f"heights above the tip up to the surface at depth_mm = {depth:g}"
        return [Fault("tracers.layers_mm", ", ".join(map(str, above)), expected)] if above else []

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps that this scene calls for, in the order in which they run."""
        photographs = self.camera is not None
        tracked = photographs and self.piv.track
        layers = self.tracers is not None and bool(self.tracers.layers_mm)
        measured = photographs or self.loadcells is not None
        modelled = self.soil is not None and self.model.run
        wanted = {
            Step.CALIBRATION: photographs,
            Step.BLADE: photographs,
            Step.FORCE: self.loadcells is not None,
            Step.SURFACE: photographs,
            Step.TRACKS: tracked,
            Step.LAYERS: tracked and layers,
            Step.DYE: photographs and self.tracers is not None and bool(self.tracers.dyed_layers_mm),
            Step.BANDS: tracked,
            Step.MODEL: modelled,
            Step.COMPARE: modelled and measured,
            Step.REPORT: True,
        }
        return tuple(step for step in Step if wanted[step])

    @property
    def settings_json(self) -> str:
        """All settings, defaults included, as one JSON string with sorted keys."""
        return json.dumps(self.model_dump(mode="json"), sort_keys=True)

    @property
    def settings_hash(self) -> str:
        """SHA-256 of :attr:`settings_json`, hexadecimal."""
        return hashlib.sha256(self.settings_json.encode()).hexdigest()

    def path(self, name: str) -> Path:
        """A file named in test.toml as a path: relative names start at the test folder."""
        return self.folder / name

    def matches(self, pattern: str) -> list[Path]:
        """Files of the test folder that match a pattern, sorted by name."""
        return find_files(self.folder, pattern)

    def not_files(self, pattern: str) -> list[Path]:
        """What matches a pattern but cannot be read: links to nowhere, pipes and devices, sorted by name."""
        return not_files(self.folder, pattern)


def _inside(values: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    """A table in raw values or in a validated scene; an empty one where there is none."""
    table = values.get(key)
    if isinstance(table, Table):
        return vars(table)
    return table if isinstance(table, dict) else {}


def load_scene(path: Path | str, *, files: bool = True) -> Scene:
    """Read and validate a test folder's settings.

    Parameters
    ----------
    path : path-like
        A test folder, or its test.toml.
    files : bool
        Whether the photographs and logs that it names have to be there; the model needs none.

    Returns
    -------
    Scene
        Frozen settings; ``scene.steps`` says what the test needs.

    Raises
    ------
    ConfigError
        Unreadable file, unknown keys, wrong values, missing files: all faults together.
    """
    path = Path(path)
    source = path / "test.toml" if path.is_dir() else path
    data, faults = rename_keys(Scene, read_toml(source))
    scene = None
    try:
        scene = Scene.model_validate({**data, "folder": source.parent, "source": source})
    except ValidationError as error:
        faults += setting_faults(Scene, data, error)
    faults += _conflicts(Scene, data)
    if files:
        faults += file_faults(data, source.parent)
    if faults or scene is None:
        raise ConfigError(source, faults)
    return scene


def _conflicts(table: type[Table], values: Mapping[str, Any], place: str = "") -> list[Fault]:
    """Conflicts of a table and of those in it, from raw values: a bad value elsewhere does not hide them."""
    faults = [
        replace(fault, place=f"{place}.{fault.place}".strip(".") or "test.toml")
        for fault in table.conflicts(values)
    ]
    for key in known_keys(table):
        inner = table_of(table.model_fields[key].annotation)
        if inner is not None and issubclass(inner, Table) and isinstance(values.get(key), dict):
            faults += _conflicts(inner, values[key], f"{place}.{key}".strip("."))
    return faults


def read_toml(source: Path) -> dict[str, Any]:
    """The raw settings of a test.toml.

    Raises
    ------
    ConfigError
        What is no readable TOML, with the line.
    """
    try:
        remedy = "Take out what the test does not need."
        text = read_limited(source, SETTINGS_BYTES, remedy).decode("utf-8-sig")
        if (deep := _DEEP.search(text)) is not None:
            place = text.count("\n", 0, deep.start()) + 1
            fault = Fault(f"line {place}", repr(deep[0][:40] + "..."), "keys of at most a few tables")
            raise ConfigError(source, [fault])
        return tomllib.loads(text)
    except FileNotFoundError:
        there = source.name == "test.toml" and source.parent.is_dir()  # else a folder may be meant
        remedy = f"Write one with: ploughval init {source.parent}" if there else "Check the name."
        fault = Fault("file", "nothing", "a test folder, or its test.toml", remedy)
    except tomllib.TOMLDecodeError as error:
        line = re.search(r"at line (\d+)", str(error))
        lines = text.split("\n")
        wrong = repr(lines[int(line[1]) - 1].strip()[:80]) if line else "the end of the file"
        fault = Fault(f"line {line[1]}" if line else "file", wrong, "TOML", f"{error}.")
    except DataError as error:
        fault = Fault("file", "nothing that can be read", "a test.toml", f"{error}.")
    except RecursionError:
        fault = Fault("file", "brackets in brackets without end", "TOML")
    except (OSError, UnicodeDecodeError) as error:
        fault = Fault("file", f"{type(error).__name__}", "a readable UTF-8 text file", f"{error}.")
    except ValueError as error:  # a date of no calendar, a number of thousands of digits
        fault = Fault("file", "a value that is none", "TOML", f"{error}.")
    raise ConfigError(source, [fault])
