"""Pictures of the reports as small files: one palette of at most 64 colours, nothing dithered."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from PIL import Image

COLOURS = 64  # thin lines of a figure over a grey photograph keep their colours; a fifth of the bytes


def save_light(figure: Figure, path: Path, *, dpi: int = 100, colours: int = COLOURS, **options: Any) -> Path:
    """Write a figure as a PNG with a palette; the same bytes for the same figure."""
    figure.savefig(path, dpi=dpi, metadata={"Software": None}, **options)
    lighten(path, colours)
    return path


def lighten(path: Path, colours: int = COLOURS) -> int:
    """Give a PNG a palette where that makes it smaller; returns its bytes.

    An octree and not the median cut: that gives the colours to the many greys of sand, and lines drawn over
    a photograph turn grey.
    """
    with Image.open(path) as picture:
        picture.load()
    if picture.mode == "P":
        return path.stat().st_size
    aside = path.with_name(f".{path.name}.part")
    flat = Image.new("RGB", picture.size, "white")
    flat.paste(picture, mask=picture.getchannel("A") if "A" in picture.getbands() else None)
    reduced = flat.quantize(colours, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    reduced.save(aside, format="PNG", optimize=True)
    if aside.stat().st_size < path.stat().st_size:
        aside.replace(path)
    else:
        aside.unlink()
    return path.stat().st_size
