"""Options that several commands of the command line share, and those of all of them."""

from pathlib import Path
from typing import Annotated

import typer


def _print_version(wanted: bool) -> None:
    """End with the version where it is asked for."""
    if wanted:
        from importlib.metadata import version

        typer.echo(f"ploughval {version('ploughval')}")
        raise typer.Exit


Folder = Annotated[Path, typer.Argument(help="Test folder with a test.toml.")]
Workers = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=256,
        help="Processors to use, for tests side by side or as threads of one; default: all that this process "
        "may use. The numbers do not depend on it.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print a machine-readable summary instead of text.")]
Debug = Annotated[bool, typer.Option("--debug", help="Print every log line and internal tracebacks.")]
Version = Annotated[
    bool,
    typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version of ploughval."),
]
