"""Model against experiment: force peaks, shear bands, layers, and error against uncertainty."""

from ploughval.compare.comparison import Comparison, compare_test, metrics_mapping
from ploughval.compare.validation import Metric

__all__ = ["Comparison", "Metric", "compare_test", "metrics_mapping"]
