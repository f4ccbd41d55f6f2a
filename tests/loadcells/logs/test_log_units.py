"""Units in headers, rows of units and settings: converted and said, or kept and said."""

import numpy as np
import pytest

from ploughval.errors import DataError
from ploughval.loadcells import read_log
from ploughval.loadcells.logs.units import unit_factor
from ploughval.scene import CellCalibration, LogColumns

N = 120
NAMES = ("time_s", "u", "upper", "lower")
TRUE = np.column_stack(
    [0.1 * np.arange(N), 0.01 * (np.arange(N) % 7), 1 + 0.1 * (np.arange(N) % 9), np.ones(N)]
)
TRUE[:, 3] += 0.1 * (np.arange(N) % 5)


def read(tmp_path, headers, scales=(1, 1, 1), below="", **options):
    path = tmp_path / "log.csv"
    rows = TRUE / np.array([1, *scales])
    text = "\n".join(";".join(f"{v:.12g}" for v in row) for row in rows)
    path.write_text(";".join(["time_s", *headers]) + f"\n{below}" + text + "\n", encoding="utf-8")
    names = {"displacement_mm": "u", "moment_upper_Nm": "upper", "moment_lower_Nm": "lower"}
    return read_log(path, LogColumns(**names | options.pop("named", {})), **options)


def values(log):
    return log.data[["time_s", "displacement_mm", "moment_upper", "moment_lower"]]


@pytest.mark.parametrize(
    ("unit", "factor"), [("mm", 1), ("cm", 10), ("m", 1000), ("um", 1e-3), ("µm", 1e-3), ("in", 25.4)]
)
def test_displacements_become_millimetres(tmp_path, unit, factor):
    for header in (f"u [{unit}]", f"u ({unit})", f"u / {unit}"):
        log = read(tmp_path, (header, "upper", "lower"), (factor, 1, 1))
        np.testing.assert_allclose(values(log), TRUE, rtol=1e-11, atol=1e-12)
        assert log.faults == ()
        assert len(log.notes) == (factor != 1)


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("N m", 1),
        ("Nm", 1),
        ("N mm", 1e-3),
        ("N·mm", 1e-3),
        ("kNm", 1e3),
        ("kN*m", 1e3),
        ("N cm", 1e-2),
        ("mNm", 1e-3),
    ],
)
def test_moments_become_newton_metres(tmp_path, unit, factor):
    log = read(tmp_path, ("u", f"upper [{unit}]", f"lower ({unit})"), (1, factor, factor))
    np.testing.assert_allclose(values(log), TRUE, rtol=1e-11, atol=1e-12)
    assert len(log.notes) == 2 * (factor != 1)


def test_endings_of_names_are_units(tmp_path):
    named = {"displacement_mm": "u_m", "moment_upper_Nm": "upper_N_mm", "moment_lower_Nm": "lower_kNm"}
    log = read(tmp_path, ("u_m", "upper_N_mm", "lower_kNm"), (1000, 1e-3, 1e3), named=named)
    np.testing.assert_allclose(values(log), TRUE, rtol=1e-11, atol=1e-12)
    assert log.notes[0] == "displacement_mm: 'u_m' is in m, times 1000 for mm"


def test_a_row_of_units_tells_them(tmp_path):
    log = read(tmp_path, ("u", "upper", "lower"), (10, 1e-3, 1e-3), below="s;cm;N mm;N mm\n")
    np.testing.assert_allclose(values(log), TRUE, rtol=1e-11, atol=1e-12)


def test_a_row_of_units_against_the_header_is_refused(tmp_path):
    with pytest.raises(DataError, match=r"'u \[mm\]' is said to be in 'mm' and in 'cm'"):
        read(tmp_path, ("u [mm]", "upper", "lower"), below="s;cm;N m;N m\n")


def test_units_that_are_not_known_are_the_logs_own(tmp_path):
    log = read(tmp_path, ("u", "upper (mV/V)", "lower [counts]"))
    np.testing.assert_allclose(values(log), TRUE, rtol=1e-11, atol=1e-12)
    assert log.notes == (
        "moment_upper: the unit 'mV/V' of 'upper (mV/V)' is not known: read as the log's own unit",
        "moment_lower: the unit 'counts' of 'lower [counts]' is not known: read as the log's own unit",
    )


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (CellCalibration(files=("cells.csv",)), ()),
        (CellCalibration(upper_Nm_per_unit=9.6, lower_Nm_per_unit=-10.2), ()),
        (CellCalibration(upper_Nm_per_unit=9.6), ("moment_lower",)),
    ],
)
def test_a_unit_that_is_not_known_is_said_only_of_a_cell_without_calibration(tmp_path, given, said):
    log = read(tmp_path, ("u", "upper (mV/V)", "lower (mV/V)"), calibration=given)
    np.testing.assert_allclose(values(log), TRUE, rtol=1e-11, atol=1e-12)
    assert tuple(note.partition(":")[0] for note in log.notes) == said


def test_a_calibration_is_for_the_unit_as_it_is_written(tmp_path):
    given = CellCalibration(upper_Nm_per_unit=0.00102, lower_Nm_per_unit=-1.0)
    log = read(tmp_path, ("u", "upper [N mm]", "lower [N mm]"), (1, 1e-3, 1e-3), calibration=given)
    np.testing.assert_allclose(log.data["moment_upper"], 1000 * TRUE[:, 2], rtol=1e-11)
    np.testing.assert_allclose(log.data["moment_lower"], TRUE[:, 3], rtol=1e-11)
    fitted = CellCalibration(files=("calibration/*.csv",))
    log = read(tmp_path, ("u", "upper [N mm]", "lower [N mm]"), (1, 1e-3, 1e-3), calibration=fitted)
    np.testing.assert_allclose(log.data["moment_lower"], 1000 * TRUE[:, 3], rtol=1e-11)


def test_a_calibration_far_from_the_unit_is_said(tmp_path):
    given = CellCalibration(upper_Nm_per_unit=1.02)
    log = read(tmp_path, ("u", "upper [N mm]", "lower"), calibration=given)
    assert any("is in N mm (0.001 N m), but upper_Nm_per_unit is 1.02" in note for note in log.notes)


def test_milli_and_mega_are_told_apart_and_never_guessed():
    assert unit_factor("mNm", "moment") == 1e-3
    assert unit_factor("MNm", "moment") == 1e6
    assert unit_factor("MNM", "moment") is None
    assert unit_factor("NMM", "moment") == 1e-3


def test_a_name_that_fits_two_columns_is_refused_with_their_numbers(tmp_path):
    with pytest.raises(DataError, match="the name 'u' fits the columns 2, 3"):
        read(tmp_path, ("u [mm]", "u [V]", "lower"), named={"moment_upper_Nm": "lower"})
    log = read(tmp_path, ("u [mm]", "u [V]", "lower"), named={"displacement_mm": "2", "moment_upper_Nm": "3"})
    np.testing.assert_allclose(values(log), TRUE, rtol=1e-11, atol=1e-12)
