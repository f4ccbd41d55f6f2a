"""What each stage that is kept depends on: code, packages, settings, files, values; and the key of these."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from ploughval.compare import Comparison
from ploughval.compare.validation import Metric
from ploughval.loadcells import ForceResult
from ploughval.loadcells.calibration import CellCalibrationResult
from ploughval.loadcells.contact import Contact
from ploughval.loadcells.friction import Friction
from ploughval.loadcells.record import MeanLoad
from ploughval.loadcells.response import CellResponse
from ploughval.run import provenance
from ploughval.run.kept.snapshots import to_arrays
from ploughval.run.kept.store import Key
from ploughval.scene import Scene
from ploughval.scene_camera import EQUIPMENT, Camera
from ploughval.tracers import BandFindings

_SETTINGS = ("scene", "scene_base", "scene_camera", "scene_cells", "scene_faults", "scene_tables")
_COMMON = (*_SETTINGS, "axes", "errors", "limits", "run.kept.table_arrays", "run.kept.snapshots")


@dataclass(frozen=True, slots=True)
class Stage:
    """A stage whose result is kept.

    Attributes
    ----------
    name : str
        In the store's file names.
    title : str
        As a user reads it: the step's name.
    entries : tuple of str
        Modules that the numbers come from.
    rooms : tuple of str
        Packages and modules that these import, themselves included: a change in one redoes the stage.
    settings : mapping
        Tables of test.toml that are read, or fields of them, in pydantic's words.
    kinds : tuple of type
        Dataclasses that the result is made of, where :mod:`ploughval.run.kept.snapshots` stores it.
    """

    name: str
    title: str
    entries: tuple[str, ...]
    rooms: tuple[str, ...]
    settings: Mapping[str, Any]
    kinds: tuple[type, ...] = ()


WINDOW = Stage(
    "window",
    "photographs",
    entries=("run.walk.walk", "run.walk.pieces", "run.walk.first_frame", "photos"),
    rooms=(
        *_COMMON,
        "changing",
        "memory",
        "photos",
        "piv",
        "run.clock",
        "run.walk.first_frame",
        "run.walk.frame_notes",
        "run.walk.noise",
        "run.walk.pattern",
        "run.walk.pieces",
        "run.walk.steadied",
        "run.walk.walk",
        "run.walk.looks",
        "run.walk.window",
        "tracers",
        "watch",
    ),
    settings={
        "blade": True,
        "camera": set(Camera.model_fields) - {*EQUIPMENT, "clock_offset_s"},
        "model": {"initial_surface_mm"},
        "piv": True,
        "tracers": True,
    },
)
FORCE = Stage(
    "force",
    "force",
    entries=("loadcells",),
    rooms=(*_COMMON, "columns", "loadcells", "memory", "photos"),
    settings={"blade": True, "loadcells": True},
    kinds=(ForceResult, MeanLoad, CellCalibrationResult, CellResponse, Friction, Contact),
)
BANDS = Stage(
    "bands",
    "bands",
    entries=("tracers.bands",),
    rooms=(*_COMMON, "changing", "tracers"),
    settings={"bands": True, "blade": True, "camera": {"mm_per_px"}, "piv": {"subset_px"}},
    kinds=(BandFindings,),
)
COMPARE = Stage(
    "compare",
    "compare",
    entries=("compare", "model"),
    rooms=(*_COMMON, "compare", "model", "watch"),
    settings={
        "blade": True,
        "box": True,
        "camera": {"mm_per_px", "mm_per_px_std"},
        "compare": True,
        "model": True,
        "soil": True,
    },
    kinds=(Comparison, Metric),
)
STAGES = (FORCE, WINDOW, BANDS, COMPARE)
PAGE = "page"
STATE = "walked"
"""In the store's file names: where an unfinished walk through the photographs stands."""


def stage_key(stage: Stage, scene: Scene, **inputs: str) -> Key:
    """Key of a stage's result: its code, the packages that touch numbers, its settings and its inputs.

    Parameters
    ----------
    stage : Stage
        Which one.
    scene : Scene
        The settings of the test.
    **inputs : str
        Digests or values of what it is given, by a name that a user understands.
    """
    return Key.of(
        code=provenance.code_digest(*stage.rooms),
        packages=json.dumps(provenance.versions()),
        settings=scene.model_dump_json(include=dict(stage.settings)),
        **inputs,
    )


def window_key(scene: Scene, input_digests: Mapping[str, str], first: int) -> Key:
    """Key of the walk through the photographs from frame ``first``, which shows the sand at rest."""
    files = {name: input_digests[name] for name in provenance.window_files(scene)}
    return stage_key(WINDOW, scene, photographs=json.dumps(files), first_photograph=str(first))


def force_key(scene: Scene, input_digests: Mapping[str, str]) -> Key:
    """Key of the force from log, empty-box runs and calibration of the cells."""
    files = {name: input_digests[name] for name in provenance.log_files(scene)}
    return stage_key(FORCE, scene, logs=json.dumps(files))


def page_key(record: Mapping[str, Any], files: Mapping[str, str]) -> Key:
    """Key of the report page: the record of the run, and the digests of the files that the page reads."""
    return Key.of(
        code=provenance.code_digest(),
        packages=json.dumps(provenance.drawing_versions()),
        record=json.dumps(record, sort_keys=True, default=str),
        results=json.dumps(dict(files), sort_keys=True),
    )


def digest_of(value: pd.DataFrame | xr.Dataset | None) -> str:
    """SHA-256 over what a table or a dataset holds, hexadecimal; "none" for None.

    Attributes of a dataset, which hold the settings of the whole test, are left out.
    """
    if value is None:
        return "none"
    if isinstance(value, xr.Dataset):
        return _digest({str(name): data.to_numpy() for name, data in value.variables.items()})
    return _digest(to_arrays(value))


def _digest(arrays: Mapping[str, NDArray[Any]]) -> str:
    digest = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        digest.update(f"{name}\0{array.dtype.str}\0{array.shape}\0".encode())
        digest.update(np.ascontiguousarray(array).data if array.size else b"")
    return digest.hexdigest()
