"""The command that writes results for other programs."""

from pathlib import Path
from typing import Annotated

import typer

from ploughval.cli_options import Json
from ploughval.talk import command, shown_progress
from ploughval.watch import one_step


def export(
    folder: Annotated[Path, typer.Argument(help="A processed test folder, or its result folder.")],
    to: Annotated[
        list[str], typer.Option(metavar="netcdf|csv|mat|vtk", help="What to write; repeat it for several.")
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder to write to; default: export in the results.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write the results for other programs. NetCDF, CSV, MATLAB and Octave (mat), ParaView (vtk).

    Every table with its units; a table that the test has not got is not there.
    """
    with command(as_json) as talk:
        from ploughval.export import export_results, formats_of

        with shown_progress(talk) as progress:
            for kind in formats_of(to):
                with one_step(progress, f"export {kind}"):
                    files = export_results(folder, kind, out)
                talk.summary[kind.value] = [str(file) for file in files]
                talk.say("\n".join(f"wrote {file}" for file in files))
