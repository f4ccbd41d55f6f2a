"""Several tests: scatter that was put in is found, intervals cover, rules part tests as they say."""

import numpy as np
import pytest
from scipy import stats

from ploughval.compare.several import (
    Record,
    Value,
    depth_trends,
    fit_line,
    group_tests,
    levels_together,
    mean_errors,
    pool,
    repeats_of,
)
from ploughval.compare.several.excess import excess_variance, weighted_fit
from ploughval.compare.several.groups import DEPTH

SOIL = {"unit_weight_kN_m3": 16.0, "peak_friction_deg": 50.0, "residual_friction_deg": 32.0}


def record(name="t", depth=30.0, *, soil=None, blade=None, values=None, **rest):
    settings = {
        "blade": {"depth_mm": depth, "width_mm": 218.0, "speed_mm_s": 1.0, **(blade or {})},
        "soil": {**SOIL, **(soil or {})},
    }
    return Record(name, settings, values or {}, **rest)


def measured(values):
    """A metric of each test."""
    return [record(f"t{k}", values={"first_peak_N": Value("N", v, s)}) for k, (v, s) in enumerate(values)]


def test_excess_variance_of_equal_uncertainties_has_its_closed_form():
    # Equal stated uncertainties: the excess variance is s^2 - u^2 in closed form.
    x = np.array([10.0, 12.0, 9.0, 13.0, 11.0])
    u = np.full(5, 0.7)
    extra = excess_variance(np.ones((5, 1)), x, u, 4.0)
    assert extra == pytest.approx(np.var(x, ddof=1) - 0.49, rel=1e-10)


def test_weighted_fit_is_that_of_the_normal_equations():
    rng = np.random.default_rng(4)
    design = np.column_stack([np.ones(12), rng.normal(size=12), rng.normal(size=12)])
    values, variance = rng.normal(size=12), rng.uniform(0.5, 4.0, 12)
    weights = np.diag(1 / variance)
    normal = design.T @ weights @ design
    fit = weighted_fit(design, values, variance)
    np.testing.assert_allclose(fit.covariance, np.linalg.inv(normal), rtol=1e-10)
    np.testing.assert_allclose(
        fit.coefficients, np.linalg.solve(normal, design.T @ weights @ values), rtol=1e-10
    )


def test_pooled_values_of_a_case_worked_by_hand():
    pooled = pool([1.0, 3.0], [1.0, 1.0])
    # Mean 2, s = sqrt(2), chi2 = 2 with one degree of freedom, excess variance 2 - 1.
    assert (pooled.mean, pooled.pooled) == pytest.approx((2.0, 2.0))
    assert pooled.std == pytest.approx(np.sqrt(2.0))
    assert pooled.birge == pytest.approx(np.sqrt(2.0))
    assert pooled.excess_std == pytest.approx(1.0)
    # Student's t of one degree of freedom, 12.706, times the standard error of the mean, 1.
    assert pooled.pooled_high - pooled.pooled == pytest.approx(12.7062, rel=1e-4)
    assert pooled.verdict == "explained"


def test_scatter_within_and_far_beyond_what_was_stated_is_called_so():
    x = [10.0, 10.1, 9.9, 10.05, 9.95, 10.02]
    assert pool(x, [0.08] * 6).verdict == "explained"
    assert pool(x, [0.01] * 6).verdict == "more"
    wide = pool(x, [2.0] * 6)
    assert wide.verdict == "less"
    # Nor does the pooled value come out better than six independent tests of what was stated.
    assert wide.half_width == pytest.approx(stats.t.ppf(0.975, 5) * 2.0 / np.sqrt(6))


def test_without_stated_uncertainties_plain_mean_and_student_interval():
    x = [4.0, 5.0, 7.0, 8.0]
    for stds in ([np.nan] * 4, [0.0] * 4, [0.1, 0.1, np.nan, 0.1]):
        pooled = pool(x, stds)
        low, high = stats.t.interval(0.95, 3, loc=6.0, scale=np.std(x, ddof=1) / 2)
        assert (pooled.pooled_low, pooled.pooled_high) == pytest.approx((low, high))
        assert pooled.verdict == "unknown"
        assert np.isnan(pooled.birge)


def test_equal_values_and_a_single_one_stay_finite_or_missing():
    same = pool([2.0, 2.0, 2.0], [0.0, 0.0, 0.0])
    assert (same.std, same.pooled, same.outlier) == (0.0, 2.0, -1)
    assert np.isnan(
        [same.std_high, same.pooled_low, same.pooled_high]
    ).all()  # alike by chance, or by rounding
    alone = pool([3.0], [0.1])
    assert alone.count == 1
    assert alone.pooled == 3.0
    assert np.isnan(alone.std)
    assert pool([], []).count == 0


def test_one_value_far_off_is_an_outlier_at_the_published_critical_value():
    # Grubbs, 1 %, two-sided, n = 7: 2.139 (ISO 5725-2, table 5). A value at G = 2.14 and 2.13.
    rest = np.array([-1.0, -0.6, -0.2, 0.2, 0.6, 1.0])

    def farthest(G):
        # The value x with (x - mean) / s = G, found by bisection on a monotone function.
        low, high = 1.0, 100.0
        for _ in range(200):
            x = 0.5 * (low + high)
            every = np.append(rest, x)
            low, high = (x, high) if (x - every.mean()) / every.std(ddof=1) < G else (low, x)
        return list(np.append(rest, x))

    assert pool(farthest(2.142), [np.nan] * 7).outlier == 6
    assert pool(farthest(2.136), [np.nan] * 7).outlier == -1


@pytest.mark.parametrize(("n", "excess"), [(4, 1.0), (8, 0.4), (8, 3.0)])
def test_intervals_of_scatter_excess_and_pooled_value_cover(n, excess):
    rng = np.random.default_rng(20 + n)
    draws = 1500
    hits = np.zeros(3)
    for _ in range(draws):
        u = rng.uniform(0.5, 1.0, n)
        x = 7.0 + rng.normal(0, excess, n) + rng.normal(0, u)
        pooled = pool(list(x), list(u))
        total = np.sqrt(excess**2 + np.mean(u**2))
        hits += [
            pooled.std_low <= total <= pooled.std_high,
            pooled.excess_low <= excess <= pooled.excess_high,
            pooled.pooled_low <= 7.0 <= pooled.pooled_high,
        ]
    # Three standard deviations of 1500 draws at 95 % are 1.7 %; never narrower, at most wide.
    assert np.all(hits / draws > 0.933)
    assert hits[0] / draws < 0.967
    assert hits[1] / draws < 0.967


def test_scatter_that_is_what_was_stated_is_called_more_in_two_and_a_half_percent():
    rng = np.random.default_rng(3)
    verdicts = [pool(list(rng.normal(0, 0.5, 6)), [0.5] * 6).verdict for _ in range(3000)]
    for word in ("more", "less"):
        assert verdicts.count(word) / 3000 == pytest.approx(0.025, abs=0.009)  # three standard deviations


def test_line_covers_its_slope_with_scatter_beyond_the_stated():
    rng = np.random.default_rng(8)
    x = np.repeat([20.0, 30.0, 40.0, 60.0], 2)
    u = rng.uniform(0.1, 0.3, x.size)
    hits = 0
    for _ in range(1500):
        y = 2.0 + 0.05 * x + rng.normal(0, 0.5, x.size) + rng.normal(0, u)
        line = fit_line(x, y, u)
        hits += line.slope_low <= 0.05 <= line.slope_high
    assert hits / 1500 == pytest.approx(0.95, abs=0.02)


def test_line_through_two_points_has_an_interval_only_by_what_was_stated():
    line = fit_line(np.array([20.0, 40.0]), np.array([1.0, 2.0]), np.array([0.3, 0.4]))
    assert line.slope == pytest.approx(0.05)
    assert line.slope_high - line.slope == pytest.approx(1.959964 * 0.5 / 20)
    assert np.isnan(fit_line(np.array([20.0, 40.0]), np.array([1.0, 2.0]), None).slope_low)
    assert fit_line(np.array([30.0, 30.0]), np.array([1.0, 2.0]), None) is None


def test_equal_tests_are_repeats_and_others_named_by_what_varies():
    tests = [
        record("a"),
        record("b", depth=30.2),
        record("c", depth=40.0),
        record("d", soil={"peak_friction_deg": 45}),
    ]
    grouping = group_tests(tests)
    assert sorted(group.members for group in grouping.groups) == [(0, 1), (2,), (3,)]
    assert [key.name for key in grouping.varying] == ["depth_mm", "peak_friction_deg"]
    series = grouping.along(DEPTH)
    assert [sorted(m for group in one for m in group.members) for one in series] == [[0, 1, 2]]


def test_stated_uncertainty_widens_what_counts_as_equal():
    close = [record(soil={"peak_friction_deg": v}) for v in (48.0, 50.0)]
    assert len(group_tests(close).groups) == 2
    stated = [record(soil={"peak_friction_deg": v, "peak_friction_std_deg": 1.0}) for v in (48.0, 50.0)]
    assert len(group_tests(stated).groups) == 1  # 2 sqrt(1 + 1) = 2.8 degrees


def test_grouping_does_not_depend_on_the_order_of_tests():
    rng = np.random.default_rng(1)
    depths = [20.0, 20.1, 30.0, 29.8, 40.0, 20.15]
    tests = [record(f"d{d}", depth=d) for d in depths]
    expected = {frozenset(test.name for test in tests if round(test.depth_mm, -1) == d) for d in (20, 30, 40)}
    for _ in range(10):
        order = [tests[k] for k in rng.permutation(len(tests))]
        groups = group_tests(order).groups
        assert {frozenset(order[m].name for m in group.members) for group in groups} == expected


def test_what_a_test_does_not_state_is_a_level_of_its_own():
    bare = Record("bare", {})
    grouping = group_tests([record(), bare, Record("other", {})])
    assert sorted(group.members for group in grouping.groups) == [(0,), (1, 2)]
    assert group_tests([bare]).varying == ()


def test_the_same_files_twice_are_one_test():
    tests = [record(inputs={"log.csv": digest, "a.png": "cc"}) for digest in ("aa", "aa", "bb")]
    grouping = group_tests(tests)
    assert grouping.copies == {1: 0}
    assert grouping.groups[0].members == (0, 2)
    assert group_tests([record(), record()]).copies == {}


def test_rules_of_the_model_do_not_part_repeats_but_are_named():
    tests = [record(), record()]
    tests[1].settings["model"] = {"direction": "least_softened"}
    grouping = group_tests(tests)
    assert len(grouping.groups) == 1
    assert grouping.model_rules == ("direction",)


def test_repeatability_counts_only_the_tests_that_measured_a_metric():
    tests = [
        *measured([(10.0, 0.1), (11.0, 0.1)]),
        record("none"),
        *measured([(np.nan, np.nan), (12.0, 0.2)]),
    ]
    (group,) = group_tests(tests).groups
    (repeat,) = repeats_of(group, tests)
    assert repeat.tests == (0, 1, 4)
    assert repeat.pooled.std == pytest.approx(1.0)


def test_scatter_of_levels_is_pooled_by_degrees_of_freedom():
    scatter = {20.0: (1.0, 3.0), 40.0: (5.0, 5.0, 8.0)}
    tests = [
        record(depth=d, values={"band_beta_deg": Value("degree", v, 0.1)})
        for d, every in scatter.items()
        for v in every
    ]
    (together,) = levels_together(group_tests(tests).groups, tests)
    assert together.dof == 3
    assert together.std == pytest.approx(np.sqrt((2.0 + 6.0) / 3))  # sums of squares over degrees of freedom


def test_powers_of_depth_and_flat_scaled_metrics_are_found():
    rng = np.random.default_rng(12)
    tests = []
    for d in (20.0, 20.0, 30.0, 40.0, 50.0, 60.0):
        P0 = 7.5 * 16e-6 * d**2 * 218.0 / 2  # (15 / 2) gamma d^2 B / 2
        values = {
            "first_peak_N": Value("N", P0 * rng.normal(1, 0.01), 0.01 * P0, P0, 0.0),
            "first_switch_u_mm": Value("mm", 1.29 * d * rng.normal(1, 0.01), 0.0129 * d, 1.29 * d),
            "work_mJ": Value("mJ", 1e-3 * d**3, 1e-5 * d**3, 1e-3 * d**3),
            "odd": Value("furlong", 1.0, 0.1, 1.0),
        }
        tests.append(record(depth=d, values=values))
    (series,) = group_tests(tests).along(DEPTH)
    trends = {trend.metric: trend for trend in depth_trends(series, tests)}
    assert set(trends) == {"first_peak_N", "first_switch_u_mm", "work_mJ"}
    for name, power in (("first_peak_N", 2), ("first_switch_u_mm", 1), ("work_mJ", 3)):
        trend = trends[name]
        assert trend.power.slope_low <= power <= trend.power.slope_high
        assert trend.predicted_power == pytest.approx(power, abs=1e-9)
        assert trend.scale_power == power
        assert trend.verdict == "none"
    assert trends["first_peak_N"].models == pytest.approx(np.full(6, 7.5))
    assert trends["first_peak_N"].power.slope_high - trends["first_peak_N"].power.slope_low < 0.1


def test_trend_that_the_model_shares_is_told_from_one_that_it_does_not():
    def tests(model_slope):
        return [
            record(
                depth=d, values={"band_beta_deg": Value("degree", 20 + 0.1 * d, 0.05, 20 + model_slope * d)}
            )
            for d in (20.0, 30.0, 40.0, 60.0)
        ]

    for slope, word in ((0.1, "predicted"), (0.0, "unpredicted")):
        several = tests(slope)
        (series,) = group_tests(several).along(DEPTH)
        assert depth_trends(series, several)[0].verdict == word


def test_counts_that_are_all_alike_tell_nothing_of_depth():
    tests = [record(depth=d, values={"peaks_count": Value("1", 3.0, 0.0, 3.0)}) for d in (20.0, 30.0, 40.0)]
    (series,) = group_tests(tests).along(DEPTH)
    assert depth_trends(series, tests)[0].verdict == "unknown"


def test_depth_uncertainty_enters_the_scaled_metric():
    one = record(blade={"depth_std_mm": 0.3})
    scaled = one.scaled(Value("N", 10.0, 0.0))
    assert scaled.experiment_std / scaled.experiment == pytest.approx(2 * 0.3 / 30)
    assert Record("bare", {"blade": {"depth_mm": 30.0}}).scaled(Value("N", 10.0)) is None


def test_the_depth_counts_once_in_an_error_whose_model_was_drawn_with_it():
    """Of forces 2 u(d) / d: the model's side holds it, the measured one is known to 0.01 N."""
    force = Value("N", 10.0, 0.01, 10.5, 0.2, 0.5, 0.2, False)
    tests = [record(blade={"depth_std_mm": 0.3}, values={"first_peak_N": force}) for _ in range(2)]
    (found,) = mean_errors(range(2), tests)
    assert found.pooled.stated_std == pytest.approx(0.01 / tests[0].scale("N").size)


def test_the_uncertainty_of_a_distance_is_kept_when_it_is_scaled():
    """A distance has no measured value of its own; what is unknown of its points still counts."""
    apart = Value("mm", error=0.4, experiment_std=0.3, model_std=0.1, validation_std=0.32)
    for depth_std in (0.0, 0.3):
        scaled = record(blade={"depth_std_mm": depth_std}).scaled(apart)
        assert scaled.experiment_std == pytest.approx(0.3 / 30)
        assert np.isnan(scaled.experiment)


def test_metrics_without_dimension_keep_their_value_and_unit():
    for unit in ("degree", "P0", "d", "1/d", "%"):
        scaled = record().scaled(Value(unit, 10.0, 0.5))
        assert (scaled.unit, scaled.experiment, scaled.experiment_std) == (unit, 10.0, 0.5)
    assert record().scaled(Value("1", 2.0)).unit == ""


def test_uncertainty_of_the_sand_does_not_average_out_but_scatter_does():
    def tests(n, soils):
        return [
            record(
                soil=soils[k % len(soils)],
                values={"beta_deg": Value("degree", 20, 0.3, 21, 0.8, 1.0 + 0.3 * (-1) ** k)},
            )
            for k in range(n)
        ]

    one_sand = mean_errors(range(40), tests(40, [{}]))[0]
    assert one_sand.input_std == pytest.approx(0.8)
    assert one_sand.pooled.half_width < 0.12
    assert one_sand.high - one_sand.pooled.pooled > 1.96 * 0.8
    assert one_sand.mean_agrees is None  # no test was judged
    two = mean_errors(range(40), tests(40, [{}, {"peak_friction_deg": 40.0}]))[0]
    assert two.input_std == pytest.approx(0.8 / np.sqrt(2))


def test_mean_error_agrees_where_zero_lies_within_its_interval():
    def tests(error):
        value = [
            Value("degree", 20, 0.3, 20 + error, 0.1, error + e, 0.32, abs(error) < 0.6)
            for e in (-0.3, 0.0, 0.3)
        ]
        return [record(values={"beta_deg": v}) for v in value]

    assert mean_errors(range(3), tests(0.2))[0].mean_agrees is True
    apart = Value("mm", error=0.4, experiment_std=0.3, model_std=0.1, validation_std=0.32, agrees=True)
    rms = mean_errors(range(2), [record(values={"layers_rms_mm": apart})] * 2)[0]
    assert rms.distance
    assert rms.mean_agrees is None  # never negative: its mean cannot be 0
    far = mean_errors(range(3), tests(3.0))[0]
    assert far.mean_agrees is False
    assert (far.agree, far.judged) == (0, 3)


def test_absurd_values_end_in_no_warning_and_units_do_not_matter():
    rng = np.random.default_rng(9)
    absurd = [np.nan, 0.0, -1.0, 1e-300, 1e-12, 3.0, 3.0, 1e300, -1e300]
    for _ in range(60):
        tests = [
            record(
                depth=d,
                values={f"{u}_x": Value(u, *rng.choice(absurd, 6)) for u in ("N", "mm", "1", "degree")},
            )
            for d in (20.0, 20.0, 30.0, 40.0)
        ]
        grouping = group_tests(tests)
        for group in grouping.groups:
            for repeat in repeats_of(group, tests):
                assert not np.isnan(repeat.pooled.mean)
        assert [depth_trends(series, tests) for series in grouping.along(DEPTH)]
        mean_errors(range(4), tests)
    x, u = rng.normal(5, 1, 6), rng.uniform(0.3, 0.8, 6)
    one, other = pool(list(x), list(u)), pool(list(1e200 * x), list(1e200 * u))
    assert other.excess_high == pytest.approx(1e200 * one.excess_high)
    assert other.birge == pytest.approx(one.birge)
