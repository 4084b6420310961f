"""The report: one page of what a build left, in numbers, curves and pictures."""

from stereocell.report.page import TEMPLATE, write_report

__all__ = ["TEMPLATE", "write_report"]
