"""Several tests together: which repeat each other, how they scatter, what depth does, and the mean error."""

from ploughval.compare.several.depth import Trend, depth_trends
from ploughval.compare.several.errors import MeanError, mean_errors
from ploughval.compare.several.groups import Group, Grouping, group_tests
from ploughval.compare.several.histories import MeanHistory, mean_history
from ploughval.compare.several.pooling import Pooled, pool
from ploughval.compare.several.record import Record, Value
from ploughval.compare.several.repeats import LevelsTogether, Repeat, levels_together, repeats_of
from ploughval.compare.several.straight import Line, fit_line

__all__ = [
    "Group",
    "Grouping",
    "LevelsTogether",
    "Line",
    "MeanError",
    "MeanHistory",
    "Pooled",
    "Record",
    "Repeat",
    "Trend",
    "Value",
    "depth_trends",
    "fit_line",
    "group_tests",
    "levels_together",
    "mean_errors",
    "mean_history",
    "pool",
    "repeats_of",
]
