"""Samples that come with the package. They need no network and have the same bytes every time."""

from stereocell.samples.brain_cells import write_brain_cells
from stereocell.samples.cells import write_cells
from stereocell.samples.cycif import write_cycif
from stereocell.samples.head_dicom import write_head

__all__ = ["write_brain_cells", "write_cells", "write_cycif", "write_head"]
