"""Load-cell logs to force, line of action and their uncertainties."""

from ploughval.loadcells.force import ForceResult, measure_force
from ploughval.loadcells.log import Log, read_log

__all__ = ["ForceResult", "Log", "measure_force", "read_log"]
