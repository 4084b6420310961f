"""Notes on the numbers of a label map's objects: a background among them, numbers that merged."""

from collections.abc import Iterator
from math import prod

import numpy as np

from stereocell.building.label_maps import Labels
from stereocell.building.located_objects import Located
from stereocell.model.settings import MAX_COUNT


def notes_on_numbers(labels: Labels, located: Located) -> Iterator[str]:
    """Yield a sentence on each doubt about a label map's numbers. Raises SourceError."""
    if len(located.extents.labels):
        yield from filter(None, (_background(labels, located), _merged(labels, located)))


def _background(labels: Labels, located: Located) -> str:
    """Return the note on a largest object that touches all six sides; empty: there is none."""
    extents = located.extents
    largest = int(np.argmax(extents.voxels))
    start = [int(edges[0]) for edges in located.grid.edges]
    stop = [int(edges[-1]) for edges in located.grid.edges]
    is_inside = (extents.low[largest] > start) | (extents.high[largest] < stop)
    if is_inside.any():
        return ""
    number = int(extents.labels[largest])
    region = prod(high - low for low, high in zip(start, stop, strict=True))
    share = int(extents.voxels[largest]) / region
    remedy = f"--background {number}" if number <= MAX_COUNT else "the number 0 in its place"
    return (
        f"{labels.name}: object {number}, the largest, has {share:.1%} of the voxels and touches "
        f"all six sides: it is probably the background; {remedy} leaves it out"
    )


def _merged(labels: Labels, located: Located) -> str:
    """Return the note on numbers that the file's type can't tell apart; empty: it can."""
    dtype, largest = labels.open().dataset.stored_dtype, int(located.extents.labels[-1])
    if dtype.kind == "f":
        exact = 2 ** (np.finfo(dtype).nmant + 1)
        if largest <= exact:
            return ""
        return (
            f"{labels.name}: found numbers up to {largest} in {dtype.name}, which rounds whole "
            f"numbers beyond {exact:,}: objects with neighbouring numbers are one object there; "
            f"save the labels as uint32"
        )
    count = len(located.extents.labels) + located.small
    if dtype.kind == "u" and dtype.itemsize <= 2 and count == largest == np.iinfo(dtype).max:
        return (
            f"{labels.name}: all {count:,} numbers of {dtype.name} are in use: if there were more "
            "objects, several of them share a number; save the labels as uint32"
        )
    return ""
