"""What the player's script reads, as one mapping that JSON can hold."""

import base64
import math
from collections.abc import Sequence
from typing import Any

import pandas as pd

from ploughval.report.player.dots import Dots
from ploughval.report.player.frames import Moment
from ploughval.report.player.history import Curve, curve, envelope_of, values_at
from ploughval.report.player.lines import FrameLines, Lines
from ploughval.report.player.pictures import Pictures
from ploughval.report.stages import view
from ploughval.results import Results


def player_data(
    results: Results,
    shown: Sequence[Moment],
    lines: Lines,
    pictures: Pictures | None,
    dots: Dots | None,
    names: tuple[str, ...],
) -> dict[str, Any]:
    """What the script reads; ``templates/player_data.js`` names each entry.

    Parameters
    ----------
    results : Results
        The files of a run.
    shown : sequence of Moment
        Frames of the player.
    lines, pictures, dots : Lines, Pictures or None, Dots or None
        What there is of these frames.
    names : tuple of str
        Panels from the top.

    Returns
    -------
    dict
        Numbers in mm, N and degrees; None is a value that is not known.
    """
    values = values_at(results, shown)
    frames = []
    for k, moment in enumerate(shown):
        v, line = values[k], lines.frames[k]
        entry = {
            "n": moment.frame, "u": _known(moment.u_mm, 4), "x": _known(moment.blade_mm, 3),
            "why": moment.reason, "P": _known(v.force_N, 4), "s": _known(v.force_std_N, 4),
            "Q": _known(v.model_N, 4), "b": _known(v.beta_deg, 2), "bs": _known(v.beta_std_deg, 2),
            "c": _known(v.model_beta_deg, 2), "i": _known(v.band, 0), "j": _known(v.model_band, 0),
        }  # fmt: skip
        if moment.note:
            entry["note"] = moment.note
        frames.append(entry | _packed(line) | _dots_of(dots, k) | _picture_of(pictures, moment))
    tags = [[source, height] for source, height in lines.layers]
    return {
        "view": [round(side, 4) for side in view(results)], "panels": list(names),
        "depth": results.depth_mm, "thickness": results.thickness_mm, "P0": results.P0_N,
        "tolerance": lines.tolerance_mm, "tags": tags, "frames": frames,
        "pictures": None if pictures is None else {
            "kind": pictures.kind, "extent": [round(side, 4) for side in pictures.extent],
        },
        "dots": None if dots is None else {
            "start": list(dots.start), "quantum": dots.quantum_mm, "motion": dots.motion_top,
            "shear": dots.shear_top, "gauge": round(dots.gauge_mm, 2),
        },
        "force": _force(results),
    }  # fmt: skip


def _packed(line: FrameLines) -> dict[str, Any]:
    texts = {"L": line.layers, "M": line.model_layers, "S": line.surface, "T": line.model_surface}
    ends = {"B": line.band_mm, "C": line.model_band_mm}
    known: dict[str, Any] = {key: text for key, text in texts.items() if text}
    return known | {key: end.round(3).tolist() for key, end in ends.items() if len(end)}


def _dots_of(dots: Dots | None, k: int) -> dict[str, str]:
    if dots is None or not dots.frames[k].places:
        return {}
    one = dots.frames[k]
    return {"d": one.places, "m": one.motion, "g": one.shear}


def _picture_of(pictures: Pictures | None, moment: Moment) -> dict[str, str]:
    if pictures is None or moment.frame not in pictures.data:
        return {}
    return {"p": base64.b64encode(pictures.data[moment.frame]).decode("ascii")}


def _force(results: Results) -> dict[str, Any] | None:
    """Curves and marks of the chart, None without a force."""
    measured, model, envelope = results.force, results.model_force, envelope_of(results)
    if measured is None and model is None:
        return None
    return {
        "measured": None if measured is None else _curve(curve(measured, ("force_N", "force_std_N"))),
        "model": None if model is None else _curve(curve(model, ("force_N",))),
        "envelope": None if envelope is None else _curve(curve(envelope, ("low_N", "high_N"))),
        "peaks": _peaks(results.peaks),
        "starts": _starts(results.bands),
        "modelStarts": _starts(results.model_bands),
    }


def _curve(made: Curve) -> dict[str, Any]:
    return {"steps": made.steps, "columns": made.columns, "t": made.text}


def _peaks(peaks: pd.DataFrame | None) -> list[list[float]]:
    """Of each peak 1 where it is the model's, else 0, then u in mm and force in N."""
    if peaks is None:
        return []
    drawn = peaks.loc[peaks["kind"] == "peak", ["source", "u_mm", "force_N"]]
    return [
        [int(source == "model"), round(u, 3), round(force, 4)]
        for source, u, force in drawn.itertuples(index=False)
        if math.isfinite(u) and math.isfinite(force)
    ]


def _starts(bands: pd.DataFrame | None) -> list[float]:
    """Travel at which bands start, mm."""
    return [] if bands is None else [round(u, 3) for u in bands["u_start_mm"].tolist() if math.isfinite(u)]


def _known(value: float, digits: int) -> float | None:
    return round(float(value), digits) if math.isfinite(value) else None
