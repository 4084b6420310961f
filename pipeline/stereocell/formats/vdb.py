"""Write an 8-bit volume as an OpenVDB fog volume, with numpy and zlib alone (file format 224).

No package on PyPI writes .vdb with numpy 2. The layout follows OpenVDB's io/Archive.cc,
io/GridDescriptor.cc, io/Compression.h and tree/*.h (MPL-2.0; read, not copied). Little endian:

  file      magic, format, library version, has-offsets flag, UUID, file metadata, grid count
  grid      descriptor (name, tree type, instance parent, three offsets), compression flags,
            metadata, transform, topology, leaf buffers
  topology  buffer count, background, root -> 32^3 nodes of 128^3 -> 16^3 nodes of 8^3 -> leaves
  values    a code (0: only active values are stored, the rest is background), then the numbers

The tree is Tree_float_5_4_3 saved as half floats: a half has 11 bits, so that steps of 1/255 are
read back exactly. Zero is inactive background and costs a bit for each voxel.

Only active values are stored, each leaf's run compressed by zlib level 1. Measured on 2 cores: a
smooth noisy volume of 194 x 512 x 512, 59 % active: 2.8 s and 53 MB (without zlib 67 MB); a crop of
real light-sheet data, 98 % active, is 28 % smaller than without. Level 6 saves 1 % more.

Only the grids' names and transforms are read back, no voxels. Formats before 222 have another
layout of the head.
"""

import hashlib
import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import StageError
from stereocell.model.volume import zyx_to_xyz
from stereocell.storage.atomic_write import write_bytes

GRID_NAME = "density"

_MAGIC = 0x56444220
_FORMAT, _LIBRARY = 224, (12, 0)
_OLDEST_FORMAT = 222  # first format with today's layout of the head
_MAPS = {"ScaleTranslateMap", "UniformScaleTranslateMap"}
_ZIP, _ACTIVE_MASK = 1, 2
_ONLY_ACTIVE_VALUES = b"\x00"
_ZLIB_LEVEL = 1
_LEAF, _NODE4, _NODE5 = 8, 16, 32  # children along an edge: voxels, leaves, nodes of leaves
_HEADER_BYTES = 65
_HALF = (np.arange(256, dtype=np.float32) / 255).astype("<f2")

_Leaves = tuple[NDArray[np.uint8], NDArray[np.int64]]


def write_vdb(
    path: Path,
    density: NDArray[np.uint8],
    *,
    first_um: tuple[float, float, float],
    spacing_um: tuple[float, float, float],
) -> None:
    """Write `density` / 255 as the one grid of a file.

    density     uint8 (z, y, x), image rows downwards
    first_um    centre of voxel (0, 0, 0), (z, y, x)
    spacing_um  (z, y, x)

    Grid index (i, j, k) is world (x, y, z). Rows are reversed, so that j grows upwards like the
    world's y, and the transform has positive scales only: some clients take a negative scale for a
    mirror. The same input gives the same bytes: the UUID is a hash of the grid. Raises OutputError
    if the file can't be written.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "cell.vdb"
    >>> volume = np.full((4, 6, 8), 255, np.uint8)
    >>> write_vdb(path, volume, first_um=(0, 0, 0), spacing_um=(2.0, 0.5, 0.5))
    >>> grid = read_vdb_head(path)[0]
    >>> grid.name, grid.spacing.tolist(), grid.origin.tolist()
    ('density', [0.5, 0.5, 2.0], [0.0, -2.5, 0.0])
    """
    upwards = density[:, ::-1]
    depth, height, width = spacing_um
    lowest_um = (first_um[0], first_um[1] + (density.shape[1] - 1) * height, first_um[2])
    transform = _transform(zyx_to_xyz(lowest_um), np.array([width, height, depth]))
    body = _grid(upwards.transpose(2, 1, 0), transform)
    digest = hashlib.sha256(body).hexdigest().upper()
    cuts = (0, 8, 12, 16, 20, 32)
    uuid = "-".join(digest[a:b] for a, b in pairwise(cuts))
    header = struct.pack("<qIII?", _MAGIC, _FORMAT, *_LIBRARY, True) + uuid.encode()
    write_bytes(path, header + struct.pack("<Ii", 0, 1) + body)


def check_vdb(path: Path) -> None:
    """Raise StageError if a file is missing, is not OpenVDB, or ends before its grids do.

    It reads the offsets at which the grids end, not the grids. A file without these offsets, or of
    a format before 222, is checked by its first bytes only: other programs may have written it.
    """
    try:
        with path.open("rb") as file:
            damage = _find_damage(file, path.stat().st_size)
    except OSError as error:
        raise StageError(f"{path}: can't be read: {error.strerror or error}") from error
    except struct.error:
        damage = "its head was cut short"
    if damage is not None:
        raise StageError(f"{path}: can't be read as OpenVDB: {damage}")


def _find_damage(file: BinaryIO, size: int) -> str | None:
    (magic,) = struct.unpack("<q", file.read(8))
    if magic != _MAGIC:
        return "its first bytes are not OpenVDB's"
    version, _, _, has_offsets = struct.unpack("<III?", file.read(13))
    if version < _OLDEST_FORMAT or not has_offsets:
        return None
    file.read(36)  # UUID
    (entries,) = struct.unpack("<I", file.read(4))
    for _ in range(3 * entries):  # name, type and value, each behind its length
        _skip_text(file)
    (grids,) = struct.unpack("<i", file.read(4))
    if grids < 1:
        return "it holds no grid"
    for _ in range(grids):
        for _ in range(3):  # name, tree type, instance parent
            _skip_text(file)
        _, _, end = struct.unpack("<3q", file.read(24))
        if end > size:
            return f"it ends at byte {size}, expected {end} or more"
        if end < file.tell():
            return f"a grid ends at byte {end}, before it begins"
        file.seek(end)
    return None


def _skip_text(file: BinaryIO) -> None:
    (length,) = struct.unpack("<I", file.read(4))
    file.seek(length, 1)


def _grid(voxels: NDArray[np.uint8], transform: bytes) -> bytes:
    """Return one grid with its descriptor; voxels (x, y, z)."""
    values, origins = _cut_leaves(voxels)
    active = values != 0
    masks = np.packbits(active, axis=1, bitorder="little")
    topology = _topology(origins, masks)
    buffers = _buffers(values, active, masks)

    first, last = _active_box(voxels)
    metadata = _metadata(
        {
            "class": ("string", b"fog volume"),
            "file_bbox_max": ("vec3i", last),
            "file_bbox_min": ("vec3i", first),
            "file_compression": ("string", b"zip + active values"),
            "file_voxel_count": ("int64", struct.pack("<q", int(active.sum()))),
            "is_saved_as_half_float": ("bool", b"\x01"),
            "name": ("string", GRID_NAME.encode()),
        }
    )
    descriptor = _string(GRID_NAME) + _string("Tree_float_5_4_3_HalfFloat") + _string("")
    head = struct.pack("<I", _ZIP | _ACTIVE_MASK) + metadata + transform
    grid_at = _HEADER_BYTES + len(descriptor) + 24
    blocks_at = grid_at + len(head) + len(topology)
    offsets = struct.pack("<3q", grid_at, blocks_at, blocks_at + len(buffers))
    return b"".join([descriptor, offsets, head, topology, buffers])


def _cut_leaves(voxels: NDArray[np.uint8]) -> _Leaves:
    """Return the non-empty leaves (n, 512) and their origins (n, 3) in leaves, in tree order."""
    padded = np.pad(voxels, [(0, -n % _LEAF) for n in voxels.shape])
    grid = [n // _LEAF for n in padded.shape]
    blocks = padded.reshape(grid[0], _LEAF, grid[1], _LEAF, grid[2], _LEAF)
    values = blocks.transpose(0, 2, 4, 1, 3, 5).reshape(-1, _LEAF**3)
    origins = np.indices(grid).reshape(3, -1).T.astype(np.int64)
    kept = values.any(axis=1)
    values, origins = values[kept], origins[kept]
    node4, node5 = origins // _NODE4, origins // (_NODE4 * _NODE5)
    levels = (node5, node4, origins)  # within a node, x outranks y, and y outranks z
    order = np.lexsort([level[:, axis] for level in reversed(levels) for axis in (2, 1, 0)])
    return values[order], origins[order]


def _topology(origins: NDArray[np.int64], masks: NDArray[np.uint8]) -> bytes:
    """Return the tree without the values of its leaves."""
    roots = _runs(origins // (_NODE4 * _NODE5))
    parts = [struct.pack("<ifII", 1, 0.0, 0, len(roots))]
    for start, stop in roots:
        root = origins[start] // (_NODE4 * _NODE5)
        inside = origins[start:stop] - root * (_NODE4 * _NODE5)
        corner = [int(v) for v in root * (_LEAF * _NODE4 * _NODE5)]
        parts += [struct.pack("<3i", *corner), _internal_node(inside // _NODE4, _NODE5)]
        for low, high in _runs(inside // _NODE4):
            node = _internal_node(inside[low:high] % _NODE4, _NODE4)
            parts += [node, masks[start + low : start + high].tobytes()]
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
    return mask + bytes(len(mask)) + _ONLY_ACTIVE_VALUES


def _buffers(
    values: NDArray[np.uint8], active: NDArray[np.bool_], masks: NDArray[np.uint8]
) -> bytes:
    """Return every leaf's mask and active values."""
    numbers = _HALF[values[active]].tobytes()
    ends = np.cumsum(active.sum(axis=1)) * _HALF.itemsize
    mask_bytes, size = masks.tobytes(), masks.shape[1]
    parts = []
    start = 0
    for leaf, end in enumerate(ends.tolist()):
        raw = numbers[start:end]
        packed = zlib.compress(raw, _ZLIB_LEVEL)
        parts += [mask_bytes[leaf * size : (leaf + 1) * size], _ONLY_ACTIVE_VALUES]
        if len(packed) < len(raw):
            parts += [struct.pack("<q", len(packed)), packed]
        else:  # a negative size: the numbers are not compressed
            parts += [struct.pack("<q", -len(raw)), raw]
        start = end
    return b"".join(parts)


def _active_box(voxels: NDArray[np.uint8]) -> tuple[bytes, bytes]:
    """Return the first and the last active index; OpenVDB's empty box (0, -1) if there is none."""
    first, last = [], []
    for axis in range(3):
        hits = np.flatnonzero(voxels.any(axis=tuple(a for a in range(3) if a != axis)))
        first.append(int(hits[0]) if len(hits) else 0)
        last.append(int(hits[-1]) if len(hits) else -1)
    return struct.pack("<3i", *first), struct.pack("<3i", *last)


def _transform(offset: NDArray[np.float64], scale: NDArray[np.float64]) -> bytes:
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


@dataclass(frozen=True, slots=True)
class VdbGrid:
    """One grid. Its map is None if it is not a plain scale and shift.

    spacing  float64 (3,), distance between voxels along x, y, z, in the file's units
    origin   float64 (3,), centre of voxel (0, 0, 0), x, y, z, in the file's units
    """

    name: str
    spacing: NDArray[np.float64] | None
    origin: NDArray[np.float64] | None


def read_vdb_head(path: Path) -> list[VdbGrid]:
    """Return the grids of a file, in its order; none for an unknown format.

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
        if version < _OLDEST_FORMAT or not has_offsets:
            return []
        file.seek(36, 1)  # UUID
        _skip_metadata(file)
        (count,) = struct.unpack("<i", file.read(4))
        return list(_read_grids(file, count))


def _read_grids(file: BinaryIO, count: int) -> Iterator[VdbGrid]:
    for _ in range(count):
        name, _, _ = _text(file), _text(file), _text(file)  # tree type, instance parent
        start, _, end = struct.unpack("<3q", file.read(24))
        file.seek(start + 4)  # compression flags
        _skip_metadata(file)
        spacing = origin = None
        if _text(file) in _MAPS:
            numbers = np.frombuffer(file.read(48), dtype="<f8")
            origin, spacing = numbers[:3], numbers[3:]
        # if two grids share a name, a counter follows it after a separator
        yield VdbGrid(name.split("\x1e")[0], spacing, origin)
        file.seek(end)


def _skip_metadata(file: BinaryIO) -> None:
    (entries,) = struct.unpack("<I", file.read(4))
    for _ in range(3 * entries):  # name, type and value, each behind its length
        _text(file)


def _text(file: BinaryIO) -> str:
    (length,) = struct.unpack("<I", file.read(4))
    return file.read(length).decode("utf-8", "replace")
