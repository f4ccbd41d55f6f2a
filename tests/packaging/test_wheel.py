"""A wheel holds what an installed ploughval needs, and nothing else."""

import ast
import zipfile
from email import message_from_string
from pathlib import PurePosixPath

import pytest

from ploughval.run import benches


@pytest.fixture(scope="module")
def files(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.fixture(scope="module")
def metadata(files):
    (name,) = (name for name in files if name.endswith(".dist-info/METADATA"))
    return message_from_string(files[name].decode())


def of_the_package(root):
    """Files of src/ploughval that are no leavings of a run."""
    source = root / "src"
    found = (path for path in (source / "ploughval").rglob("*") if path.is_file())
    return {p.relative_to(source).as_posix(): p for p in found if "__pycache__" not in p.parts}


def test_it_holds_the_package_byte_for_byte_and_beside_it_benchmarks_and_metadata_alone(files, root):
    package = of_the_package(root)
    assert {name for name in files if name not in package} == {
        name for name in files if name.startswith("ploughval/benchmarks/") or ".dist-info/" in name
    }
    assert {name: files[name] for name in package} == {
        name: path.read_bytes() for name, path in package.items()
    }
    assert {"ploughval/py.typed", "ploughval/report/templates/test.html.j2"} <= set(files)


def test_its_benchmarks_are_the_scripts_of_ploughval_bench_and_what_they_import_of_each_other(files, root):
    """Every import of one script by another is met by a file of the wheel; no file is there in vain."""
    folder = "ploughval/benchmarks/"
    held = {name.removeprefix(folder): text for name, text in files.items() if name.startswith(folder)}
    started = {path.name for path in (root / "benchmarks").glob(f"{benches.PREFIX}*.py")}
    started |= {f"{name.replace('.', '/')}.py" for name in (benches.PAGE, benches.MACHINE)}
    assert started <= set(held)
    local = {path.stem for path in (root / "benchmarks").iterdir() if path.suffix in ("", ".py")}
    modules, members = (set().union(*each) for each in zip(*map(imports, held.values()), strict=True))
    for place in (name.replace(".", "/") for name in modules if name.partition(".")[0] in local):
        assert {f"{place}.py", f"{place}/__init__.py"} & set(held)
    packages = {f"{parent}/__init__.py" for name in held for parent in PurePosixPath(name).parents}
    called = {f"{name.replace('.', '/')}.py" for name in modules | members}
    assert set(held) - started - packages <= called


def imports(text):
    """Modules that a script imports, or imports names from; and those names, which may be modules too."""
    nodes = list(ast.walk(ast.parse(text)))
    parts = [node for node in nodes if isinstance(node, ast.ImportFrom)]
    plain = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    members = {f"{node.module}.{alias.name}" for node in parts for alias in node.names}
    return plain | {str(node.module) for node in parts}, members


def test_it_stays_below_one_and_a_half_megabytes_and_holds_neither_tests_nor_leavings(files, wheel):
    assert wheel.stat().st_size < 1_500_000
    assert not [name for name in files if "test_" in name or "__pycache__" in name or name.endswith(".pyc")]
    assert wheel.name.endswith("-py3-none-any.whl")


def test_it_states_its_licence_and_holds_its_text(files, metadata, root):
    assert metadata["License-Expression"] == "MIT"
    (text,) = (files[name] for name in files if name.endswith(".dist-info/licenses/LICENSE"))
    assert text == (root / "LICENSE").read_bytes()


def test_the_command_is_its_entry_point(files):
    (text,) = (files[name].decode() for name in files if name.endswith(".dist-info/entry_points.txt"))
    assert text.split() == ["[console_scripts]", "ploughval", "=", "ploughval.cli:main"]


def test_its_description_is_the_readme_without_what_an_index_cannot_show(metadata, root):
    """An index has neither the repository's pictures nor its files: links to them would lead nowhere."""
    description = metadata.get_payload()
    readme = (root / "README.md").read_text(encoding="utf-8")
    assert metadata["Description-Content-Type"] == "text/markdown"
    targets = [part.partition(")")[0] for part in description.split("](")[1:]]
    assert [target for target in targets if not target.startswith(("https://", "#"))] == []
    blocks, of_readme = (text.split("```")[1::2] for text in (description, readme))
    assert blocks == of_readme
    headings, of_readme = ([li for li in t.splitlines() if li[:1] == "#"] for t in (description, readme))
    assert headings == of_readme
