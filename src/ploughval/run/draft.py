"""A first test.toml, written from what is in a folder; what only the user can know is left as a question."""

import json
from pathlib import Path

from pydantic import BaseModel

from ploughval.errors import ConfigError, Fault
from ploughval.run.survey import LogFound, Survey, survey
from ploughval.scene import Blade, Camera, LoadCells, Soil, Tracers

_HEAD = """\
# Settings of one test, drafted from the files in this folder.
# Answer every line that ends in a question mark: take away the "# ", put the value in place of the "?".
# Then: ploughval check <this folder>
"""


def draft_settings(folder: Path | str) -> str:
    """Write a commented test.toml for a folder.

    Parameters
    ----------
    folder : path-like
        With photographs, logs and empty runs, wherever they stand at the top or one level down.

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
    found = survey(folder)
    name = folder.resolve().name.encode("utf-8", "replace").decode() or "test"
    tables = [
        _HEAD,
        f"[test]\nname = {_quoted(name)}\n",
        _blade(found),
        _box(),
        _soil(),
        _camera(found),
        _loadcells(found),
        _tracers(found),
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
        No such folder, a test.toml that is there already, or a folder that cannot be written to.
    """
    path = Path(folder) / "test.toml"
    text = draft_settings(folder)
    try:
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except FileExistsError:
        fault = Fault("test.toml", "a file that exists", "none yet", "Edit it, or move it out of the way.")
        raise ConfigError(path, [fault]) from None
    except OSError as error:
        raise ConfigError(path, [Fault("test.toml", str(error), "a folder that can be written to")]) from None
    return path


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _ask(table: type[BaseModel], *keys: str) -> str:
    """Keys as questions, each with its meaning."""
    return "".join(f"# {table.model_fields[key].description}\n# {key} = ?\n" for key in keys)


def _blade(found: Survey) -> str:
    speed = found.log.speed_mm_s if found.log else None
    told = f"speed_mm_s = {speed:.3g}              # from the log\n" if speed else ""
    return f"[blade]\n{_ask(Blade, 'depth_mm', 'width_mm')}{told}# thickness_mm = 5.0\n"


def _box() -> str:
    return "# [box]\n# length_mm = 370.0             # inner length along the travel, where known\n"


def _soil() -> str:
    keys = ("unit_weight_kN_m3", "peak_friction_deg", "residual_friction_deg")
    return (
        f"[soil]                          # for the model; take the table out where no model is wanted\n"
        f"{_ask(Soil, *keys)}"
        "# mobilization_length_mm = 1.0\n"
        "# wall_friction_deg = 0.0\n"
        "# repose_deg = 32.0              # default: the residual friction angle\n"
    )


def _camera(found: Survey) -> str:
    photos = found.photos
    if photos is None:
        return '# No photographs were found.\n# [camera]\n# photos = "photos/*.png"\n'
    size = "that cannot be read"
    if photos.header is not None:
        (height, width), bits = photos.header.shape, photos.header.bits
        size = f"of {width} x {height} px, {bits} bit"
    return (
        f"[camera]                        # {photos.count} photographs {size}\n"
        f"photos = {_quoted(photos.pattern)}\n"
        f"{_times(found)}"
        f"{_calibration(found)}"
        'direction = "right"             # or "left": the way the blade travels in the photograph\n'
        f"{_clock(found)}"
    )


def _times(found: Survey) -> str:
    if found.times is not None:
        return f"times = {_quoted(found.times)}\n"
    span = found.photos.exif_span_s if found.photos else None
    if span is not None:
        return f'times = "exif"                  # DateTimeOriginal, {span:g} s from first to last\n'
    shown = found.photos.video_span_s if found.photos else None
    if shown is not None:
        return (
            f'times = "video"                 # as it is shown, {shown:g} s from first to last; slow\n'
            "                                # motion and time lapse need {start_s = 0.0, interval_s = 2.0}\n"
        )
    return (
        "# The photographs hold no usable times: a CSV file (file,time_s), or an interval.\n"
        "# times = {start_s = 0.0, interval_s = 2.0}\n"
    )


def _calibration(found: Survey) -> str:
    board = ""
    if found.boards:
        keys = "columns = 10, rows = 7, spacing_mm = 10.0"
        board = (
            "# or, in place of mm_per_px, the board (kind: charuco, chessboard or dots):\n"
            f'# board = {{kind = "chessboard", picture = {_quoted(found.boards[0])}, {keys}}}\n'
        )
    return (
        f"{_ask(Camera, 'mm_per_px', 'tip_px')}"
        "# or, in place of both, control points on the window, at least 4:\n"
        "# control_points = [[px_x, px_y, x_mm, y_mm], ...]\n"
        f"{board}"
    )


def _clock(found: Survey) -> str:
    if found.log is None:
        return ""
    photos = found.photos
    if found.times is None and photos and not (photos.exif_span_s is None and photos.video_span_s is None):
        return 'clock_offset_s = "auto"         # the camera has its own clock: found from the blade\n'
    return '# clock_offset_s = "auto"        # where photographs and log do not share a clock\n'


def _loadcells(found: Survey) -> str:
    log = found.log
    if log is None:
        return "# No log of load cells was found.\n# [loadcells]\n"
    empty = ", ".join(_quoted(name) for name in found.empty)
    friction = (
        f"empty = [{empty}]\n"
        if empty
        else "# empty = []   # no empty-box runs found: no friction compensation\n"
    )
    return (
        f"[loadcells]\nlog = {_quoted(log.name)}\n{_trouble(log)}{friction}"
        f"{_ask(LoadCells, 'spacing_mm', 'lower_to_tip_mm')}"
        f"{_rest(log)}{_columns(log)}"
    )


def _trouble(log: LogFound) -> str:
    return "".join(f"# {line}\n" for line in log.trouble.splitlines())


def _rest(log: LogFound) -> str:
    if log.rest_s is None:
        return (
            "# rest_s = [0.0, 5.0]            # window before motion; absent: found from the displacement\n"
        )
    travel = f", which travels {log.travel_mm:.4g} mm" if log.travel_mm else ""
    return (
        f"rest_s = [{log.rest_s[0]:g}, {log.rest_s[1]:g}]           # before the displacement moves{travel}\n"
    )


def _columns(log: LogFound) -> str:
    wanted = ("time_s", "displacement_mm", "moment_upper_Nm", "moment_lower_Nm")
    if all(log.columns.get(key) == key for key in wanted):
        return ""
    lines = [
        f"{key} = {_quoted(log.columns[key])}\n" if key in log.columns else f"# {key} = ?\n" for key in wanted
    ]
    there = f"# columns of the log: {', '.join(map(repr, log.header))}\n" if log.header else ""
    return f"[loadcells.columns]\n{there}{''.join(lines)}"


def _tracers(found: Survey) -> str:
    if found.photos is None:
        return ""
    text = Tracers.model_fields["layers_mm"].description
    return (
        f"# [tracers]\n# layers_mm = [5, 10, 15, 20, 25]   # {text}\n"
        "# dyed = true                      # where they are dyed sand\n"
    )
