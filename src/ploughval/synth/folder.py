"""Whole test folders with exact truth, from a seed."""

import logging
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ploughval.axes import Direction
from ploughval.errors import ConfigError, DataError, Fault
from ploughval.scene import Soil
from ploughval.synth.bed import fill_bed
from ploughval.synth.logs import LogTruth, empty_truth, feel, log_table
from ploughval.synth.motion import Floats, Motion, Trench, plan_motion
from ploughval.synth.options import SynthOptions
from ploughval.synth.settings import settings_text
from ploughval.synth.truth import Truth, band_table, layer_table, surface_table, write_truth
from ploughval.synth.view import View, expose, frame_view, light_field

log = logging.getLogger(__name__)

EXAMPLE = SynthOptions(
    seed=30,
    name="example",
    soil=Soil(unit_weight_kN_m3=15.7, peak_friction_deg=42.0, residual_friction_deg=33.0),
)
"""Recipe of data/example."""

_ENCODING = {
    "png": [cv2.IMWRITE_PNG_COMPRESSION, 6],
    "jpg": [cv2.IMWRITE_JPEG_QUALITY, 95],
    "tif": [],
}


def make_folder(out: Path | str, options: SynthOptions | None = None, *, overwrite: bool = False) -> Truth:
    """Make a whole test folder with exact truth.

    Parameters
    ----------
    out : path-like
        Folder to make: test.toml, photos/, photos.csv, loadcells.csv, empty/ and truth/.
    options : SynthOptions, optional
        What it shall contain.
    overwrite : bool
        Write into a folder that is not empty; files of the same names are replaced.

    Returns
    -------
    Truth
        The same as :func:`load_truth` reads.

    Raises
    ------
    ConfigError
        ``out`` is a file, or a folder that is not empty.
    """
    from ploughval.model import simulate  # the model is heavy; grains and truth do without

    options = SynthOptions() if options is None else options
    out = Path(out)
    _check_place(out, overwrite)
    history = simulate(options.true_scene)
    frames_u = np.linspace(0.0, options.displacement_mm, options.frames)
    trench = Trench(options.depth_mm, options.thickness_mm, options.soil.slope_of_repose_deg)
    motion = plan_motion(history.increments, history.surface, frames_u, trench)
    view = frame_view(motion, options)
    felt = feel(
        history.force["u_mm"].to_numpy(), history.force["force_N"].to_numpy(), _rng(options, 4), options
    )
    out.mkdir(parents=True, exist_ok=True)
    if options.photographs:
        _write_photographs(out, view, motion, frames_u, options)
    if options.loadcells:
        _write_logs(out, felt, options)
    tip = view.stated_tip_px(options.direction)
    (out / "test.toml").write_text(settings_text(options, tip), encoding="utf-8")
    truth = Truth(
        options=options,
        tip_px=tip,
        motion=motion,
        force=_force_table(felt),
        bands=band_table(history.bands),
        surface=surface_table(motion, frames_u),
        layers=layer_table(motion, frames_u, np.array(options.layers_mm), _layer_places(view)),
        blade=_blade_table(frames_u, tip, options),
    )
    write_truth(out / "truth", truth)
    log.info("made %s: %d frames of %d x %d px", out, options.frames, *view.shape[::-1])
    return truth


def _check_place(out: Path, overwrite: bool) -> None:
    if out.exists() and not out.is_dir():
        raise ConfigError(out, [Fault("out", "a file", "a folder to make", "Choose another place.")])
    if not overwrite and out.is_dir() and any(out.iterdir()):
        fault = Fault(
            "out", "a folder that is not empty", "a new or empty folder", "Empty it or choose another place."
        )
        raise ConfigError(out, [fault])


def _rng(options: SynthOptions, *purpose: int) -> np.random.Generator:
    """A generator of its own for each purpose: changing one option does not shift the others' numbers."""
    return np.random.default_rng([options.seed, *purpose])


def _write_photographs(
    out: Path, view: View, motion: Motion, frames_u_mm: Floats, options: SynthOptions
) -> None:
    (out / "photos").mkdir(exist_ok=True)
    bed = fill_bed(_rng(options, 1), view, motion, options)
    falls = _rng(options, 2)
    light = light_field(view.shape, vignetting=options.vignetting, gradient=options.gradient)
    names = []
    for frame, (u, steps) in enumerate(zip(frames_u_mm, motion.frame_steps, strict=True)):
        bed.advance(motion, int(steps), falls)
        picture = bed.picture(view, options.air_grey)
        cover = view.blade_cover(float(u), options.thickness_mm)
        picture += cover * (np.float32(options.blade_grey) - picture)
        picture *= light
        levels = expose(
            picture, _rng(options, 3, frame), noise_grey=options.noise_grey, bit_depth=options.bit_depth
        )
        if options.direction is Direction.LEFT:
            levels = cv2.flip(levels, 1)  # type: ignore[assignment]
        names.append(f"{frame:04d}.{options.image_format}")
        _write_picture(out / "photos" / names[-1], levels)
    times = _frame_times(frames_u_mm, options) + options.clock_offset_s
    pd.DataFrame({"file": names, "time_s": times.round(6)}).to_csv(
        out / "photos.csv", index=False, lineterminator="\n"
    )


def _write_picture(path: Path, levels: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    done, data = cv2.imencode(path.suffix, levels, _ENCODING[path.suffix[1:]])
    if not done:
        raise DataError("the picture could not be encoded", path=path)
    path.write_bytes(data.tobytes())


def _write_logs(out: Path, felt: LogTruth, options: SynthOptions) -> None:
    _write_log(out / "loadcells.csv", log_table(felt, _rng(options, 5), options))
    if options.empty_runs:
        (out / "empty").mkdir(exist_ok=True)
    for run in range(1, options.empty_runs + 1):
        table = log_table(empty_truth(felt), _rng(options, 5, run), options)
        _write_log(out / "empty" / f"run{run}.csv", table)


def _write_log(path: Path, table: pd.DataFrame) -> None:
    table.to_csv(path, index=False, lineterminator="\n")


def _frame_times(frames_u_mm: Floats, options: SynthOptions) -> Floats:
    """Times of the photographs on the log's clock, s."""
    return options.rest_s + frames_u_mm / options.speed_mm_s


def _layer_places(view: View) -> Floats:
    """Where the material lines are sampled: from the blade's face to the picture's edge, every 6 px."""
    right = (view.shape[1] - 1 - view.tip_px[0]) * view.mm_per_px
    return np.arange(0.0, right, 6 * view.mm_per_px)


def _force_table(felt: LogTruth) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "time_s": felt.time_s.round(4),
            "u_mm": felt.u_mm.round(6),
            "force_N": felt.force_N.round(6),
            "arm_mm": felt.arm_mm.round(6),
        }
    )


def _blade_table(frames_u_mm: Floats, tip_px: tuple[float, float], options: SynthOptions) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "frame": np.arange(len(frames_u_mm)),
            "time_s": _frame_times(frames_u_mm, options).round(6),
            "u_mm": frames_u_mm,
            "x_px": tip_px[0] + options.direction.sign * frames_u_mm / options.mm_per_px,
        }
    )
