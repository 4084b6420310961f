"""Write the table of a label map's objects, as schemas/objects.schema.json describes it.

    objects.json        the columns, and the rows of each tile
    objects/            raw arrays: labels, boxes, and two files per column

The viewer colours objects by one column at a time. So each column is a file with one byte per
object: to recolour 20 000 objects, the viewer loads 20 kB. A second file has the exact values. The
viewer loads them in ranges of ROWS, so it need not load whole columns to show one object's values.

Bytes 1 to 255 span the 0.1th to the 99.9th percentile, so that one extreme value does not make all
others equal. Their scale is linear or logarithmic. It is logarithmic if three conditions hold:

- all values are positive
- the span's upper end is at least ten times its lower end
- the median is nearer to the middle of the span on the logarithmic scale than on the linear one

Means of markers are typical logarithmic columns. Shapes and positions are linear.
"""

from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.bundle.tile_part import FileRef, write_file
from stereocell.model.object_table import MISSING, Column, ObjectTable
from stereocell.storage.json_files import compact_json

OBJECTS = "objects.json"
ROWS = 4096  # rows in a range of exact values, which has 16 kB
_SPAN = (0.1, 99.9)  # percentiles of the values that bytes 1 and 255 stand for
_LOG_FROM = 10.0  # smallest ratio of the span's ends for a logarithmic scale


def write_objects(
    root: Path, folder: str, table: ObjectTable, *, paint: str = ""
) -> tuple[FileRef, list[FileRef]]:
    """Write a channel's table below `folder` of a bundle; return objects.json, and all files.

    paint  ID of the channel whose intensity colours the vertices; empty: none

    Raises OutputError.
    """
    files: list[FileRef] = []

    def write(name: str, values: NDArray[Any]) -> dict[str, Any]:
        files.append(write_file(root, f"{folder}/objects/{name}", values.tobytes()))
        return asdict(files[-1])

    count = len(table.labels)
    is_wide = count > 0 and int(table.labels.max()) > np.iinfo(np.uint32).max
    content: dict[str, Any] = {
        "count": count,
        "labels": write("labels.bin", table.labels.astype("<u8" if is_wide else "<u4")),
        "label_bytes": 8 if is_wide else 4,
        "names": list(table.names),
        "boxes": write("boxes.bin", table.boxes.astype("<f4")),
        "default": table.default,
        "tiles": {tile: _compact(rows) for tile, rows in table.rows.items()},
        "columns": [],
    }
    if paint:
        content["paint"] = paint
    for i, column in enumerate(table.columns):
        data, entry = _describe(column)
        # The column's number keeps file names apart on disks that ignore case, since the IDs of
        # columns may differ only by case.
        entry["bytes"] = write(f"{i}_{column.id}.u8", data)
        values = column.values.astype("<f4")
        entry["exact"] = write(f"{i}_{column.id}.f32", values)
        if count > ROWS:
            entry["parts"] = hash_parts(values.tobytes())
        content["columns"].append(entry)
    if table.interfaces is not None:
        first, rows, order = _neighbours(table.interfaces, count)
        content["neighbours"] = {
            "first": write("neighbours_first.bin", first),
            "rows": write("neighbours.bin", rows),
        }
        if table.interface_um2 is not None and not np.isnan(table.interface_um2).any():
            areas = np.tile(table.interface_um2, 2)[order].astype("<f4")
            content["neighbours"]["area_um2"] = write("neighbours_um2.f32", areas)
    index = write_file(root, f"{folder}/{OBJECTS}", compact_json(content))
    return index, [index, *files]


def hash_parts(data: bytes) -> list[str]:
    """Return the SHA-256 of each range of ROWS exact values in a column's float32 bytes."""
    size = ROWS * np.dtype("<f4").itemsize
    return [sha256(data[at : at + size]).hexdigest() for at in range(0, len(data), size)]


def _compact(rows: NDArray[np.int32]) -> dict[str, Any]:
    """Describe row numbers: a run of consecutive ones from the first on, and a list of the rest."""
    if len(rows) == 0:
        return {"first": 0, "count": 0}
    is_next = rows == rows[0] + np.arange(len(rows))
    count = len(rows) if is_next.all() else int(np.argmin(is_next))
    more = rows[count:].tolist()
    return {"first": int(rows[0]), "count": count, **({"more": more} if more else {})}


def _describe(column: Column) -> tuple[NDArray[np.uint8], dict[str, Any]]:
    """Return a column's bytes, and its entry without the references to files."""
    entry: dict[str, Any] = {
        "id": column.id,
        "name": column.name,
        "about": column.about,
        "unit": column.unit,
        "kind": "category" if column.categories else "number",
    }
    if column.categories:
        codes = np.nan_to_num(column.values, nan=MISSING).astype(np.int64)
        entry["categories"] = list(column.categories)
        entry["colors"] = [list(color) for color in column.colors]
        data = (np.clip(codes, MISSING, 254) + 1).astype(np.uint8)
    else:
        data, span = _quantize(column.values)
        if span is not None:
            entry["range"] = span
    return data, {**entry, "known": int(np.count_nonzero(data))}


def _quantize(values: NDArray[np.float32]) -> tuple[NDArray[np.uint8], dict[str, Any] | None]:
    """Quantize numbers to bytes (0: missing), and describe their range; None: all are missing."""
    data = np.zeros(len(values), dtype=np.uint8)
    is_known = np.isfinite(values)
    known = values[is_known].astype(np.float64)
    if len(known) == 0:
        return data, None
    low, middle, high = (float(v) for v in np.percentile(known, [_SPAN[0], 50, _SPAN[1]]))
    is_log = bool(
        known.min() > 0
        and high >= _LOG_FROM * low
        and abs(np.log(middle / low) / np.log(high / low) - 0.5)
        < abs((middle - low) / (high - low) - 0.5)
    )
    at, start, end = (np.log(known), np.log(low), np.log(high)) if is_log else (known, low, high)
    share = np.clip((at - start) / (end - start), 0, 1) if end > start else np.zeros_like(at)
    data[is_known] = np.rint(1 + 254 * share).astype(np.uint8)
    scale = "log" if is_log else "linear"
    span = {"min": float(known.min()), "max": float(known.max()), "low": low, "high": high}
    return data, {**span, "scale": scale}


def _neighbours(
    interfaces: NDArray[np.int32], count: int
) -> tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.int64]]:
    """Return, as a flat list, the rows of the objects that touch each row's object.

    Returns the index of each row's first neighbour (count + 1,), all neighbours (2 m,), ascending
    within a row, and an order (2 m,). The order sorts two copies of the interfaces, one after the
    other, in the same way as the neighbours.
    """
    both = np.concatenate([interfaces, interfaces[:, ::-1]])
    order = np.lexsort((both[:, 1], both[:, 0]))
    both = both[order]
    first = np.zeros(count + 1, dtype="<u4")
    first[1:] = np.cumsum(np.bincount(both[:, 0], minlength=count))
    return first, both[:, 1].astype("<u4"), order
