"""How the numbers came about: blade, frames, settings, provenance."""

from typing import Any

import pandas as pd

from ploughval.report.blocks import Cell, Chapter, Drawing, Pen, Table, value_cell
from ploughval.report.figures import blade_figure, noise_figure, volume_figure
from ploughval.report.results import FrameEntry, NoiseEntry, Results
from ploughval.report.text import number

SAME_MM = 1e-9
MISFIT = 3.0  # distances of the noise from a straight line, in their standard uncertainties


def quality_chapter(results: Results, pen: Pen) -> Chapter | None:
    """Faults, blade and the frame ledger."""
    run = results.run
    drawings, tables = [], []
    if results.blade is not None and _tells(results.blade):
        drawings.append(
            pen.draw(
                blade_figure(results.blade),
                "Blade position seen in the photographs minus the displacement used, against displacement.",
                "Blade seen in the photographs against the displacement used: a slope would be a wrong "
                "scale, an offset a wrong clock.",
                name="blade-position",
                data=("blade.csv",),
            )
        )
    if results.volume is not None and results.volume["ratio"].notna().any():
        middle = float(results.volume["ratio"].median())
        drawings.append(
            pen.draw(
                volume_figure(results.volume),
                f"Area of the heap over the area swept by the blade; the median is {number(middle, 3)}.",
                "Area of the heap ahead of the blade over the area that the blade has swept, with twice its "
                "standard deviation: a check of scale, tip and surface. Above 1: sand has loosened.",
                name="heap-area",
                data=("volume.csv",),
            )
        )
    if run.noise is not None and run.noise.grey:
        drawings.append(_noise(run.noise, pen))
    lost = [entry for entry in run.frames if not entry.used]
    if lost:
        tables.append(_ledger("Photographs that were lost", lost, folded=False))
    if run.frames:
        tables.append(_ledger("All photographs", list(run.frames), folded=True))
    notes = [text for text in run.warnings if text not in run.faults]
    if not (drawings or tables or notes or run.faults):
        return None
    return Chapter("quality", "Quality", drawings=drawings, tables=tables, notes=notes, faults=run.faults)


def _tells(blade: pd.DataFrame) -> bool:
    """Whether the blade seen says something of the displacement used: not where the one is the other."""
    apart = (blade["blade_x_mm"] - blade["u_mm"]).abs()
    return bool(apart.max() > SAME_MM)


def _noise(entry: NoiseEntry, pen: Pen) -> Drawing:
    """Noise against grey level, in words as well."""
    level, grey = number(entry.std_at_mean_grey, 3), number(entry.mean_grey, 3)
    said = f"{level} grey levels at the sand's mean grey of {grey}"
    bent = ""
    if entry.misfit is not None and entry.misfit > MISFIT:
        bent = " It does not follow the line: the picture was compressed, or its grey is not linear in light."
    return pen.draw(
        noise_figure(entry.grey, entry.std, entry.std_std, gain=entry.gain, floor=entry.floor),
        f"Noise of the camera against grey level: {said}.",
        f"Noise of one photograph from the difference of the first two, in sand that stays: {said}. Dashed: "
        f"variance in proportion to light, and a floor.{bent} Standard deviations of displacements follow "
        "the residuals of their own subset, and with them the noise at its grey.",
        name="camera-noise",
        data=("run.json",),
    )


def _ledger(caption: str, frames: list[FrameEntry], *, folded: bool) -> Table:
    rows = [
        [
            Cell(str(f.frame), f.frame),
            Cell(f.file),
            value_cell(f.time_s, 6),
            value_cell(f.u_mm),
            Cell(f.status.replace("_", " "), mark="" if f.used else "differs"),
            Cell("; ".join([*([f.reason] if f.reason else []), *f.notes])),
        ]
        for f in frames
    ]
    return Table(
        caption, ("Frame", "File", "Time, s", "u, mm", "Status", "Reason and notes"), rows, folded=folded
    )


def provenance_chapter(results: Results) -> Chapter | None:
    """Settings, versions, hashes, timings: folded, for those who repeat the run."""
    run = results.run
    tables = []
    if run.settings:
        rows = [[Cell(key), _setting(value)] for key, value in flatten(run.settings)]
        tables.append(Table("Settings", ("Key", "Value"), rows, folded=True))
    if run.timings_s:
        total = sum(value or 0.0 for value in run.timings_s.values())
        rows = [[Cell(step), value_cell(value, 3)] for step, value in run.timings_s.items()]
        rows.append([Cell("all steps"), value_cell(float(total), 3)])
        tables.append(Table("Timings", ("Step", "Time, s"), rows, folded=True))
    for caption, pairs in (("Versions", run.versions), ("Inputs (SHA-256)", run.inputs)):
        if pairs:
            rows = [[Cell(key), Cell(value)] for key, value in pairs.items()]
            tables.append(Table(caption, ("Name", "Value"), rows, folded=True))
    if not tables:
        return None
    lead = f"ploughval {run.ploughval}" if run.ploughval else ""
    if run.settings_hash:
        lead += f", settings {run.settings_hash[:12]}"
    return Chapter("provenance", "Settings and provenance", lead=lead.strip(", "), tables=tables)


def flatten(settings: dict[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    """Nested settings as dotted keys in their order.

    >>> flatten({"blade": {"depth_mm": 30.0}, "box": {}})
    [('blade.depth_mm', 30.0)]
    """
    flat: list[tuple[str, Any]] = []
    for key, value in settings.items():
        if isinstance(value, dict):
            flat += flatten(value, f"{prefix}{key}.")
        else:
            flat.append((f"{prefix}{key}", value))
    return flat


def _setting(value: Any) -> Cell:
    if isinstance(value, list | tuple):
        return Cell(", ".join(str(item) for item in value) or "none")
    if value is None:
        return Cell("not given")
    if isinstance(value, bool | str):
        return Cell(str(value).lower() if isinstance(value, bool) else value)
    return Cell(f"{value:g}", value) if isinstance(value, int | float) else Cell(str(value))
