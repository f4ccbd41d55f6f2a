"""Every column of a result table has a meaning and a unit; the catalogue knows every file of a run."""

import pytest

from ploughval import axes
from ploughval.results.catalogue import FILES, VARIABLES
from ploughval.results.meanings import MEANINGS
from ploughval.run.results import FILES as WRITTEN

UNITS = {
    "1", "", "mm", "mm^2", "s", "N", "N m", "degree", "%", "by row", "unit of the log", "N per unit",
    "mm per unit",
}  # fmt: skip


def test_the_catalogue_holds_every_table_that_a_run_or_a_fit_writes():
    tables = {name for name in WRITTEN if name.endswith(".csv")}
    assert set(FILES) == tables | {"fit_force.csv", "fit_profiles.csv", "fit_landscape.csv"}


@pytest.mark.parametrize("name", FILES)
def test_a_column_has_a_meaning_of_its_own_and_a_unit_that_is_known(name):
    for column in FILES[name].columns:
        assert column.unit in UNITS
        assert len(column.meaning.split()) > 1
        assert not column.meaning.endswith(".")


def test_no_meaning_stands_for_a_column_that_no_table_has():
    assert set(MEANINGS) <= {name for f in FILES.values() for name in f.units}


def test_keys_by_which_programs_know_tables_are_names_of_variables_and_differ():
    keys = [table.key for table in FILES.values()]
    assert all(key.isidentifier() for key in keys)
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize(
    ("table", "column", "unit"),
    [
        ("layers.csv", "layer", "mm"),  # no ending tells it
        ("budget.csv", "std", "by row"),
        ("band_pairs.csv", "u_start_mm_validation_std", "mm"),
        ("peak_pairs.csv", "force_N_agrees", "1"),
        ("softening.csv", "band", ""),  # the row of all bands together
        ("bands.csv", "band", "1"),
        ("mound.csv", "area_std_mm2", "mm^2"),
    ],
)
def test_units_follow_what_a_column_holds(table, column, unit):
    assert FILES[table].units[column] == unit


def test_units_of_tracks_follow_from_their_names():
    assert {name: v.unit for name, v in VARIABLES.items()} == {name: axes.unit_of(name) for name in VARIABLES}
