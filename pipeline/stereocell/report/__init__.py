"""The report: one page about a build, with numbers, curves and pictures."""
