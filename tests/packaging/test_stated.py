"""What is stated in two places is the same in both."""

import re
import tomllib
from importlib.metadata import version

import pytest
from packaging.requirements import Requirement


@pytest.fixture(scope="module")
def project(root):
    return tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_the_citation_names_version_licence_and_title_of_the_package(project, root):
    text = (root / "CITATION.cff").read_text(encoding="utf-8")
    cited = dict(re.findall(r"^(version|license|title|abstract): \"?([^\"\n]+)\"?$", text, re.MULTILINE))
    keys = ("version", "license", "title", "abstract")
    assert {key: cited[key].rstrip(".") for key in keys} == {
        "version": project["version"],
        "license": project["license"],
        "title": project["name"],
        "abstract": project["description"],
    }


def test_the_installed_version_is_that_of_the_project(project):
    assert version("ploughval") == project["version"]


def test_the_pythons_of_the_classifiers_begin_with_the_lowest_that_is_required(project):
    listed = [
        text.rpartition(" :: ")[2] for text in project["classifiers"] if re.search(r"Python :: 3\.\d+$", text)
    ]
    assert project["requires-python"] == f">={listed[0]}"
    assert listed == [f"3.{minor}" for minor in range(11, 11 + len(listed))]


def test_every_dependency_has_a_lower_bound(project):
    """Without one the row of lowest versions would test whatever was first released."""
    extras = project["optional-dependencies"].values()
    asked = [Requirement(text) for text in (*project["dependencies"], *(t for each in extras for t in each))]
    own = [requirement for requirement in asked if requirement.name == project["name"]]
    assert [r.name for r in asked if r not in own and not any(s.operator == ">=" for s in r.specifier)] == []
