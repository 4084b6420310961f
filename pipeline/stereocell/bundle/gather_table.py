"""Merge the objects of all tiles into one table, with one row for an object in several tiles."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stereocell.bundle.tile_part import PackedObjects, TileChannel
from stereocell.model.object_table import Column, ObjectTable


def gather_table(
    described: tuple[list[Column], str] | None, tiles: Sequence[tuple[str, TileChannel]]
) -> ObjectTable | None:
    """Return the table of a channel's objects in all given tiles; None: there are no objects.

    described  columns without values, and the ID of the default column; None: not a label map

    The values of an object in several tiles come from the first of them.
    """
    own = {tile: channel.objects for tile, channel in tiles if channel.objects is not None}
    if described is None or not own:
        return None
    columns, default = described
    labels = {tile: np.frombuffer(one.labels, "<u8") for tile, one in own.items()}
    every = np.concatenate(list(labels.values()))
    found, first, times = np.unique(every, return_index=True, return_counts=True)
    # Rows are in the order of tiles. Objects in several tiles come last.
    order = np.lexsort((first, times > 1))
    row = np.empty(len(found), np.int32)
    row[order] = np.arange(len(found), dtype=np.int32)
    rows = {tile: row[np.searchsorted(found, one)] for tile, one in labels.items()}
    kept = first[order]
    boxes = np.concatenate([np.frombuffer(o.boxes, "<f4").reshape(-1, 6) for o in own.values()])
    return ObjectTable(
        every[kept],
        _joined_boxes(boxes, np.concatenate(list(rows.values())), len(found)),
        rows,
        tuple(replace(column, values=_values(own, column.id)[kept]) for column in columns),
        _names(own, kept),
        default,
        *_interfaces(own, found, row),
    )


def _joined_boxes(
    boxes: NDArray[np.float32], rows: NDArray[np.int32], count: int
) -> NDArray[np.float32]:
    """Return the bounding box (n, 6) of all pieces of each object: least and largest (x, y, z)."""
    joined = np.empty((count, 6), np.float32)
    joined[:, :3], joined[:, 3:] = np.inf, -np.inf
    np.fmin.at(joined[:, :3], rows, boxes[:, :3])
    np.fmax.at(joined[:, 3:], rows, boxes[:, 3:])
    return joined


def _values(own: dict[str, PackedObjects], column_id: str) -> NDArray[np.float32]:
    return np.concatenate([np.frombuffer(one.values[column_id], "<f4") for one in own.values()])


def _names(own: dict[str, PackedObjects], kept: NDArray[np.int64]) -> tuple[str, ...]:
    if not all(one.names or not one.labels for one in own.values()):
        return ()
    names = [name for one in own.values() for name in one.names]
    return tuple(names[place] for place in kept.tolist()) if names else ()


def _interfaces(
    own: dict[str, PackedObjects], found: NDArray[np.uint64], row: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Return pairs of rows (m, 2) whose objects share an interface, and its area (m,), um^2.

    Each pair occurs once. Objects in hidden tiles are left out.
    """
    pairs = np.concatenate([np.frombuffer(o.touching, "<u8") for o in own.values()]).reshape(-1, 2)
    at = np.searchsorted(found, pairs).clip(0, len(found) - 1)
    known = (found[at] == pairs).all(axis=1)
    areas = np.concatenate([np.frombuffer(o.interface_um2, "<f4") for o in own.values()])
    interfaces, first = np.unique(np.sort(row[at[known]], axis=1), axis=0, return_index=True)
    return interfaces.astype(np.int32), areas[known][first]
