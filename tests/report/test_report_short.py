"""The few metrics that stand before the many."""

import json

from ploughval.report.verdict import short_chapter
from ploughval.results import read_results


def folder(tmp_path, metrics):
    (tmp_path / "metrics.json").write_text(json.dumps({"test": "t", "metrics": metrics}), encoding="utf-8")
    return read_results(tmp_path)


def entry(agrees):
    return {
        "unit": "N",
        "experiment": 2.0,
        "model": 3.0,
        "error": 1.0,
        "validation_std": 1.0,
        "agrees": agrees,
    }


def test_many_metrics_have_the_main_ones_before_them_in_their_own_order(tmp_path):
    many = {f"switch_{k}_N": entry(True) for k in range(25)}
    results = folder(tmp_path, many | {"force_mean_N": entry(False), "first_peak_N": entry(True)})
    chapter = short_chapter(results)
    (table,) = chapter.tables
    assert [row[0].text for row in table.rows] == ["First peak, N", "Force mean, N"]
    assert [row[5].mark for row in table.rows] == ["agrees", "differs"]


def test_a_metric_that_cannot_be_judged_is_not_among_them(tmp_path):
    many = {f"switch_{k}_N": entry(True) for k in range(25)}
    assert short_chapter(folder(tmp_path, many | {"first_peak_N": entry(None)})) is None


def test_few_metrics_need_no_shorter_table(tmp_path):
    assert short_chapter(folder(tmp_path, {"first_peak_N": entry(True)})) is None


def test_those_that_differ_most_are_of_different_subjects(tmp_path):
    far = entry(False) | {"error": 9.0}
    differ = {"switch_u_mean_mm": far, "switch_u_rms_mm": far, "layers_rms_mm": entry(False)}
    many = {f"switch_{k}_N": entry(True) for k in range(25)}
    (table,) = short_chapter(folder(tmp_path, many | differ | {"surface_rms_mm": entry(False)})).tables
    assert [row[0].text for row in table.rows] == ["Layers RMS, N", "Switch u mean, N", "Surface RMS, N"]


def test_what_the_counts_leave_out_is_said_before_the_table(tmp_path):
    many = {f"switch_{k}_N": entry(True) for k in range(25)} | {"first_peak_N": entry(True)}
    assert any("No standard uncertainty of an input" in said for said in noted(tmp_path, many))
    stated = many | {"force_mean_N": entry(True) | {"input_std": 0.1}}
    assert not any("No standard uncertainty of an input" in said for said in noted(tmp_path, stated))


def test_warnings_and_faults_of_the_run_are_counted_before_the_table(tmp_path):
    many = {f"switch_{k}_N": entry(True) for k in range(25)} | {"first_peak_N": entry(True)}
    assert not any("Quality" in said for said in noted(tmp_path, many))
    run = {"warnings": ["the scale may be wrong"], "faults": ["no bands", "no layers"]}
    (tmp_path / "run.json").write_text(json.dumps(run), encoding="utf-8")
    assert any("2 faults and 1 warning" in said for said in noted(tmp_path, many))


def noted(tmp_path, metrics):
    return short_chapter(folder(tmp_path, metrics)).notes


def test_an_error_has_the_digits_of_the_limit_it_is_held_against(tmp_path):
    small = entry(True) | {"error": -4.2e-5, "validation_std": 0.136}
    many = {f"switch_{k}_N": entry(True) for k in range(25)} | {"first_peak_N": small}
    (table,) = short_chapter(folder(tmp_path, many)).tables
    assert [cell.text for cell in table.rows[0][3:5]] == ["0.00", "0.27"]
    assert table.rows[0][3].value == -4.2e-5
