"""The README of the study on several tests, from its tables."""

from collections.abc import Mapping

import pandas as pd

from several.made import DEPTH_MM, DEPTHS_MM, MEAN, REPEATS, TESTS_A_DEPTH, TRAVEL_DEPTHS

REPEAT_COLUMNS = (
    "metric", "put_in_std", "s_r", "s_r_low", "s_r_high", "stated_std", "birge", "excess_low",
    "excess_high", "verdict",
)  # fmt: skip
DEPTH_COLUMNS = (
    "metric", "scale", "tests", "level", "change_low", "change_high", "says", "power", "power_low",
    "power_high",
    "power_put_in",
)  # fmt: skip


def readme(tables: Mapping[str, pd.DataFrame], sands: int, sets: int) -> str:
    """What the study found.

    Parameters
    ----------
    tables : mapping of str to DataFrame
        repeats, depth, errors, coverage, mean-errors.
    sands, sets : int
        Sands drawn for the scatter put in; sets of tests drawn to count coverage.
    """
    parts = (
        _opening(sands),
        _repeats(tables["repeats"]),
        _depth(tables["depth"]),
        _errors(tables["errors"]),
        _coverage(tables["coverage"], sands, sets),
        _mean_errors(tables["mean-errors"], sets),
    )
    return "\n".join(parts)


def _opening(sands: int) -> str:
    others = ", ".join(f"{depth:g}" for depth in DEPTHS_MM)
    peak = f"{MEAN.peak_friction_deg:g} ± {MEAN.peak_friction_std_deg:g}"
    residual = f"{MEAN.residual_friction_deg:g} ± {MEAN.residual_friction_std_deg:g}"
    return f"""# Several tests together: is the scatter found that was put in?

Made by `python benchmarks/study_repeatability.py --work DIR --out reports/several`; every figure stands
in a CSV file of this folder. [docs/several-tests.md](../../docs/several-tests.md) says how each is
computed.

{REPEATS} made tests at {DEPTH_MM:g} mm and {TESTS_A_DEPTH} at each of {others} mm, {TRAVEL_DEPTHS:g} d
of travel. Each has grains, noise and friction of its own, and sand of its own: peak and residual
friction are drawn from {peak} and {residual} degrees, which is what every test.toml states. The scatter
put in is that of the model's metrics over {sands} sands drawn alike.
"""


def _repeats(table: pd.DataFrame) -> str:
    held, means = int(table["excess_holds"].sum()), int(table["pooled_holds"].sum())
    return f"""## Repeats

![Values of ten equal tests about their mean, beside what they state](scatter.svg)

{_markdown(table, REPEAT_COLUMNS)}

The interval of the excess holds the scatter put in for {held} of {len(table)} metrics, that of the
pooled value the sands' mean for {means}. They are one sample of ten sands: the metrics stand or fall
together.

![Force of the ten tests, mean and standard deviation; below with switches aligned](force.svg)
"""


def _depth(table: pd.DataFrame) -> str:
    peak = table[table["metric"] == "first_peak_N"].iloc[0]
    ends = f"{peak['power_low']:.3f} to {peak['power_high']:.3f}"
    return f"""## Depth

![Scaled metrics against depth](depth.svg)

{_markdown(table, DEPTH_COLUMNS)}

The first peak grows with the power {peak["power"]:.3f} of depth ({ends}); {peak["power_put_in"]:.3f}
was put in.

![First peak against depth](power.svg)
"""


def _errors(table: pd.DataFrame) -> str:
    single = f"{int(table['agree'].sum())} of {int(table['judged'].sum())}"
    return f"""## Mean errors

![Errors of all tests and their mean](errors.svg)

The tests' sands scatter about the stated one by what is stated, so no mean error should differ from zero:
{int(table["mean_agrees"].sum())} of {len(table)} intervals hold it (`errors.csv`). Test by test {single}
metrics agree within twice the validation uncertainty.
"""


def _coverage(table: pd.DataFrame, sands: int, sets: int) -> str:
    alone, shared = table[table["common_std"] == 0], table[table["common_std"] > 0]
    few, many = (_range(alone[alone["tests"] == count]["called_more"]) for count in (3, 10))
    whole = [_range(table["whole_holds"]) for table in (alone, shared)]
    return f"""## How often the intervals hold

{sets} sets of 3, 5 and 10 tests a metric, drawn from the {sands} sands, with noise of half their
scatter, which the tests state (`coverage.csv`).

| 95 % interval of | holds | with an error common to all tests |
| --- | --- | --- |
| repeatability standard deviation | {_range(alone["s_r_holds"])} | {_range(shared["s_r_holds"])} |
| excess over what is stated | {_range(alone["excess_holds"])} | {_range(shared["excess_holds"])} |
| pooled value, from scatter alone | {_range(alone["pooled_holds"])} | {_range(shared["pooled_holds"])} |
| pooled value, stated uncertainty kept whole | {whole[0]} | {whole[1]} |

The scatter is called "more than stated" in {few} of the sets of 3 and {many} of those of 10: three
tests often cannot tell. The common error is as large as the sands' scatter and stated, too. Stated, it
hides as much of the scatter, so that the excess comes out too small; and it does not average out: only
with the stated uncertainty kept whole does the interval hold.
"""


def _mean_errors(table: pd.DataFrame, sets: int) -> str:
    few, many = (_range(table[table["tests"] == count]["as_if_independent"]) for count in (2, 30))
    return f"""## The sand is a common error

Where the stated sand is off by its own uncertainty, in all tests alike (`mean-errors.csv`), the mean
error's interval holds zero in {_range(table["holds"])} of {sets} sets of 2 to 30 tests. From the
scatter between tests alone it would in {few} of the sets of 2 (Student's t is 12.7) and {many}
of those of 30: thirty tests of a sand do not make its friction angles better known than they were.
"""


def _markdown(table: pd.DataFrame, columns: tuple[str, ...]) -> str:
    """Columns of a table, numbers to four digits."""
    chosen = table[list(columns)].to_numpy().tolist()
    rows = [[f"{value:.4g}" if isinstance(value, float) else str(value) for value in row] for row in chosen]
    lines = [list(columns), ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _range(shares: pd.Series) -> str:
    low, high = (f"{100 * float(share):.0f}" for share in (shares.min(), shares.max()))
    return f"{low} %" if low == high else f"{low} to {high} %"
