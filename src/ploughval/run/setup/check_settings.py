"""Settings for a check: what is sound of a refused test.toml still tells of photographs and logs."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ploughval.errors import ConfigError, Fault
from ploughval.run.setup.check_findings import Ledger
from ploughval.scene import Scene, load_scene
from ploughval.scene_faults import rename_keys, setting_faults

_STAND_INS: dict[str, dict[str, Any]] = {
    "test": {"name": "test"},
    "blade": {"depth_mm": 1.0, "width_mm": 1.0},
    "loadcells": {"spacing_mm": 1.0, "lower_to_tip_mm": 1.0},
}
_NEEDED = {"camera": "photos", "loadcells": "log"}
_WAYS = ("mm_per_px", "control_points", "board", "calibration")


@dataclass(frozen=True, slots=True)
class Settings:
    """A scene to look with.

    Attributes
    ----------
    scene : Scene
    sound : frozenset of str
        Tables without a fault.
    complete : bool
        Whether test.toml is sound as a whole; else parts of the scene stand in for what is missing.
    """

    scene: Scene
    sound: frozenset[str]
    complete: bool


def settings_of(folder: Path | str, ledger: Ledger) -> Settings | None:
    """Settings of a test folder, their faults in the ledger; None where nothing of them can be used."""
    try:
        scene = load_scene(folder)
    except ConfigError as error:
        source = Path(error.source)
        ledger.refuse(error, source.name, "test.toml", "settings as in the guide")
        return _sound_part(source, error.faults)
    return Settings(scene, frozenset(Scene.model_fields), True)


def _sound_part(source: Path, faults: Sequence[Fault]) -> Settings | None:
    """The scene without what is at fault."""
    try:
        data, _ = rename_keys(Scene, tomllib.loads(source.read_bytes().decode("utf-8-sig")))
    except (OSError, ValueError, RecursionError):
        return None
    places = [fault.place for fault in faults]
    for _ in range(3):
        for place in places:
            _drop(data, place.split("."))
        _stand_in(data)
        try:
            scene = Scene.model_validate({**data, "folder": source.parent, "source": source})
        except ValidationError as error:
            again = [fault.place for fault in setting_faults(Scene, data, error)]
            places = again or [place.split(".")[0] for place in places]
            continue
        at_fault = {fault.place.split(".")[0] for fault in faults}
        return Settings(scene, frozenset(set(data) - at_fault), False)
    return None


def _drop(data: dict[str, Any], path: list[str]) -> None:
    """Take a key out of nested tables; a fault of a whole table, or inside of a list, takes nothing more."""
    *tables, key = path
    here: Any = data
    for name in tables:
        if not isinstance(here, dict) or not isinstance(here.get(name), dict):
            if isinstance(here, dict):
                here.pop(name, None)
            return
        here = here[name]
    if isinstance(here, dict) and (tables or not isinstance(here.get(key), dict)):
        here.pop(key, None)


def _stand_in(data: dict[str, Any]) -> None:
    """Values for what is missing, so that the rest can be looked at; tables without files go."""
    for table, key in _NEEDED.items():
        if not isinstance(data.get(table), dict) or key not in data[table]:
            data.pop(table, None)
    for table, values in _STAND_INS.items():
        if table in data or table != "loadcells":
            data[table] = values | data.get(table, {})
    for table in ("soil", "tracers"):
        data.pop(table, None)
    camera = data.get("camera")
    if camera is not None:
        given = [way for way in _WAYS if way in camera]
        for way in given[1:]:
            camera.pop(way)
        if not given:
            camera["mm_per_px"] = 1.0
        camera.setdefault("tip_px", [0.0, 0.0])
