"""One look for all figures: palette (Okabe & Ito, 2008), type sizes, SVG that follows the theme."""

import base64
import io
import re
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from ploughval.report.figures import look
from ploughval.report.figures.svg import compact, escaped
from ploughval.run.kept.written import write_aside

P = ParamSpec("P")
R = TypeVar("R")

# Colours that the page re-defines for dark screens; kept apart from pure black and white on purpose.
INK = "#1b1f23"
MUTED = "#6a737d"
GRID = "#dfe3e8"
PAPER = "#fdfdfc"
MEASURED = "#0072b2"
MODEL = "#d55e00"
SAND = "#ecdcb4"
STEEL = "#8a929a"
THEMED = {
    INK: "ink",
    MUTED: "muted",
    GRID: "grid",
    PAPER: "paper",
    MEASURED: "measured",
    MODEL: "model",
    SAND: "sand",
    STEEL: "steel",
}
# Over a photograph the ground is the same in both themes, so are the colours (one level off, not themed).
ON_PHOTO_MEASURED = "#0071b2"
ON_PHOTO_MODEL = "#d55d00"
ON_PHOTO_HALO = "#ffffff"
SERIES = (MEASURED, MODEL, "#009e73", "#cc79a7", "#e69f00", "#56b4e9")

WIDTH_IN = 6.4
_PHOTOGRAPH_PIXELS = 40_000  # opaque pictures from this size on are photographs
_PALETTE_BYTES = 10_000
_QUALITY = 70  # of JPEG: grains stay grains
STAGE_WIDTH_IN = 5.4  # two stand side by side on a wide page
_RC: Any = {
    "font.size": 10,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "axes.titlesize": 10,
    "axes.labelsize": 10,
    "legend.fontsize": 9,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.edgecolor": MUTED,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "figure.facecolor": PAPER,
    "axes.facecolor": PAPER,
    "savefig.facecolor": PAPER,
    "savefig.dpi": 150,
    "figure.dpi": 100,
    "svg.fonttype": "none",
    "svg.hashsalt": "ploughval",
    "path.simplify": True,
    "image.composite_image": False,
}


def styled(plot: Callable[P, R]) -> Callable[P, R]:
    """Run a plot function under the house style and leave matplotlib's settings as they were."""

    @wraps(plot)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        with mpl.rc_context(look.settings(_RC)):
            drawn = plot(*args, **kwargs)
            if isinstance(drawn, Figure):
                look.finish(drawn)
            return drawn

    return wrapped


class HouseFigure(Figure):
    """A figure that a notebook shows as it stands, whether pyplot is there or not."""

    def _repr_png_(self) -> tuple[bytes, dict[str, float]]:
        """The picture, and the size at which it is shown, px."""
        width, height = (float(side) * self.get_dpi() for side in self.get_size_inches())
        return _png(self), {"width": width, "height": height}


def new_figure(
    height_in: float = 0.0, *, width_in: float = WIDTH_IN, picture_in: float = 0.0, text_in: float = 0.0
) -> Figure:
    """An empty figure of the house width, or of the look in force; its axes are laid out when it is drawn.

    Parameters
    ----------
    height_in, picture_in, text_in : float, inches
        Parts of the height, by what they follow on paper: see :func:`.look.figure_size`.
    width_in : float, inches
        Width on the page.
    """
    size = look.figure_size(height_in, width_in=width_in, picture_in=picture_in, text_in=text_in)
    return HouseFigure(figsize=size, layout="constrained")


def plain(text: str, length: int = 48) -> str:
    """Text from a user as a label: one line, printable, no mathematics, not hidden from legends."""
    line = "".join(c if c.isprintable() else " " for c in text).strip()
    line = line if len(line) <= length else line[: length - 1] + "…"
    line = line.replace("$", r"\$")
    return f"\u200b{line}" if line.startswith("_") else line


def legend_above(axes: Axes, columns: int = 4) -> None:
    """A legend above the axes, where it hides no data, in one line if that is wide enough."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        beside_in = 0.6  # the axis on the left
        fitting = look.fitting_columns(labels, columns, look.width_of(axes) - beside_in)
        axes.legend(
            handles, labels, loc="lower left", bbox_to_anchor=(0, 1.0), ncols=fitting, borderaxespad=0.2
        )


@styled
def to_svg(figure: Figure, key: str, alt: str) -> str:
    """A figure as an inline SVG element: ids prefixed by the key, theme colours as CSS variables.

    Parameters
    ----------
    figure : Figure
        What is drawn.
    key : str
        Unique on the page; letters, digits and dashes.
    alt : str
        Text for those who do not see the figure; escaped here.

    Returns
    -------
    str
        ``<svg ...>...</svg>`` without references outside itself; same figure, same bytes.
    """
    buffer = io.StringIO()
    figure.savefig(
        buffer, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None}
    )
    source = buffer.getvalue()
    view = re.search(r'viewBox="[^"]*"', source)
    body = compact(re.sub(r"data:image/png;base64,([^\"]+)", _lighter, source), key, _themed)
    return f'<svg {view.group(0) if view else ""} role="img" aria-label="{escaped(alt)}">{body}</svg>'


@styled
def _png(figure: Figure) -> bytes:
    """A figure as the bytes of a PNG file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


@styled
def saved(figure: Figure, target: Path) -> Path:
    """Write a figure to a file of its own; the same bytes for the same figure.

    Raises
    ------
    DataError
        When the disk refuses.
    """
    kind = target.suffix.lower().lstrip(".")
    metadata = {"png": {"Software": None}, "svg": {"Date": None}}.get(kind, {"CreationDate": None})
    write_aside(target, lambda aside: figure.savefig(aside, format=kind, metadata=metadata))
    return target


def _themed(style: str) -> str:
    """A style whose colours and type are those of the page's theme."""
    style = re.sub(r"'DejaVu Sans'[^;]*sans-serif", "var(--font)", style)
    for colour, name in THEMED.items():
        style = style.replace(colour, f"var(--{name})")
    return style


def _lighter(found: re.Match[str]) -> str:
    """An embedded picture with fewer bytes.

    Opaque ones become JPEG (photographs of sand are noise: PNG is five times larger), large others get a
    palette, which no eye tells from the picture.
    """
    data = base64.b64decode(found.group(1))
    picture = Image.open(io.BytesIO(data)).convert("RGBA")
    opaque = picture.getchannel("A").getextrema() == (255, 255)
    buffer = io.BytesIO()
    if opaque and picture.width * picture.height >= _PHOTOGRAPH_PIXELS:
        picture.convert("RGB").save(buffer, format="JPEG", quality=_QUALITY, optimize=True)
        return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode()
    if len(data) > _PALETTE_BYTES:
        picture.quantize(256, method=Image.Quantize.FASTOCTREE).save(buffer, format="PNG", optimize=True)
        data = min(data, buffer.getvalue(), key=len)
    return "data:image/png;base64," + base64.b64encode(data).decode()
