"""Tables made of records: metrics, photographs, faults and warnings; and of tracks, in long form."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd
import xarray as xr

from ploughval.axes import Status
from ploughval.results.catalogue import VARIABLES, Column, TableFile
from ploughval.results.meanings import BY_ROW
from ploughval.results.records import MetricsRecord, RunRecord

_METRIC = (
    ("metric", "name of the metric; its ending is its unit", ""),
    ("unit", "unit of the values", ""),
    ("experiment", "measured value", BY_ROW),
    ("experiment_std", "standard uncertainty of the measured value", BY_ROW),
    ("model", "predicted value", BY_ROW),
    ("model_std", "standard uncertainty of the predicted value", BY_ROW),
    ("error", "model less experiment", BY_ROW),
    ("validation_std", "standard uncertainty of the error", BY_ROW),
    ("agrees", "1: the error is within twice its standard uncertainty; empty: not judged", "1"),
    ("note", "what else is to be known; why a value is missing", ""),
    ("input_std", "part of model_std that the model's inputs leave", BY_ROW),
    ("numerical_std", "part of model_std that the numerics leave", BY_ROW),
    ("dominant_input", "input that leaves the most", ""),
)
_FRAME = (
    ("frame", "number of the photograph in order of time, from 0", "1"),
    ("file", "its file", ""),
    ("time_s", "time by the camera's clock", "s"),
    ("time_std_s", "standard uncertainty of the time", "s"),
    ("u_mm", "displacement of the blade", "mm"),
    ("status", "ok or lost", ""),
    ("reason", "why it was lost", ""),
    ("notes", "what else was found, joined by semicolons", ""),
)
_NOTE = (("kind", "fault or warning", ""), ("text", "what was said", ""))
_LONG = ("frame", "point", *VARIABLES)
_ALL = slice(None)


def _columns(rows: tuple[tuple[str, str, str], ...]) -> tuple[Column, ...]:
    return tuple(Column(*row) for row in rows)


def _tracked(name: str) -> Column:
    if name in VARIABLES:
        meaning = "reason code, in words" if name == "status" else VARIABLES[name].meaning
        return Column(name, meaning, "" if name == "status" else VARIABLES[name].unit)
    return Column(name, f"number of the {'photograph' if name == 'frame' else name}, from 0", "1")


METRICS = TableFile("metrics.csv", "Experiment against model.", "a metric", _columns(_METRIC))
FRAMES = TableFile("frames.csv", "What became of the photographs.", "a photograph", _columns(_FRAME))
NOTES = TableFile("notes.csv", "Faults and warnings of the run.", "a fault or a warning", _columns(_NOTE))
TRACKS = TableFile(
    "tracks.csv", "Tracked points.", "a point in a photograph", tuple(_tracked(name) for name in _LONG)
)
MADE: Mapping[str, TableFile] = MappingProxyType(
    {table.name: table for table in (METRICS, FRAMES, NOTES, TRACKS)}
)
"""Tables that no file of a result folder holds as they are, by the names that exports give them."""


def metrics_table(record: MetricsRecord | None) -> pd.DataFrame | None:
    """The metrics of metrics.json, a row each; None where there are none.

    Parameters
    ----------
    record : MetricsRecord or None
        metrics.json.

    Returns
    -------
    DataFrame or None
    """
    if record is None or not record.metrics:
        return None
    rows = [{"metric": name, **entry.model_dump()} for name, entry in record.metrics.items()]
    return _table(rows, METRICS)


def frames_table(record: RunRecord) -> pd.DataFrame | None:
    """The frame ledger of run.json; None where there are no photographs.

    Parameters
    ----------
    record : RunRecord
        run.json.

    Returns
    -------
    DataFrame or None
    """
    if not record.frames:
        return None
    rows = [{**entry.model_dump(), "notes": "; ".join(entry.notes)} for entry in record.frames]
    return _table(rows, FRAMES)


def notes_table(record: RunRecord) -> pd.DataFrame | None:
    """Faults and warnings of run.json; None where there are none.

    Parameters
    ----------
    record : RunRecord
        run.json.

    Returns
    -------
    DataFrame or None
    """
    said = [("fault", text) for text in record.faults] + [("warning", text) for text in record.warnings]
    return _table([dict(zip(("kind", "text"), row, strict=True)) for row in said], NOTES) if said else None


def tracks_table(tracks: xr.Dataset, chosen: slice = _ALL) -> pd.DataFrame:
    """Tracked points in long form, a row a point and photograph.

    Parameters
    ----------
    tracks : Dataset
        tracks.nc.
    chosen : slice
        Of the photographs: the table of all is several times as large as the tracks.

    Returns
    -------
    DataFrame
    """
    tracks = tracks.isel(frame=chosen).assign_coords(frame=tracks["frame"][chosen])
    shape = tracks.sizes["frame"], tracks.sizes["point"]
    dims = {"frame": tracks["frame"].to_numpy()[:, None], "point": np.arange(shape[1])}
    columns = {name: np.broadcast_to(values, shape).ravel() for name, values in dims.items()}
    for name, variable in VARIABLES.items():
        if name in tracks:
            values = tracks[name].to_numpy()
            across = values[:, None] if variable.dims == ("frame",) else values
            columns[name] = np.broadcast_to(across, shape).ravel()
    table = pd.DataFrame(columns)
    words = table["status"].map({int(status): status.meaning for status in Status})
    return table.assign(status=words.fillna("unknown").astype(str))


def _table(rows: list[dict[str, object]], told: TableFile) -> pd.DataFrame:
    """Rows as a table of the columns told; None becomes NaN among numbers."""
    table = pd.DataFrame(rows, columns=list(told.units))
    for column in told.columns:
        if not column.is_text:
            table[column.name] = table[column.name].astype(np.float64)
    return table
