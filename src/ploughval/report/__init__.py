"""Figures and the page: reads the files of result folders, writes one self-contained file."""

from ploughval.report.page import write_report
from ploughval.report.preview import write_preview

__all__ = ["write_preview", "write_report"]
