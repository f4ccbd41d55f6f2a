"""A first test.toml, written from what is in a folder; what only the user can know is left as a question."""

import logging
from pathlib import Path

import numpy as np

from ploughval.errors import ConfigError, Fault, PloughvalError
from ploughval.run.kept.written import write_text
from ploughval.run.setup.draft_camera import camera_text, tracers_text
from ploughval.run.setup.draft_cells import loadcells_text
from ploughval.run.setup.draft_facts import Found
from ploughval.run.setup.draft_lines import ask, offer, quoted
from ploughval.run.setup.guess_scale import ScaleGuess, guess_scale
from ploughval.run.setup.guesses import NOTHING, Guesses, guess
from ploughval.run.setup.survey import Survey, survey
from ploughval.scene import Blade, Soil

log = logging.getLogger(__name__)

_HEAD = """\
# Settings of one test, drafted from the files in this folder.
# Answer every line that ends in a question mark: take away the "# ", put the value in place of the "?";
# where a value stands before the "?" it is a guess: judge it, then take away the "?".
# Other lines in comments may be taken or left.
# Then: ploughval check <this folder>
"""


def draft_settings(folder: Path | str) -> str:
    """Write a commented test.toml for a folder.

    Parameters
    ----------
    folder : path-like
        With photographs, logs and empty runs, wherever they stand, down to two folders deep.

    Returns
    -------
    str
        TOML. Required keys that the files do not tell are comments that end in a question mark, so that
        reading the draft names them as missing.

    Raises
    ------
    ConfigError
        No such folder.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise ConfigError(folder, [Fault("folder", "nothing", "a folder with photographs or logs")])
    there = survey(folder)
    guesses = _guesses(there)
    found = Found(there, guesses, _scale(there, guesses))
    name = folder.resolve().name.encode("utf-8", "replace").decode() or "test"
    tables = [
        _HEAD,
        f"[test]\nname = {quoted(name)}\n",
        _blade(found),
        "# [box]\n# length_mm = ...               # inner length along the travel, where known\n",
        _soil(),
        camera_text(found),
        loadcells_text(found),
        tracers_text(found),
    ]
    return "\n".join(tables)


def write_draft(folder: Path | str) -> Path:
    """Write :func:`draft_settings` as test.toml into the folder.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ConfigError
        No such folder, or a test.toml that is there already.
    DataError
        A folder that cannot be written to.
    """
    path = Path(folder) / "test.toml"
    if path.exists():
        raise ConfigError(path, [_THERE])
    text = draft_settings(folder)
    if path.exists():
        raise ConfigError(path, [_THERE])
    write_text(path, text)
    return path


_THERE = Fault("test.toml", "a file that exists", "none yet", "Edit it, or move it out of the way.")


def _guesses(there: Survey) -> Guesses:
    """What the photographs tell; nothing where they cannot be read."""
    photos = there.photos
    if photos is None or photos.header is None:
        return NOTHING
    order = np.argsort(photos.time_s, kind="stable") if photos.times else np.arange(len(photos.files))
    kept = [k for k in order.tolist() if photos.times is None or np.isfinite(photos.time_s[k])]
    try:
        return guess([photos.files[k] for k in kept], photos.header.bits).renumbered(kept)
    except PloughvalError as error:
        log.warning("%s", error)
        return NOTHING


def _scale(there: Survey, guesses: Guesses) -> ScaleGuess | None:
    """The scale, where both photographs and log show the travel."""
    record, blade, photos = there.logs.log, guesses.blade, there.photos
    if record is None or record.time_s is None or record.u_mm is None or photos is None:
        return None
    if blade is None or not blade.sure:
        return None
    # a video may run faster or slower than the test did: its times tell nothing of the scale
    time_s = photos.time_s if photos.times != "video" else np.full(len(photos.files), np.nan)
    return guess_scale(
        time_s[blade.frames],
        blade.travel_px,
        record.time_s,
        record.u_mm,
        one_clock=not photos.own_clock,
    )


def _blade(found: Found) -> str:
    depth_px, wide_px, scale = found.depth_px, found.thickness_px, found.mm_per_px
    told = f"it is {depth_px:.0f} px in the first photograph" if depth_px else ""
    if told:
        told += f", times {found.scale_text}" if scale else ": mm_per_px is depth_mm over that"
    depth = f"{found.depth_mm:.3g}" if found.depth_mm else ""
    thickness = "# thickness_mm = 5.0\n"
    if wide_px:
        size = f"{wide_px * scale:.3g}" if scale else f"{wide_px:.1f} * mm_per_px"
        how = f"guess: it is {wide_px:.1f} px wide in the first photograph; if absent, 5.0"
        thickness = offer(f"thickness_mm = {size}", how)
    return f"[blade]\n{ask(Blade, 'depth_mm', depth, told)}{ask(Blade, 'width_mm')}{_speed(found)}{thickness}"


def _speed(found: Found) -> str:
    record = found.there.logs.log
    if record is None or record.speed_mm_s is None:
        return ""
    return f"speed_mm_s = {record.speed_mm_s:.3g}              # from the log\n"


def _soil() -> str:
    keys = ("unit_weight_kN_m3", "peak_friction_deg", "residual_friction_deg")
    return (
        "[soil]                          # for the model; take the table out where no model is wanted\n"
        f"{''.join(ask(Soil, key) for key in keys)}"
        "# mobilization_length_mm = 1.0\n"
        "# wall_friction_deg = 0.0\n"
        "# repose_deg = ...               # if absent, the residual friction angle\n"
    )
