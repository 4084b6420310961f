"""The report: one page of what a build left, in numbers, curves and pictures."""

from stereocell.report.page import TEMPLATE, write_report
from stereocell.report.phase import run_report

__all__ = ["TEMPLATE", "run_report", "write_report"]
