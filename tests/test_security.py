"""What the code must not do with what it is given: run it, unpack it to objects, or hand it to a shell."""

import ast
import io
import re
import struct
import xml.etree.ElementTree as ET
import zlib
from pathlib import Path
from xml.dom import minidom
from xml.parsers import expat

import numpy as np
import pytest
import tifffile
from PIL import Image

from ploughval.photos.reading.decode import decode, read_header

ROOT = Path(__file__).parents[1]
FILES = [path for room in ("src", "benchmarks") for path in sorted((ROOT / room).rglob("*.py"))]
UNPACKERS = {
    "pickle",
    "cPickle",
    "_pickle",
    "marshal",
    "shelve",
    "dill",
    "cloudpickle",
    "jsonpickle",
    "joblib",
}
PARSERS = {"xml", "lxml", "yaml", "defusedxml"}
CALLS = {
    "eval",
    "exec",
    "compile",
    "__import__",
    "os.system",
    "os.popen",
    "os.startfile",
    "pty.spawn",
    "subprocess.getoutput",
    "subprocess.getstatusoutput",
    "tempfile.mktemp",
    "pd.read_pickle",
    "pd.eval",
    "np.fromregex",
    "ssl._create_unverified_context",
    "asyncio.create_subprocess_shell",
}
STARTERS = ("os.exec", "os.spawn", "os.posix_spawn", "subprocess.")
"""What starts programs: called by these names alone, so that it is seen."""
METHODS = {"to_pickle", "read_pickle", "eval"}
OWN_MARKUP = {
    "src/ploughval/report/figures/svg.py": "shrinks the drawings that matplotlib has just written",
    "src/ploughval/export/vtk_xml.py": "writes files for ParaView, and reads none",
}
"""Files that know XML, and of whom: never of a user's."""


SUSPECT = re.compile(
    "pickle|marshal|shelve|dill|joblib|eval|exec|compile|__import__|system|popen|startfile|spawn|getoutput|getstatus"
    "|mktemp|shell|subprocess|load|xml|yaml|Environment|assert |_unverified|fromregex"
)
"""A file without any of these words needs no parsing."""


@pytest.fixture(scope="module")
def trees():
    sources = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in FILES}
    return {file: list(ast.walk(ast.parse(text))) for file, text in sources.items() if SUSPECT.search(text)}


def nodes(trees, kind):
    return [(file, node) for file, found in trees.items() for node in found if isinstance(node, kind)]


def named(call):
    """Dotted name of what is called; empty for anything else."""
    parts, node = [], call.func
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    return ".".join([node.id, *parts[::-1]]) if isinstance(node, ast.Name) else ""


def options(call):
    return {word.arg: ast.unparse(word.value) for word in call.keywords}


def imported(node):
    names = [node.module or ""] if isinstance(node, ast.ImportFrom) else [alias.name for alias in node.names]
    return {name.partition(".")[0] for name in names}


def places(found):
    return [f"{file}:{node.lineno}: {ast.unparse(node)[:80]}" for file, node in found]


def test_there_is_code_to_look_at(trees):
    assert len(FILES) > 300
    assert len(trees) > 100
    assert any(named(call) == "np.load" for _, call in nodes(trees, ast.Call))


def test_nothing_unpacks_objects_from_bytes(trees):
    found = [(f, n) for f, n in nodes(trees, ast.Import | ast.ImportFrom) if imported(n) & UNPACKERS]
    assert places(found) == []


def test_no_text_is_run_as_code_or_by_a_shell(trees):
    calls = nodes(trees, ast.Call)
    named_so = [
        (f, n)
        for f, n in calls
        if named(n) in CALLS or named(n).startswith(STARTERS[:-1]) or getattr(n.func, "attr", "") in METHODS
    ]
    shells = [(f, n) for f, n in calls if any(word.arg == "shell" for word in n.keywords)]
    assert places(named_so + shells) == []


def test_what_runs_or_unpacks_is_not_called_by_another_name(trees):
    names = [(f, n, f"{n.module}.{a.name}") for f, n in nodes(trees, ast.ImportFrom) for a in n.names]
    bare = [(f, n) for f, n, name in names if name in CALLS or name.startswith(STARTERS)]
    watched = {"os", "subprocess", "builtins", "importlib", "asyncio", "pty", "tempfile", "ssl"}
    renamed = [(f, n) for f, n in nodes(trees, ast.Import) for a in n.names if a.asname and a.name in watched]
    late = [
        (f, n)
        for f, n in nodes(trees, ast.Call)
        if named(n).endswith("import_module")
        and {part.value.partition(".")[0] for part in n.args if isinstance(part, ast.Constant)} & UNPACKERS
    ]
    assert places(bare + renamed + late) == []


def test_processes_are_started_from_lists_and_not_from_lines(trees):
    for file, call in nodes(trees, ast.Call):
        if named(call).startswith("subprocess.") and named(call) != "subprocess.TimeoutExpired":
            assert not isinstance(call.args[0], ast.Constant | ast.JoinedStr), places([(file, call)])


def test_arrays_are_loaded_without_objects_among_them(trees):
    calls = nodes(trees, ast.Call)
    loads = [(f, n) for f, n in calls if named(n) in ("np.load", "numpy.load") and f.startswith("src")]
    assert loads
    assert places([(f, n) for f, n in loads if options(n).get("allow_pickle") != "False"]) == []
    assert (
        places(
            [
                (f, n)
                for f, n in calls
                if any(word.arg == "allow_pickle" for word in n.keywords)
                and options(n)["allow_pickle"] != "False"
            ]
        )
        == []
    )


def test_xml_and_yaml_of_users_have_no_parser_here(trees):
    found = [(f, n) for f, n in nodes(trees, ast.Import | ast.ImportFrom) if imported(n) & PARSERS]
    assert places([(f, n) for f, n in found if f not in OWN_MARKUP]) == []
    assert {f for f, _ in found} == set(OWN_MARKUP)


def test_templates_escape_what_is_put_into_them(trees):
    made = [n for _, n in nodes(trees, ast.Call) if named(n).rpartition(".")[2] == "Environment"]
    assert [options(n).get("autoescape") for n in made] == ["True"]
    templates = sorted((ROOT / "src/ploughval/report/templates").glob("*.j2"))
    assert templates
    for path in templates:
        assert not re.search(r"\|\s*safe\b|autoescape\s+false", path.read_text(encoding="utf-8")), path.name


def test_assertions_narrow_types_and_guard_no_input(trees):
    """They are gone under ``python -O``: what a user can cause is refused by an ``if``."""
    usual = re.compile(r"[\w.\[\]'()]+ is not None|(isinstance|is_dataclass)\(.*\)")
    found = [
        (f, n)
        for f, n in nodes(trees, ast.Assert)
        if f.startswith("src") and not usual.fullmatch(ast.unparse(n.test))
    ]
    assert places(found) == []


LAUGHS = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10 if k else "lol"}">' for k in range(10))
BOMB = f'<?xml version="1.0"?><!DOCTYPE OME [{LAUGHS}]><OME xmlns="x">&l9;</OME>'
"""A text of 600 bytes that becomes 3 GB where its entities are expanded."""


@pytest.fixture
def parsed(monkeypatch):
    """Names of the XML parsers that were called."""
    called = []
    for home, name in [
        (ET, "XMLParser"),
        (ET, "fromstring"),
        (ET, "XML"),
        (ET, "parse"),
        (ET, "iterparse"),
        (minidom, "parseString"),
        (expat, "ParserCreate"),
    ]:
        monkeypatch.setattr(home, name, lambda *_, name=name, **__: called.append(name))
    return called


def png_with(text):
    """A picture whose first chunk of text, as Adobe's programs write it, holds XML."""
    buffer = io.BytesIO()
    Image.fromarray(np.full((40, 60), 99, np.uint8)).save(buffer, format="PNG")
    data = b"XML:com.adobe.xmp\0\0\0\0\0" + text.encode()
    chunk = struct.pack(">I", len(data)) + b"iTXt" + data + struct.pack(">I", zlib.crc32(b"iTXt" + data))
    whole = buffer.getvalue()
    return whole[:33] + chunk + whole[33:]  # after the header


def jpeg_with(text):
    buffer = io.BytesIO()
    Image.fromarray(np.full((40, 60), 99, np.uint8)).save(buffer, format="JPEG")
    data = b"http://ns.adobe.com/xap/1.0/\0" + text.encode()
    whole = buffer.getvalue()
    return whole[:2] + b"\xff\xe1" + struct.pack(">H", len(data) + 2) + data + whole[2:]


def tiff_with(text):
    buffer = io.BytesIO()
    tifffile.imwrite(buffer, np.full((40, 60), 99, np.uint8), description=text, metadata=None)
    return buffer.getvalue()


@pytest.mark.parametrize(("name", "made"), [("a.png", png_with), ("a.jpg", jpeg_with), ("a.tif", tiff_with)])
def test_xml_in_a_picture_is_never_parsed_so_that_it_cannot_grow(name, made, tmp_path, parsed):
    path = tmp_path / name
    path.write_bytes(made(BOMB))
    assert b"l9" in path.read_bytes()
    assert read_header(path).shape[:2] == (40, 60)
    assert abs(int(decode(path)[5, 5]) - 99) <= 1
    assert parsed == []
