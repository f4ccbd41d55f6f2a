"""What is wrong with a test.toml, in words: unknown keys, wrong units, impossible values, missing files."""

import difflib
import itertools
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from ploughval.errors import Fault
from ploughval.limits import FILE_BYTES, size_in_words

Values = Mapping[str, Any]
Location = tuple[int | str, ...]

_EXPECTED = {
    "greater_than": "more than {gt:g}",
    "greater_than_equal": "at least {ge:g}",
    "less_than": "less than {lt:g}",
    "less_than_equal": "at most {le:g}",
    "finite_number": "a finite number",
    "float_type": "a number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": "text in quotes",
    "string_too_short": "text that is not empty",
    "string_too_long": "at most {max_length} characters",
    "tuple_type": "a list in brackets",
    "too_long": "{max_length} values",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "literal_error": "{expected}",
    "enum": "{expected}",
}
_MANY = 100  # values from which on a length is a limit rather than that of a pair or triple
# factor to the unit that ploughval uses, by ending of the key; the longest ending first
_UNITS = {
    "mm_s": {"um_s": 1e-3, "cm_s": 10.0, "m_s": 1e3, "mm_min": 1 / 60, "cm_min": 1 / 6, "m_min": 1000 / 60},
    "kN_m3": {"N_m3": 1e-3, "kg_m3": 9.80665e-3, "g_cm3": 9.80665, "t_m3": 9.80665, "MN_m3": 1e3},
    "per_px": {"per_pixel": 1.0},
    "Nm_per_unit": {"Nmm_per_unit": 1e-3, "kNm_per_unit": 1e3},
    "mm": {"um": 1e-3, "cm": 10.0, "dm": 100.0, "m": 1e3, "in": 25.4, "inch": 25.4},
    "s": {"ms": 1e-3, "min": 60.0, "h": 3600.0},
    "deg": {"rad": 57.29577951308232, "degrees": 1.0},
}


def number(values: Values, key: str, default: float | None = None) -> float | None:
    """A finite number of a table, or None where there is none."""
    value = values.get(key, default)
    usable = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300
    return float(value) if usable and value is not None else None


def table_of(annotation: Any) -> type[BaseModel] | None:
    """The table that a field holds, or may hold; None for a plain value."""
    kinds = [annotation, *get_args(annotation)]
    return next((k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)), None)


def known_keys(model: type[BaseModel]) -> list[str]:
    """Keys that a user may write in a table."""
    return [name for name, field in model.model_fields.items() if not field.exclude]


def rename_keys(
    model: type[BaseModel], data: Values, *, place: str = "", root: type[BaseModel] | None = None
) -> tuple[dict[str, Any], list[Fault]]:
    """Find unknown keys and guess what was meant.

    Returns
    -------
    dict
        The data with the guessed names, so that the rest can be judged at the same time.
    list of Fault
        One for each unknown key.
    """
    root = root or model
    keys = known_keys(model)
    repaired: dict[str, Any] = {}
    faults: list[Fault] = []
    for key, value in data.items():
        meant, scale, expected, remedy = (key, 1.0, "", "") if key in keys else _meant(key, keys, root)
        if scale != 1 and isinstance(value, int | float) and not isinstance(value, bool):
            remedy, value = f"{remedy} = {value * scale:.6g}", value * scale
        if key not in keys:
            value_text = f"{_shown(data[key])} for a key that does not exist"
            faults.append(Fault(f"{place}{key}", value_text, expected, f"{remedy}."))
        if not meant or (meant != key and (meant in data or meant in repaired)):
            continue
        table = table_of(model.model_fields[meant].annotation)
        if table is not None and isinstance(value, dict):
            value, inner = rename_keys(table, value, place=f"{place}{meant}.", root=root)
            faults += inner
        repaired[meant] = value
    return repaired, faults


def _meant(key: str, keys: list[str], root: type[BaseModel]) -> tuple[str, float, str, str]:
    """The key that was probably meant, the factor to its unit, what was expected and what to do."""
    for known in keys:
        for unit, others in _UNITS.items():
            stem = known.removesuffix(f"_{unit}")
            if stem == known or not key.lower().startswith(stem.lower()):
                continue
            rest = key[len(stem) :].removeprefix("_")
            if not rest:
                return known, 1.0, known, f"The unit belongs to the name: write {known}"
            if rest in others:
                return known, others[rest], known, f"The unit is {unit}, not {rest}: write {known}"
    for name in known_keys(root):
        table = table_of(root.model_fields[name].annotation)
        if table is not None and key in known_keys(table):
            return "", 1.0, f"one of {', '.join(keys)}", f"It belongs in [{name}]"
    close = difflib.get_close_matches(key.lower(), [k.lower() for k in keys], n=1, cutoff=0.6)
    for known in keys:
        if close and known.lower() == close[0]:
            return known, 1.0, known, f"Write {known}, or remove it"
    return "", 1.0, f"one of {', '.join(keys)}", "Remove it or correct its name"


def setting_faults(model: type[BaseModel], data: Values, error: ValidationError) -> list[Fault]:
    """Faults of values, from the validation of `data` by `model`; conflicts of a table are left out."""
    groups: dict[Location, list[Any]] = {}
    for item in error.errors(include_url=False):
        if item["type"] == "value_error":  # a conflict: told by the table's own check
            continue
        groups.setdefault(_place(item, data), []).append(item)
    deeper = {path[:k] for path in groups for k in range(len(path))}
    return [_fault(model, data, path, items) for path, items in groups.items() if path not in deeper]


def _place(item: Any, data: Any) -> Location:
    """Where an error stands in the data, without the names that pydantic gives to alternatives."""
    path: list[int | str] = []
    here = data
    for part in item["loc"]:
        inside = part in here if isinstance(here, dict) else isinstance(part, int) and isinstance(here, list)
        if inside and not (isinstance(here, list) and part >= len(here)):
            path.append(part)
            here = here[part]
    if item["type"] == "missing" and isinstance(item["loc"][-1], str):
        path.append(item["loc"][-1])
    return tuple(path)


def _fault(model: type[BaseModel], data: Any, path: Location, items: list[Any]) -> Fault:
    place = ".".join(map(str, path)) or "test.toml"
    kinds = {item["type"] for item in items}
    if "missing" in kinds and isinstance(items[0]["loc"][-1], str):
        return Fault(place, "nothing", "a value", _remedy(model, path))
    if "missing" in kinds:
        expected = f"{1 + max(item['loc'][-1] for item in items)} values"
    else:
        expected = " or ".join(dict.fromkeys(_expected(item) for item in items))
    value = _at(data, path)
    remedy = _remedy(model, path)
    if isinstance(value, str) and "number" in expected and re.fullmatch(r"\s*[-+0-9.,eE]+\s*", value):
        remedy = f"Write it without quotes, with a point. {remedy}".strip()
    return Fault(place, _shown(value), expected, remedy)


def _expected(item: Any) -> str:
    template = _EXPECTED.get(item["type"])
    if template is None:
        return str(item["msg"])
    if item["type"] == "too_long" and item["ctx"]["max_length"] >= _MANY:
        template = f"at most {template}"
    context = {k: float(v) if k in ("gt", "ge", "lt", "le") else v for k, v in item.get("ctx", {}).items()}
    return template.format(**context)


def _at(data: Any, path: Location) -> Any:
    for part in path:
        data = data[part]
    return data


def _remedy(model: type[BaseModel], path: Location) -> str:
    """What the key at a location means, or what its table needs."""
    table: type[BaseModel] | None = model
    key, text = "", ""
    for part in path:
        if table is None or part not in table.model_fields:
            break
        field = table.model_fields[str(part)]
        key, text, table = str(part), field.description or "", table_of(field.annotation)
    if text or table is None or not path:
        return f"{key}: {text}." if text else ""
    needs = [name for name, field in table.model_fields.items() if field.is_required()]
    return f"Add [{'.'.join(map(str, path))}] with {', '.join(needs)}." if needs else ""


def _shown(value: Any) -> str:
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, bool):
        return str(value).lower()
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def find_files(folder: Path, pattern: str) -> list[Path]:
    """Files of a folder with that name or, failing that, that match a pattern; sorted by name.

    A file outside the folder, to which a symbolic link leads, is none of them.
    """
    return [path for path in _matching(folder, pattern) if _within(folder, path)]


def _matching(folder: Path, pattern: str) -> list[Path]:
    try:
        if (folder / pattern).is_file():
            return [folder / pattern]
        return sorted(p for p in folder.glob(pattern) if p.is_file())
    except (ValueError, NotImplementedError, OSError, RuntimeError):
        return []


def not_files(folder: Path, pattern: str) -> list[Path]:
    """What matches a pattern but is neither file nor directory: links to nowhere, pipes, devices."""
    try:
        found = [folder / pattern, *folder.glob(pattern)]
        return sorted({p for p in found if os.path.lexists(p) and not p.is_file() and not p.is_dir()})
    except (ValueError, NotImplementedError, OSError, RuntimeError):
        return []


def _within(folder: Path, path: Path) -> bool:
    """Whether a file lies in the folder once every link is followed."""
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # links that go in circles
        return False


def file_faults(data: Values, folder: Path) -> list[Fault]:
    """Faults of the files and patterns that a test.toml names; values of wrong type are passed over.

    Empty-box runs that are not there are none: the force can do without one, and says so.
    """
    faults = []
    for place, name, is_pattern in named_files(data):
        if not name.strip() or "\0" in name or leaves(name):
            expected = "a path inside the test folder, with forward slashes"
            faults.append(Fault(place, _shown(name), expected, "Copy the files into the test folder."))
            continue
        found = _matching(folder, name) if is_pattern else _named(folder, name)
        faults += _unusable(place, folder, found)
        if not found and not place.startswith("loadcells.empty"):
            expected = "at least one file that matches" if is_pattern else "an existing file"
            faults.append(Fault(place, _shown(name), expected, denied(folder, name) or _near(folder, name)))
    return faults


def denied(folder: Path, pattern: str) -> str:
    """Which folder on the way to a pattern's files may not be read, in words; empty where each may."""
    for depth in range(len(Path(pattern).parts)):
        place = folder.joinpath(*Path(pattern).parts[:depth])
        try:
            with os.scandir(place) as entries:
                for entry in itertools.islice(entries, 1):
                    entry.stat(follow_symlinks=False)
        except PermissionError:
            return f"Permission denied: {place} may not be read; allow it."
        except OSError:  # no folder: a wildcard, or not there
            return ""
    return ""


def _named(folder: Path, name: str) -> list[Path]:
    try:
        return [folder / name] if (folder / name).is_file() else []
    except (ValueError, OSError):
        return []


def _unusable(place: str, folder: Path, found: list[Path]) -> list[Fault]:
    """The first of the files that is outside, one whose name is no text, one that is too large."""
    outside = [p for p in found if not _within(folder, p)]
    inside = [p for p in found if p not in outside]
    nameless = [p for p in inside if not _is_text(p.relative_to(folder).as_posix())]
    large = [p for p in inside if _size(p) > FILE_BYTES]
    faults = []
    if outside:
        got = f"{_shown(outside[0].relative_to(folder).as_posix())}, which lies outside the test folder"
        expected = "files that lie inside it, symbolic links followed"
        faults.append(Fault(place, got, expected, "Copy the files into the test folder."))
    if nameless:
        got = ascii(nameless[0].name)
        faults.append(Fault(place, got, "a name in UTF-8", "Rename the file, best in letters and digits."))
    if large:
        got = f"{_shown(large[0].name)} of {size_in_words(_size(large[0]))}"
        expected = f"files of at most {size_in_words(FILE_BYTES)}"
        faults.append(Fault(place, got, expected, "Keep only the part of the test in it."))
    return faults


def _is_text(name: str) -> bool:
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def named_files(data: Values) -> Iterator[tuple[str, str, bool]]:
    """Place, name and whether it is a pattern, of every file named in the raw settings."""
    camera, cells = data.get("camera"), data.get("loadcells")
    if isinstance(camera, dict):
        board = camera.get("board")
        yield from _text("camera.photos", camera.get("photos"), is_pattern=True)
        if camera.get("times") not in ("exif", "video"):
            yield from _text("camera.times", camera.get("times"))
        yield from _text("camera.calibration", camera.get("calibration"))
        if isinstance(board, dict):
            yield from _text("camera.board.picture", board.get("picture"))
    if isinstance(cells, dict):
        log = cells.get("log")
        named = isinstance(log, str) and not any(sign in log for sign in "*?[")
        yield from _text("loadcells.log", log, is_pattern=not named)
        for k, name in enumerate(log if isinstance(log, list) else []):
            yield from _text(f"loadcells.log.{k}", name, is_pattern=True)
        empty = cells.get("empty")
        for k, name in enumerate(empty if isinstance(empty, list) else []):
            yield from _text(f"loadcells.empty.{k}", name, is_pattern=True)
        yield from _calibration_files(cells.get("calibration"))


def _calibration_files(given: Any) -> Iterator[tuple[str, str, bool]]:
    """The same of the files that calibrate the cells."""
    files, logs = (given.get(k) if isinstance(given, dict) else None for k in ("files", "staircases"))
    for k, name in enumerate(files if isinstance(files, list) else []):
        yield from _text(f"loadcells.calibration.files.{k}", name, is_pattern=True)
    for k, staircase in enumerate(logs if isinstance(logs, list) else []):
        if isinstance(staircase, dict):
            yield from _text(f"loadcells.calibration.staircases.{k}.log", staircase.get("log"))


def _text(place: str, name: Any, *, is_pattern: bool = False) -> Iterator[tuple[str, str, bool]]:
    if isinstance(name, str):
        yield place, name, is_pattern


def leaves(name: str) -> bool:
    """Whether a name leads out of its folder, or is none with forward slashes."""
    windows = PureWindowsPath(name)
    return bool(PurePosixPath(name).is_absolute() or windows.anchor or ".." in windows.parts or "\\" in name)


def _near(folder: Path, name: str) -> str:
    """What stands where the file was sought."""
    place = (folder / name).parent
    if not _within(folder, place):
        return f"{place} leads outside the test folder. Copy the files into it."
    try:
        place = place if place.is_dir() else folder
        there = sorted(p.name + "/" * p.is_dir() for p in place.iterdir())
    except OSError as error:
        return f"{place} cannot be looked into: {error.strerror}."
    close = difflib.get_close_matches(Path(name).name, there, n=3, cutoff=0.3) or there[:3]
    return (
        f"{place} holds {', '.join(close)}{', ...' if len(there) > len(close) else ''}."
        if there
        else (f"{place} holds nothing.")
    )
