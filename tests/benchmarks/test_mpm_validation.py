"""The material-point run as an experiment: metrics of both rules side by side, in one row each."""

import numpy as np
import pandas as pd
import pytest

from mpm_validation_figures import draw_verdicts
from study_mpm_validation import RULES, metric_table

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


def test_figure_has_a_row_for_every_judged_metric(table, tmp_path):
    table.loc["not_judged_mm"] = {name: np.nan for name in table.columns}
    draw_verdicts(table, RULES, tmp_path / "verdicts.png")
    assert (tmp_path / "verdicts.png").stat().st_size > 5000
