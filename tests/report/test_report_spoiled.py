"""A spoiled file of a result folder is refused by name, whatever its parser raises."""

import numpy as np
import pytest

from ploughval.errors import DataError, PloughvalError
from ploughval.results import read_results


def test_an_error_within_hdf5_is_a_refusal_that_names_the_tracks(own_folder, monkeypatch):
    """Found by spoiling sound files: h5py raises RuntimeError at a wrong checksum of metadata."""

    def fail(*_, **options):
        raise RuntimeError("Link iteration failed (incorrect metadata checksum)")

    monkeypatch.setattr("ploughval.results.reading.xr.open_dataset", fail)
    with pytest.raises(DataError, match=r"tracks\.nc: not readable as netCDF: Link iteration failed"):
        read_results(own_folder)


@pytest.mark.parametrize("seed", range(2))
def test_tracks_with_flipped_bytes_are_read_or_refused(own_folder, seed):
    path, rng = own_folder / "tracks.nc", np.random.default_rng(seed)
    data = bytearray(path.read_bytes())
    for place in rng.integers(0, len(data), 20):
        data[place] ^= 0xFF
    path.write_bytes(bytes(data))
    try:
        found = str(read_results(own_folder).tracks)
    except PloughvalError as error:
        found = str(error)
    assert "tracks.nc" in found or "x_mm" in found


def test_a_table_with_a_number_of_hundreds_of_digits_is_read_as_infinite(own_folder):
    path = own_folder / "surface.csv"
    head, row, *rest = path.read_text().splitlines()
    frame, u, _, *others = row.split(",")
    path.write_text("\n".join([head, ",".join([frame, u, "2" * 400, *others]), *rest]))
    assert np.isinf(read_results(own_folder).surface["x_mm"].iloc[0])
