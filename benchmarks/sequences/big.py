"""A made test with photographs as large as a laboratory's camera takes: 60 of 12 megapixels."""

import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import pandas as pd

from ploughval.synth import EXAMPLE, SynthOptions, Truth, load_truth, make_folder
from ploughval.synth.truth import write_truth
from ploughval.synth.view import frame_view

SHAPE = (3000, 4000)  # rows, columns
SPACING_PX = 19.5  # places about 5 000 points over the sand and along five layers at 10 px/mm
_AIR = 0.4  # share of the height beyond the test that is air; the rest is still sand
_BEHIND = 0.4  # share of the width beyond the test that lies behind the blade

BIG = replace(
    EXAMPLE,
    name="big",
    frames=60,
    mm_per_px=0.1,
    displacement_mm=48.0,
    box_length_mm=600.0,
    image_format="jpg",
)


def make_big(
    folder: Path,
    options: SynthOptions = BIG,
    *,
    spacing_px: float = SPACING_PX,
    shape: tuple[int, int] = SHAPE,
) -> Truth:
    """Make a test whose photographs are ``shape`` (rows, columns), with the points' spacing in test.toml."""
    truth = make_folder(folder, framed(options, shape))
    with (folder / "test.toml").open("a", encoding="utf-8") as settings:
        settings.write(f"\n[piv]\nspacing_px = {spacing_px}\n")
    return truth


def framed(options: SynthOptions, shape: tuple[int, int] = SHAPE) -> SynthOptions:
    """The same test with margins that make the photographs ``shape`` (rows, columns) large.

    Raises
    ------
    ValueError
        Where the test by itself is larger.
    """
    bare = replace(options, above_mm=0.0, below_mm=0.0, ahead_mm=0.0, behind_mm=0.0)
    with tempfile.TemporaryDirectory() as scratch:
        truth = make_folder(scratch, replace(bare, photographs=False, loadcells=False))
    least = frame_view(truth.motion, bare).shape
    if least[0] > shape[0] or least[1] > shape[1]:
        raise ValueError(f"the test needs {least} px, which is more than {shape}")
    missing, found = (0.0, 0.0), bare
    for _ in range(3):  # the frame is cut to whole pixels, so that the first answer may be one off
        seen = frame_view(truth.motion, found).shape
        missing = tuple(m + (n - s) * bare.mm_per_px for m, n, s in zip(missing, shape, seen, strict=True))
        found = _with_margins(bare, *missing)
    return found


def _with_margins(options: SynthOptions, high_mm: float, wide_mm: float) -> SynthOptions:
    above, behind = _AIR * high_mm, _BEHIND * wide_mm
    return replace(
        options, above_mm=above, below_mm=high_mm - above, ahead_mm=wide_mm - behind, behind_mm=behind
    )


def first_frames(folder: Path, out: Path, count: int) -> Truth:
    """A made test as if it had ended after ``count`` photographs: the same files and logs."""
    shutil.copytree(folder, out, ignore=shutil.ignore_patterns("photos", "truth", "results"))
    times = pd.read_csv(folder / "photos.csv")[:count]
    times.to_csv(out / "photos.csv", index=False, lineterminator="\n")
    (out / "photos").mkdir()
    for name in times["file"]:
        shutil.copy2(folder / "photos" / name, out / "photos" / name)
    whole = load_truth(folder)
    blade = whole.blade[:count]
    end = float(blade["u_mm"].iloc[-1])
    bands = whole.bands[whole.bands["u_start_mm"] < end].copy()
    bands["u_end_mm"] = bands["u_end_mm"].clip(upper=end)
    truth = replace(
        whole,
        options=replace(whole.options, frames=count, displacement_mm=end),
        motion=replace(whole.motion, frame_steps=whole.motion.frame_steps[:count]),
        bands=bands,
        surface=whole.surface[whole.surface["frame"] < count],
        layers=whole.layers[whole.layers["frame"] < count],
        blade=blade,
    )
    write_truth(out / "truth", truth)
    return truth
