"""The page of whole sequences, written from the tables beside it.

python benchmarks/study_sequences_page.py --out reports/sequences
"""

import argparse
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

Tables = dict[str, pd.DataFrame]

HEAD = """\
# Whole sequences: what comes out of the photographs, how exactly, and how fast

Every number on this page stands in a table of this folder, and every table is made again by one command:

| command | makes |
| --- | --- |
| `python benchmarks/study_sequences.py` | `cases.csv`, `statuses.csv`, figure: made tests by case |
| `python benchmarks/bench_sequence_speed.py` | `speed.csv`: 60 photographs of 12 megapixels |
| `python benchmarks/study_sequence_settings.py` | `settings.csv` and its figure: seconds against error |
| `python benchmarks/study_virtual.py --virtual DIR` | `virtual*.csv`, figures: a material-point run |
| `python benchmarks/study_stability.py` | `stability.csv`, `stability.png`: spoiled photographs |
| `python benchmarks/study_real_sequences.py --shared DIR` | `real.csv` and pictures: real series |
| `python benchmarks/study_sequences_page.py` | this page |

Errors are distances from the exact truth of the same sand, in pixels of the photographs. Sand that has
avalanched or was swept up has no truth any more and counts only where it is still called valid. "Missed"
is said of a figure that lies outside the bounds that the project has set itself; bounds are printed
beside the values.
"""

CASES = """
## Made tests

![every case against the figures to reach](cases.png)

The base: blade 30 mm deep, travel 55 mm in {frames} photographs of 8 px/mm, noise of 2 grey levels, sand
of 40/33 degrees, five dyed layers. Each other case changes what its name says; the last ones change
several things at once. Cases run two at a time, and the machine may do other work beside them: their seconds
tell nothing, those of `speed.csv` below do.

{table}

{missed}
"""

STATUSES = """
## What becomes of a point, and what its status says

Points in photographs after the first, all cases together. "Crossed by a band": sand a quarter of a subset
away, on either side, has left the point by more than a pixel.

{table}
"""

SPEED = """
## A test of 60 photographs of 12 megapixels

JPEG of quality 95, 10 px/mm, 480 px travelled, two workers; decoding and the start of the interpreter
included.

{table}

{missed}
"""

SETTINGS = """
## Spacing of the points and size of the subsets

![seconds against error](settings.png)

24 photographs of 8 px/mm, two workers. Without `spacing_px`, points stand half a subset apart.

{table}

**What to choose.** The spacing decides the seconds, and how finely layers and bands are drawn; the error
of a point does not depend on it. Half a subset is the default; twice that for a first look. A larger
subset is more exact as long as sand moves in rigid blocks, as it does in these tests, and no slower at
half its side; real sand also deforms within a block, which these tests do not show: leave 31 px where
grains are 3 to 6 px wide, and go to 41 or 61 px where the texture is poor. A smaller one is noisier and
costs more points.
"""

VIRTUAL = """
## Sand whose motion no block model made

A material-point run of the same kind of test, photographed: every particle carries a cluster of grains
that deforms with the sand around it. Three photographs for each frame that the run kept, particles on
straight ways between them, so that the switch of bands, which the run makes within 2.5 mm of travel, is
spread over three increments.

![found and true bands](virtual-bands.png)

![findings over photographs](virtual-overlays.png)

{table}

The run's bands are read from its particles in columns of 2 mm at 0.8 depths above the tip: the line from
the tip to there is what inclinations are compared with (`virtual-increments.csv`). Coherent sand has
principal stretches between 0.85 and 1.2 since the start; churned sand has gone through a band or down the
slope.
"""

STABILITY = """
## Spoiled photographs

![how they look](stability.png)

One made test of 24 photographs (8 px/mm), spoiled at photograph 12, from there on, or in all. "Elsewhere"
is the worst photograph that was not touched: the larger 95 % of the errors of moved points, and the least
share of standing sand that is tracked.

{table}

{said}
"""

REAL = """
## Real series

![wall, surface and dark layer](wall-push.png)

![ways of points in an avalanche](avalanche.png)

Photographs of the wall push: Sun Chuang (Nanjing University, 2017), published by geovbox; of the avalanche:
William Thielicke, published with PIVlab; both under the MIT licence.

The wall push and the avalanche may be shown here; the wedge and the T-bar are measured only. Orange: ways
of points that are still followed in the last picture; crosses: where points began that are not.

{table}
"""


def main(arguments: Sequence[str] | None = None) -> None:
    """Write README.md into --out from the tables that are there."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/sequences"))
    folder = parser.parse_args(arguments).out
    tables = {path.stem: pd.read_csv(path) for path in sorted(folder.glob("*.csv"))}
    (folder / "README.md").write_text(page(tables), encoding="utf-8")


def page(tables: Tables) -> str:
    """The whole page; a section whose table is missing is left out."""
    sections: dict[str, Callable[[Tables], str]] = {
        "cases": cases,
        "statuses": lambda t: STATUSES.format(table=markdown(t["statuses"])),
        "speed": speed,
        "settings": lambda t: SETTINGS.format(table=markdown(t["settings"])),
        "virtual": lambda t: VIRTUAL.format(table=markdown(t["virtual"])),
        "stability": stability,
        "real": lambda t: REAL.format(table=markdown(t["real"])),
    }
    return HEAD + "".join(write(tables) for name, write in sections.items() if name in tables)


def cases(tables: Tables) -> str:
    """Section of the made tests: each figure in the base, its worst case, the cases that miss it."""
    table = tables["cases"].set_index("case")
    bounds = table.loc["to reach"]
    values = table.drop(index="to reach").apply(pd.to_numeric)
    rows, misses = [], []
    for label in values:
        bound = bounds[label] if isinstance(bounds[label], str) else ""
        column = values[label]
        asked = column.index[[not _not_asked(label, name) for name in column.index]]
        failing = [name for name in asked if outside(column[name], bound)]
        worst = column.abs().idxmax() if column.notna().any() else ""
        rows.append(
            {
                "figure": label,
                "to reach": bound,
                "base": column.get("base", np.nan),
                "least": column.min(),
                "greatest": column.max(),
                "greatest in": worst,
                "missed in": len(failing) if bound else "",
            }
        )
        misses += [f"- {name}: {label} is {column[name]:.3g} ({bound})" for name in failing]
    missed = f"Missed ({len(misses)} of {values[bounds.dropna().index].size} bounded figures):\n\n"
    told = missed + "\n".join(misses) if misses else "No bounded figure is missed in any case."
    return CASES.format(frames=40, table=markdown(pd.DataFrame(rows)), missed=told)


def _not_asked(label: str, case: str) -> bool:
    """Whether a case has nothing to show of a figure: no dyed layers where none are dyed."""
    return label.startswith("layers (dye)") and "not dyed" in case


def speed(tables: Tables) -> str:
    """Section of the large photographs."""
    table = tables["speed"]
    value = table.columns[-1]
    misses = [
        f"- {row['quantity']} is {row[value]:.3g} ({row['to reach']})"
        for _, row in table.iterrows()
        if isinstance(row["to reach"], str) and outside(row[value], row["to reach"])
    ]
    told = "Missed:\n\n" + "\n".join(misses) if misses else "No bounded figure is missed."
    return SPEED.format(table=markdown(table), missed=told)


def stability(tables: Tables) -> str:
    """Section of the spoiled photographs: figures, then what was said of each."""
    table = tables["stability"]
    shown = {
        "fault": "fault",
        "exit_code": "exit code",
        "tracks_95_px": "tracks 95 %, px",
        "wrong_pct": "wrong by > 1 px, %",
        "tracked_pct": "tracked, %",
        "surface_rms_px": "surface rms, px",
        "blade_rms_px": "blade rms, px",
        "bands_missed": "bands missed",
        "bands_invented": "invented",
        "outcrop_mm": "outcrop, mm",
        "beta_deg": "beta, degrees",
        "worst_other_95_px": "elsewhere 95 %, px",
        "worst_other_tracked_pct": "elsewhere tracked, %",
    }
    said = [
        f"- *{row['fault']}*: {_shortened(row['said'])}"
        for _, row in table.iterrows()
        if isinstance(row["said"], str)
    ]
    told = "What the command said:\n\n" + "\n".join(said) if said else ""
    return STABILITY.format(
        table=markdown(table[[name for name in shown if name in table]].rename(columns=shown)), said=told
    )


def _shortened(said: str, most: int = 3) -> str:
    parts = said.split(" | ")
    rest = f"; and {len(parts) - most} more" if len(parts) > most else ""
    return "; ".join(parts[:most]) + rest


def outside(value: float, bound: str) -> bool:
    """Whether a value lies outside bounds in words ("at most 0.5", "65 to 71"); NaN lies outside any."""
    if not bound:
        return False
    numbers = [float(n) for n in re.findall(r"-?\d+(?:\.\d+)?", bound)]
    if bound.startswith("at most"):
        return not value <= numbers[0]
    if bound.startswith("at least"):
        return not value >= numbers[0]
    return not numbers[0] <= value <= numbers[1]


def markdown(table: pd.DataFrame) -> str:
    """A table with numbers to three figures; empty where there is nothing."""
    rows = [list(table.columns), ["---"] * len(table.columns)]
    rows += [[_cell(value) for value in row] for row in table.itertuples(index=False)]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _cell(value: object) -> str:
    if isinstance(value, str):
        return value.replace("|", "/")
    number = float(value)  # type: ignore[arg-type]
    if np.isnan(number):
        return ""
    return f"{number:.0f}" if abs(number) >= 1000 or number == round(number) else f"{number:.3g}"


if __name__ == "__main__":
    main()
