"""The report: one page of what a build left, in numbers, curves and pictures."""

from stereocell.report import charts, choice, facts, page, remarks, scene, slices
from stereocell.report.page import write_report

# all whose change changes the page
MODULES = (charts, choice, facts, page, remarks, scene, slices)

__all__ = ["MODULES", "write_report"]
