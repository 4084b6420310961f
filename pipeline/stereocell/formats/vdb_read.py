"""Read OpenVDB files: the heads of their grids, and the measured voxels that vdb.py writes.

Formats before 222 have another layout of the head. Values are read only in the layout of vdb.py:
the tree has no tiles of one value, inactive voxels are background, and floats are in Blosc frames.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numcodecs import blosc
from numpy.typing import NDArray

from stereocell.formats.vdb import OLDEST_FORMAT, check_vdb
from stereocell.formats.vdb_tree import (
    ACTIVE_MASK,
    BLOSC,
    NODE4,
    NODE5,
    ONLY_ACTIVE_VALUES,
    TREE,
)
from stereocell.kernels.vdb_leaves import LEAF
from stereocell.model.errors import StageError

_MAPS = {"ScaleTranslateMap", "UniformScaleTranslateMap"}
_MASK_BYTES = LEAF**3 // 8  # bytes of a leaf's mask: a bit for each voxel
_FRAME_HEAD = 16  # bytes of a Blosc frame before its numbers; at byte 4 is their size when unpacked


@dataclass(frozen=True, slots=True)
class VdbGrid:
    """One grid. spacing and origin are None if its map is not a plain scale and shift.

    spacing  float64 (3,), distance between voxels along x, y, z, in the file's units
    origin   float64 (3,), centre of voxel (0, 0, 0), x, y, z, in the file's units
    tree     type of the tree
    start    position of the grid's first byte, after its descriptor
    blocks   position of the first byte of its leaves' values
    end      position after the grid's last byte
    """

    name: str
    spacing: NDArray[np.float64] | None
    origin: NDArray[np.float64] | None
    tree: str
    start: int
    blocks: int
    end: int


def read_vdb_head(path: Path) -> list[VdbGrid]:
    """Return the grids of a file, in order; none for an unknown format.

    Raises StageError if the file is missing or damaged.
    """
    check_vdb(path)
    try:
        return _read(path)
    except (struct.error, ValueError, OSError) as error:
        raise StageError(f"{path}: can't be read as OpenVDB: {error}") from None


def _read(path: Path) -> list[VdbGrid]:
    with path.open("rb") as file:
        file.seek(8)
        version, _, _, has_offsets = struct.unpack("<III?", file.read(13))
        if version < OLDEST_FORMAT or not has_offsets:
            return []
        file.seek(36, 1)  # UUID
        _skip_metadata(file)
        (count,) = struct.unpack("<i", file.read(4))
        return list(_read_grids(file, count))


def _read_grids(file: BinaryIO, count: int) -> Iterator[VdbGrid]:
    for _ in range(count):
        name, tree, _ = _text(file), _text(file), _text(file)  # instance parent
        start, blocks, end = struct.unpack("<3q", file.read(24))
        file.seek(start + 4)  # compression flags
        _skip_metadata(file)
        spacing = origin = None
        if _text(file) in _MAPS:
            numbers = np.frombuffer(file.read(48), dtype="<f8")
            origin, spacing = numbers[:3], numbers[3:]
        # If two grids have the same name, a separator and a counter follow the name.
        yield VdbGrid(name.split("\x1e")[0], spacing, origin, tree, start, blocks, end)
        file.seek(end)


def _skip_metadata(file: BinaryIO) -> None:
    (entries,) = struct.unpack("<I", file.read(4))
    for _ in range(3 * entries):  # name, type and value, each after its length
        _text(file)


def _text(file: BinaryIO) -> str:
    (length,) = struct.unpack("<I", file.read(4))
    return file.read(length).decode("utf-8", "replace")


class VdbValues:
    """The numbers of one grid of floats. The file is mapped, and leaves are unpacked on request.

    Raises StageError, here and in all methods, for a file that is missing, damaged, or in a layout
    different from that of vdb.py.
    """

    def __init__(self, path: Path, name: str) -> None:
        self.path = path
        grid = next((grid for grid in read_vdb_head(path) if grid.name == name), None)
        if grid is None or grid.spacing is None or grid.origin is None or grid.tree != TREE:
            raise StageError(f"{path}: found no grid {name!r} of floats, expected measured voxels")
        self.grid = grid
        self._spacing, self._origin = grid.spacing, grid.origin
        try:
            self._data = memoryview(np.memmap(path, np.uint8, "r").data)[: grid.end]
            self._find_leaves()
        except (struct.error, ValueError, OSError) as error:
            raise StageError(f"{path}: can't be read as OpenVDB: {error}") from None

    def box(
        self, low_um: tuple[float, float, float], size: tuple[int, int, int]
    ) -> NDArray[np.float32]:
        """Return the voxels of a box, (z, y, x), image rows downwards.

        low_um  centre of the lowest voxel of the box, (x, y, z); `size`: its voxels (x, y, z)
        """
        low = np.rint((np.array(low_um) - self._origin) / self._spacing).astype(np.int64)
        first = low // LEAF
        leaves = (low + size - 1) // LEAF - first + 1
        whole = np.full(leaves * LEAF, self._background, np.float32)
        places = self._origins - first
        for leaf in np.flatnonzero(((places >= 0) & (places < leaves)).all(axis=1)).tolist():
            x, y, z = (int(n) * LEAF for n in places[leaf])
            whole[x : x + LEAF, y : y + LEAF, z : z + LEAF] = self._leaf(leaf)
        cut = tuple(slice(a, a + n) for a, n in zip(low - first * LEAF, size, strict=True))
        return np.ascontiguousarray(whole[cut].transpose(2, 1, 0)[:, ::-1])

    def _find_leaves(self) -> None:
        """Find all leaves: their origins in leaves, (n, 3), and where their values begin."""
        at = self._behind_map()
        buffers, self._background, tiles, roots = struct.unpack_from("<ifII", self._data, at)
        if buffers != 1 or tiles:
            raise ValueError("tiles of one value, expected only leaves")
        at += 16
        origins = [np.zeros((0, 3), np.int64)]
        for _ in range(roots):
            corner = np.array(struct.unpack_from("<3i", self._data, at), np.int64) // LEAF
            nodes, at = self._children(at + 12, NODE5)
            for node in nodes:
                inside, at = self._children(at, NODE4)
                origins.append(corner + node * NODE4 + inside)
                at += len(inside) * _MASK_BYTES
        if at != self.grid.blocks:
            raise ValueError("the tree does not end where its leaves begin")
        self._origins = np.concatenate(origins)
        self._starts = []
        for _ in range(len(self._origins)):
            self._starts.append(at)
            (size,) = struct.unpack_from("<q", self._data, at + _MASK_BYTES + 1)
            at += _MASK_BYTES + 9 + abs(size)
        if at != self.grid.end:
            raise ValueError("the leaves do not end where the grid does")

    def _behind_map(self) -> int:
        with self.path.open("rb") as file:
            file.seek(self.grid.start)
            (flags,) = struct.unpack("<I", file.read(4))
            if flags != BLOSC | ACTIVE_MASK:
                raise ValueError(f"compression {flags}, expected Blosc and active values")
            _skip_metadata(file)
            _text(file)
            return file.tell() + 18 * 8

    def _children(self, at: int, edge: int) -> tuple[NDArray[np.int64], int]:
        """Return the positions of a node's children, (n, 3), in order, and where the node ends."""
        count = edge**3 // 8
        masks = np.frombuffer(self._data, np.uint8, 2 * count, at)
        end = at + 2 * count + 9
        if masks[count:].any() or bytes(self._data[end - 9 : end]) != ONLY_ACTIVE_VALUES + bytes(8):
            raise ValueError("tiles of one value, expected only leaves")
        places = np.flatnonzero(np.unpackbits(masks[:count], bitorder="little"))
        return np.stack(np.unravel_index(places, (edge,) * 3), axis=1).astype(np.int64), end

    def _leaf(self, leaf: int) -> NDArray[np.float32]:
        """Return the voxels of a leaf, (x, y, z)."""
        try:
            return self._unpacked(self._starts[leaf])
        except (ValueError, RuntimeError) as error:
            raise StageError(f"{self.path}: can't be read as OpenVDB: {error}") from None

    def _unpacked(self, at: int) -> NDArray[np.float32]:
        mask = np.frombuffer(self._data, np.uint8, _MASK_BYTES, at)
        active = np.unpackbits(mask, bitorder="little").view(bool)
        at += _MASK_BYTES
        wanted = 4 * int(active.sum())
        (size,) = struct.unpack_from("<q", self._data, at + 1)
        packed: Any = self._data[at + 9 : at + 9 + abs(size)]
        if bytes(self._data[at : at + 1]) != ONLY_ACTIVE_VALUES:
            raise ValueError("inactive values, expected background")
        if size > 0:
            # Blosc allocates memory and reads by the sizes that the frame states.
            if size < _FRAME_HEAD or struct.unpack_from("<3I", packed, 4)[::2] != (wanted, size):
                raise ValueError("a leaf has another size than its mask states")
            packed = blosc.decompress(packed)
        values = np.full(LEAF**3, self._background, np.float32)
        values[active] = np.frombuffer(packed, "<f4", wanted // 4)
        return values.reshape(LEAF, LEAF, LEAF)
