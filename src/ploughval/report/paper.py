"""The figures of Hambleton et al. for the test at hand: all stages on one sheet, beside the force history."""

from ploughval.report.blocks import Chapter, Pen
from ploughval.report.figures import stages_figure
from ploughval.report.figures.look import narrow
from ploughval.report.photographs import open_photographs
from ploughval.report.stages import photo_width, stage_at, stage_frames, view
from ploughval.results import Results

_MOST_IN_COLUMN = 2  # pairs of panels below each other on the height of a page


def paper_chapter(results: Results, pen: Pen) -> Chapter | None:
    """Predicted above measured layers at the stages shown; None where a test has one side only.

    Parameters
    ----------
    results : Results
        The files of a run.
    pen : Pen
        Draws the figure.
    """
    frames = stage_frames(results)
    measured = results.layers is not None or results.surface is not None
    if results.model_layers is None or not measured or not frames:
        return None
    shown = frames[-_MOST_IN_COLUMN:] if narrow() else frames
    photographs, extent = open_photographs(results), view(results)
    width = photo_width(photographs, extent, 0)
    stages = [
        stage_at(
            results,
            frame,
            None if photographs is None else photographs.picture(frame, extent, width=width),
        )
        for frame in shown
    ]
    figure = stages_figure(
        stages,
        depth_mm=results.depth_mm or extent[3],
        extent=extent,
        thickness_mm=results.thickness_mm,
    )
    places = ", ".join(f"{one.u_mm:.1f}" for one in stages)
    drawing = pen.draw(
        figure,
        f"Deformed tracer layers at u = {places} mm: predicted above, measured below.",
        f"Deformation predicted (above) and measured (below) at u = {places} mm. Lines were level before the "
        "blade moved; dash-dotted: the band that slips, to its outcrop.",
        name="figure-8",
        data=("layers.csv", "surface.csv", "bands.csv", "model/layers.csv", "model/surface.csv"),
    )
    lead = (
        "As Figure 8 of Hambleton et al.; the figure “force” is as their Figure 9, with uncertainty, peaks "
        "and starts of bands."
    )
    return Chapter("paper", "All stages on one sheet", lead=lead, drawings=[drawing])
