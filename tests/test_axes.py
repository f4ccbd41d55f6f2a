"""Units, codes and signs are what the files say they are."""

import pytest

from ploughval import axes


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("depth_mm", "mm"),
        ("force_std_N", "N"),
        ("moment_upper_Nm", "N m"),
        ("unit_weight_kN_m3", "kN/m^3"),
        ("P0_N_m", "N/m"),
        ("area_mm2", "mm^2"),
        ("beta_deg", "degree"),
        ("time_s", "s"),
        ("work_mJ", "mJ"),
        ("std_px", "px"),
        ("zncc", "1"),
        ("frame", "1"),
        ("status", "1"),
    ],
)
def test_the_longest_ending_gives_the_unit(name, unit):
    assert axes.unit_of(name) == unit


def test_status_codes_are_small_stable_and_named():
    expected = (
        "ok masked low_correlation outlier replaced edge not_converged frame_missing "
        "buried sheared avalanched out_of_picture flat lost ambiguous"
    )
    assert [status.meaning for status in axes.Status] == expected.split()
    assert [int(status) for status in axes.Status] == list(range(15))  # written to files: never renumbered


def test_signs_of_the_two_directions_are_opposed():
    assert axes.Direction("right").sign == 1
    assert axes.Direction("left").sign == -1


def test_columns_of_result_files_are_those_of_the_contract():
    assert ",".join(axes.FORCE_COLUMNS) == (
        "time_s,u_mm,force_N,force_std_N,arm_mm,arm_std_mm,force_raw_N,friction_N,status"
    )
    assert ",".join(axes.LAYER_COLUMNS) == "frame,u_mm,layer,source,x_mm,y_mm,std_mm"
    assert ",".join(axes.SURFACE_COLUMNS) == "frame,u_mm,x_mm,y_mm"
    assert ",".join(axes.BAND_COLUMNS) == (
        "band,u_start_mm,u_end_mm,beta_deg,beta_std_deg,outcrop_x_mm,outcrop_std_mm,slip_mm"
    )
    assert ",".join(axes.MODEL_FORCE_COLUMNS) == "u_mm,force_N,beta_deg,outcrop_x_mm,band"


def test_units_cannot_be_changed_by_accident():
    with pytest.raises(TypeError):
        axes.UNITS["_mm"] = "m"
