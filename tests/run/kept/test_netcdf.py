"""NetCDF files: the same bytes whoever looks on while they are written."""

import h5py
import numpy as np
import xarray as xr

from ploughval.run.kept.netcdf import netcdf_bytes


def test_a_netcdf_file_does_not_depend_on_who_holds_its_arrays_while_it_is_written(monkeypatch):
    values = np.random.default_rng(1).normal(size=(3, 40))
    names = ("x_mm", "y_mm", "std_mm")
    tracks = xr.Dataset({name: (("frame", "point"), values + k) for k, name in enumerate(names)})
    expected = netcdf_bytes({"": tracks})
    held, write = [], h5py.Dataset.__setitem__

    def held_on(self, *place):
        held.append(self)
        return write(self, *place)

    monkeypatch.setattr(h5py.Dataset, "__setitem__", held_on)
    assert netcdf_bytes({"": tracks}) == expected
    assert len(held) >= len(names)


def test_groups_are_read_back_one_by_one_with_numbers_words_and_empty_tables(tmp_path):
    table = xr.Dataset(
        {
            "u_mm": ("row", np.array([0.0, np.nan]), {"units": "mm"}),
            "note": ("row", np.array(["", "größer"], dtype=str)),
        }
    )
    groups = {"": xr.Dataset(attrs={"title": "d30"}), "a": table, "model/a": table.isel(row=slice(0, 0))}
    path = tmp_path / "groups.nc"
    path.write_bytes(netcdf_bytes(groups))
    for name, dataset in groups.items():
        with xr.open_dataset(path, group=name or None, engine="h5netcdf") as found:
            xr.testing.assert_identical(found.load().astype(dataset.dtypes), dataset)
