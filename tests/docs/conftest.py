"""Runs what the pages show: their commands, their Python, and the files that they say to save.

Only fenced blocks count. `console`: lines that begin with "$ " are run, the lines after each are what it
prints; decimals may differ by one unit of the last digit that the page gives, `...` stands for anything.
`python`: names live through the page; a `text` block right after it is what it prints. `toml` after a
paragraph "Save ... `FILE`:" is written to that file. A paragraph that begins with "Not run by the tests:"
excuses the block after it. All blocks of a page share one folder, for all pages but the tutorial a copy of
the one in which the tutorial was followed.
"""

import fcntl
import json
import os
import re
import shlex
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import chdir, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import pytest
from markdown_it import MarkdownIt
from typer.testing import CliRunner

ROOT = Path(__file__).resolve().parents[2]
TUTORIAL = "docs/tutorial.md"
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?![\w]*\.\d)")
_SAVED = re.compile(r"Save\b.*`([^`]+)`:")
_PLAIN = frozenset({"ls", "cat", "head", "mkdir", "cp"})


@dataclass(frozen=True)
class Block:
    """A fenced block: where it stands, what it holds, what the paragraph before it says."""

    page: str
    line: int
    kind: str
    text: str
    before: str

    @property
    def place(self) -> str:
        return f"{self.page}, line {self.line}"

    @property
    def excuse(self) -> str:
        """Why it is not run; empty: it is."""
        found = re.match(r"\W*Not run by the tests:\W*(.*)", self.before, re.DOTALL)
        return " ".join(found[1].split()) if found else ""


def _blocks_of(name: str, text: str) -> list[Block]:
    """The fenced blocks of a page in their order."""
    tokens = MarkdownIt("commonmark").parse(text)
    found, before = [], ""
    for token in tokens:
        if token.type == "inline":
            before = token.content
        elif token.type == "fence":
            found.append(Block(name, token.map[0] + 1, token.info.strip(), token.content, before))
            before = ""
    return found


def _says(shown: str, printed: str) -> bool:
    """Whether what was printed is what a page shows, but for `...` and the last digit of numbers."""
    parts, wanted = [], []
    for piece in re.split(r"(\.\.\.)", shown.strip()):
        if piece == "...":
            parts.append(r".*?")
            continue
        end = 0
        for number in _NUMBER.finditer(piece):
            parts += [_plain(piece[end : number.start()]), r"([-+]?\d+(?:\.\d+)?)"]
            wanted.append(number[0])
            end = number.end()
        parts.append(_plain(piece[end:]))
    found = re.fullmatch("".join(parts), printed.strip(), re.DOTALL)
    return found is not None and all(map(_alike, wanted, found.groups()))


def _plain(text: str) -> str:
    """A text as a pattern in which any white space stands for any other."""
    return r"\s+".join(re.escape(word) for word in re.split(r"\s+", text))


def _alike(wanted: str, got: str) -> bool:
    digits = len(wanted.partition(".")[2])
    return abs(float(wanted) - float(got)) <= (1.01 * 10.0**-digits if digits else 0.0)


class Follower:
    """Someone who types what a page shows into a folder and compares what comes out."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.names: dict[str, object] = {"__name__": "page"}
        self.failures: list[str] = []

    def follow(self, blocks: list[Block]) -> None:
        """Run the blocks of a page; what differs is gathered in `failures`."""
        printed = ""
        with chdir(self.folder):
            for block in blocks:
                if block.excuse:
                    continue
                if block.kind == "console":
                    self._console(block)
                elif block.kind == "python":
                    printed = self._python(block)
                elif block.kind == "text" and not block.before and printed:
                    self._compare(block.place, block.text, printed)
                elif block.kind == "toml" and (saved := _SAVED.match(block.before)):
                    Path(saved[1]).write_text(block.text, encoding="utf-8")
                if block.kind != "python":
                    printed = ""

    def _console(self, block: Block) -> None:
        for command, shown in _commands(block.text):
            code, printed = self._run(command)
            self._compare(f"{block.place}: {command}", shown, printed)
            if code and not re.search(r"^(refused|fault)\b", shown, re.MULTILINE):
                self.failures.append(f"{block.place}: {command}: exit code {code}\n{printed}")

    def _run(self, command: str) -> tuple[int, str]:
        program, *arguments = shlex.split(command)
        if program == "ploughval" and arguments[0] != "fit":
            from ploughval.cli import app
            from ploughval.progress import Events

            with pytest.MonkeyPatch.context() as patch:  # progress as on a terminal: gone at the end
                patch.setattr("ploughval.talk.Lines", lambda say: Events(lambda event: None))
                done = CliRunner().invoke(app, arguments, catch_exceptions=False)
            return done.exit_code, done.output
        if program == "ploughval":  # fit asks for one thread of linear algebra before that is loaded
            line = [sys.executable, "-m", "ploughval.cli", *arguments]
        elif program in _PLAIN:
            line = [program, *arguments]
        else:
            return 127, f"{program}: pages run ploughval and {', '.join(sorted(_PLAIN))} only"
        told = subprocess.run(line, capture_output=True, text=True, check=False, timeout=300)
        return told.returncode, told.stdout + (told.stderr if told.returncode else "")

    def _python(self, block: Block) -> str:
        printed = StringIO()
        code = compile("\n" * block.line + block.text, str(ROOT / block.page), "exec")
        with redirect_stdout(printed):
            exec(code, self.names)
        return printed.getvalue()

    def _compare(self, place: str, shown: str, printed: str) -> None:
        if not _says(shown, printed):
            self.failures.append(f"{place}\nthe page shows:\n{shown}\nit prints:\n{printed}")


def _commands(text: str) -> Iterator[tuple[str, str]]:
    """Commands of a console block, each with what is shown after it."""
    for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
        command, _, shown = re.sub(r"\\\n>?\s*", " ", part).partition("\n")
        yield command, shown


def _pages() -> dict[str, list[Block]]:
    """The fenced blocks of every page that people read, by its name from the top of the repository."""
    files = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
    names = {path.relative_to(ROOT).as_posix(): path for path in files}
    return {name: _blocks_of(name, path.read_text(encoding="utf-8")) for name, path in names.items()}


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """A test that asks for a page gets each that shows something to run, but for the tutorial."""
    if "page" in metafunc.fixturenames and "pages" in metafunc.fixturenames:
        names = [
            name
            for name, blocks in _pages().items()
            if name != TUTORIAL and any(b.kind in ("console", "python") and not b.excuse for b in blocks)
        ]
        metafunc.parametrize("page", names)


@pytest.fixture(scope="session")
def pages() -> dict[str, list[Block]]:
    """The blocks of all pages."""
    return _pages()


@pytest.fixture(scope="session")
def follower() -> type[Follower]:
    """Makes someone who follows a page."""
    return Follower


@dataclass(frozen=True)
class Followed:
    """The folder in which the tutorial was followed, and what differed."""

    folder: Path
    failures: list[str]


@pytest.fixture(scope="session")
def followed(
    tmp_path_factory: pytest.TempPathFactory, pages: dict[str, list[Block]], follower: type[Follower]
) -> Followed:
    """Follow the tutorial once, whichever of pytest's processes comes first."""
    base = tmp_path_factory.getbasetemp()
    shared = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "tutorial"
    folder, told = shared / "lab", shared / "failures.json"
    shared.mkdir(exist_ok=True)
    with (shared / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not told.exists():
            folder.mkdir(exist_ok=True)
            someone = follower(folder)
            try:
                someone.follow(pages[TUTORIAL])
            except Exception:  # told by the tutorial's own test; the others fail for want of files
                someone.failures.append(traceback.format_exc())
            told.write_text(json.dumps(someone.failures))
    return Followed(folder, json.loads(told.read_text()))


@pytest.fixture(scope="session")
def blocks_of() -> Callable[[str, str], list[Block]]:
    """The blocks of a page of this name and text."""
    return _blocks_of


@pytest.fixture(scope="session")
def says() -> Callable[[str, str], bool]:
    """How what was printed is compared with what a page shows."""
    return _says
