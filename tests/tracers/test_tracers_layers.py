"""Material lines carried by tracks, against exact block kinematics."""

import numpy as np
import pytest

from ploughval.axes import LAYER_COLUMNS, Status
from ploughval.tracers import layers_from_tracks

U = np.arange(0, 7.0)


def tracks(kinematics, **options):
    block_of, tracks_of, _ = kinematics
    return tracks_of(block_of(lambda _: 80.0), U, layers=(10.0, 20.0), **options)


def test_positions_are_those_of_the_points_in_order_along_the_layer(kinematics):
    data = tracks(kinematics)
    table = layers_from_tracks(data)
    assert list(table.columns) == list(LAYER_COLUMNS)
    assert set(table["source"]) == {"tracks"}
    line = table[(table["frame"] == 5) & (table["layer"] == 10.0)].dropna(subset=["x_mm"])
    member = (data["layer_mm"] == 10.0) & (data["status"][5] == Status.OK)
    expected = np.column_stack([data["x_mm"][5], data["y_mm"][5]])[member.to_numpy()]
    assert np.array_equal(line[["x_mm", "y_mm"]].to_numpy(), expected)
    assert set(line["u_mm"]) == {5.0}


def test_a_layer_is_torn_where_the_band_cuts_it_and_nowhere_else(kinematics):
    """Whether two neighbours moved together is known exactly: steps of rigid motion are all or nothing."""
    table = layers_from_tracks(tracks(kinematics))
    assert not table[table["frame"] == 0]["x_mm"].isna().any()
    for height in (10.0, 20.0):
        line = table[(table["frame"] == 6) & (table["layer"] == height)]
        gaps = line["x_mm"].isna().to_numpy()
        assert gaps.any()
        before = line["y_mm"].to_numpy()[np.flatnonzero(gaps)[0] - 1]
        after = line["y_mm"].to_numpy()[np.flatnonzero(gaps)[-1] + 1]
        assert before > height + 1.0  # ahead of the first tear: risen with the block
        assert after < height + 0.5 or after == height  # beyond the last one: at rest
        still = line["y_mm"].to_numpy() == height
        assert not gaps[np.flatnonzero(still)[0] + 1 :].any()


def test_lost_points_are_absent(kinematics):
    data = tracks(kinematics)
    lost = np.flatnonzero(data["layer_mm"].to_numpy() == 10.0)[::3]
    data["status"][4, lost] = Status.LOW_CORRELATION
    table = layers_from_tracks(data)
    line = table[(table["frame"] == 4) & (table["layer"] == 10.0)].dropna(subset=["x_mm"])
    kept = (data["status"][4] == Status.OK) & (data["layer_mm"] == 10.0)
    assert len(line) == int(kept.sum())


def test_noise_tears_nothing(kinematics):
    block_of, tracks_of, _ = kinematics
    table = layers_from_tracks(tracks_of(block_of(lambda _: 80.0), np.zeros(3), layers=(10.0,), noise=0.03))
    assert not table["x_mm"].isna().any()


@pytest.mark.parametrize(("noise", "torn"), [(0.002, True), (0.05, False)])
def test_a_small_tear_is_told_from_noise(kinematics, noise, torn):
    """0.11 mm of travel shift the block by 0.12 mm, a quarter of the points' spacing of 0.5 mm."""
    block_of, tracks_of, _ = kinematics
    data = tracks_of(block_of(lambda _: 80.0), np.array([0.0, 0.11]), layers=(10.0, 20.0), noise=noise)
    table = layers_from_tracks(data)
    for height in (10.0, 20.0):
        line = table[(table["frame"] == 1) & (table["layer"] == height)]
        gaps = np.flatnonzero(line["x_mm"].isna())
        assert len(gaps) == int(torn)
        if torn:
            cut = 0.11 + height * 80.0 / 30.0  # where the band stands, to a spacing
            assert line["x_mm"].to_numpy()[gaps[0] - 1] == pytest.approx(cut, abs=1.0)


def test_even_strain_tears_nothing_also_over_lost_points(kinematics):
    """Stretched by 4 %: points ten spacings apart move apart by 0.2 mm, and are not torn."""
    block_of, tracks_of, _ = kinematics
    data = tracks_of(block_of(lambda _: 80.0), np.zeros(2), layers=(10.0,), noise=0.001)
    data["x_mm"][1] = data["x_mm"][1] * 1.04
    member = np.flatnonzero(data["layer_mm"].to_numpy() == 10.0)
    data["status"][1, member[50:60]] = Status.LOW_CORRELATION
    table = layers_from_tracks(data)
    assert not table["x_mm"].isna().any()


def test_tracks_without_layers_give_an_empty_table(kinematics):
    block_of, tracks_of, _ = kinematics
    table = layers_from_tracks(tracks_of(block_of(lambda _: 80.0), U))
    assert list(table.columns) == list(LAYER_COLUMNS)
    assert len(table) == 0
