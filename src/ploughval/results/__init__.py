"""The files of a result folder: what they are called, what their columns mean, and how they are read.

The one reader of result folders: report, exports and what Python users hold read through it.
"""

from ploughval.results.catalogue import FILES, VARIABLES, Column, TableFile, Variable
from ploughval.results.datasets import table_dataset
from ploughval.results.folder import Results, calibration_in, horizontal_share, read_results, with_files
from ploughval.results.made import MADE, frames_table, metrics_table, notes_table, tracks_table
from ploughval.results.reading import read_record, read_table, read_tracks
from ploughval.results.records import (
    CalibrationEntry,
    FrameEntry,
    LoadCellEntry,
    MetricEntry,
    MetricsRecord,
    NoiseEntry,
    Number,
    RunRecord,
    Text,
)
from ploughval.results.units import with_units

__all__ = [
    "FILES",
    "MADE",
    "VARIABLES",
    "CalibrationEntry",
    "Column",
    "FrameEntry",
    "LoadCellEntry",
    "MetricEntry",
    "MetricsRecord",
    "NoiseEntry",
    "Number",
    "Results",
    "RunRecord",
    "TableFile",
    "Text",
    "Variable",
    "calibration_in",
    "frames_table",
    "horizontal_share",
    "metrics_table",
    "notes_table",
    "read_record",
    "read_results",
    "read_table",
    "read_tracks",
    "table_dataset",
    "tracks_table",
    "with_files",
    "with_units",
]
