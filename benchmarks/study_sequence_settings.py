"""Seconds of a whole sequence against its errors, for the spacing of the points and the size of the subsets.

python benchmarks/study_sequence_settings.py                  # nine settings, one after the other
python benchmarks/study_sequence_settings.py --folder t       # a made test that is there, or is made there
"""

import argparse
import os
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from drawing.style import BLUE, GREY, VERMILION, save, style
from ploughval.synth import EXAMPLE, make_folder
from sequences.errors import geometry_errors
from sequences.process import process_afresh

BASE = replace(EXAMPLE, name="settings", seed=31, mm_per_px=0.125, frames=24)
SUBSET_PX, SPACING_PX = 31, 15.0
SETTINGS = (
    *((subset, (subset - 1) / 2) for subset in (21, 31, 41, 61)),
    *((SUBSET_PX, spacing) for spacing in (8.0, 10.0, 20.0, 30.0, 45.0)),
)
COLUMNS = {
    "points [1]": "points",
    "last frame, moved, median [px]": "tracks_median_px",
    "last frame, moved, 95 % [px]": "tracks_95_px",
    "standing sand that is tracked [%]": "tracked_pct",
    "layers (tracks), 95 % [px]": "layers_95_px",
    "layers (tracks), share found [%]": "layers_found_pct",
    "bands missed [1]": "bands_missed",
    "bands invented [1]": "bands_invented",
    "bands, largest error of start [frame intervals]": "start_intervals",
    "bands, largest error of outcrop [mm]": "outcrop_mm",
    "bands, largest error of beta [degree]": "beta_deg",
}
PANELS = {
    "tracks_95_px": "tracks at the end, 95 %, px",
    "tracked_pct": "standing sand that is tracked, %",
    "outcrop_mm": "largest error of an outcrop, mm",
    "beta_deg": "largest error of an inclination, degrees",
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print; write settings.csv and a figure into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/sequences"))
    parser.add_argument("--folder", type=Path)
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as scratch:
        whole: Path = options.folder if options.folder is not None else Path(scratch) / "whole"
        if not (whole / "test.toml").is_file():
            make_folder(whole, BASE)
        lines = [_measure(whole, Path(scratch) / "one", *setting) for setting in SETTINGS]
    table = pd.DataFrame(lines)
    print(table.to_string(float_format=lambda v: f"{v:.4g}"))
    options.out.mkdir(parents=True, exist_ok=True)
    table.to_csv(options.out / "settings.csv", float_format="%.4g", index=False)
    save(draw(table), options.out / "settings")


def _measure(whole: Path, folder: Path, subset_px: int, spacing_px: float) -> dict[str, float]:
    shutil.copytree(whole, folder, copy_function=os.link, ignore=shutil.ignore_patterns("results"))
    text = (folder / "test.toml").read_text(encoding="utf-8")
    (folder / "test.toml").unlink()  # shared with the whole test
    text += f"\n[piv]\nsubset_px = {subset_px}\nspacing_px = {spacing_px}\n"
    (folder / "test.toml").write_text(text, encoding="utf-8")
    run = process_afresh(folder)
    values = {row.label: row.value for row in geometry_errors(folder, run.results)}
    photographs_s = run.record["timings_s"]["photographs"]
    shutil.rmtree(folder)
    print(f"subset {subset_px}, spacing {spacing_px}: {run.seconds:.0f} s", flush=True)
    return {
        "subset_px": subset_px,
        "spacing_px": spacing_px,
        "photographs_s": photographs_s,
        "whole_s": run.seconds,
        **{short: values.get(label, float("nan")) for label, short in COLUMNS.items()},
    }


def draw(table: pd.DataFrame) -> Figure:
    """Error against seconds: one line for the spacing, one for the subset."""
    lines = (
        (table[table["subset_px"] == SUBSET_PX], "spacing_px", BLUE, "o", f"spacing, subset {SUBSET_PX} px"),
        (
            table[table["spacing_px"] == (table["subset_px"] - 1) / 2],
            "subset_px",
            VERMILION,
            "s",
            "subset, spacing half of it",
        ),
    )
    with style():
        figure = Figure(figsize=(9.2, 6.0), layout="constrained")
        for ax, (column, title) in zip(figure.subplots(2, 2).flat, PANELS.items(), strict=True):
            for rows, name, colour, marker, words in lines:
                rows = rows.sort_values(name)
                ax.plot(rows["photographs_s"], rows[column], color=colour, marker=marker, label=words)
                for x, y, value in zip(rows["photographs_s"], rows[column], rows[name], strict=True):
                    ax.annotate(
                        f"{value:g}", (x, y), (4, 4), textcoords="offset points", fontsize=7, color=GREY
                    )
            ax.set_title(title)
            ax.set_xlabel("seconds for 24 photographs, two workers")
            ax.set_xlim(left=0)
            if column != "tracked_pct":
                ax.set_ylim(bottom=0)
        figure.axes[0].legend(frameon=False)
        return figure


if __name__ == "__main__":
    main()
