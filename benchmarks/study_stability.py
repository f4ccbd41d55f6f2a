"""One made test spoiled in every way a laboratory knows: what is said, and what the figures become.

python benchmarks/study_stability.py                              # all faults, two at a time
python benchmarks/study_stability.py --only "a hand in one picture" --folders /scratch
"""

import argparse
import os
import re
import shutil
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from ploughval.scene import load_scene
from ploughval.synth import EXAMPLE, load_truth, make_folder
from sequences.errors import Tracked, frames_of, geometry_errors
from sequences.process import Processed, process_afresh
from sequences.rows import Row, missed
from sequences.spoil import SPOILS, Spoil, photos_of
from sequences.spoil_figures import draw_sheet

BASE = replace(EXAMPLE, name="stability", seed=21, mm_per_px=0.125, frames=24)
FRAME = 12  # the photograph that is spoiled, or from which on
SEED = 22
PROCESSES = 2
_FIGURES = {
    "last frame, moved, median [px]": "tracks_median_px",
    "last frame, moved, 95 % [px]": "tracks_95_px",
    "moved points wrong by more than 1 px [%]": "wrong_pct",
    "standing sand that is tracked [%]": "tracked_pct",
    "track errors within one std [%]": "within_one_std_pct",
    "blade face, rms [px]": "blade_rms_px",
    "photographs without a blade [1]": "without_blade",
    "free surface, rms [px]": "surface_rms_px",
    "layers (dye), 95 % [px]": "dye_95_px",
    "layers (tracks), 95 % [px]": "layers_95_px",
    "bands missed [1]": "bands_missed",
    "bands invented [1]": "bands_invented",
    "bands, largest error of start [frame intervals]": "start_intervals",
    "bands, largest error of outcrop [mm]": "outcrop_mm",
    "bands, largest error of beta [degree]": "beta_deg",
}


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of one spoiled test."""

    name: str
    exit_code: int
    said: tuple[str, ...]
    rows: tuple[Row, ...]
    others_px: float  # worst photograph that was not spoiled: 95 % of the errors of moved points
    others_tracked_pct: float  # least share of standing points that is tracked in one of them
    seconds: float

    def line(self) -> dict[str, object]:
        """The verdict as a row of the table."""
        values = {row.label: row.value for row in self.rows}
        return {
            "fault": self.name,
            "exit_code": self.exit_code,
            **{short: values.get(label, np.nan) for label, short in _FIGURES.items()},
            "worst_other_95_px": self.others_px,
            "worst_other_tracked_pct": self.others_tracked_pct,
            "missed": "; ".join(missed(self.rows)),
            "said": " | ".join(self.said),
        }


def main(arguments: Sequence[str] | None = None) -> None:
    """Spoil, process, measure; write stability.csv and stability.png into --out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("reports/sequences"))
    parser.add_argument("--folders", type=Path, help="where the tests are kept")
    parser.add_argument("--only", nargs="*", default=[], help="names of faults")
    options = parser.parse_args(arguments)
    chosen = [spoil for spoil in SPOILS if not options.only or spoil.name in options.only]
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(scratch) if options.folders is None else options.folders
        if not (place / "clean" / "test.toml").is_file():
            make_folder(place / "clean", BASE)
        with ProcessPoolExecutor(PROCESSES) as pool:
            verdicts = list(pool.map(partial(judge, place=place), chosen))
        options.out.mkdir(parents=True, exist_ok=True)
        draw_sheet({s.name: folder_of(place, s) for s in chosen}, FRAME, options.out / "stability.png")
    table = pd.DataFrame([verdict.line() for verdict in verdicts])
    table.to_csv(options.out / "stability.csv", float_format="%.4g", index=False)
    print(table.drop(columns=["missed", "said"]).T.to_string(float_format=lambda v: f"{v:.4g}"))
    for verdict in verdicts:
        print(f"\n{verdict.name}: exit code {verdict.exit_code}")
        for text in (*verdict.said, *(f"missed: {m}" for m in missed(verdict.rows))):
            print(f"    {text}")


def folder_of(place: Path, spoil: Spoil) -> Path:
    """Where a spoiled test lies."""
    return place / re.sub(r"[^a-z0-9]+", "-", spoil.name.lower())


def judge(spoil: Spoil, *, place: Path) -> Verdict:
    """Spoil a copy of the clean test, process it, and measure it against the truth."""
    folder = folder_of(place, spoil)
    if folder.exists():
        shutil.rmtree(folder)
    shutil.copytree(place / "clean", folder, copy_function=os.link)
    before = {path.name: path.stat().st_ino for path in photos_of(folder)}
    spoil.work(folder, FRAME, np.random.default_rng(SEED))
    touched = {p.name for p in photos_of(folder) if before.get(p.name) != p.stat().st_ino}
    run = process_afresh(folder, workers=1)
    rows: list[Row] = []
    others, tracked = float("nan"), float("nan")
    if (run.results / "run.json").is_file():
        rows = geometry_errors(folder, run.results)
        others, tracked = elsewhere(folder, run, set() if spoil.all_frames else touched)
    print(f"{spoil.name}: exit code {run.exit_code}, {run.seconds:.0f} s", flush=True)
    said = tuple(text.replace(f"{folder}{os.sep}", "") for text in told(run))
    return Verdict(spoil.name, run.exit_code, said, tuple(rows), others, tracked, run.seconds)


def told(run: Processed) -> tuple[str, ...]:
    """The record's faults, warnings and frames that are not whole; without a record, the log."""
    record = run.record
    if not record:
        return tuple(line for line in run.log.splitlines() if line.strip())
    frames = [
        f"frame {f['frame']} ({f['file']}): {f['status']}: {f['reason']}"
        for f in record["frames"]
        if f["status"] != "ok"
    ]
    notes = [f"frame {f['frame']}: {note}" for f in record["frames"] for note in f.get("notes", ())]
    return tuple(dict.fromkeys([*record["faults"], *record["warnings"], *frames, *notes]))


def elsewhere(folder: Path, run: Processed, touched: set[str]) -> tuple[float, float]:
    """Worst 95 % of errors, px, and least share tracked, %, in one photograph that was not touched."""
    truth = load_truth(folder)
    tracked = Tracked.read(run.results, truth, load_scene(folder, files=False).camera.mm_per_px)
    error = np.linalg.norm(tracked.error_px, axis=-1)
    names = [frame["file"] for frame in run.record["frames"]]
    real = frames_of(run.results, truth, len(names))
    worst, least = 0.0, 100.0
    for frame, name in enumerate(names):
        standing = tracked.standing[frame]
        if Path(name).name in touched or real[frame] == 0:
            continue
        least = min(least, 100 * float((tracked.valid[frame] & standing).sum() / standing.sum()))
        known = tracked.valid[frame] & standing & tracked.moved[frame]
        if known.any():
            worst = max(worst, float(np.quantile(error[frame][known], 0.95)))
    return worst, least


if __name__ == "__main__":
    main()
