"""The look of the studies' figures: Okabe-Ito colours, labels on the lines, small PNG files."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drawing.png import save_light

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#767676"
STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "lines.linewidth": 1.5,
    "lines.markersize": 3.5,
    "svg.hashsalt": "ploughval",
    "svg.fonttype": "path",
    "path.simplify": True,
    "path.simplify_threshold": 0.3,
}


@contextmanager
def style() -> Iterator[None]:
    """The type and lines of every figure here, without changing them elsewhere."""
    with mpl.rc_context(STYLE):
        yield


def save(figure: Figure, stem: Path) -> None:
    """Write stem.png, a small one."""
    save_light(figure, stem.with_suffix(".png"))


def label(ax: Axes, x: float, y: float, text: str, colour: str, **options: object) -> None:
    """Name a line beside one of its points (offset in points)."""
    settings = {"xytext": (4, 0), "va": "center", "fontsize": 8.0, **options}
    ax.annotate(text, (x, y), color=colour, textcoords="offset points", annotation_clip=False, **settings)
