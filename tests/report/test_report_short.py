"""The few metrics that stand before the many."""

import json

from ploughval.report.results import read_results
from ploughval.report.verdict import short_chapter


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
