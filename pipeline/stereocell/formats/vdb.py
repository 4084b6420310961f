"""Write a volume as an OpenVDB file (format 224): 8-bit densities, and voxels as measured.

No package on PyPI writes .vdb with numpy 2. The layout follows OpenVDB's io/Archive.cc,
io/GridDescriptor.cc, io/Compression.h and tree/*.h (MPL-2.0; read, not copied). Little endian:

  file      magic, format, library version, has-offsets flag, UUID, file metadata, grid count
  grid      descriptor (name, tree type, instance parent, three offsets), compression flags,
            metadata, transform, topology, leaf buffers
  topology  buffer count, background, root -> 32^3 nodes of 128^3 -> 16^3 nodes of 8^3 -> leaves
  values    a code (0: only active values are stored, the rest is background), then the numbers

Both trees are Tree_float_5_4_3. Voxels equal to the background are inactive, and cost a bit each.

density   The background is 0. Values are half floats, whose 11 bits hold steps of 1/255 exactly.
          The active values of each leaf are compressed as by zlib, by libdeflate at level 1.
          Three stains of 512 x 512 x 64 voxels, 92 to 97 % active, are 94.8 MB of half floats.
          This takes 1.8 s and 45.6 MB. Others: zlib level 1 2.6 s and 46.7 MB; its Huffman codes
          alone 1.8 s and 52.7 MB; zlib-ng 1.2 s and 64.2 MB; Blosc with LZ4 .6 s and 86.6 MB. A
          crop of real light-sheet data, 98 % active, becomes 28 % smaller by compression.
measured  The background is the least value. Values are floats, which hold all numbers of 16 bits;
          half floats hold whole numbers only up to 2048. They are compressed by Blosc with LZ4, as
          in OpenVDB's own files, with bytes of equal weight side by side. Light-sheet data of 16
          bits takes 1.82 bytes per voxel and .010 s of CPU per million voxels. Others: zlib 1.90
          and .126; zstd in Blosc 1.53 and .057, which not every OpenVDB reads. A cyclic stain takes
          1.49 and .007.

vdb_read.py reads files that are written here.
"""

import hashlib
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from imagecodecs import deflate_encode
from numcodecs import blosc
from numpy.typing import NDArray

from stereocell.model.errors import StageError
from stereocell.model.spacing import Point, Spacing
from stereocell.model.volume import zyx_to_xyz
from stereocell.storage.atomic_write import write_bytes

GRID_NAME = "density"
MEASURED_NAME = "measured"

MAGIC = 0x56444220
_FORMAT, _LIBRARY = 224, (12, 0)
OLDEST_FORMAT = 222  # first format with today's layout of the head
TREE = "Tree_float_5_4_3"
ZIP, ACTIVE_MASK, BLOSC = 1, 2, 4
ONLY_ACTIVE_VALUES = b"\x00"
_DEFLATE_LEVEL, _LZ4_LEVEL, _SHUFFLE = 1, 9, 1
LEAF, NODE4, NODE5 = 8, 16, 32  # children along an edge: voxels, leaves, nodes of leaves
_SIZE = struct.Struct("<q")
_HEADER_BYTES = 65
_HALF = (np.arange(256, dtype=np.float32) / 255).astype("<f2")

_Leaves = tuple[NDArray[Any], NDArray[np.int64]]


@dataclass(frozen=True, slots=True)
class _Grid:
    """A grid of an OpenVDB file that is to be written.

    voxels  (x, y, z), the grid's numbers; uint8 if `is_half`
    first   index (i, j, k) of the first voxel
    """

    name: str
    voxels: NDArray[Any]
    first: tuple[int, int, int]
    background: Any
    is_half: bool


def write_vdb(
    path: Path,
    density: NDArray[np.uint8],
    *,
    first_um: Point,
    spacing_um: Spacing,
    measured: NDArray[Any] | None = None,
    apron: int = 0,
) -> None:
    """Write a file with the grid `density`, which is `density` / 255, and maybe `measured`.

    density     uint8 (z, y, x), image rows downwards
    first_um    centre of voxel (0, 0, 0) of `density`, (z, y, x)
    spacing_um  voxel spacing (z, y, x)
    measured    (z, y, x), numbers that float32 can hold. It has `apron` voxels more than the
                density at the start of each axis, and any number at the end
    apron       number of voxels by which `measured` begins before `density`

    Grid index (i, j, k) is world (x, y, z), in both grids. Rows are reversed, so that j grows
    upwards like the world's y, and the transform has only positive scales: some clients treat a
    negative scale as a mirror. The same input gives the same bytes, because the UUID is a hash of
    the grids. Raises OutputError if the file cannot be written.

    >>> import tempfile
    >>> from stereocell.formats.vdb_read import read_vdb_head
    >>> volume = np.full((4, 6, 8), 255, np.uint8)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "cell.vdb"
    ...     write_vdb(path, volume, first_um=(0, 0, 0), spacing_um=(2.0, 0.5, 0.5))
    ...     grid = read_vdb_head(path)[0]
    >>> grid.name, grid.spacing.tolist(), grid.origin.tolist()
    ('density', [0.5, 0.5, 2.0], [0.0, -2.5, 0.0])
    """
    rows, (depth, height, width) = density.shape[1], spacing_um
    lowest_um = (first_um[0], first_um[1] + (rows - 1) * height, first_um[2])
    transform = _transform(zyx_to_xyz(lowest_um), np.array([width, height, depth]))
    grids = [_Grid(GRID_NAME, _upwards(density), (0, 0, 0), 0, is_half=True)]
    if measured is not None:
        first = (-apron, rows + apron - measured.shape[1], -apron)
        grids.append(_Grid(MEASURED_NAME, _upwards(measured), first, measured.min(), is_half=False))
    body = b""
    for grid in grids:
        body += _encode(grid, transform, _HEADER_BYTES + len(body))
    digest = hashlib.sha256(body).hexdigest().upper()
    cuts = (0, 8, 12, 16, 20, 32)
    uuid = "-".join(digest[a:b] for a, b in pairwise(cuts))
    header = struct.pack("<qIII?", MAGIC, _FORMAT, *_LIBRARY, True) + uuid.encode()
    write_bytes(path, header + struct.pack("<Ii", 0, len(grids)) + body)


def _upwards(voxels: NDArray[Any]) -> NDArray[Any]:
    """Return voxels (z, y, x), rows downwards, as (x, y, z), y upwards."""
    return voxels[:, ::-1].transpose(2, 1, 0)


def check_vdb(path: Path) -> None:
    """Raise StageError if a file is missing, is not OpenVDB, or ends before its grids do.

    The function reads the offsets at which the grids end, not the grids. A file without these
    offsets, or of a format before 222, is checked only by its first bytes, because other programs
    may have written it.
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
    if magic != MAGIC:
        return "its first bytes are not OpenVDB's"
    version, _, _, has_offsets = struct.unpack("<III?", file.read(13))
    if version < OLDEST_FORMAT or not has_offsets:
        return None
    file.read(36)  # UUID
    (entries,) = struct.unpack("<I", file.read(4))
    for _ in range(3 * entries):  # name, type and value, each after its length
        _skip_text(file)
    (grids,) = struct.unpack("<i", file.read(4))
    if grids < 1:
        return "the file holds no grid"
    for _ in range(grids):
        for _ in range(3):  # name, tree type, instance parent
            _skip_text(file)
        _, _, end = struct.unpack("<3q", file.read(24))
        if end > size:
            return f"the file ends at byte {size}, expected {end} or more"
        if end < file.tell():
            return f"a grid ends at byte {end}, before it begins"
        file.seek(end)
    return None


def _skip_text(file: BinaryIO) -> None:
    (length,) = struct.unpack("<I", file.read(4))
    file.seek(length, 1)


def _encode(grid: _Grid, transform: bytes, at: int) -> bytes:
    """Return one grid with its descriptor, for a position in the file."""
    values, origins = _cut_leaves(grid)
    active = values != grid.background
    masks = np.packbits(active, axis=1, bitorder="little")
    topology = _topology(grid, origins, masks)
    buffers = _buffers(grid, values, active, masks)

    first, last = _active_box(grid)
    metadata = {
        "class": ("string", b"fog volume" if grid.is_half else b"unknown"),
        "file_bbox_max": ("vec3i", last),
        "file_bbox_min": ("vec3i", first),
        "file_compression": (
            "string",
            b"zip + active values" if grid.is_half else b"blosc + active values",
        ),
        "file_voxel_count": ("int64", struct.pack("<q", int(active.sum()))),
        "name": ("string", grid.name.encode()),
    }
    if grid.is_half:
        metadata["is_saved_as_half_float"] = ("bool", b"\x01")
    tree = f"{TREE}_HalfFloat" if grid.is_half else TREE
    descriptor = _string(grid.name) + _string(tree) + _string("")
    flags = (ZIP if grid.is_half else BLOSC) | ACTIVE_MASK
    head = struct.pack("<I", flags) + _metadata(dict(sorted(metadata.items()))) + transform
    grid_at = at + len(descriptor) + 24
    blocks_at = grid_at + len(head) + len(topology)
    offsets = struct.pack("<3q", grid_at, blocks_at, blocks_at + len(buffers))
    return b"".join([descriptor, offsets, head, topology, buffers])


def _cut_leaves(grid: _Grid) -> _Leaves:
    """Return the non-empty leaves (n, 512) and their origins (n, 3) in leaves, in tree order."""
    before = [first % LEAF for first in grid.first]
    shape = [-(-(a + n) // LEAF) for a, n in zip(before, grid.voxels.shape, strict=True)]
    # Voxels are copied along their rows, in the order of memory with x innermost.
    padded = np.full([n * LEAF for n in shape[::-1]], grid.background, grid.voxels.dtype).T
    inner = tuple(slice(a, a + n) for a, n in zip(before, grid.voxels.shape, strict=True))
    padded[inner] = grid.voxels
    blocks = padded.reshape(shape[0], LEAF, shape[1], LEAF, shape[2], LEAF)
    values = blocks.transpose(0, 2, 4, 1, 3, 5).reshape(-1, LEAF**3)
    corner = np.array(grid.first) // LEAF
    origins = np.indices(shape).reshape(3, -1).T.astype(np.int64) + corner
    kept = (values != grid.background).any(axis=1)
    values, origins = values[kept], origins[kept]
    node4, node5 = origins // NODE4, origins // (NODE4 * NODE5)
    levels = (node5, node4, origins)  # within a node, x outranks y, and y outranks z
    order = np.lexsort([level[:, axis] for level in reversed(levels) for axis in (2, 1, 0)])
    return values[order], origins[order]


def _topology(grid: _Grid, origins: NDArray[np.int64], masks: NDArray[np.uint8]) -> bytes:
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


def _buffers(
    grid: _Grid, values: NDArray[Any], active: NDArray[np.bool_], masks: NDArray[np.uint8]
) -> bytes:
    """Return every leaf's mask and active values."""
    kept = _HALF[values[active]] if grid.is_half else values[active].astype("<f4")
    pack = _pack_halves if grid.is_half else _pack_floats
    coded = np.pad(masks, ((0, 0), (0, 1)), constant_values=ONLY_ACTIVE_VALUES[0])
    ends, parts, start = np.cumsum(np.count_nonzero(active, axis=1)).tolist(), [], 0
    for mask, end in zip(coded.view(f"V{coded.shape[1]}").ravel().tolist(), ends, strict=True):
        numbers = kept[start:end]
        packed, size = pack(numbers), numbers.nbytes
        if len(packed) < size:
            parts += [mask, _SIZE.pack(len(packed)), packed]
        else:  # a negative size: the numbers are not compressed
            parts += [mask, _SIZE.pack(-size), numbers.tobytes()]
        start = end
    return b"".join(parts)


def _pack_halves(numbers: NDArray[Any]) -> bytes:
    """Return half floats in the format of zlib."""
    return bytes(deflate_encode(numbers.tobytes(), _DEFLATE_LEVEL))


def _pack_floats(numbers: NDArray[Any]) -> bytes:
    """Return float32 numbers in a Blosc frame."""
    return bytes(blosc.compress(numbers, b"lz4", _LZ4_LEVEL, _SHUFFLE))


def _active_box(grid: _Grid) -> tuple[bytes, bytes]:
    """Return the first and the last active index; OpenVDB's empty box (0, -1) if there is none."""
    first, last = [], []
    active = grid.voxels != grid.background
    for axis in range(3):
        hits = np.flatnonzero(active.any(axis=tuple(a for a in range(3) if a != axis)))
        first.append(int(hits[0]) + grid.first[axis] if len(hits) else 0)
        last.append(int(hits[-1]) + grid.first[axis] if len(hits) else -1)
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
