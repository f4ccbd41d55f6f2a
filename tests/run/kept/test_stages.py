"""The key of a stage names all that the stage depends on: code by its imports, settings by what is read."""

import ast
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import ploughval
from ploughval.photos import calibrate, open_frames
from ploughval.run import process_folder
from ploughval.run.kept.stages import STAGES, WINDOW, Stage, stage_key
from ploughval.run.kept.store import Store
from ploughval.run.provenance import code_digest
from ploughval.scene import Scene, load_scene
from ploughval.scene_base import Table
from ploughval.synth import EXAMPLE, make_folder

ROOT = Path(ploughval.__file__).parent
OWN = "ploughval"


def file_of(module):
    place = ROOT.parent.joinpath(*module.split("."))
    for path in (place.with_suffix(".py"), place / "__init__.py"):
        if path.is_file():
            return path
    return None


class Imports(ast.NodeVisitor):
    """Modules of this package that a module imports, wherever in it, but for those of type checkers alone."""

    def __init__(self):
        self.found = set()

    def visit_If(self, node):
        if isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            for other in node.orelse:
                self.visit(other)
        else:
            self.generic_visit(node)

    def visit_Import(self, node):
        self.found.update(alias.name for alias in node.names)

    def visit_ImportFrom(self, node):
        assert node.level == 0, "relative import"
        self.found.add(node.module)
        self.found.update(f"{node.module}.{alias.name}" for alias in node.names)


@cache
def bare(module):
    """Whether a module holds nothing but its docstring."""
    return len(ast.parse(file_of(module).read_text(encoding="utf-8")).body) == 1


@cache
def imported(module):
    """Modules that a module imports, and the packages that they stand in."""
    visitor = Imports()
    visitor.visit(ast.parse(file_of(module).read_text(encoding="utf-8")))
    found = set()
    for name in visitor.found:
        while name.startswith(f"{OWN}."):
            if file_of(name) is not None:
                found.add(name)
            name = name.rpartition(".")[0]
    return {name for name in found - {f"{OWN}.run"} if not bare(name)}  # run names what the package offers


def reached(*entries):
    """Every module that these import, and what those import."""
    waiting = [f"{OWN}.{entry}" for entry in entries]
    for entry in entries:
        folder = ROOT.joinpath(*entry.split("."))
        for path in folder.rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            waiting.append(".".join([OWN, *parts]).removesuffix(".__init__"))
    seen = set()
    while waiting:
        module = waiting.pop()
        if module not in seen:
            seen.add(module)
            waiting += imported(module)
    return {module.removeprefix(f"{OWN}.") for module in seen}


def covered(module, rooms):
    return any(module == room or module.startswith(f"{room}.") for room in rooms)


@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: stage.name)
def test_a_stage_lists_every_room_that_its_code_reaches_and_no_other(stage):
    modules = reached(*stage.entries)
    assert {module for module in modules if not covered(module, stage.rooms)} == set()
    idle = [room for room in stage.rooms if not any(covered(module, [room]) for module in modules)]
    assert set(idle) <= {"run.kept.snapshots", "run.kept.table_arrays"}  # how the result is stored


def test_the_digest_of_a_room_follows_its_files_and_no_others():
    assert code_digest("model") == code_digest("model")
    assert len({code_digest(), code_digest("model"), code_digest("piv"), code_digest("model", "piv")}) == 4
    assert code_digest("axes") != code_digest("errors")
    with pytest.raises(FileNotFoundError):
        code_digest.__wrapped__("no_such_room")


def test_files_that_change_under_a_run_do_not_change_the_code_that_it_names(monkeypatch):
    before = code_digest()
    monkeypatch.setattr(Path, "read_bytes", lambda path: pytest.fail(f"{path} is read again"))
    assert code_digest.__wrapped__("model") == code_digest.__wrapped__("model")
    assert code_digest.__wrapped__() == before


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("stages") / "test"
    photographs = {"frames": 3, "displacement_mm": 4.0, "mm_per_px": 0.4, "ahead_mm": 60.0}
    make_folder(path, replace(EXAMPLE, seed=2, rate_hz=10.0, rest_s=3.0, clock_told=False, **photographs))
    with (path / "test.toml").open("a") as file:
        file.write("\n[compare]\ndraws = 16\n")
    return path


def tables_of_settings():
    """The tables of test.toml by name."""
    return {
        name: kind
        for name, field in Scene.model_fields.items()
        for kind in [field.annotation, *getattr(field.annotation, "__args__", ())]
        if isinstance(kind, type) and issubclass(kind, Table)
    }


@pytest.fixture
def read(monkeypatch):
    """Names of the tables of test.toml, and of their fields, that are read from now on."""
    seen = set()
    plain = Table.__getattribute__
    tables = tables_of_settings()
    names = {kind: name for name, kind in tables.items()}

    def watched(self, name):
        kind = type(self)
        if name in kind.model_fields:
            if kind is Scene and name in tables:
                seen.add(name)
            elif kind in names:
                seen.add(f"{names[kind]}.{name}")
        return plain(self, name)

    monkeypatch.setattr(Table, "__getattribute__", watched)
    return seen


def told(stage: Stage):
    """What the settings of a stage's key name."""
    names = set()
    for table, fields in stage.settings.items():
        named = tables_of_settings()[table].model_fields if fields is True else fields
        names |= {table, *(f"{table}.{field}" for field in named)}
    return names


def test_a_stage_reads_no_setting_that_its_key_does_not_name(folder, read, monkeypatch, tmp_path):
    """Each stage is run with an empty store, and what it reads of the scene meanwhile is taken down."""
    scene = load_scene(folder)
    read.clear()
    assert scene.steps
    steps, reads, keys = set(read), {}, {}
    read.clear()
    calibrate(scene, open_frames(scene))
    opened = set(read)
    load, save = Store.load, Store.save

    def loading(self, stage, key):
        found = load(self, stage, key)
        if not stage.startswith("walk"):
            read.clear()
        return found

    def saving(self, stage, key, arrays):
        reads[stage], keys[stage] = set(read), key
        return save(self, stage, key, arrays)

    monkeypatch.setattr(Store, "load", loading)
    monkeypatch.setattr(Store, "save", saving)
    process_folder(folder, out=tmp_path / "out")
    reads["window"] |= opened
    assert reads.keys() == {stage.name for stage in STAGES}
    for stage in STAGES:
        assert reads[stage.name] - told(stage) - steps == set(), stage.name
        assert reads[stage.name] - steps, stage.name
        settings = scene.model_dump_json(include=dict(stage.settings))
        assert ("settings", settings) in keys[stage.name].parts


def test_what_tells_the_steps_of_a_test_apart_is_named_where_a_stage_asks_for_it(folder):
    scene = load_scene(folder)
    without = scene.model_copy(update={"tracers": None})
    assert stage_key(WINDOW, scene).digest != stage_key(WINDOW, without).digest
    untracked = scene.model_copy(update={"piv": scene.piv.model_copy(update={"track": False})})
    assert stage_key(WINDOW, scene).digest != stage_key(WINDOW, untracked).digest
