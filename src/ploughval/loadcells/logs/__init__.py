"""Logs of the load cells: text tables and TDMS of any dialect to one table with its faults named."""

from ploughval.loadcells.logs.files import log_paths, read_cell_log
from ploughval.loadcells.logs.log import Log, read_log

__all__ = ["Log", "log_paths", "read_cell_log", "read_log"]
