"""Notes on a label map's objects: their count, which are cut, and suspicious numbers."""

from collections.abc import Iterator
from math import prod

import numpy as np

from stereocell.model.counted import counted
from stereocell.model.settings import MAX_COUNT
from stereocell.planning.located_objects import (
    AROUND,
    CUT,
    Located,
    TileGrid,
    locate,
    tile_boxes,
)
from stereocell.planning.plan import Plan
from stereocell.steps.find_extents import FindExtents
from stereocell.steps.labels import Labels

_COUNTED_AT_ONCE = 1 << 25  # voxels of the largest label map that `plan` counts, in half a second
_SIDES = 6  # sides of a volume; a background touches all of them
_SIDES_OF_MOST_VOXELS = 3  # fewest sides that a background with over half of the voxels touches


def notes_on_numbers(labels: Labels, located: Located) -> Iterator[str]:
    """Yield a sentence on each suspicious number of a label map.

    Raises SourceError if the label map can't be read.
    """
    if len(located.extents.labels):
        yield from filter(None, (_background(labels, located), _merged(labels, located)))


def _background(labels: Labels, located: Located) -> str:
    """Return the note on an object that is probably the background; empty: there is none.

    It is the largest object and touches most sides of the volume.
    """
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
    """Return the note on objects that share a number in the file's data type; empty: none do."""
    dtype, largest = labels.open().dataset.stored_dtype, int(located.extents.labels[-1])
    if dtype.kind == "f":
        exact = 2 ** (np.finfo(dtype).nmant + 1)
        if largest <= exact:
            return ""
        return (
            f"{labels.name}: found numbers up to {largest} in {dtype.name}, which rounds whole "
            f"numbers beyond {exact:,}: objects with neighbouring numbers become one object; save "
            "the labels as uint32"
        )
    count = len(located.extents.labels) + located.small
    if dtype.kind == "u" and dtype.itemsize <= 2 and count == largest == np.iinfo(dtype).max:
        return (
            f"{labels.name}: all {count:,} numbers of {dtype.name} are in use: if there were more "
            "objects, several of them share a number; save the labels as uint32"
        )
    return ""


def notes_on_objects(labels: Labels, located: Located) -> Iterator[str]:
    """Yield the number of objects, and the notes on their numbers if `plan` did not count them."""
    yield describe_objects(labels, located)
    if is_large(labels):
        yield from notes_on_numbers(labels, located)


def describe_objects(labels: Labels, located: Located) -> str:
    """Return the line on how many objects there are, which are cut, and how many left out."""
    summary = counted(len(located.owners), "object")
    cut = located.extents.labels[located.owners == CUT]
    if len(cut):
        shown = ", ".join(map(str, cut[:8].tolist())) + ", ..." * (len(cut) > 8)
        summary += (
            f", {len(cut)} of them cut at tile borders, because they reach farther than half a "
            f"tile beyond their own ({shown})"
        )
    if located.small:
        summary += f"; {located.small} with too few voxels are left out (objects.smallest_voxels)"
    return f"{labels.name}: {summary}"


def is_large(labels: Labels) -> bool:
    """Return whether a label map has too many voxels for `plan` to count its objects."""
    return prod(labels.shape) > _COUNTED_AT_ONCE


def notes_before_units(plan: Plan) -> Iterator[str]:
    """Yield the note on which objects of each label map will be cut.

    Small label maps are counted; for large ones the note states the size of an object that is cut.
    Raises SourceError if the voxels are not labels.
    """
    for labels in plan.labels:
        boxes = tile_boxes(TileGrid.of(plan, labels))
        if not is_large(labels):
            parts = {tile: FindExtents(labels.voxels, box).run() for tile, box in boxes.items()}
            found = locate(plan, labels, parts, plan.settings.objects.smallest_voxels)
            yield describe_objects(labels, found)
            yield from notes_on_numbers(labels, found)
        elif len(plan.tiles) > 1:
            largest = np.max([box.shape for box in boxes.values()], axis=0) * labels.spacing_um
            z, y, x = ((1 + 2 * AROUND) * largest).tolist()
            yield (
                f"{labels.name}: objects larger than {z:.4g} x {y:.4g} x {x:.4g} um (z, y, x), the "
                "tile and what is read around it, are cut at tile borders (`units` names them)"
            )
