"""The report: one page about a build, with numbers, curves and pictures."""

from stereocell.report.page import TEMPLATE, write_report

__all__ = ["TEMPLATE", "write_report"]
