"""Samples that come with the package: no network, the same bytes every time."""

from collections.abc import Callable
from dataclasses import dataclass

from stereocell.samples.brain_cells import write_brain_cells
from stereocell.samples.cycif import write_cycif

__all__ = ["SAMPLES", "Sample", "write_brain_cells", "write_cycif"]


@dataclass(frozen=True, slots=True)
class Sample:
    """A sample: `write(path)` leaves it at a path that ends in `suffix`."""

    write: Callable[..., None]
    suffix: str
    summary: str


SAMPLES = {
    "cycif": Sample(
        write_cycif,
        ".ome.zarr",
        "synthetic CyCIF block: nuclei, a tumour's membranes, vessels; its truth is written too",
    ),
    "brain-cells": Sample(
        write_brain_cells,
        ".ome.tif",
        "crop of a light-sheet mouse brain: labelled cells and autofluorescence (BSD-3-Clause)",
    ),
}
