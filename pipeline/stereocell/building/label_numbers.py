"""Notes on the numbers of a label map's objects: a background among them, numbers that merged."""

from collections.abc import Iterator
from math import prod

import numpy as np

from stereocell.building.label_maps import Labels
from stereocell.building.located_objects import Located
from stereocell.model.settings import MAX_COUNT

_SIDES = 6  # sides of a volume, all of which a background touches
_SIDES_OF_MOST_VOXELS = 3  # at least that many, where it has over half of the voxels


def notes_on_numbers(labels: Labels, located: Located) -> Iterator[str]:
    """Yield a sentence on each doubt about a label map's numbers. Raises SourceError."""
    if len(located.extents.labels):
        yield from filter(None, (_background(labels, located), _merged(labels, located)))


def _background(labels: Labels, located: Located) -> str:
    """Return the note on a largest object that touches most sides; empty: there is none."""
    extents = located.extents
    largest = int(np.argmax(extents.voxels))
    start = [int(edges[0]) for edges in located.grid.edges]
    stop = [int(edges[-1]) for edges in located.grid.edges]
    sides = int((extents.low[largest] <= start).sum() + (extents.high[largest] >= stop).sum())
    region = prod(high - low for low, high in zip(start, stop, strict=True))
    share = int(extents.voxels[largest]) / region
    if sides < (_SIDES_OF_MOST_VOXELS if share > 0.5 else _SIDES):
        return ""
    number = int(extents.labels[largest])
    remedy = f"--background {number}" if number <= MAX_COUNT else "the number 0 in its place"
    touched = "all six" if sides == _SIDES else f"{sides} of six"
    return (
        f"{labels.name}: object {number}, the largest, has {share:.1%} of the voxels and touches "
        f"{touched} sides: it is probably the background; {remedy} leaves it out"
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
