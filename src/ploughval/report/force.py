"""The chapter on force: history, shape, switches and line of action."""

from collections import Counter

import numpy as np
import pandas as pd

from ploughval.axes import ForceStatus
from ploughval.report.blocks import Chapter, Drawing, Pen, Table, pair_cell, table_of, value_cell
from ploughval.report.chapters import not_had
from ploughval.report.figures import arm_figure, force_figure, shape_figure
from ploughval.report.text import number, with_std
from ploughval.results import Results
from ploughval.scene import Step

_HISTORIES = ("force.csv", "model/force.csv", "peaks.csv", "force_envelope.csv")


def force_chapter(results: Results, pen: Pen) -> Chapter | None:
    """Force history, measured against model, and line of action."""
    missing = () if results.force is not None else not_had(results, Step.FORCE, "The measured force")
    alone = results.force is None and results.surface is None and not missing
    if results.force is None and (results.model_force is None or not alone):
        # A test that measured other things only has nothing to hold against the model's force.
        return Chapter("force", "Force", notes=missing) if missing else None
    envelope = results.table("force_envelope.csv")
    pairs = results.table("peak_pairs.csv")
    drawings = [
        pen.draw(
            force_figure(
                results.force,
                results.model_force,
                depth_mm=results.depth_mm,
                P0_N=results.P0_N,
                bands=results.bands,
                model_bands=results.model_bands,
                peaks=results.peaks,
                envelope=envelope,
            ),
            f"Force against displacement of the blade. {_force_words(results)}",
            _force_caption(results, drawn=envelope is not None and bool(envelope["low_N"].notna().any())),
            name="force",
            data=(*_HISTORIES, "bands.csv", "model/bands.csv"),
        )
    ]
    drawings += _shape(results, envelope, pairs, pen)
    notes = [*missing]
    if results.force is not None:
        if np.isfinite(results.force["arm_mm"]).any():
            drawings.append(
                pen.draw(
                    arm_figure(results.force, depth_mm=results.depth_mm),
                    "Height of the line of action of the force above the tip, against displacement.",
                    f"Line of action of {_acting(results)}. Dotted: a third of the depth, where a "
                    "pressure growing linearly with depth acts.",
                    name="line-of-action",
                    data=("force.csv",),
                )
            )
        else:
            notes.append("No line of action: the force was too small for one in every row.")
        notes += _force_notes(results.force)
    tables = [] if pairs is None or pairs.empty else [_switches(pairs)]
    if results.peaks is not None and len(results.peaks):
        tables.append(table_of(results.peaks, "Peaks and troughs", folded=True))
    return Chapter("force", "Force", drawings=drawings, tables=tables, notes=notes)


def _shape(
    results: Results, envelope: pd.DataFrame | None, pairs: pd.DataFrame | None, pen: Pen
) -> list[Drawing]:
    """Both histories, each over its own initial force; nothing where one side has none."""
    initial, depth = results.metric("first_peak_N"), results.depth_mm
    force, model = results.force, results.model_force
    if initial is None or not (initial.experiment and initial.model and depth):
        return []
    if force is None or model is None:
        return []
    own = (initial.experiment, initial.model)
    figure = shape_figure(
        force, model, own, depth_mm=depth, peaks=results.peaks, envelope=envelope, pairs=pairs
    )
    caption = (
        f"Each side over its own initial force: measured {with_std(own[0], initial.experiment_std)} N, "
        f"predicted {with_std(own[1], initial.model_std)} N. Circles: peaks; triangles: troughs; lines join "
        "peaks that match."
    )
    if envelope is not None and envelope["low_N"].notna().any():
        caption += (
            " Shaded: 95 % of the drawn inputs, over the stated run's initial force, so with its level."
        )
    alt = f"Shape of the force, P over own P₀ against u / d. {caption}"
    return [pen.draw(figure, alt, caption, name="force-shape", data=(*_HISTORIES, "peak_pairs.csv"))]


def _switches(pairs: pd.DataFrame) -> Table:
    """Switches of both sides: what is measured, and by how much the model is off."""
    head = ["Switch", "Model's"]
    for what, measure in (("u", "mm"), ("Force", "N"), ("Drop", "N"), ("Spacing", "mm")):
        head += [f"{what} ± std, {measure}", f"E ± u_val, {measure}"]
    rows = []
    for _, pair in pairs.iterrows():
        row = [value_cell(pair["switch_experiment"]), value_cell(pair["switch_model"])]
        for name in ("u_mm", "force_N", "drop_N", "spacing_mm"):
            row += [
                pair_cell(pair[f"{name}_experiment"], pair[f"{name}_experiment_std"]),
                pair_cell(pair[f"{name}_error"], pair[f"{name}_validation_std"]),
            ]
        rows.append(row)
    return Table("Switches that match, and those that are alone", head, rows, kind="cards")


def _force_words(results: Results) -> str:
    words = []
    for name, table in (("measured", results.force), ("predicted", results.model_force)):
        if table is not None and table["force_N"].notna().any():
            P, u = table["force_N"].to_numpy(float), table["u_mm"].to_numpy(float)
            at = int(np.nanargmax(P))
            words.append(
                f"The {name} force reaches at most {number(P[at], 3)} N at u = {number(u[at], 3)} mm."
            )
    return " ".join(words)


def _acting(results: Results) -> str:
    """What the line of action is that of."""
    if results.force_only:
        return "sand and friction together (friction is taken off the force alone)"
    return "the measured force"


def _force_caption(results: Results, *, drawn: bool) -> str:
    said = "Force against displacement of the blade. "
    said += "Circles: peaks. " if results.peaks is not None else ""
    said += "Shaded along the prediction: what 95 % of the drawn inputs give. " if drawn else ""
    marks = "Triangles: band starts, measured at the top, predicted at the bottom. "
    bands = results.bands is not None or results.model_bands is not None
    divisor = f"Both curves are divided by P₀ = {number(results.P0_N)} N" if results.P0_N else ""
    depth = f" and d = {number(results.depth_mm, 3)} mm." if results.P0_N and results.depth_mm else "."
    return (said + (marks if bands else "") + (divisor + depth if divisor else "")).strip()


def _said(status: str) -> str:
    """The status of rows of the log, in words."""
    if status == ForceStatus.NO_ARM:
        return "with a force too small for a line of action, those before contact among them"
    return status.replace("_", " ")


def _force_notes(force: pd.DataFrame) -> list[str]:
    counts = Counter(str(status) for status in force["status"])
    bad = [f"{n} {_said(name)}" for name, n in counts.most_common() if name not in ("ok", "")]
    notes = [f"Of {len(force)} rows of the log: {', '.join(bad)}."] if bad else []
    if not np.isfinite(force["friction_N"]).any():
        notes.append("No empty-box run: the friction of the seals is still in the measured force.")
    return notes
