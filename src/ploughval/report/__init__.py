"""Figures and the page: from the files of result folders, one self-contained file, or the figures alone."""

from ploughval.report.figure_files import write_figures
from ploughval.report.page import write_report, write_single
from ploughval.report.preview import write_preview

__all__ = ["write_figures", "write_preview", "write_report", "write_single"]
