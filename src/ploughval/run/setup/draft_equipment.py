"""Camera, lens and exposure in a draft: told by EXIF, else left to be filled in."""

from ploughval.photos.reading.exif import Shot
from ploughval.run.setup.draft_lines import quoted, remark
from ploughval.scene import Camera
from ploughval.scene_camera import EQUIPMENT


def equipment_text(shot: Shot) -> str:
    """The keys of [camera] that only tell what was used, in comments.

    Parameters
    ----------
    shot : Shot
        What EXIF says of the first photograph; empty: nothing.

    Returns
    -------
    str
        Keys that EXIF answers are not needed; the others may be filled in, and none is asked for.
    """
    known = {key: value for key in EQUIPMENT if (value := getattr(shot, key, None))}
    text = remark("for the report alone, where it is known:")
    if known:
        said = ", ".join(f"{key} {_shown(value)}" for key, value in known.items())
        text += remark(f"EXIF tells {said}; a key here counts before it")
    return text + "".join(_line(key) for key in EQUIPMENT if key not in known)


def _shown(value: str | float) -> str:
    return quoted(value) if isinstance(value, str) else f"{value:g}"


def _line(key: str) -> str:
    """A key with an empty place for its value and what it means."""
    field = Camera.model_fields[key]
    meaning = (field.description or key).split(";", maxsplit=1)[0]
    kind = ", in quotes" if field.default == "" else ""
    return f"# {f'{key} = ...':<30}# {meaning}{kind}\n"
