"""A synthetic test as camera and logger leave it: EXIF times, a logger's tables, notes; no test.toml."""

import shutil
import struct
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
from PIL import Image

from ploughval.disk import unwritable
from ploughval.errors import ConfigError, Fault
from ploughval.synth.folder import EXAMPLE, make_folder
from ploughval.synth.logs import bending_moments
from ploughval.synth.motion import Floats
from ploughval.synth.options import Purpose, SynthOptions
from ploughval.synth.settings import notes_text
from ploughval.synth.truth import Truth
from ploughval.synth.view import View
from ploughval.watch import Progress, unheard

RECORDED = replace(
    EXAMPLE,
    name="recorded",
    frames=19,
    displacement_mm=54.0,
    image_format="jpg",
    markers=8,
    marker_radius_px=6.0,
    above_mm=15.0,
    below_mm=15.0,
    clock_offset_s=113.4,
    clock_told=False,
)
"""Recipe of the tutorial's test: a photograph every 3 s, dots on the window, a camera with its own clock."""

_CARD = "DCIM/100BLADE"
_FIRST_NUMBER = 412
_CAMERA_ZERO = datetime(2026, 3, 12, 9, 40)  # what the camera's clock showed at its time 0
_READING_PER_NM = (0.1037, 0.0982)  # mV/V, of the upper and of the lower cell
_LOADS_N = (0.0, 10.0, 20.0, 40.0, 20.0, 10.0, 0.0)
_ARMS_MM = (0.0, 150.0)
_LOG_HEADER = "Time [s];Displacement [mm];Upper cell [mV/V];Lower cell [mV/V]"


def make_recorded(
    out: Path | str,
    options: SynthOptions = RECORDED,
    *,
    overwrite: bool = False,
    progress: Progress = unheard,
) -> Truth:
    """Make a test folder to which nobody has written a test.toml yet.

    Parameters
    ----------
    out : path-like
        Folder to make: DCIM/ with JPEG named and stamped by a camera, logger/ and empty/ with tables of a
        logger (semicolons, decimal commas, bridges in mV/V), calibration/cells.csv with known loads, notes.md
        with what only the laboratory knows, and truth/, to which the test.toml of the same test goes.
    options : SynthOptions, optional
        What it shall contain, as JPEG.
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
        As :func:`make_folder`; photographs that are not to be JPEG.
    DataError
        When the disk refuses; what is there then is replaced by the next making.
    """
    out = Path(out)
    if options.image_format != "jpg":
        fault = Fault(
            "image_format", repr(options.image_format), "'jpg', which cameras stamp with their time"
        )
        raise ConfigError("synth options", [fault])
    truth = make_folder(out, options, overwrite=overwrite, progress=progress)
    with unwritable(out):
        told = (out / "test.toml").read_text(encoding="utf-8")
        (out / "test.toml").unlink()  # from here on the folder is half made, until truth/ has it
        dots_mm = np.empty((0, 2))
        if options.photographs:
            dots_mm = _dots_mm(out / "photos" / "0000.jpg", truth)
            _fill_card(out)
        if options.loadcells:
            _write_logs(out, options)
            _write_known_loads(out / "calibration", options)
        (out / "notes.md").write_text(notes_text(options, dots_mm), encoding="utf-8")
        (out / "truth" / "test.toml").write_text(told, encoding="utf-8")
    return truth


def _dots_mm(photograph: Path, truth: Truth) -> Floats:
    """Where the painted dots are on the window, (N, 2) mm from the tip at rest."""
    options = truth.options
    with Image.open(photograph) as picture:
        width, height = picture.size
    x, y = truth.tip_px
    tip = (x if options.direction.sign > 0 else width - 1 - x, y)
    view = View((height, width), tip, options.mm_per_px)
    return view.to_mm(view.marker_places_px(options.markers, options.marker_radius_px))


def _fill_card(out: Path) -> None:
    """Photographs under a camera's names, its clock in their EXIF, in place of photos/ and photos.csv."""
    card = out / _CARD
    shutil.rmtree(card, ignore_errors=True)
    card.mkdir(parents=True)
    times = pd.read_csv(out / "photos.csv")
    for k, (name, time_s) in enumerate(zip(times["file"], times["time_s"], strict=True)):
        jpeg = (out / "photos" / name).read_bytes()
        (card / f"DSC_{_FIRST_NUMBER + k:04d}.JPG").write_bytes(_stamped(jpeg, float(time_s)))
    shutil.rmtree(out / "photos")
    (out / "photos.csv").unlink()


def _stamped(jpeg: bytes, time_s: float) -> bytes:
    """A JPEG with an EXIF block: a camera, its exposure, and the time to a hundredth of a second."""
    taken = _CAMERA_ZERO + timedelta(seconds=round(time_s, 2))
    exif = Image.Exif()
    exif[0x010F], exif[0x0110] = "ploughval", "synth"
    inner = exif.get_ifd(0x8769)
    inner[0x829A], inner[0x829D], inner[0x8827], inner[0x920A] = 1 / 125, 8.0, 400, 50.0
    inner[0x9003] = taken.strftime("%Y:%m:%d %H:%M:%S")
    inner[0x9291] = f"{taken.microsecond // 10_000:02d}"
    block = exif.tobytes()
    return jpeg[:2] + b"\xff\xe1" + struct.pack(">H", len(block) + 2) + block + jpeg[2:]


def _write_logs(out: Path, options: SynthOptions) -> None:
    """The logs as a logger writes them, in place of those that test.toml would name."""
    (out / "logger").mkdir(exist_ok=True)
    _write_log(out / "loadcells.csv", out / "logger" / "test.csv", options)
    (out / "loadcells.csv").unlink()
    for run in sorted((out / "empty").glob("run*.csv")) if options.empty_runs else ():
        _write_log(run, run, options)


def _write_log(source: Path, target: Path, options: SynthOptions) -> None:
    table = pd.read_csv(source)
    upper, lower = (
        table[name] * factor
        for name, factor in zip(("moment_upper_Nm", "moment_lower_Nm"), _READING_PER_NM, strict=True)
    )
    columns = (table["time_s"], table["displacement_mm"], upper, lower)
    head = [f"Rig logger;4 channels;{options.rate_hz:g} Hz", "", _LOG_HEADER]
    _write_commas(target, head, columns, (2, 4, 6, 6))


def _write_commas(path: Path, head: list[str], columns: Sequence[pd.Series], digits: Sequence[int]) -> None:
    """A table with semicolons between its fields and commas before its decimals."""
    texts = [column.map(f"{{:.{n}f}}".format) for column, n in zip(columns, digits, strict=True)]
    rows = [";".join(row).replace(".", ",") for row in zip(*texts, strict=True)]
    path.write_text("\n".join([*head, *rows, ""]), encoding="utf-8")


def _write_known_loads(folder: Path, options: SynthOptions) -> None:
    """What the cells read under weights on the blade: up and down at two heights, each run with its zeros."""
    folder.mkdir(exist_ok=True)
    geometry = {"spacing_mm": options.spacing_mm, "lower_to_tip_mm": options.lower_to_tip_mm}
    rows = []
    for run, arm in enumerate(_ARMS_MM, start=1):
        rng = options.rng(Purpose.KNOWN_LOADS, run)
        zeros = rng.normal(0, options.zero_offset_Nm, 2)
        for load in _LOADS_N:
            moments = np.ravel(bending_moments(np.array([load]), np.array([arm]), **geometry))
            noise = rng.normal(0, options.moment_noise_Nm / 5, 2)  # means of half a second at 50 Hz
            upper, lower = (moments + zeros + noise) * _READING_PER_NM
            rows.append((run, load, arm, round(upper, 6), round(lower, 6)))
    table = pd.DataFrame(rows, columns=["run", "load_N", "arm_mm", "upper", "lower"])
    table.to_csv(folder / "cells.csv", index=False, lineterminator="\n")
