"""docs/architecture.md, the index and the reference name what there is."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "ploughval"
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
INSIDE = PAGE.split("## Inside the rooms", 1)[1]
SHARED = {"changing", "load_results", "simulate"}
ROOMS = sorted(path.parent.name for path in SOURCE.glob("*/__init__.py"))


def paragraph(room: str) -> str:
    """What the page says of a room, up to the next one."""
    return re.split(r"\n\*\*|\nBeside", INSIDE.split(f"**{room}** ", 1)[1])[0]


@pytest.mark.parametrize("room", ROOMS)
def test_every_room_is_on_the_page_with_each_of_its_folders(room):
    inside = [path.parent.name for path in (SOURCE / room).glob("*/__init__.py")]
    assert [name for name in inside if f"`{name}/`" not in paragraph(room)] == []


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_is_said_to_hold_only_what_is_in_it(room):
    there = {path.stem for path in (SOURCE / room).rglob("*")} | SHARED
    assert set(re.findall(r"`([a-z]\w*)/?`", paragraph(room))) - there == set()


@pytest.mark.parametrize("room", ROOMS)
def test_every_room_is_in_the_drawing_and_has_a_page_of_the_reference(room):
    drawing = (ROOT / "docs" / "sketches" / "rooms.svg").read_text(encoding="utf-8")
    assert f">{room}<" in drawing
    reference = (ROOT / "docs" / "api" / f"{room}.md").read_text(encoding="utf-8")
    assert f"automodule:: ploughval.{room}\n" in reference


def test_every_single_module_beside_the_rooms_is_on_the_page():
    modules = {path.stem for path in SOURCE.glob("*.py")} - {"__init__", "__main__"}
    assert [name for name in sorted(modules) if f"`{name.split('_')[0]}" not in PAGE] == []
