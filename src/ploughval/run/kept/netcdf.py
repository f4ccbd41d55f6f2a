"""NetCDF files in memory: whole before the disk sees them."""

import io
from collections.abc import Mapping

import h5netcdf
import xarray as xr


def netcdf_bytes(groups: Mapping[str, xr.Dataset]) -> bytes:
    """A NetCDF file in memory: HDF5 itself, on a disk that fills up, ends the process.

    Without HDF5's cache of chunks, which places them in the file when an array's handle is let go: whoever
    holds one a moment longer, as a profiler does, would change the file's bytes.

    Parameters
    ----------
    groups : mapping of str to Dataset
        Each by the path of its group, "" for the file itself; numbers are compressed.

    Returns
    -------
    bytes
        The same for the same datasets.
    """
    buffer = io.BytesIO()
    with h5netcdf.File(buffer, "w", rdcc_nbytes=0) as file:
        for path, dataset in groups.items():
            encoding = {
                str(name): {"zlib": True, "complevel": 4, "shuffle": True}
                for name, data in dataset.data_vars.items()
                if data.size and data.dtype.kind in "fiu"
            }
            store = xr.backends.H5NetCDFStore(file, group=path or None, mode="a")
            dataset.dump_to_store(store, encoding=encoding)
    return buffer.getvalue()
