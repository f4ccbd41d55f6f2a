"""Result files: the same bytes whoever looks on while they are written."""

import h5py
import numpy as np
import xarray as xr

from ploughval.run.results import netcdf_bytes


def test_a_netcdf_file_does_not_depend_on_who_holds_its_arrays_while_it_is_written(monkeypatch):
    values = np.random.default_rng(1).normal(size=(3, 40))
    names = ("x_mm", "y_mm", "std_mm")
    tracks = xr.Dataset({name: (("frame", "point"), values + k) for k, name in enumerate(names)})
    encoding = {name: {"zlib": True, "complevel": 4, "shuffle": True} for name in names}
    expected = netcdf_bytes(tracks, encoding)
    held, write = [], h5py.Dataset.__setitem__

    def held_on(self, *place):
        held.append(self)
        return write(self, *place)

    monkeypatch.setattr(h5py.Dataset, "__setitem__", held_on)
    assert netcdf_bytes(tracks, encoding) == expected
    assert len(held) >= len(names)
