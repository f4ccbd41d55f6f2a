"""The page of several tests, and the numbers behind it as files."""

from ploughval.report.several.context import several_context
from ploughval.report.several.files import write_numbers
from ploughval.report.several.findings import SeveralFindings, find_several

__all__ = ["SeveralFindings", "find_several", "several_context", "write_numbers"]
