"""The material-point run as an experiment: metrics of both rules side by side, in one row each."""

import cv2
import pandas as pd
import pytest

from study_mpm_validation import RULES, metric_table
from virtual.validation_figures import draw_verdicts

KEYS = ("unit", "experiment", "experiment_std", "model", "input_std", "numerical_std")


def metric(experiment, model, std):
    error = model - experiment
    values = dict(zip(KEYS, ("N", experiment, 0.5, model, std, 0.0), strict=True))
    judged = {"error": error, "validation_std": std, "agrees": abs(error) <= 2 * std}
    return {**values, **judged, "dominant_input": "peak_friction_deg"}


@pytest.fixture
def table():
    first = {"first_peak_N": metric(50.0, 54.0, 3.0), "only_here_N": metric(1.0, 2.0, 0.1)}
    second = {"first_peak_N": metric(50.0, 67.0, 3.0), "only_there_N": metric(1.0, 200.0, 0.1)}
    return metric_table(dict(zip(RULES, (first, second), strict=True)))


def test_experiment_stands_once_and_the_rules_beside_each_other(table):
    assert list(table.index) == ["first_peak_N", "only_here_N", "only_there_N"]
    row = table.loc["first_peak_N"]
    assert row["experiment"] == 50.0
    assert row["least_force error"] == 4.0
    assert row["least_softened error"] == 17.0
    assert row["least_force agrees"]
    assert not row["least_softened agrees"]


def test_metric_of_one_rule_alone_is_kept(table):
    assert table.loc["only_there_N", "experiment"] == 1.0
    assert pd.isna(table.loc["only_there_N", "least_force error"])
    assert pd.isna(table.loc["only_here_N", "least_softened agrees"])


def test_figure_grows_by_a_row_for_every_judged_metric(table, tmp_path):
    heights = []
    for shown in (table, table.iloc[:1], pd.concat([table, without_verdict(table)])):
        draw_verdicts(shown, RULES, tmp_path / "verdicts.png")
        heights.append(cv2.imread(str(tmp_path / "verdicts.png")).shape[0])
    # two rows fewer, 0.2 inches each at 85 dots an inch; a metric that nobody judged adds none
    assert heights[0] - heights[1] == pytest.approx(2 * 0.2 * 85, abs=1)
    assert heights[2] == heights[0]


def without_verdict(table):
    return (
        table.iloc[:1]
        .rename(index={"first_peak_N": "not_judged_N"})
        .assign(**{f"{rule} agrees": None for rule in RULES})
    )
