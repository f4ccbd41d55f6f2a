"""The chapter on the mound ahead of the blade."""

from ploughval.report.blocks import Cell, Chapter, Pen, Table, pair_cell, travel_cell
from ploughval.report.figures.mound import mound_figure
from ploughval.report.text import with_std
from ploughval.results import Results

_HEAD = (
    "Source", "u, mm", "Crest ± std, mm", "Crest at x ± std, mm", "At the face ± std, mm",
    "Front ahead ± std, mm", "Flank ± std, °", "Front's slope ± std, °", "Area ± std, mm²",
)  # fmt: skip
_PARTS = (
    ("crest_mm", "crest_std_mm"), ("crest_x_mm", "crest_x_std_mm"), ("face_mm", "face_std_mm"),
    ("front_mm", "front_std_mm"), ("flank_deg", "flank_std_deg"), ("slope_deg", "slope_std_deg"),
    ("area_mm2", "area_std_mm2"),
)  # fmt: skip


def mound_chapter(results: Results, pen: Pen) -> Chapter | None:
    """Crest, front, slope and area of the heap, measured and predicted; None without a surface of both."""
    mound = results.table("mound.csv")
    if mound is None or not mound["crest_mm"].notna().any():
        return None
    soil_repose = results.setting("soil", "repose_deg")
    repose = soil_repose if soil_repose is not None else results.setting("soil", "residual_friction_deg")
    words = _words(results)
    drawing = pen.draw(
        mound_figure(mound, repose_deg=None if repose is None else float(repose)),
        f"Crest, front, slope and area of the heap against travel, measured and predicted. {words}",
        "The heap ahead of the blade against travel. Heights and area are above the initial surface; the "
        "front is where the surface leaves it. The flank falls from near the crest to near the front, steps "
        "included; the front is its lowest step. Dotted: "
        f"the slope of repose that the model was given. {words}".strip(),
        name="mound",
        data=("mound.csv",),
    )
    rows = []
    for source, said in (("experiment", "measured"), ("model", "predicted")):
        for _, row in mound[mound["source"] == source].iterrows():
            pairs = [pair_cell(float(row[name]), float(row[std])) for name, std in _PARTS]
            rows.append([Cell(said, mark=said), travel_cell(float(row["u_mm"])), *pairs])
    note = (
        "The prediction is read as a measured surface would be, and has the uncertainty that such a reading "
        "leaves: that of the model's numbers is in the metrics."
    )
    table = Table("The mound, every frame", _HEAD, rows, folded=True, footnotes=(note,))
    return Chapter("mound", "Mound", drawings=[drawing], tables=[table])


def _words(results: Results) -> str:
    """How the last crests and fronts compare, in a sentence."""
    said = []
    for name, what in (("surface_crest_end_mm", "crest"), ("surface_front_end_mm", "front")):
        metric = results.metric(name)
        if metric is not None and metric.experiment is not None and metric.model is not None:
            measured = with_std(metric.experiment, metric.experiment_std)
            said.append(
                f"{what} {measured} mm measured, {with_std(metric.model, metric.model_std)} mm predicted"
            )
    return f"At the end: {'; '.join(said)}." if said else ""
