"""Whole test folders with exact truth, from a seed."""

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pandas as pd

from ploughval.axes import Direction
from ploughval.disk import unwritable
from ploughval.errors import ConfigError, DataError, Fault
from ploughval.scene import Soil
from ploughval.synth.camera import Levels, photographs
from ploughval.synth.logs import LogTruth, empty_truth, feel, log_table
from ploughval.synth.motion import Floats, Motion, Trench, plan_motion
from ploughval.synth.options import Purpose, SynthOptions
from ploughval.synth.settings import settings_text
from ploughval.synth.truth import Truth, band_table, layer_table, surface_table, write_truth
from ploughval.synth.view import View, frame_view
from ploughval.watch import Progress, unheard

if TYPE_CHECKING:
    from ploughval.model import History

log = logging.getLogger(__name__)

EXAMPLE = SynthOptions(
    seed=30,
    name="example",
    box_length_mm=370.0,
    soil=Soil(unit_weight_kN_m3=15.7, peak_friction_deg=40.0, residual_friction_deg=33.0),
)
"""Recipe of data/example."""

_ENCODING = {
    "png": [cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE],
    "jpg": [cv2.IMWRITE_JPEG_QUALITY, 95],
    "tif": [],
}


def make_folder(
    out: Path | str,
    options: SynthOptions | None = None,
    *,
    overwrite: bool = False,
    progress: Progress = unheard,
) -> Truth:
    """Make a whole test folder with exact truth.

    Parameters
    ----------
    out : path-like
        Folder to make: test.toml, photos/, photos.csv, loadcells.csv, empty/ and truth/.
    options : SynthOptions, optional
        What it shall contain.
    overwrite : bool
        Write into a folder that is not empty; what an earlier making left is replaced.
    progress : callable
        Hears of (stage, done, total) of the photographs.

    Returns
    -------
    Truth
        The same as :func:`load_truth` reads.

    Raises
    ------
    ConfigError
        ``out`` is a file, or a folder that is not empty; the blade would come to the end of the box.
    DataError
        When the disk refuses; what is there then is no test, and the next making replaces it.
    """
    from ploughval.model import simulate  # the model is heavy; grains and truth do without

    options = SynthOptions() if options is None else options
    out = Path(out)
    _check_place(out, overwrite)
    history = simulate(options.true_scene)
    frames_u = options.frames_u_mm
    trench = Trench(options.depth_mm, options.thickness_mm, options.soil.slope_of_repose_deg)
    motion = plan_motion(
        history.increments, history.surface, frames_u, trench, rounding_mm=min(0.01, options.mm_per_px / 30)
    )
    _check_travel(motion, options)
    view = frame_view(motion, options)
    felt = _felt(history, options)
    tip = view.stated_tip_px(options.direction)
    truth = Truth(
        options=options,
        tip_px=tip,
        motion=motion,
        force=_force_table(felt),
        bands=band_table(history.bands),
        surface=surface_table(motion, frames_u),
        layers=layer_table(motion, frames_u, np.array(options.layers_mm), _layer_places(view)),
        blade=_blade_table(tip, options),
    )
    # what is made half has no test.toml, and says by truth.json that it may be replaced
    with unwritable(out):
        for told in (out / "test.toml", out / "truth" / "test.toml"):
            told.unlink(missing_ok=True)
        write_truth(out / "truth", truth)
        if options.photographs:
            _write_photographs(out, view, motion, options, progress)
        if options.loadcells:
            _write_logs(out, felt, options)
        _write_settings(out / "test.toml", settings_text(options, tip, _markers_px(view, options)))
    log.info("made %s: %d frames of %d x %d px", out, options.frames, *view.shape[::-1])
    return truth


def _felt(history: "History", options: SynthOptions) -> LogTruth:
    """What the load cells feel of the model's force."""
    return feel(
        history.force["u_mm"].to_numpy(),
        options.soil.horizontal_share * history.force["force_N"].to_numpy(),
        options.rng(Purpose.LINE_OF_ACTION),
        options,
    )


def _markers_px(view: View, options: SynthOptions) -> Floats:
    """Places of the markers as the photographs show them, (K, 2) px."""
    markers = view.marker_places_px(options.markers, options.marker_radius_px)
    if options.direction is Direction.LEFT:
        markers[:, 0] = view.shape[1] - 1 - markers[:, 0]
    return markers


def _check_place(out: Path, overwrite: bool) -> None:
    if out.exists() and not out.is_dir():
        raise ConfigError(out, [Fault("out", "a file", "a folder to make", "Choose another place.")])
    whole = (out / "test.toml").exists() or (out / "truth" / "test.toml").exists()
    half = (out / "truth" / "truth.json").is_file() and not whole
    if not overwrite and not half and out.is_dir() and any(out.iterdir()):
        fault = Fault(
            "out", "a folder that is not empty", "a new or empty folder", "Empty it or choose another place."
        )
        raise ConfigError(out, [fault])
    if out.is_dir() and any(out.iterdir()) and not (out / "truth" / "truth.json").is_file():
        fault = Fault(
            "out",
            "a folder that was not made by synth",
            "a new folder, an empty one or a made one",
            "Choose another place: nothing of a real test is written over.",
        )
        raise ConfigError(out, [fault])


def _check_travel(motion: Motion, options: SynthOptions) -> None:
    reached = float(motion.u_mm[-1] + motion.du_mm[-1])
    if reached < options.displacement_mm * (1 - 1e-9):
        expected = f"at most {reached:.4g} mm, where the model ends"
        remedy = "Shorten the travel or lengthen the box (box_length_mm)."
        fault = Fault("displacement_mm", repr(options.displacement_mm), expected, remedy)
        raise ConfigError("synth options", [fault])


def _write_photographs(
    out: Path, view: View, motion: Motion, options: SynthOptions, progress: Progress
) -> None:
    _fresh(out / "photos", "[0-9]*.*")
    names: list[str] = []
    progress("making photographs", 0, options.frames)
    for frame, levels in enumerate(photographs(view, motion, options)):
        names.append(f"{frame:04d}.{options.image_format}")
        _write_picture(out / "photos" / names[-1], levels)
        progress("making photographs", len(names), options.frames)
    times = _frame_times(options) + options.clock_offset_s
    pd.DataFrame({"file": names, "time_s": times.round(6)}).to_csv(
        out / "photos.csv", index=False, lineterminator="\n"
    )


def _fresh(folder: Path, ours: str) -> None:
    """A folder without files of an earlier making, which test.toml would take for this test's."""
    folder.mkdir(exist_ok=True)
    for left in folder.glob(ours):
        left.unlink()


def _write_picture(path: Path, levels: Levels) -> None:
    done, data = cv2.imencode(path.suffix, levels, _ENCODING[path.suffix[1:]])
    if not done:
        raise DataError("the picture could not be encoded", path=path)
    path.write_bytes(data.tobytes())


def _write_settings(path: Path, text: str) -> None:
    """Last, and whole or not at all: without it a folder is no test."""
    aside = path.with_name(".test.toml")
    try:
        aside.write_text(text, encoding="utf-8")
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)


def _write_logs(out: Path, felt: LogTruth, options: SynthOptions) -> None:
    _write_log(out / "loadcells.csv", log_table(felt, options.rng(Purpose.LOG), options))
    if options.empty_runs:
        _fresh(out / "empty", "run*.csv")
    for run in range(1, options.empty_runs + 1):
        table = log_table(empty_truth(felt), options.rng(Purpose.LOG, run), options)
        _write_log(out / "empty" / f"run{run}.csv", table)


def _write_log(path: Path, table: pd.DataFrame) -> None:
    table.to_csv(path, index=False, lineterminator="\n")


def _frame_times(options: SynthOptions) -> Floats:
    """Times of the photographs on the log's clock, s."""
    return options.rest_s + options.frames_u_mm / options.speed_mm_s


def _layer_places(view: View) -> Floats:
    """Where the material lines are sampled: from the blade's face to the picture's edge, every 8 px."""
    right = (view.shape[1] - 1 - view.tip_px[0]) * view.mm_per_px
    return np.arange(0.0, right, 8 * view.mm_per_px)


def _force_table(felt: LogTruth) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "time_s": felt.time_s.round(4),
            "u_mm": felt.u_mm.round(6),
            "force_N": felt.force_N.round(5),
            "arm_mm": felt.arm_mm.round(4),
        }
    )


def _blade_table(tip_px: tuple[float, float], options: SynthOptions) -> pd.DataFrame:
    frames_u_mm = options.frames_u_mm
    return pd.DataFrame(
        {
            "frame": np.arange(len(frames_u_mm)),
            "time_s": _frame_times(options).round(6),
            "u_mm": frames_u_mm,
            "x_px": tip_px[0] + options.direction.sign * frames_u_mm / options.mm_per_px,
        }
    )
