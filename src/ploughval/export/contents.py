"""What an export holds: every table of a result folder with its columns explained, tracks, and texts."""

import json
import re
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import xarray as xr

from ploughval.axes import WORLD
from ploughval.results import (
    FILES,
    MADE,
    MetricsRecord,
    RunRecord,
    TableFile,
    frames_table,
    horizontal_share,
    metrics_table,
    notes_table,
    read_record,
    read_table,
    read_tracks,
    with_units,
)
from ploughval.results.reading import read_json

_DOCUMENTS = ("calibration", "fit")  # JSON files that no table stands for


@dataclass(frozen=True, slots=True)
class Part:
    """A table with what is known of it; ``table.attrs`` has units and meanings."""

    told: TableFile
    table: pd.DataFrame


@dataclass(frozen=True, slots=True)
class Contents:
    """All of one result folder.

    Attributes
    ----------
    name : str
        Of the test.
    texts : dict of str to str
        title, source (program and version), axes, settings_hash; settings, calibration and fit as JSON,
        where the test has them.
    parts : tuple of Part
        The tables that are there, in the order of the catalogue; then metrics, frames and notes.
    tracks : Dataset or None
        Tracked points.
    horizontal_share : float
        What load cells measure of the model's force P.
    """

    name: str
    texts: dict[str, str]
    parts: tuple[Part, ...]
    tracks: xr.Dataset | None
    horizontal_share: float

    @property
    def stem(self) -> str:
        """The name as that of a file."""
        return re.sub(r"[^\w.-]+", "-", self.name).strip("-.") or "results"


def read_contents(folder: Path) -> Contents:
    """Read a result folder whole.

    Parameters
    ----------
    folder : Path
        With a run.json, which says that it is whole.

    Raises
    ------
    DataError
        A file that cannot be read.
    """
    run = read_record(folder / "run.json", RunRecord) or RunRecord()
    tables = {told: read_table(folder, name) for name, told in FILES.items()}
    tables |= {
        MADE["metrics.csv"]: metrics_table(read_record(folder / "metrics.json", MetricsRecord)),
        MADE["frames.csv"]: frames_table(run),
        MADE["notes.csv"]: notes_table(run),
    }
    return Contents(
        name=run.test or folder.resolve().name,
        texts=_texts(folder, run),
        parts=tuple(
            Part(told, with_units(table, told)) for told, table in tables.items() if table is not None
        ),
        tracks=read_tracks(folder),
        horizontal_share=horizontal_share(run.settings),
    )


def _texts(folder: Path, run: RunRecord) -> dict[str, str]:
    texts = {
        "title": run.test,
        "source": f"ploughval {run.ploughval}".strip(),
        "axes": WORLD,
        "settings": json.dumps(run.settings, sort_keys=True),
        "settings_hash": run.settings_hash,
    }
    for name in _DOCUMENTS:
        found = read_json(folder / f"{name}.json")
        if found is not None:
            texts[name] = json.dumps(found, sort_keys=True)
    return texts
