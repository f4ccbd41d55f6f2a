"""A made folder through the whole run: the table is written, whole, and true of what was put in."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from ploughval.axes import PRACTICE_COLUMNS
from ploughval.run import process_folder
from ploughval.synth import EXAMPLE, make_folder

OPTIONS = replace(
    EXAMPLE, seed=12, frames=5, displacement_mm=6.0, noise_grey=3.0, ahead_mm=60.0, below_mm=50.0
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("practice") / "test"
    make_folder(path, OPTIONS)
    settings = (path / "test.toml").read_text()
    told = '[camera]\nmake = "Made"\nlens = "=1+1, \\"none\\""\nexposure_s = 0.01'
    (path / "test.toml").write_text(settings.replace("[camera]", told, 1))
    return path


@pytest.fixture(scope="module")
def written(folder):
    outcome = process_folder(folder)
    assert outcome.complete, outcome.faults
    return outcome.results / "good_practice.csv"


@pytest.fixture(scope="module")
def rows(written):
    return pd.read_csv(written).set_index("item")


def test_columns_and_groups_are_those_of_the_contract(written, rows):
    table = pd.read_csv(written)
    assert tuple(table.columns) == PRACTICE_COLUMNS
    groups = ["camera and photographs", "pattern", "correlation", "strain", "noise floors"]
    assert list(dict.fromkeys(table["group"])) == groups
    assert table["item"].is_unique


def test_every_row_has_a_value_or_says_what_is_missing(written):
    table = pd.read_csv(written)
    without = table["value"].isna() & table["text"].isna() & table["predicted"].isna()
    assert (table.loc[without, "source"] == "not told").all()
    assert table.loc[without, "note"].notna().all()
    assert not (table.loc[~without, "source"] == "not told").any()


def test_words_of_the_user_come_back_unchanged(rows):
    assert rows.loc["Lens", "text"] == '=1+1, "none"'
    assert rows.loc["Camera", "text"] == "Made"


def test_noise_that_was_put_in_is_found_within_5_percent(rows):
    assert rows.loc["Noise of the camera", "value"] == pytest.approx(np.hypot(3.0, 12**-0.5), rel=0.05)
    assert rows.loc["Force, one sample", "value"] == pytest.approx(
        np.sqrt(2) * OPTIONS.moment_noise_Nm / 0.15, rel=0.15
    )


def test_predicted_and_measured_noise_of_displacement_agree_within_a_half(rows):
    for item in ("Displacement along the travel", "Displacement upwards"):
        ratio = rows.loc[item, "value"] / rows.loc[item, "predicted"]
        assert 0.5 < ratio < 1.5  # one photograph's texture under the points; scatter of pictures is 20 %


def test_grains_lie_between_the_least_and_greatest_that_were_drawn(rows):
    low, high = (4 * np.sqrt(np.log(2) * ((d / 4) ** 2 + 1 / 12)) for d in OPTIONS.diameter_px)
    assert low < rows.loc["Grain size", "value"] < high


def test_equipment_costs_no_new_walk_through_the_photographs(folder, written):
    before = written.read_bytes()
    settings = (folder / "test.toml").read_text()
    (folder / "test.toml").write_text(settings.replace('make = "Made"', 'make = "Other"'))
    stages = []
    process_folder(folder, progress=lambda stage, done, total: stages.append((stage, total)))
    assert ("photographs", OPTIONS.frames) not in stages
    assert written.read_bytes() == before.replace(b"Made", b"Other")
