"""The grids of an OpenVDB file: their leaves, trees, metadata and transforms, as bytes.

vdb.py describes the layout.
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels import vdb_leaves
from stereocell.kernels.vdb_leaves import LEAF, VOXELS, cut_leaves

TREE = "Tree_float_5_4_3"
ZIP, ACTIVE_MASK, BLOSC = 1, 2, 4
ONLY_ACTIVE_VALUES = bytes([vdb_leaves.ONLY_ACTIVE_VALUES])
NODE4, NODE5 = 16, 32  # children along an edge of a node: leaves, nodes of leaves
_HALF = (np.arange(256, dtype=np.float32) / 255).astype("<f2")
# Types of voxels for which the kernel is compiled; others are converted
_TYPES = {np.dtype(name) for name in ("u1", "u2", "i2", "f4")}


@dataclass(frozen=True, slots=True)
class Grid:
    """A grid of an OpenVDB file that is to be written.

    voxels  (z, y, x), the grid's numbers, y upwards; uint8 if `is_half`
    first   index (i, j, k), along x, y and z, of the first voxel
    """

    name: str
    voxels: NDArray[Any]
    first: tuple[int, int, int]
    background: Any
    is_half: bool


@dataclass(frozen=True, slots=True)
class Leaves:
    """The leaves of a grid that are not empty, in the order of the tree.

    origins  int64 (n, 3), index (x, y, z) of each leaf, in leaves
    masks    uint8 (n, 64), a bit for each voxel: 1 if it is active
    ends     for each leaf, the number of active values up to its end
    values   (k,), active values of all leaves: half floats if the grid `is_half`, or float32
    """

    origins: NDArray[np.int64]
    masks: NDArray[np.uint8]
    ends: list[int]
    values: NDArray[Any]


def find_leaves(grid: Grid) -> Leaves:
    """Return the leaves of a grid, with their values."""
    first = np.array(grid.first)
    corner = first // LEAF
    size = (first + grid.voxels.shape[::-1] - 1) // LEAF - corner + 1
    origins = np.indices(size).reshape(3, -1).T.astype(np.int64) + corner
    node4, node5 = origins // NODE4, origins // (NODE4 * NODE5)
    levels = (node5, node4, origins)  # within a node, x outranks y, and y outranks z
    order = np.lexsort([level[:, axis] for level in reversed(levels) for axis in (2, 1, 0)])
    origins = origins[order]

    is_known = grid.voxels.dtype in _TYPES and grid.voxels.dtype.isnative
    voxels = grid.voxels.view() if is_known else grid.voxels.astype(np.float32)
    voxels.flags.writeable = False  # the kernel is compiled for arrays that can't be written to
    masks = np.empty((len(origins), VOXELS // 8), np.uint8)
    table = _HALF.view(np.uint16) if grid.is_half else None
    active = np.empty(len(origins) * VOXELS, np.uint16 if grid.is_half else np.float32)
    background = active.dtype.type(grid.background)
    counts = cut_leaves(voxels, origins * LEAF - first, table, background, masks, active)
    kept, values = counts > 0, active[: counts.sum()]
    ends: list[int] = np.cumsum(counts[kept]).tolist()
    return Leaves(
        origins[kept], masks[kept], ends, values.view(_HALF.dtype) if grid.is_half else values
    )


def describe(grid: Grid, leaves: Leaves, transform: bytes) -> tuple[bytes, bytes]:
    """Return a grid's descriptor without its offsets, and its bytes before its leaves' values."""
    first, last = _active_box(leaves)
    metadata = {
        "class": ("string", b"fog volume" if grid.is_half else b"unknown"),
        "file_bbox_max": ("vec3i", last),
        "file_bbox_min": ("vec3i", first),
        "file_compression": (
            "string",
            b"zip + active values" if grid.is_half else b"blosc + active values",
        ),
        "file_voxel_count": ("int64", struct.pack("<q", len(leaves.values))),
        "name": ("string", grid.name.encode()),
    }
    if grid.is_half:
        metadata["is_saved_as_half_float"] = ("bool", b"\x01")
    tree = f"{TREE}_HalfFloat" if grid.is_half else TREE
    descriptor = _string(grid.name) + _string(tree) + _string("")
    flags = (ZIP if grid.is_half else BLOSC) | ACTIVE_MASK
    head = struct.pack("<I", flags) + _metadata(dict(sorted(metadata.items()))) + transform
    return descriptor, head + _topology(grid, leaves.origins, leaves.masks)


def _topology(grid: Grid, origins: NDArray[np.int64], masks: NDArray[np.uint8]) -> bytes:
    """Return the tree without the values of its leaves."""
    # A grid of floats states the length of the values of a node even if it has no values.
    nothing = b"" if grid.is_half else bytes(8)
    roots = _runs(origins // (NODE4 * NODE5))
    parts = [struct.pack("<ifII", 1, float(grid.background), 0, len(roots))]
    for start, stop in roots:
        root = origins[start] // (NODE4 * NODE5)
        inside = origins[start:stop] - root * (NODE4 * NODE5)
        corner = [int(v) for v in root * (LEAF * NODE4 * NODE5)]
        parts += [struct.pack("<3i", *corner), _internal_node(inside // NODE4, NODE5), nothing]
        for low, high in _runs(inside // NODE4):
            node = _internal_node(inside[low:high] % NODE4, NODE4)
            parts += [node, nothing, masks[start + low : start + high].tobytes()]
    return b"".join(parts)


def _runs(keys: NDArray[np.int64]) -> list[tuple[int, int]]:
    """Return the half-open ranges of equal rows; equal rows are neighbours."""
    if len(keys) == 0:
        return []
    cuts = np.flatnonzero((keys[1:] != keys[:-1]).any(axis=1)) + 1
    edges = [0, *(int(cut) for cut in cuts), len(keys)]
    return list(pairwise(edges))


def _internal_node(children: NDArray[np.int64], edge: int) -> bytes:
    """Return a node; each slot without a child is inactive background."""
    bits = np.zeros((edge, edge, edge), dtype=bool)
    bits[tuple(children.T)] = True
    mask = np.packbits(bits.ravel(), bitorder="little").tobytes()
    return mask + bytes(len(mask)) + ONLY_ACTIVE_VALUES


def _active_box(leaves: Leaves) -> tuple[bytes, bytes]:
    """Return the first and the last active index; OpenVDB's empty box (0, -1) if there is none."""
    if not leaves.ends:
        return struct.pack("<3i", 0, 0, 0), struct.pack("<3i", -1, -1, -1)
    rows = leaves.masks.reshape(-1, LEAF, LEAF)  # (leaf, x, y), a bit for each z
    lines = np.bitwise_or.reduce(leaves.masks, axis=1)
    hits = (
        rows.any(axis=2),
        rows.any(axis=1),
        np.unpackbits(lines[:, None], axis=1, bitorder="little") > 0,
    )
    first, last = [], []
    for axis in range(3):
        leaf, place = np.nonzero(hits[axis])
        index = leaves.origins[leaf, axis] * LEAF + place
        first.append(int(index.min()))
        last.append(int(index.max()))
    return struct.pack("<3i", *first), struct.pack("<3i", *last)


def make_transform(offset: NDArray[np.float64], scale: NDArray[np.float64]) -> bytes:
    """Return the map from index to world, with the inverse scales that OpenVDB also stores."""
    uniform = bool(np.ptp(scale) == 0)
    kind = "UniformScaleTranslateMap" if uniform else "ScaleTranslateMap"
    numbers = [offset, scale, scale, 1 / scale, 1 / scale**2, 0.5 / scale]
    return _string(kind) + np.concatenate(numbers).astype("<f8").tobytes()


def _metadata(items: Mapping[str, tuple[str, bytes]]) -> bytes:
    parts = [struct.pack("<I", len(items))]
    for key, (kind, value) in items.items():
        parts += [_string(key), _string(kind), struct.pack("<I", len(value)), value]
    return b"".join(parts)


def _string(text: str) -> bytes:
    return struct.pack("<I", len(text)) + text.encode()
