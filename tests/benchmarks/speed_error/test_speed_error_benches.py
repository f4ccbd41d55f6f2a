"""What the benches of speed against error measure: families about one default, errors against exact truth."""

import dataclasses

import numpy as np
import pytest

import bench_force
import bench_piv
import bench_sequences
from fit_study import settings as fits
from made import rigs
from model_study import settings as marches


def test_every_family_of_every_bench_holds_its_default_once():
    for families, default in (
        (bench_sequences.FAMILIES, bench_sequences.DEFAULT),
        (
            {name: tuple(members.values()) for name, members in fits.FAMILIES.items()},
            fits.DEFAULT,
        ),
    ):
        for name, members in families.items():
            assert list(members).count(default) == 1, name
    assert bench_piv.settings().count(bench_piv.Setting()) == 1
    for (name, members), default in zip(bench_force.FAMILIES.items(), bench_force.DEFAULTS, strict=True):
        assert default in members, name


def test_settings_of_a_family_differ_in_one_thing():
    for name, members in bench_sequences.FAMILIES.items():
        for member in members:
            changed = [
                field.name
                for field in dataclasses.fields(member)
                if getattr(member, field.name) != getattr(bench_sequences.DEFAULT, field.name)
            ]
            assert changed in ([], [bench_sequences.VARIED[name]])


def test_errors_of_the_model_fall_with_the_increment():
    limit = marches.by_march(marches.scene_of(), 1e-5)
    runs = [marches.by_march(marches.scene_of(), tolerance) for tolerance in (1e-2, 1e-3, 1e-4)]
    found = np.array([marches.errors(run, limit) for run in runs])
    assert np.all(
        found[1:] < 0.2 * found[:-1]
    )  # first order: a tenth, rounding and the limit's own error aside
    assert found[1].max() < 0.2  # per cent, what the default tolerance is to reach
    assert marches.errors(limit, limit) == (0.0, 0.0, 0.0)


def test_nodes_in_a_level_surface_change_nothing():
    plain = marches.by_march(marches.scene_of(), 1e-3)
    noded = marches.by_march(marches.noded(0.3), 1e-3)
    assert np.max(np.abs(noded[1] / plain[1] - 1.0)) < 1e-9  # the same polyline: rounding alone


def test_a_rig_without_errors_is_measured_exactly(tmp_path):
    found = rigs.accuracy(rigs.Case("exact", rate_hz=20.0), 1, tmp_path)
    # the log holds nine digits, and the displacement, by which friction is laid on, 0.002 mm of noise
    assert found.force_rms_percent < 1e-3
    assert found.arm_rms_mm < 1e-3


def test_more_empty_runs_lower_the_bound_by_the_scatter_of_their_mean(tmp_path):
    rows = [
        rigs.Rig(
            dataclasses.replace(bench_force.SCATTERED, noise_Nm=0.0, empty_runs=runs),
            np.random.default_rng(0),
        )
        for runs in (1, 3, 10)
    ]
    bounds = np.array([rig.bounds(rig.moving)[0] for rig in rows])
    assert bounds == pytest.approx(3.0 * 0.05 * np.sqrt(1.0 + 1.0 / np.array([1, 3, 10])))  # N


def test_a_record_of_a_seed_has_the_same_errors_whatever_its_rows():
    short, long = (fits.record(3, rows) for rows in (100, 1000))
    assert short.noise_std_N == long.noise_std_N
    difference = short.force_N - np.interp(short.u_mm, long.u_mm, long.force_N)
    away = np.abs(np.diff(short.force_N, prepend=short.force_N[0])) < 4.0 * short.noise_std_N
    # noise of both, 1.4 times that of one; an offset that differed would be twice the noise
    assert abs(np.mean(difference[away])) < 5.0 * 1.5 * short.noise_std_N / np.sqrt(away.sum())


@pytest.fixture(scope="module")
def film():
    options = dataclasses.replace(bench_sequences.SMALL, frames=4, displacement_mm=6.0)
    return bench_sequences.make_film(options)


def test_true_places_have_no_error_and_lost_ones_are_counted(film):
    setting = dataclasses.replace(bench_sequences.DEFAULT, subset_px=21, spacing_px=20.0)
    points = bench_sequences.points_of(film, setting)
    truth = film.calibration.to_px(film.truth.positions(film.calibration.to_mm(points)))
    found = np.dstack([truth, np.ones(truth.shape[:2])])
    told = bench_sequences.errors_of(film, setting, points, found)
    assert (told["median_px"], told["wrong_pct"], told["not_tracked_pct"]) == (0.0, 0.0, 0.0)
    moved = np.linalg.norm(truth[-1] - points, axis=1) > 1.0
    found[-1, np.flatnonzero(moved)[0]] = np.nan
    assert bench_sequences.errors_of(film, setting, points, found)["not_tracked_pct"] > 0.0


def test_both_plain_rules_begin_with_the_same_pair(film):
    setting = dataclasses.replace(bench_sequences.DEFAULT, subset_px=21, spacing_px=30.0)
    points = bench_sequences.points_of(film, setting)
    first = bench_sequences.always_first(film, setting, points)
    last = bench_sequences.always_last(film, setting, points)
    assert np.isfinite(first[1, :, 0]).sum() > 0.5 * len(points)
    assert first[1] == pytest.approx(last[1], abs=0.0, nan_ok=True)  # px: the same call
