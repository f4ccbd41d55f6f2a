"""The MAT-file holds structs as scipy's reader, and so MATLAB and Octave, give them back."""

import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat

from ploughval.export import export_results


@pytest.fixture(scope="module")
def path(folder, tmp_path_factory):
    (path,) = export_results(folder, "mat", tmp_path_factory.mktemp("mat"))
    return path


@pytest.fixture(scope="module")
def written(path):
    return loadmat(path, struct_as_record=False)


def struct(value):
    return value[0, 0]


@pytest.mark.parametrize("name", ["force", "layers", "bands", "mobilised"])
def test_a_column_comes_back_as_a_column_vector_to_the_bit(folder, written, name):
    table, found = pd.read_csv(folder / f"{name}.csv"), struct(written[name])
    assert set(found._fieldnames) == set(table)
    for column in table.select_dtypes("number"):
        values = getattr(found, column)
        assert values.shape == (len(table), 1)
        np.testing.assert_array_equal(values[:, 0], table[column].to_numpy(dtype=float))


def test_words_are_cells_and_an_empty_one_is_empty(written):
    status = struct(written["force"]).status
    assert status.shape[1] == 1
    assert status[0, 0][0] == "force_too_small_for_arm"
    reasons = struct(written["frames"]).reason
    assert [reasons[k, 0].size for k in (0, 5)] == [0, 1]
    assert struct(written["notes"]).text[-1, 0][0] == "größer als erwartet"


def test_tracks_are_matrices_of_photograph_by_point_and_missing_places_are_nan(written, tracks):
    found = struct(written["tracks"])
    for name in ("x_mm", "status", "std_mm"):
        np.testing.assert_array_equal(getattr(found, name), tracks[name].to_numpy().astype(float))
    assert found.time_s.shape == (tracks.sizes["frame"], 1)
    codes = dict(
        zip(found.status_codes[:, 0], (cell[0] for cell in found.status_meanings[:, 0]), strict=True)
    )
    assert codes[13.0] == "lost"


def test_the_model_and_units_stand_in_structs_of_the_same_names(written):
    model, units = struct(written["model"]), struct(written["units"])
    assert {"force", "bands", "layers", "surface", "horizontal_share"} == set(model._fieldnames)
    assert struct(struct(units.model).force).outcrop_x_mm[0] == "mm"
    assert struct(units.increments).velocity_y[0] == "1"


def test_a_metric_that_could_not_be_had_is_nan(written):
    metrics = struct(written["metrics"])
    names = [cell[0] for cell in metrics.metric[:, 0]]
    assert np.isnan(metrics.experiment[names.index("line_of_action_mm"), 0])
    assert metrics.agrees[names.index("first_peak_N"), 0] in (0.0, 1.0)


def test_names_are_short_enough_for_matlab(written):
    def names(value):
        for name in value._fieldnames:
            yield name
            inner = getattr(value, name)
            if inner.shape == (1, 1) and hasattr(inner[0, 0], "_fieldnames"):
                yield from names(inner[0, 0])

    found = [name for key, value in written.items() if key[0] != "_" for name in (key, *names(struct(value)))]
    assert max(map(len, found)) <= 63
    assert all(name.isidentifier() and name.isascii() and name[0] != "_" for name in found)


def test_the_same_results_give_the_same_bytes_without_a_date(folder, path, tmp_path):
    (again,) = export_results(folder, "mat", tmp_path)
    assert again.read_bytes() == path.read_bytes()
    assert path.read_bytes()[:116].rstrip() == b"MATLAB 5.0 MAT-file, ploughval 0.1.0"
