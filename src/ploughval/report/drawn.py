"""The figures of a page one by one, as matplotlib has them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from markupsafe import Markup
from matplotlib.figure import Figure

from ploughval.report.blocks import Chapter, Drawing, Pen
from ploughval.results import Results


@dataclass(slots=True, kw_only=True)
class FigurePen(Pen):
    """Keeps every figure by its name."""

    figures: dict[str, Figure] = field(default_factory=dict)

    def draw(self, figure: Figure, alt: str, caption: str, *, name: str, data: Sequence[str] = ()) -> Drawing:
        """A figure kept; see :meth:`Pen.draw`."""
        own = self.own_name(name)
        self.figures[own] = figure
        return Drawing(Markup(""), caption, own, tuple(data))


def figures_of(
    results: Results, chapters: Sequence[Callable[[Results, Pen], Chapter | None]]
) -> dict[str, Figure]:
    """The figures of some chapters by the names that they have on a page.

    Parameters
    ----------
    results : Results
        The files of a run.
    chapters : sequence of callable
        As the page is made of.

    Returns
    -------
    dict of str to Figure
        In the order of the page; empty where the test has nothing to show.
    """
    pen = FigurePen()
    for chapter in chapters:
        chapter(results, pen)
    return pen.figures
