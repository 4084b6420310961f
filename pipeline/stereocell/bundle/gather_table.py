"""Put the objects of all tiles together as one table: an object cut into pieces has one row."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stereocell.bundle.tile_part import PackedObjects, TileChannel
from stereocell.model.object_table import Column, ObjectTable


def gather_table(
    described: tuple[list[Column], str] | None, tiles: Sequence[tuple[str, TileChannel]]
) -> ObjectTable | None:
    """Return the table of a channel's objects in all tiles that are shown; None: it has none.

    described  its columns without values, and the one that colours first; None: it is no label map

    An object in several tiles has its values from the first one.
    """
    own = {tile: channel.objects for tile, channel in tiles if channel.objects is not None}
    if described is None or not own:
        return None
    columns, default = described
    labels = {tile: np.frombuffer(one.labels, "<u8") for tile, one in own.items()}
    every = np.concatenate(list(labels.values()))
    found, first, times = np.unique(every, return_index=True, return_counts=True)
    # by the tiles' order, those in several tiles last
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
        *_walls(own, found, row),
    )


def _joined_boxes(
    boxes: NDArray[np.float32], rows: NDArray[np.int32], count: int
) -> NDArray[np.float32]:
    """Return the box around all pieces of each object (n, 6)."""
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


def _walls(
    own: dict[str, PackedObjects], found: NDArray[np.uint64], row: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Return the rows of objects that share a wall, each pair once, and the walls' areas, um^2.

    Hidden tiles' are left out.
    """
    pairs = np.concatenate([np.frombuffer(o.touching, "<u8") for o in own.values()]).reshape(-1, 2)
    at = np.searchsorted(found, pairs).clip(0, len(found) - 1)
    known = (found[at] == pairs).all(axis=1)
    areas = np.concatenate([np.frombuffer(o.wall_um2, "<f4") for o in own.values()])
    walls, first = np.unique(np.sort(row[at[known]], axis=1), axis=0, return_index=True)
    return walls.astype(np.int32), areas[known][first]
