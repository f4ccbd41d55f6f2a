"""The results of one test in Python: tables with units, tracks, figures, exports."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Self, overload

import pandas as pd
import xarray as xr

from ploughval.errors import DataError
from ploughval.export import Format, export_results
from ploughval.notebook.plots import Plots
from ploughval.photos import Calibration
from ploughval.results import (
    FILES,
    MADE,
    MetricsRecord,
    Results,
    RunRecord,
    TableFile,
    calibration_in,
    frames_table,
    horizontal_share,
    metrics_table,
    read_record,
    read_results,
    read_table,
    read_tracks,
    with_units,
)
from ploughval.results.reading import read_json
from ploughval.run.outcome import Outcome
from ploughval.run.results import results_of
from ploughval.run.urls import is_url

Table = pd.DataFrame | None


class TableOf:
    """A table of the result folder as an attribute, read when it is first asked for."""

    def __init__(self, name: str) -> None:
        told = FILES[name]
        self._name = name
        self.__doc__ = f"{told.about} A row is {told.row}. None where the test has none."

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type) -> Table: ...
    def __get__(self, instance: Any, owner: type) -> Any:
        """The table, a DataFrame whose ``attrs`` hold units and meanings of its columns."""
        return self if instance is None else instance.table(self._name)


class ModelTables:
    """The model's side of a test.

    Parameters
    ----------
    table : callable
        Gives a table by the name of its file.
    """

    force = TableOf("model/force.csv")
    bands = TableOf("model/bands.csv")
    layers = TableOf("model/layers.csv")
    surface = TableOf("model/surface.csv")

    def __init__(self, table: Callable[[str], Table]) -> None:
        self.table = table


@dataclass(frozen=True, repr=False)
class Result(Outcome):
    """What became of one test, with its results: read from its folder when they are first asked for.

    Each table is a DataFrame whose ``attrs`` hold ``units`` and ``long_name`` by column, or None where the
    test has none.
    """

    force = TableOf("force.csv")
    force_frames = TableOf("force_frames.csv")
    layers = TableOf("layers.csv")
    surface = TableOf("surface.csv")
    bands = TableOf("bands.csv")
    increments = TableOf("increments.csv")
    blade = TableOf("blade.csv")
    volume = TableOf("volume.csv")
    budget = TableOf("budget.csv")
    cell_calibration = TableOf("cell_calibration.csv")
    cell_models = TableOf("cell_models.csv")
    cell_quality = TableOf("cell_quality.csv")
    peaks = TableOf("peaks.csv")
    peak_pairs = TableOf("peak_pairs.csv")
    force_envelope = TableOf("force_envelope.csv")
    mobilised = TableOf("mobilised.csv")
    mobilised_curve = TableOf("mobilised_curve.csv")
    softening = TableOf("softening.csv")
    layer_distances = TableOf("layer_distances.csv")
    mound = TableOf("mound.csv")
    band_pairs = TableOf("band_pairs.csv")
    good_practice = TableOf("good_practice.csv")
    fit_force = TableOf("fit_force.csv")
    fit_profiles = TableOf("fit_profiles.csv")
    fit_landscape = TableOf("fit_landscape.csv")

    @classmethod
    def of(cls, outcome: Outcome) -> Self:
        """The outcome of a run, with access to its results.

        Parameters
        ----------
        outcome : Outcome
            As processing gives it.
        """
        return cls(**{field.name: getattr(outcome, field.name) for field in fields(Outcome)})

    @property
    def folder(self) -> Path:
        """The result folder.

        Raises
        ------
        DataError
            It is behind a URL, where nothing is read.
        """
        if is_url(self.results):
            raise DataError(
                "is behind a URL; copy the result folder to this machine and read it with load_results",
                path=str(self.results),
            )
        return Path(self.results)

    @cached_property
    def record(self) -> RunRecord:
        """run.json: versions, settings, inputs, frames."""
        return read_record(self.folder / "run.json", RunRecord) or RunRecord()

    @property
    def settings(self) -> dict[str, Any]:
        """The settings that the test was processed with, by table and key of test.toml."""
        return self.record.settings

    @cached_property
    def tracks(self) -> xr.Dataset | None:
        """Tracked points: a Dataset of dims frame and point, each variable with units and long_name."""
        return read_tracks(self.folder)

    @cached_property
    def calibration(self) -> Calibration | None:
        """What turns px into mm and back, or None."""
        return calibration_in(self.folder)

    @cached_property
    def frames(self) -> Table:
        """What became of each photograph: its file, time, displacement, and why it was lost."""
        return _told(frames_table(self.record), MADE["frames.csv"])

    @cached_property
    def metrics_table(self) -> Table:
        """The metrics, a row each: both sides, error, standard uncertainties, and whether they agree."""
        record = read_record(self.folder / "metrics.json", MetricsRecord)
        return _told(metrics_table(record), MADE["metrics.csv"])

    @cached_property
    def fit(self) -> dict[str, Any] | None:
        """fit.json: the soil fitted to the force, where ``ploughval fit`` has been run; else None."""
        return read_json(self.folder / "fit.json")

    @cached_property
    def model(self) -> ModelTables:
        """The model's side: ``force``, ``bands``, ``layers``, ``surface``."""
        return ModelTables(self.table)

    def table(self, name: str) -> Table:
        """A table by the name of its file.

        Parameters
        ----------
        name : str
            As "bands.csv" or "model/bands.csv".

        Returns
        -------
        DataFrame or None
            Read once; None where the test has none.

        Raises
        ------
        DataError
            No such table is known, or it cannot be read.
        """
        if name not in FILES:
            raise DataError(f"is no table of results; expected one of {', '.join(FILES)}", path=name)
        if name not in self._tables:
            found = _told(read_table(self.folder, name), FILES[name])
            if found is not None and name == "model/force.csv":
                found.attrs["horizontal_share"] = horizontal_share(self.settings)
            self._tables[name] = found
        return self._tables[name]

    @cached_property
    def plot(self) -> Plots:
        """The figures of the report page: ``result.plot.force()`` and others."""
        return Plots(lambda: self._results)

    def export(self, to: Format | str, out: Path | str | None = None) -> list[Path]:
        """Write the results for another program; see :func:`ploughval.export.export_results`.

        Parameters
        ----------
        to : Format or str
            netcdf, csv, mat or vtk.
        out : path-like or None
            Folder to write to; None: ``export`` in the result folder.

        Returns
        -------
        list of Path
            What was written and is to be opened.
        """
        return export_results(self.folder, to, out)

    @cached_property
    def _tables(self) -> dict[str, Table]:
        return {}

    @cached_property
    def _results(self) -> Results:
        return read_results(self.folder)

    def __repr__(self) -> str:
        state = "complete" if self.complete else "incomplete"
        return f"<Result of {self.name}: {state}, {len(self.metrics)} metrics, in {self.results}>"

    def _repr_html_(self) -> str | None:
        """The summary; None, for which a notebook shows the line of text, where nothing can be read."""
        if is_url(self.results):
            return None
        from ploughval.notebook.summary import summary

        return summary(self, self._results)


def load_results(folder: Path | str) -> Result:
    """The results of a test that has been processed.

    Parameters
    ----------
    folder : path-like
        A result folder, or a test folder that holds ``results``.

    Returns
    -------
    Result
        As :func:`ploughval.process` returned it.

    Raises
    ------
    DataError
        No results there, or a record that cannot be read.
    """
    results = results_of(Path(folder))
    run = read_record(results / "run.json", RunRecord) or RunRecord()
    metrics = read_record(results / "metrics.json", MetricsRecord) or MetricsRecord()
    page = results / "report.html"
    return Result(
        name=run.test,
        results=results,
        complete=run.complete,
        faults=run.faults,
        warnings=run.warnings,
        metrics={name: entry.model_dump() for name, entry in metrics.metrics.items()},
        steps=run.steps,
        seconds=sum(filter(None, run.timings_s.values())),
        report=page if page.is_file() else None,
    )


def _told(table: Table, told: TableFile) -> Table:
    return None if table is None else with_units(table, told)
