"""Environments that scripts of CI make beside the project's own, under build/."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TOOLS = ROOT / "build" / "tools"
WANTED = ("build>=1.2", "twine>=6", "uv>=0.5")


class Failed(Exception):
    """What went wrong, for the last line of a script."""


@contextmanager
def timed(what: str) -> Iterator[None]:
    """Say how long something took."""
    begun = time.monotonic()
    yield
    print(f"{what}: {time.monotonic() - begun:.0f} s", flush=True)


def run(
    *command: str | Path, cwd: Path | None = None, env: Mapping[str, str] | None = None, code: int = 0
) -> str:
    """Run a program that has to end with a code; what it said, both streams together."""
    words = " ".join(str(word) for word in command)
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    try:
        done = subprocess.run(command, cwd=cwd, env=env, **streams, text=True, check=False)
    except OSError as error:
        raise Failed(f"{words}\ncould not be run: {error}") from None
    if done.returncode != code:
        raise Failed(f"{words}\nended with {done.returncode}, not {code}:\n{done.stdout[-4000:]}")
    return done.stdout


def tool(name: str) -> Path:
    """A tool of packaging, in an environment of its own."""
    path = TOOLS / "bin" / name
    if not path.is_file():
        run(sys.executable, "-m", "venv", "--clear", TOOLS)
        run(
            TOOLS / "bin" / "python",
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            *WANTED,
        )
    return path


def fresh(place: Path, python: str | Path, *what: str) -> Path:
    """Make an environment that holds what pip is told and no more; its folder of programs."""
    shutil.rmtree(place, ignore_errors=True)
    uv = tool("uv")
    run(uv, "venv", "--quiet", "--python", python, place)
    programs = place / "bin"
    run(uv, "pip", "install", "--quiet", "--python", programs / "python", *what)
    return programs


def python_of(version: str) -> str | None:
    """The interpreter ``python3.12`` of the path, as it calls itself; None where there is none that runs."""
    name = f"python{version}"
    for more in ({}, {"PYENV_VERSION": version}):  # what pyenv puts on the path runs only when it is told
        try:
            return run(name, "-c", "import sys; print(sys.executable)", env={**os.environ, **more}).strip()
        except Failed:
            continue
    return None
