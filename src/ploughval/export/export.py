"""A result folder written for another program."""

from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from pathlib import Path

from ploughval.errors import ConfigError, Fault
from ploughval.export.contents import Contents, read_contents
from ploughval.export.mat import write_mat
from ploughval.export.netcdf import write_netcdf
from ploughval.export.tables import write_tables
from ploughval.export.vtk import write_vtk
from ploughval.run.results import results_of

FOLDER = "export"


class Format(StrEnum):
    """What can be written."""

    NETCDF = "netcdf"
    CSV = "csv"
    MAT = "mat"
    VTK = "vtk"


_WRITERS: Mapping[Format, Callable[[Contents, Path], list[Path]]] = {
    Format.NETCDF: write_netcdf,
    Format.CSV: write_tables,
    Format.MAT: write_mat,
    Format.VTK: write_vtk,
}


def export_results(folder: Path | str, to: Format | str, out: Path | str | None = None) -> list[Path]:
    """Write the results of a test for another program.

    Parameters
    ----------
    folder : path-like
        A result folder, or a test folder that holds ``results``.
    to : Format or str
        netcdf (a file with a group for each table), csv (a folder of tables), mat (MATLAB and Octave, version
        7) or vtk (a folder of series for ParaView).
    out : path-like or None
        Folder to write to; None: ``export`` in the result folder.

    Returns
    -------
    list of Path
        What was written and is to be opened; the same results give the same bytes. A table that the test has
        not got is not there.

    Raises
    ------
    ConfigError
        Another format.
    DataError
        No whole results, a file of them that cannot be read, or a place that cannot be written to.
    """
    (kind,) = formats_of([to])
    results = results_of(Path(folder))
    return _WRITERS[kind](read_contents(results), results / FOLDER if out is None else Path(out))


def formats_of(names: Sequence[Format | str]) -> list[Format]:
    """Formats by their names, each once.

    Parameters
    ----------
    names : sequence of Format or str
        As "csv".

    Returns
    -------
    list of Format

    Raises
    ------
    ConfigError
        Naming every one that is not known.
    """
    known = ", ".join(Format)
    wrong = [name for name in names if name not in set(Format)]
    if wrong:
        raise ConfigError("export", [Fault("to", repr(str(name)), f"one of {known}") for name in wrong])
    return list(dict.fromkeys(Format(name) for name in names))
