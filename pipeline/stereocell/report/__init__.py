"""The report: one page of what a build left, in numbers, curves and pictures."""

from stereocell.report import charts, choice, draw_meshes, facts, page, remarks, scene, slices
from stereocell.report.page import TEMPLATE, write_report

# all whose change changes the page
MODULES = (charts, choice, draw_meshes, facts, page, remarks, scene, slices)

__all__ = ["MODULES", "TEMPLATE", "write_report"]
