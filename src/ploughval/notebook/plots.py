"""The figures of the report page by name; matplotlib is imported when the first is drawn."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ploughval.errors import DataError
from ploughval.results import Results

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Plots:
    """The figures of one test, each as it stands on the report page.

    Every method returns a matplotlib Figure, changes nothing else, and raises DataError where the test has no
    results for it. A notebook shows the figure; ``figure.savefig("force.png")`` writes it.

    Parameters
    ----------
    read : callable
        Gives the results, read once.
    """

    def __init__(self, read: Callable[[], Results]) -> None:
        self._read = read

    def all(self) -> "dict[str, Figure]":
        """Every figure of the report page by its name, as ``ploughval report --figures`` names them."""
        from ploughval.report.drawn import figures_of
        from ploughval.report.figure_files import FIGURED

        return figures_of(self._read(), FIGURED)

    def force(self) -> "Figure":
        """Measured and predicted force against displacement, with peaks and starts of bands."""
        from ploughval.report.force import force_chapter

        return self._one(force_chapter, "force")

    def force_shape(self) -> "Figure":
        """Both force histories, each over its own initial force."""
        from ploughval.report.force import force_chapter

        return self._one(force_chapter, "force-shape")

    def line_of_action(self) -> "Figure":
        """Height of the force's line of action above the tip."""
        from ploughval.report.force import force_chapter

        return self._one(force_chapter, "line-of-action")

    def bands(self) -> "Figure":
        """Outcrop and inclination of the shear bands against displacement."""
        from ploughval.report.chapters import bands_chapter

        return self._one(bands_chapter, "bands")

    def block_motion(self) -> "Figure":
        """Velocity of the moving block for a unit velocity of the blade."""
        from ploughval.report.chapters import bands_chapter

        return self._one(bands_chapter, "block-motion")

    def layers(self, u_mm: float | None = None) -> "Figure":
        """Tracer layers and free surface, predicted above measured, over the photograph where it is there.

        Parameters
        ----------
        u_mm : float or None, mm
            Displacement of the blade: the nearest photograph is shown; None: the last.
        """
        from ploughval.report.stages import layers_chapter, stage_near

        return self._one(layers_chapter, "layers-", stage_near(self._read(), u_mm))

    def layer_distances(self) -> "Figure":
        """Distances of measured from predicted layers, by layer and displacement."""
        from ploughval.report.stages import layers_chapter, stage_near

        return self._one(layers_chapter, "layer-distances", stage_near(self._read(), None))

    def tracks(self, u_mm: float | None = None) -> "Figure":
        """Displacement of the tracked points in the increment that leads to a photograph.

        Parameters
        ----------
        u_mm : float or None, mm
            Displacement of the blade: the nearest photograph is shown; None: the last.
        """
        from ploughval.report.chapters import field_chapter
        from ploughval.report.stages import increment_near

        return self._one(field_chapter, "displacement-", increment_near(self._read(), u_mm))

    def shear(self, u_mm: float | None = None) -> "Figure":
        """Maximum shear strain of that increment, and since the start.

        Parameters
        ----------
        u_mm : float or None, mm
            Displacement of the blade: the nearest photograph is shown; None: the last.
        """
        from ploughval.report.shear import shear_chapter
        from ploughval.report.stages import increment_near

        return self._one(shear_chapter, "shear-", increment_near(self._read(), u_mm))

    def agreement(self, topic: str = "force") -> "Figure":
        """Errors of the model in validation uncertainties.

        Parameters
        ----------
        topic : str
            Of the metrics: force, layers, "shear bands" and others, as the report page heads them.
        """
        from ploughval.report.text import slug
        from ploughval.report.verdict import agreement_chapter

        return self._one(agreement_chapter, f"agreement-{slug(topic)}")

    def mobilised(self) -> "Figure":
        """Friction mobilised on the shear bands against slip."""
        from ploughval.report.friction import friction_chapter

        return self._one(friction_chapter, "mobilised-friction")

    def mound(self) -> "Figure":
        """Crest, front, slope and area of the heap."""
        from ploughval.report.mound import mound_chapter

        return self._one(mound_chapter, "mound")

    def budget(self) -> "Figure":
        """What the uncertainty of the force is made of."""
        from ploughval.report.load_cells import load_cells_chapter

        return self._one(load_cells_chapter, "force-budget")

    def blade(self) -> "Figure":
        """Blade found in the photographs against the log."""
        from ploughval.report.quality import quality_chapter

        return self._one(quality_chapter, "blade-position")

    def volume(self) -> "Figure":
        """Area of the heap against the area swept by the blade."""
        from ploughval.report.quality import quality_chapter

        return self._one(quality_chapter, "heap-area")

    def calibration(self) -> "Figure":
        """Residuals of the control points in the photograph."""
        from ploughval.report.calibration import calibration_chapter

        return self._one(calibration_chapter, "calibration-residuals")

    def soil_fit(self) -> "Figure":
        """Force of the soil fitted to it."""
        from ploughval.report.soil_fit import soil_fit_chapter

        return self._one(soil_fit_chapter, "soil-fit")

    def _one(self, chapter: Callable[..., Any], name: str, results: Results | None = None) -> "Figure":
        """The first figure of a chapter whose name is this, or begins so where it ends in a dash."""
        from ploughval.report.drawn import figures_of

        results = self._read() if results is None else results
        found = figures_of(results, [chapter])
        for own, figure in found.items():
            if own == name or (name.endswith("-") and own.startswith(name)):
                return figure
        there = f"; of its chapter there are: {', '.join(found)}" if found else ""
        raise DataError(
            f"no figure {name.rstrip('-')!r}: the test has no results for it{there}. "
            "plot.all() has every figure of the test",
            path=results.folder,
        )
