"""The NetCDF file holds every table and the tracks, to the bit, as xarray reads them."""

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from ploughval.axes import ForceStatus
from ploughval.export import export_results


@pytest.fixture(scope="module")
def written(folder, tmp_path_factory):
    (path,) = export_results(folder, "netcdf", tmp_path_factory.mktemp("netcdf"))
    return path


def group(path, name):
    with xr.open_dataset(path, group=name, engine="h5netcdf") as stored:
        return stored.load()


def test_the_file_is_called_as_the_test_without_signs_that_no_file_name_holds(written):
    assert written.name == "d30-β-01.nc"


@pytest.mark.parametrize("name", ["force", "layers", "bands", "model/force", "model/layers", "fit_profiles"])
def test_a_table_comes_back_to_the_bit_with_the_units_of_its_columns(folder, written, name):
    table, found = pd.read_csv(folder / f"{name}.csv"), group(written, name)
    assert set(found) == set(table)
    for column in table:
        if table[column].dtype == np.float64:
            np.testing.assert_array_equal(found[column].to_numpy(), table[column].to_numpy())
            ending = column.rsplit("_", 1)[-1]
            assert found[column].attrs.get("units", "") in {ending, "degree", "1", "mm", ""}
        assert found[column].attrs["long_name"]


def test_units_of_a_table_are_those_of_the_catalogue(written):
    found = group(written, "increments")
    assert found["beta_deg"].attrs["units"] == "degree"
    assert found["velocity_x"].attrs["units"] == "1"
    assert "units" not in group(written, "budget")["value"].attrs  # each row has its own


def test_the_status_of_a_force_is_a_code_whose_meanings_the_file_tells(folder, written):
    status = group(written, "force")["status"]
    meanings = status.attrs["flag_meanings"].split()
    assert meanings == [str(one) for one in ForceStatus]
    words = [meanings[list(status.attrs["flag_values"]).index(code)] for code in status.to_numpy()]
    assert words == pd.read_csv(folder / "force.csv")["status"].tolist()


def test_tracks_come_back_to_the_bit(written, tracks):
    found = group(written, "tracks")
    assert set(found) == set(tracks)
    for name in tracks:
        np.testing.assert_array_equal(found[name].to_numpy(), tracks[name].to_numpy())


def test_words_and_metrics_come_back(written):
    metrics = group(written, "metrics")
    row = metrics["metric"].to_numpy().tolist().index("line_of_action_mm")
    assert np.isnan(metrics["experiment"].to_numpy()[row])
    assert metrics["note"].to_numpy()[row] == "the model has no line of action"
    assert "größer als erwartet" in group(written, "notes")["text"].to_numpy()


def test_the_file_says_where_it_comes_from_and_names_no_place_of_the_machine(written, folder):
    about = group(written, None).attrs
    assert about["Conventions"].startswith("CF-")
    assert about["source"] == "ploughval 0.1.0"
    assert json.loads(about["settings"])["blade"]["depth_mm"] == 30.0
    assert json.loads(about["fit"])["parameters"]["peak_friction_deg"]["value"] == 44.5
    assert str(folder).encode() not in written.read_bytes()


def test_a_table_that_the_test_has_not_got_is_not_there(written):
    with xr.open_datatree(written, engine="h5netcdf") as tree:
        groups = set(tree.groups)
    assert {"/model/surface", "/mobilised", "/frames"} < groups
    assert not {"/softening", "/cell_quality"} & groups


def test_the_same_results_give_the_same_bytes(folder, written, tmp_path):
    (again,) = export_results(folder, "netcdf", tmp_path)
    assert again.read_bytes() == written.read_bytes()
