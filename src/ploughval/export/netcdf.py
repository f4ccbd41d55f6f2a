"""One NetCDF file with a group for each table: units and meanings on every variable, codes as flags."""

from pathlib import Path

import xarray as xr

from ploughval.export.contents import Contents
from ploughval.results import table_dataset
from ploughval.run.kept.netcdf import netcdf_bytes
from ploughval.run.kept.written import write_bytes

CONVENTIONS = "CF-1.11"


def write_netcdf(contents: Contents, out: Path) -> list[Path]:
    """Write NAME.nc; the same results give the same bytes.

    Parameters
    ----------
    contents : Contents
        What is exported.
    out : Path
        Folder.

    Raises
    ------
    DataError
        When the disk refuses.
    """
    groups = {"": xr.Dataset(attrs={"Conventions": CONVENTIONS, **contents.texts})}
    for part in contents.parts:
        dataset = table_dataset(part.table, part.told)
        if part.told.name == "model/force.csv":
            dataset.attrs["horizontal_share"] = contents.horizontal_share
        groups[part.told.name.removesuffix(".csv")] = dataset
    if contents.tracks is not None:
        groups["tracks"] = contents.tracks.drop_encoding()
    path = out / f"{contents.stem}.nc"
    write_bytes(path, netcdf_bytes(groups))
    return [path]
