"""The chapters of one test: each is there when its files are, or says what could not be had."""

import numpy as np
import pandas as pd

from ploughval.report.band_pairs import pair_parts
from ploughval.report.blocks import (
    BAND_HEAD,
    Cell,
    Chapter,
    Drawing,
    Pen,
    Table,
    band_rows,
    value_cell,
)
from ploughval.report.figures import (
    bands_figure,
    field_figure,
    kinematics_figure,
)
from ploughval.report.stages import increments_shown, view
from ploughval.results import Results
from ploughval.scene import Step

MOST_PLACES = 12  # increments that are named


def not_had(results: Results, step: Step, what: str) -> tuple[str, ...]:
    """A note when a step was called for but left no file; its faults stand in the last chapter."""
    if step.value not in results.run.steps:
        return ()
    return (f"{what} could not be had; the faults of the run are listed under “Quality”.",)


def bands_chapter(results: Results, pen: Pen) -> Chapter | None:
    """Shear bands: table and histories of outcrop and inclination."""
    missing = () if results.bands is not None else not_had(results, Step.BANDS, "The measured shear bands")
    if results.bands is None and results.model_bands is None and results.increments is None:
        return Chapter("bands", "Shear bands", notes=missing) if missing else None
    rows = [*band_rows(results.bands, "measured"), *band_rows(results.model_bands, "predicted")]
    tables = [Table("Bands", BAND_HEAD, rows, kind="cards")] if rows else []
    drawing = pen.draw(
        bands_figure(
            results.bands,
            results.increments,
            model_bands=results.model_bands,
            model_force=results.model_force,
        ),
        f"Outcrop and inclination of the shear bands against displacement; measured {_count(results.bands)}, "
        f"predicted {_count(results.model_bands)}.",
        "Outcrop and inclination of the shear bands. A band's outcrop stays in the sand while the tip closes "
        "in on it, so the band steepens until a fresh one is cheaper.",
        name="bands",
        data=("bands.csv", "increments.csv", "model/bands.csv", "model/force.csv"),
    )
    notes = list(missing)
    if results.bands is not None and results.bands.empty:
        notes.append("No shear band was found in the measurement.")
    paired, tables_of_pairs, said = pair_parts(results, pen)
    drawings, tables, notes = [drawing, *paired], [*tables_of_pairs, *tables], [*said, *notes]
    if results.increments is not None and results.increments["velocity_x"].notna().any():
        drawings.append(_kinematics(results.increments, pen))
    if results.increments is not None:
        tables += _mechanisms(results.increments)
    return Chapter("bands", "Shear bands", drawings=drawings, tables=tables, notes=notes)


def _kinematics(increments: pd.DataFrame, pen: Pen) -> Drawing:
    """The block's velocity, and in how many increments it is that of a rigid block over the band."""
    known = increments.dropna(subset=["velocity_y", "velocity_y_std", "beta_deg", "beta_std_deg"])
    beta = np.radians(known["beta_deg"].to_numpy(float))
    std = np.hypot(
        known["velocity_y_std"], np.radians(known["beta_std_deg"].to_numpy(float)) / np.cos(beta) ** 2
    )
    agree = int((np.abs(known["velocity_y"] - np.tan(beta)) < 2 * std).sum())
    return pen.draw(
        kinematics_figure(increments),
        "Velocity of the moving block along the travel and upwards for a millimetre of the blade.",
        "Motion of the block for a millimetre of the blade. A rigid block over one band moves by 1 along and "
        f"by tan β up; within two standard uncertainties it does in {agree} of {len(known)} increments. "
        "Bars: ± std.",
        name="block-motion",
        data=("increments.csv",),
    )


_MECHANISMS = {
    "one_band": "one band is enough",
    "two_bands": "two bands through the tip",
    "shear_along_blade": "shearing along the blade",
    "diffuse": "no sharp band: motion fades in gradually",
    "still": "the sand does not move",
    "": "could not be told: too few points, or too little travel",
}


def _mechanisms(increments: pd.DataFrame) -> list[Table]:
    """How many increments moved in which way, and which ones did not move over one band."""
    rows = []
    for name, words in _MECHANISMS.items():
        some = increments[increments["mechanism"] == name]
        if len(some):
            places = "" if name == "one_band" else ", ".join(f"{u:.1f}" for u in some["u_mm"][:MOST_PLACES])
            more = " …" if name != "one_band" and len(some) > MOST_PLACES else ""
            evidence = some["evidence"].max()
            rows.append(
                [Cell(words), value_cell(len(some)), value_cell(float(evidence), 3), Cell(places + more)]
            )
    head = ("Motion", "Increments", "Largest evidence against one band, ln", "Beginning at u, mm")
    return [Table("One band or not, by increments", head, rows, kind="cards")] if rows else []


def _count(table: pd.DataFrame | None) -> str:
    return "none" if table is None else str(len(table))


def field_chapter(results: Results, pen: Pen) -> Chapter | None:
    """Displacement between photographs at the stages shown."""
    tracks = results.tracks
    if tracks is None:
        missing = not_had(results, Step.TRACKS, "The displacement field")
        return Chapter("field", "Displacement field", notes=missing) if missing else None
    extent, u = view(results), tracks["u_mm"].to_numpy()
    drawings: list[Drawing] = []
    for frame, before, row in increments_shown(results):
        surface = None if results.surface is None else results.surface[results.surface["frame"] == frame]
        figure = field_figure(
            tracks, before, row, extent=extent, surface=surface, thickness_mm=results.thickness_mm
        )
        words = f"between u = {u[before]:.1f} mm and {u[row]:.1f} mm"
        drawings.append(
            pen.draw(
                figure,
                f"Displacement of the sand {words}.",
                f"Frame {frame}: {words}.",
                name=f"displacement-f{frame:03d}",
                data=("tracks.nc", "surface.csv"),
            )
        )
    if not drawings:
        return Chapter("field", "Displacement field", notes=("No two photographs share a tracked point.",))
    return Chapter(
        "field",
        "Displacement field",
        lead="How far each point moved for a millimetre of the blade. A rigid block moves 1 / cos β.",
        grid=drawings,
    )
