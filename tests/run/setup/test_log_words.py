"""Columns of a log are recognised by words of several languages, and only where their unit allows it."""

import pytest

from ploughval.run.setup.log_words import guess_columns, words_of

ALL = {"time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm"}


@pytest.mark.parametrize(
    "names",
    [
        ("time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm"),
        ("Time (ms)", "Stroke [cm]", "M top [kNm]", "M bottom [kNm]"),
        ("Zeit s", "Weg mm", "oben N m", "unten Nm"),
        ("Temps (s)", "Déplacement (mm)", "Moment supérieur (N.m)", "Moment inférieur (N.m)"),
        ("Tiempo [s]", "Desplazamiento [mm]", "Momento superior [Nm]", "Momento inferior [Nm]"),
        ("tempo", "spostamento", "momento superiore", "momento inferiore"),
        ("Timestamp", "LVDT [mm]", "Upper cell", "Lower cell"),
        ("Sample", "Travel (mm)", "top", "bottom"),
        ("tijd", "verplaatsing", "boven", "onder"),
        ("Time [s]", "Displacement [mm]", "Upper cell [mV/V]", "Lower cell [mV/V]"),
    ],
)
def test_all_four_columns_are_recognised(names):
    found = guess_columns(names)
    assert set(found) == ALL
    assert tuple(found.values()) == names


@pytest.mark.parametrize(
    ("names", "found"),
    [
        (("time_ms", "upper", "lower"), ALL - {"displacement_mm"}),
        (("t", "u_cm", "upper_V", "lower_Nm"), ALL - {"moment_upper_Nm"}),
        (("t", "u_cm", "upper [mV/V]", "lower [mV]"), ALL - {"moment_lower_Nm"}),
        (("t", "travel (V)", "upper", "lower"), ALL - {"displacement_mm"}),
        (("time_s", "Time", "travel mm"), {"time_s", "displacement_mm"}),
        (("upper cell", "upper strain"), set()),
    ],
)
def test_what_two_columns_may_mean_or_has_another_unit_is_not_guessed(names, found):
    assert set(guess_columns(names)) == found


def test_words_have_neither_case_nor_accents():
    assert words_of("Moment_SUPÉRIEUR (N·m)") == ["moment", "superieur", "n", "m"]
