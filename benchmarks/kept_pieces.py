"""What it costs to keep the walk through the photographs on the way: bytes and seconds of a piece.

python benchmarks/kept_pieces.py FOLDER              # for example that of bench_sequence_speed.py --folder
python benchmarks/kept_pieces.py FOLDER --frames 24 --every 8
"""

import argparse
import os
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ploughval import load_scene
from ploughval.photos import calibrate, open_frames
from ploughval.run.kept.snapshots import to_arrays
from ploughval.run.kept.stages import STATE
from ploughval.run.kept.store import Key, Store
from ploughval.run.walk.looks import Series
from ploughval.run.walk.photographs import EVERY_S
from ploughval.run.walk.pieces import state_of
from ploughval.run.walk.walk import Walk


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--frames", type=int, default=24)
    parser.add_argument("--every", type=int, default=8, help="frames of a piece")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args(arguments)
    scene = load_scene(options.folder)
    frames = open_frames(scene)
    series = Series(scene, frames, calibrate(scene, frames))
    print(f"{frames.shape[1]} x {frames.shape[0]} px; seconds by the clock, in brackets of all processors")
    with tempfile.TemporaryDirectory() as scratch:
        for text in measured(series, Store(Path(scratch)), options):
            print(text, flush=True)


def measured(series: Series, kept: Store, options: argparse.Namespace) -> Iterator[str]:
    """A line for each piece: the walk, the keeping, and going on from it."""
    walk, key = Walk(series, options.workers), Key.of(what="a bench")
    for last in range(options.every, min(options.frames, len(series.frames)) + 1, options.every):
        start = _now()
        piece = next(walk.pieces(last))
        walked = _now() - start
        start = _now()
        parts = {"walk": piece.without_state().to_arrays(), STATE: to_arrays(piece.state)}
        for name, arrays in parts.items():
            kept.save(name, key, arrays)
        saved = _now() - start
        start = _now()
        Walk(series, options.workers, state_of(kept.load(STATE, key) or {}))
        resumed = _now() - start
        rows, state = (sum(array.nbytes for array in arrays.values()) for arrays in parts.values())
        yield (
            f"frames {piece.first} to {last - 1}, {piece.rows.position_px.shape[1]} points: "
            f"walk {_text(walked)}; kept {_text(saved)}, {rows / (last - piece.first) / 1e6:.2f} MB a frame "
            f"and {state / 1e6:.2f} MB of state; gone on with {_text(resumed)}; "
            f"{100 * saved[0] / EVERY_S:.2f} % of a walk that keeps a piece every {EVERY_S:g} s"
        )


def _now() -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
    times = os.times()
    return np.array([time.perf_counter(), times.user + times.system])


def _text(seconds: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> str:
    return f"{seconds[0]:.2f} s ({seconds[1]:.2f})"


if __name__ == "__main__":
    main()
