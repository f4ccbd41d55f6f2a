"""What the page of several tests finds of scatter and powers of depth that were put into made tests.

Writes tables, the page's figures and a README:

python benchmarks/study_repeatability.py --work DIR --out reports/several              # some minutes
python benchmarks/study_repeatability.py --work DIR --out reports/several --sets 2000  # more sets of numbers
"""

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from ploughval.compare.several import Record, Value, mean_errors, pool
from ploughval.report import write_report
from ploughval.report.figures.several import (
    envelope_figure,
    errors_figure,
    power_figure,
    scatter_figure,
    trends_figure,
)
from ploughval.report.figures.style import saved
from ploughval.report.several import SeveralFindings, find_several
from ploughval.results import read_results
from several.made import (
    DEPTH_MM,
    DEPTHS_MM,
    MEAN,
    make_tests,
    population,
    true_values,
)
from several.page import readme

SANDS = 1000  # drawn to know the scatter that was put in
SEED = 31
SHOWN = ("first_peak_N", "force_mean_N", "first_switch_u_mm", "first_band_beta_deg", "first_outcrop_x_mm")


def repeats_table(found: SeveralFindings, drawn: dict[str, np.ndarray]) -> pd.DataFrame:
    """Scatter put in and found, metric by metric, in the group with the most tests."""
    label = max(found.repeats, key=lambda group: len(found.repeats[group][0].tests))
    rows = []
    for repeat in found.repeats[label]:
        if repeat.metric not in drawn:
            continue
        pooled, values = repeat.pooled, drawn[repeat.metric]
        put_in, mean = float(values.std(ddof=1)), float(values.mean())
        rows.append(
            {
                "metric": repeat.metric,
                "tests": pooled.count,
                "put_in_std": put_in,
                "s_r": pooled.std,
                "s_r_low": pooled.std_low,
                "s_r_high": pooled.std_high,
                "stated_std": pooled.stated_std,
                "birge": pooled.birge,
                "excess_std": pooled.excess_std,
                "excess_low": pooled.excess_low,
                "excess_high": pooled.excess_high,
                "excess_holds": pooled.excess_low <= put_in <= pooled.excess_high,
                "put_in_mean": mean,
                "pooled": pooled.pooled,
                "pooled_low": pooled.pooled_low,
                "pooled_high": pooled.pooled_high,
                "pooled_holds": pooled.pooled_low <= mean <= pooled.pooled_high,
                "verdict": pooled.verdict,
            }
        )
    return pd.DataFrame(rows)


def depth_table(found: SeveralFindings) -> pd.DataFrame:
    """Changes and powers over depth, found and as the model of the mean sand has them."""
    depths = np.array(sorted({DEPTH_MM, *DEPTHS_MM}))
    truth = [true_values(MEAN, float(depth)) for depth in depths]
    rows = []
    for trend in found.trends:
        if trend.measured is None or trend.metric not in SHOWN:
            continue
        span = float(np.log(trend.depth_mm.max() / trend.depth_mm.min()))
        line, power = trend.measured, trend.power
        true_power = np.polyfit(np.log(depths), np.log([values[trend.metric] for values in truth]), 1)[0]
        true_power = round(float(true_power), 6) + 0.0  # the model's own numerical error is larger
        rows.append(
            {
                "metric": trend.metric,
                "scale": trend.scale,
                "tests": len(trend.tests),
                "level": line.level,
                "change": line.slope * span,
                "change_low": line.slope_low * span,
                "change_high": line.slope_high * span,
                "says": trend.verdict,
                "power": np.nan if power is None else power.slope,
                "power_low": np.nan if power is None else power.slope_low,
                "power_high": np.nan if power is None else power.slope_high,
                "power_put_in": true_power,
                "power_without_effect": trend.scale_power,
            }
        )
    return pd.DataFrame(rows)


def errors_table(found: SeveralFindings) -> pd.DataFrame:
    """Mean errors of the metrics that the figure shows."""
    rows = [
        {
            "metric": error.metric,
            "scale": error.scale,
            "tests": error.pooled.count,
            "mean": error.pooled.pooled,
            "low": error.low,
            "high": error.high,
            "std": error.pooled.std,
            "model_std": error.input_std,
            "agree": error.agree,
            "judged": error.judged,
            "mean_agrees": error.mean_agrees,
        }
        for error in found.errors
        if error.mean_agrees is not None and _drawn(error.metric)
    ]
    return pd.DataFrame(rows)


def coverage_of_scatter(drawn: dict[str, np.ndarray], sets: int) -> pd.DataFrame:
    """Sets of tests drawn from the sands: how often intervals hold what was put in.

    Noise of half the sands' scatter is added and stated; "common" adds an error that all tests of a set
    share, of the sands' scatter, and states it too.
    """
    rng = np.random.default_rng(SEED)
    rows = []
    for metric in SHOWN:
        values = drawn[metric]
        put_in, mean = float(values.std(ddof=1)), float(values.mean())
        noise = put_in / 2
        for count in (3, 5, 10):
            for common in (0.0, put_in):
                hits = np.zeros(5)
                for _ in range(sets):
                    x = rng.choice(values, count) + rng.normal(0, noise, count) + rng.normal(0, common)
                    pooled = pool(list(x), [float(np.hypot(noise, common))] * count)
                    whole = np.hypot(pooled.half_width, 1.96 * pooled.stated_std)
                    hits += [
                        pooled.std_low <= np.hypot(put_in, noise) <= pooled.std_high,
                        pooled.excess_low <= put_in <= pooled.excess_high,
                        abs(pooled.pooled - mean) <= pooled.half_width,
                        abs(pooled.pooled - mean) <= whole,
                        pooled.verdict == "more",
                    ]
                names = (
                    "s_r_holds",
                    "excess_holds",
                    "pooled_holds",
                    "whole_holds",
                    "called_more",
                )
                shares = dict(zip(names, hits / sets, strict=True))
                rows.append({"metric": metric, "tests": count, "common_std": common, **shares})
    return pd.DataFrame(rows)


def coverage_of_mean_error(drawn: dict[str, np.ndarray], sets: int) -> pd.DataFrame:
    """How often the mean error's interval holds 0 where the stated sand is off by its own uncertainty.

    The tests of a set share a sand, drawn from the stated uncertainty; each scatters about it by a third.
    """
    rng = np.random.default_rng(SEED + 1)
    told = true_values(MEAN, DEPTH_MM)
    settings = {"blade": {"depth_mm": DEPTH_MM, "width_mm": 218.0}, "soil": MEAN.model_dump()}
    rows = []
    for metric in SHOWN:
        values = drawn[metric] - np.mean(drawn[metric]) + told[metric]
        input_std = float(values.std(ddof=1))
        noise, unit = input_std / 3, _unit(metric)
        for count in (2, 5, 10, 30):
            hits = np.zeros(2)
            for _ in range(sets):
                measured = rng.choice(values) + rng.normal(0, noise, count)
                records = [
                    Record(
                        str(number),
                        settings,
                        {metric: Value(unit, x, noise, told[metric], input_std, told[metric] - x, 1.0, True)},
                    )
                    for number, x in enumerate(measured)
                ]
                (error,) = mean_errors(range(count), records)
                hits += [
                    error.low <= 0 <= error.high,
                    error.pooled.pooled_low <= 0 <= error.pooled.pooled_high,
                ]
            rows.append(
                {
                    "metric": metric,
                    "tests": count,
                    "holds": hits[0] / sets,
                    "as_if_independent": hits[1] / sets,
                }
            )
    return pd.DataFrame(rows)


def _unit(metric: str) -> str:
    return {"N": "N", "mm": "mm", "deg": "degree"}[metric.rsplit("_", 1)[1]]


def _drawn(metric: str) -> bool:
    """Whether a figure of the README shows a metric: those of the first peak, switches and bands."""
    return metric in SHOWN or metric.startswith(("first_", "second_"))


def draw_figures(found: SeveralFindings, out: Path) -> None:
    """The page's figures, one file each."""
    label = max(found.repeats, key=lambda group: len(found.repeats[group][0].tests))
    repeats = [repeat for repeat in found.repeats[label] if _drawn(repeat.metric) and repeat.pooled.std > 0]
    saved(scatter_figure(repeats), out / "scatter.svg")
    saved(envelope_figure(found.histories[label]), out / "force.svg")
    trends = [trend for trend in found.trends if trend.metric in SHOWN]
    saved(trends_figure(trends), out / "depth.svg")
    saved(power_figure(next(t for t in trends if t.metric == "first_peak_N")), out / "power.svg")
    saved(
        errors_figure([e for e in found.errors if e.mean_agrees is not None and _drawn(e.metric)]),
        out / "errors.svg",
    )


def main() -> None:
    """Make tests, take them together, count, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--work", type=Path, required=True, help="where the made tests go; kept")
    parser.add_argument("--out", type=Path, default=Path("reports/several"))
    parser.add_argument("--sets", type=int, default=400, help="sets of tests drawn to count coverage")
    given = parser.parse_args()
    folders = make_tests(given.work)
    print(write_report(folders, out=given.work / "comparison.html"))
    found = find_several([read_results(folder) for folder in folders])
    drawn = population(SANDS)
    tables = {
        "repeats": repeats_table(found, drawn),
        "depth": depth_table(found),
        "errors": errors_table(found),
        "coverage": coverage_of_scatter(drawn, given.sets),
        "mean-errors": coverage_of_mean_error(drawn, given.sets),
    }
    given.out.mkdir(parents=True, exist_ok=True)
    for name, table in tables.items():
        table.to_csv(given.out / f"{name}.csv", index=False, float_format="%.6g")
        print(name, table.to_string(), sep="\n")
    draw_figures(found, given.out)
    (given.out / "README.md").write_text(readme(tables, SANDS, given.sets), encoding="utf-8")


if __name__ == "__main__":
    main()
