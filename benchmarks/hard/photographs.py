"""Hard cases of whole series of photographs: one made test spoiled in every way a laboratory knows."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
import pandas as pd

import study_stability
from hard.cases import Canvas, Happened, HardCase, Part
from ploughval.report.figures.style import MEASURED, MODEL, MUTED

TABLE = Path(__file__).parents[2] / "reports" / "sequences" / "stability.csv"
TARGETS = {
    "tracks_95_px": ("tracks", 0.25),
    "worst_other_95_px": ("other photographs", 0.25),
    "blade_rms_px": ("blade", 0.2),
    "surface_rms_px": ("surface", 0.5),
    "dye_95_px": ("layers", 2.0),
    "start_intervals": ("start of bands", 1.0),
}
MUST = "all figures of the unspoiled test are reached, or the photograph is named"


@dataclass(frozen=True, slots=True)
class Drawn:
    """Figures over the figures to reach, by name."""

    shares: dict[str, float]


@lru_cache(maxsize=1)
def rows() -> pd.DataFrame:
    """Figures of every fault as study_stability.py has measured them; measured anew where there are none."""
    if TABLE.is_file():
        return pd.read_csv(TABLE).set_index("fault")
    with tempfile.TemporaryDirectory() as place:
        study_stability.main(["--out", place])
        return pd.read_csv(Path(place) / "stability.csv").set_index("fault")


def read(name: str) -> Happened:
    """One fault's figures against those to reach."""
    row = rows().loc[name]
    missed = [] if isinstance(row["missed"], float) else str(row["missed"]).split("; ")
    told = () if isinstance(row["said"], float) else tuple(str(row["said"]).split(" | "))
    what = (
        f"exit code {row['exit_code']}, tracks at the end {row['tracks_95_px']:.2g} px (95 %), "
        f"{row['tracked_pct']:.3g} % tracked, worst sound photograph {row['worst_other_95_px']:.2g} px, "
        f"{row['bands_missed']:.0f} bands missed, {row['bands_invented']:.0f} invented"
    )
    shares = {label: float(row[column]) / target for column, (label, target) in TARGETS.items()}
    return Happened(float(len(missed)), what, told, tuple(missed), Drawn(shares))


def cases() -> Sequence[HardCase]:
    """Every fault of `sequences.spoil` that the table holds."""
    done = {spoil.name: " ".join((spoil.work.__doc__ or "").split()) for spoil in study_stability.SPOILS}
    return [
        HardCase(
            name,
            done.get(name, "as named"),
            MUST,
            partial(read, name),
            0.0,
            "figures missed",
            r"frame \d+|photograph",
        )
        for name in rows().index
    ]


def draw(canvas: Canvas, case: HardCase, shown: Drawn) -> None:
    """Bars of the figures over those to reach."""
    ax = canvas.subplots()
    names = list(shown.shares)[::-1]
    values = np.array([shown.shares[name] for name in names])
    seen = np.clip(np.nan_to_num(values), 0.0, 2.0)
    ax.barh(names, seen, color=[MODEL if value > 1 else MEASURED for value in values], height=0.6)
    ax.axvline(1.0, color=MUTED, linewidth=0.8)
    for place, value in enumerate(values):
        if value > 2.0:
            ax.text(2.0, place, f"{value:.0f} x ", ha="right", va="center", color="#ffffff", fontsize=6)
    ax.set_xlim(0, 2.0)
    ax.set_xlabel("of the figure to reach")


PART = Part(
    "photographs",
    "Photographs",
    "A made test of 24 photographs, spoiled and processed whole; the figures are those of "
    "reports/sequences/stability.csv, made by study_stability.py. Bars: errors over the figures to "
    "reach, of tracks "
    "at the end, tracks in the worst photograph that was not touched, blade, surface, dyed layers, "
    "start of bands.",
    cases,
    draw,
)
