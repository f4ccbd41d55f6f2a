"""The public names are those of public_names.toml, and each says what it takes, gives and refuses."""

import ast
import dataclasses
import importlib
import inspect
import itertools
import re
import textwrap
import tomllib
from pathlib import Path

import pytest

PUBLIC = tomllib.loads((Path(__file__).parent / "public_names.toml").read_text(encoding="utf-8"))
NAMES = [f"{module}.{name}" for module, names in PUBLIC.items() for name in names]
SECTION = r"(?ms)^{}\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)"
ENTRY = re.compile(r"(?m)^(?!\s)([^:\n]+?)(?: : (.*))?$")
UNITS = {"mm", "mm2", "px", "deg", "s", "N", "Nm", "Hz"}
"""How names end that say their unit."""
COUNTED = re.compile(r"\b(bool|int\w*|uint\w*|str|Region|Status)\b")
"""Kinds of values that have no unit."""
ARRAYS = re.compile(r"\b(NDArray|ArrayLike|Floats|Points|Image|ndarray)\b")
"""Annotations of arrays."""


def section(text, name):
    """Entries of a section of a numpydoc text: what stands before and after the colon."""
    found = re.search(SECTION.format(name), text)
    if found is None:
        return None
    entries = {}
    for names, kind in ENTRY.findall(found[1]):
        for one in names.split(","):
            entries[one.strip().lstrip("*")] = kind
    return entries


def public(name):
    module, _, own = name.rpartition(".")
    return getattr(importlib.import_module(module), own)


def is_class_of_fields(thing):
    return inspect.isclass(thing) and (dataclasses.is_dataclass(thing) or hasattr(thing, "_fields"))


def fields_of(thing):
    names = [f.name for f in dataclasses.fields(thing)] if dataclasses.is_dataclass(thing) else thing._fields
    return [name for name in names if not name.startswith("_")]


def source_of(thing):
    return ast.parse(textwrap.dedent(inspect.getsource(thing))).body[0]


def described_in_place(thing):
    """Fields of a class with a text of their own on the next line."""
    body = source_of(thing).body
    return {
        first.target.id: second.value.value
        for first, second in itertools.pairwise(body)
        if isinstance(first, ast.AnnAssign)
        and isinstance(second, ast.Expr)
        and isinstance(second.value, ast.Constant)
        and isinstance(second.value.value, str)
    }


def described_fields(thing):
    """Fields that a class, or one that it comes from, has words for."""
    known = set()
    for kind in thing.__mro__[:-1]:
        known |= set(section(inspect.getdoc(kind) or "", "Attributes") or {})
        known |= set(described_in_place(kind)) if kind.__module__.startswith("ploughval") else set()
    return known


@pytest.mark.parametrize("module", PUBLIC)
def test_the_public_names_of_a_module_are_those_that_are_listed(module):
    assert sorted(importlib.import_module(module).__all__) == sorted(PUBLIC[module])


def test_every_room_is_in_the_list():
    import ploughval

    rooms = {
        f"ploughval.{path.parent.name}" for path in Path(ploughval.__file__).parent.glob("*/__init__.py")
    }
    assert rooms - set(PUBLIC) == set()


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_says_what_it_takes_gives_and_refuses(name):
    thing = public(name)
    if not (inspect.isclass(thing) or inspect.isfunction(thing)):
        return
    text = inspect.getdoc(thing)
    assert text
    if is_class_of_fields(thing):
        assert set(fields_of(thing)) <= described_fields(thing)
    elif inspect.isfunction(thing):
        check_function(thing, text)


def check_function(function, text):
    signature = inspect.signature(function)
    given = section(text, "Parameters") or {}
    assert set(given) == set(signature.parameters)
    lacking = [
        name for name, p in signature.parameters.items() if not given[name] and p.kind is not p.VAR_KEYWORD
    ]
    assert not lacking, "kind"
    back = str(signature.return_annotation)
    if not re.search(r"(^|\W)(None|Figure)'?>?$", back):
        assert section(text, "Returns") is not None or section(text, "Yields") is not None
    raised = [node for node in ast.walk(source_of(function)) if isinstance(node, ast.Raise) and node.exc]
    assert not raised or section(text, "Raises") is not None


def arrays_of(thing):
    """What is said of each parameter or field that holds an array: its type line, or the text below it."""
    if inspect.isfunction(thing):
        kinds = {p.name: str(p.annotation) for p in inspect.signature(thing).parameters.values()}
        told = section(inspect.getdoc(thing), "Parameters") or {}
    else:
        kinds = {name: str(kind) for name, kind in inspect.get_annotations(thing).items()}
        beside = {name: text.replace(" px", ", px") for name, text in described_in_place(thing).items()}
        told = beside | (section(inspect.getdoc(thing), "Attributes") or {})
    return {
        name: told[name]
        for name, kind in kinds.items()
        if name[0] != "_" and ARRAYS.search(kind) and "tuple[" not in kind
    }


@pytest.mark.parametrize("name", NAMES)
def test_arrays_of_a_public_name_have_a_shape_and_a_unit(name):
    thing = public(name)
    if not (inspect.isfunction(thing) or is_class_of_fields(thing)):
        return
    for one, told in arrays_of(thing).items():
        shape = re.search(r"\(\S[^)]*\)", told)
        assert shape, f"{one}: {told!r} has no shape"
        kind, _, unit = told[shape.end() :].partition(",")
        said = unit or one.rpartition("_")[2] in UNITS or COUNTED.search(kind)
        assert said, f"{one}: {told!r} has no unit"
