"""Which frames the player shows, with the travel of each and why one is empty."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from ploughval.results import Results


@dataclass(frozen=True, slots=True)
class Moment:
    """A frame of the player.

    Attributes
    ----------
    frame : int
        Number of the photograph, or of the model's row where there are no photographs.
    u_mm, blade_mm : float, mm
        Displacement of the blade, and its face as seen in the photograph; NaN where not known.
    file, reason, note : str
        The photograph, why it was lost, and what else the ledger says of it.
    """

    frame: int
    u_mm: float
    blade_mm: float
    file: str = ""
    reason: str = ""
    note: str = ""


def moments(results: Results) -> list[Moment]:
    """All frames that have a photograph or a line, in their order."""
    ledger = {entry.frame: entry for entry in results.run.frames}
    u = _displacements(results)
    numbers = sorted({*ledger, *u})
    face = _column(results.blade, "blade_x_mm")
    found = []
    for number in numbers:
        entry = ledger.get(number)
        travel = u.get(number, float("nan"))
        if entry is not None and entry.u_mm is not None:
            travel = entry.u_mm
        reason = "" if entry is None or entry.used else entry.reason or entry.status
        name, notes = (entry.file, entry.notes) if entry is not None else ("", ())
        blade = face.get(number, float("nan"))
        found.append(Moment(number, travel, blade, name, reason, "; ".join(notes)))
    return found


def spread(travel: list[float], most: int) -> list[int]:
    """Places of at most so many frames at even steps of travel, first and last among them.

    Frames without travel count as half-way between their neighbours.

    >>> spread([0.0, 1.0, 2.0, 3.0, 10.0], 3)
    [0, 3, 4]
    """
    if len(travel) <= most:
        return list(range(len(travel)))
    u = pd.Series(travel, dtype=float).interpolate(limit_direction="both").fillna(0.0).to_numpy()
    if u.max() <= u.min():
        u = np.arange(len(u), dtype=float)
    wanted = np.linspace(u.min(), u.max(), most)[1:-1]
    nearest = {int(np.abs(u - place).argmin()) for place in wanted} | {0, len(u) - 1}
    return sorted(nearest)


def _displacements(results: Results) -> dict[int, float]:
    """Travel by frame number, from every table that has it."""
    tables = (results.layers, results.model_layers, results.surface, results.blade)
    known: dict[int, float] = {}
    for table in tables:
        for frame, u in _column(table, "u_mm").items():
            known.setdefault(frame, u)
    if results.tracks is not None:
        rows = results.tracks["frame"].to_numpy()
        for frame, u in zip(rows.tolist(), results.tracks["u_mm"].to_numpy().tolist(), strict=True):
            known.setdefault(int(frame), float(u))
    return known


def _column(table: pd.DataFrame | None, name: str) -> dict[int, float]:
    """First finite value of a column by frame."""
    if table is None or name not in table:
        return {}
    good = table[np.isfinite(table["frame"]) & np.isfinite(table[name])].drop_duplicates("frame")
    return dict(zip(good["frame"].astype(int).tolist(), good[name].astype(float).tolist(), strict=True))
