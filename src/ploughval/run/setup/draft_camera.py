"""The photographs' tables of a draft: files, times, geometry, layers."""

import numpy as np

from ploughval.photos.reading.exif import Shot
from ploughval.run.setup.draft_equipment import equipment_text
from ploughval.run.setup.draft_facts import Found
from ploughval.run.setup.draft_lines import ask, offer, quoted, remark
from ploughval.run.setup.survey_photos import Photos
from ploughval.scene import Camera, Tracers

_ASK_DIRECTION = (
    f'direction = "?"                 # "right" or "left": {Camera.model_fields["direction"].description}\n'
)
"""Asked by a value that is refused: the key has a default, which would be taken without a word."""


def camera_text(found: Found) -> str:
    """[camera]."""
    photos = found.there.photos
    if photos is None:
        return '# No photographs were found.\n# [camera]\n# photos = "photos/*.png"\n'
    return (
        f"[camera]                        # {_size(photos)}\n"
        f"photos = {quoted(photos.pattern)}\n"
        f"{''.join(remark(f'also there, not taken: {text}') for text in photos.left)}"
        f"{''.join(remark(f'cannot be read: {text}') for text in photos.unreadable[:5])}"
        f"{_times(photos)}"
        f"{_direction(found)}"
        f"{_calibration(found)}"
        f"{_view(found)}"
        f"{_clock(found)}"
        f"{equipment_text(Shot() if photos.header is None else photos.header.tags.shot)}"
    )


def _size(photos: Photos) -> str:
    if photos.header is None:
        return f"{len(photos.files)} photographs that cannot be read"
    (height, width), bits = photos.header.shape, photos.header.bits
    colour = "colour" if photos.coloured else "grey"
    return f"{len(photos.files)} photographs of {width} x {height} px, {bits} bit, {colour}"


def _times(photos: Photos) -> str:
    remarks = "".join(remark(text) for text in photos.remarks)
    if photos.times is None:
        return (
            "# The photographs hold no usable times: a CSV file (file,time_s), or an interval.\n"
            f"{remarks}# times = {{start_s = 0.0, interval_s = ...}}\n"
        )
    if photos.times == "exif":
        return (
            f'times = "exif"                  # DateTimeOriginal, {photos.span_s:g} s from first to last\n'
            f"{remarks}"
        )
    if photos.times == "video":
        return (
            f'times = "video"                 # shown over {photos.span_s:g} s; slow\n'
            "                                # motion and time lapse need {start_s = 0.0, interval_s = 2.0}\n"
        )
    return f"times = {quoted(photos.times)}\n{remarks}"


def _direction(found: Found) -> str:
    blade = found.guesses.blade
    if blade is None:
        return remark("the photographs do not show which way the blade travels") + _ASK_DIRECTION
    way = f"the blade is seen to go {blade.way_px:.0f} px to the {blade.direction.value}"
    if blade.sure:
        return f'{f"""direction = "{blade.direction.value}" """:<32}# {way}\n'
    return remark(f"{way}, but that is not sure") + _ASK_DIRECTION


def _calibration(found: Found) -> str:
    scale = found.scale
    guess, told = "", ""
    if scale is not None and scale.sure:
        guess = f"{scale.mm_per_px:.5g}"
        told = f"{_travels(found)} at the same times"
    elif scale is not None:
        told = (
            f"{_travels(found)}: {scale.mm_per_px:.5g} mm/px, if the photographs show the whole travel of "
            "the log; their times do not tell"
        )
    elif found.depth_px:
        depth_px = found.depth_px
        told = f"the depth is {depth_px:.0f} px: mm_per_px = depth_mm / {depth_px:.1f}"
    place = found.guesses.tip_px if found.blade_sure else None
    tip = "" if place is None else f"[{place[0]:.1f}, {place[1]:.1f}]"
    return (
        f"{ask(Camera, 'mm_per_px', guess, told)}{_scale_std(found)}"
        f"{ask(Camera, 'tip_px', tip, _tip_text(found))}"
        "# or, in place of both, control points on the window, at least 4:\n"
        "# control_points = [[px_x, px_y, x_mm, y_mm], ...]\n"
        f"{_board(found)}{_earlier(found)}"
    )


def _scale_std(found: Found) -> str:
    if found.scale is None or not found.scale.sure:
        return ""
    return f"# mm_per_px_std = {found.scale.std:.2g}          # guess: of the scale that the travel gives\n"


def _travels(found: Found) -> str:
    blade, record = found.guesses.blade, found.there.logs.log
    assert blade is not None
    assert record is not None
    mm = np.nan if record.travel_mm is None else record.travel_mm
    return f"the blade travels {blade.way_px:.1f} px in the photographs, {mm:.4g} mm in the log"


def _tip_text(found: Found) -> str:
    blade, surface = found.guesses.blade, found.guesses.surface_px
    if blade is None or surface is None or not found.blade_sure:
        return ""
    if found.guesses.tip_px is None:
        return f"the face of the blade is at x = {blade.face_px:.1f}; its lower end was not found"
    doubt = "" if found.guesses.tip_sure else ", but that is not sure"
    return (
        f"edge of the body that travels; under its lower end the sand stays{doubt}. The sand's surface at "
        f"rest is at y = {surface:.1f}, {found.guesses.depth_px:.0f} px above"
    )


def _board(found: Found) -> str:
    if not found.there.boards:
        return ""
    keys = "columns = 0, rows = 0, spacing_mm = 0.0"
    return (
        "# or, in place of mm_per_px, the board (kind: charuco, chessboard or dots):\n"
        f'# board = {{kind = "?", picture = {quoted(found.there.boards[0])}, {keys}}}\n'
    )


def _earlier(found: Found) -> str:
    text = ""
    for name in found.there.calibrations[:1]:
        line = "or, in place of mm_per_px, where camera and window were not moved since, that of another test"
        if name.startswith(".."):
            text += remark(f"{line}: copy {name} into this folder")
            name = "calibration.json"
        else:
            text += remark(f"{line}:")
        text += f"# calibration = {quoted(name)}\n"
    return text


def _view(found: Found) -> str:
    view = found.guesses.view_px
    if view is None:
        return f"# view_px = ...                  # {Camera.model_fields['view_px'].description}\n"
    return offer(
        f"view_px = [{', '.join(map(str, view))}]",
        "guess: the photographs have even borders; inside of them is",
    )


def _clock(found: Found) -> str:
    photos, scale = found.there.photos, found.scale
    if found.there.logs.log is None or photos is None:
        return ""
    if photos.times is not None and photos.own_clock:
        told = ""
        if scale is not None and scale.sure:
            told = f", about {scale.clock_offset_s:.1f} s"
        return f'clock_offset_s = "auto"         # the camera has its own clock: found from the blade{told}\n'
    if scale is not None and scale.sure and scale.clock_offset_s != 0:
        told = (
            f"guess: the blade moves {scale.clock_offset_s:.1f} s later in the photographs than in the log: "
            "they do not share a clock"
        )
        return offer('clock_offset_s = "auto"', told)
    return '# clock_offset_s = "auto"        # where photographs and log do not share a clock\n'


def tracers_text(found: Found) -> str:
    """[tracers]."""
    if found.there.photos is None:
        return ""
    meaning = Tracers.model_fields["layers_mm"].description
    layers, scale = found.guesses.layers if found.blade_sure else None, found.mm_per_px
    if layers is None:
        return (
            f"# [tracers]\n# layers_mm = [...]                # {meaning}\n"
            "# dyed = true                      # where they are dyed sand\n"
        )
    tint = "dark" if layers.dark else "pale"
    heights = ", ".join(f"{h:.0f}" for h in layers.above_px)
    told = (
        f"guess: {len(layers.above_px)} {tint} bands lie level in the sand, {heights} px above the tip and "
        f"{layers.thick_px:.0f} px thick"
    )

    def mm(px: float) -> str:
        return f"{scale * px:.3g}" if scale else f"{px:.1f} * mm_per_px"

    return remark(told) + (
        f"# [tracers]\n# layers_mm = [{', '.join(map(mm, layers.above_px))}]   # {meaning}\n"
        f"# dyed = true\n# dye = {quoted(tint)}\n# thickness_mm = {mm(layers.thick_px)}\n"
    )
