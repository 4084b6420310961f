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
          The active values of each leaf are compressed as by zlib, by kernels/deflate.py, in less
          than half of libdeflate's time and in the same space (docs/decisions/own-writers.md). A
          crop of real light-sheet data, 98 % active, becomes 28 % smaller by compression.
measured  The background is the least value. Values are floats, which hold all numbers of 16 bits;
          half floats hold whole numbers only up to 2048. They are compressed by Blosc with LZ4, as
          in OpenVDB's own files, with bytes of equal weight side by side. Light-sheet data of 16
          bits takes 1.82 bytes per voxel and .010 s of CPU per million voxels. Others: zlib 1.90
          and .126; zstd in Blosc 1.53 and .057, which not every OpenVDB reads. A cyclic stain takes
          1.49 and .007.

vdb_tree.py has the grids' trees and heads. vdb_read.py reads files that are written here.
"""

import hashlib
import struct
from itertools import pairwise
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from imagecodecs import deflate_decode
from numcodecs import blosc
from numpy.typing import NDArray

from stereocell.formats.vdb_tree import (
    ONLY_ACTIVE_VALUES,
    Grid,
    Leaves,
    describe,
    find_leaves,
    make_transform,
)
from stereocell.kernels.deflate import MAX_BYTES, make_space
from stereocell.kernels.vdb_leaves import HEAD, pack_halves
from stereocell.model.errors import StageError
from stereocell.model.spacing import Point, Spacing
from stereocell.model.volume import zyx_to_xyz
from stereocell.storage.atomic_write import replacing

GRID_NAME = "density"
MEASURED_NAME = "measured"

MAGIC = 0x56444220
_FORMAT, _LIBRARY = 224, (12, 0)
OLDEST_FORMAT = 222  # first format with today's layout of the head
_LZ4_LEVEL, _SHUFFLE = 9, 1
_SIZE, _OFFSETS = struct.Struct("<q"), struct.Struct("<3q")
_HEADER_BYTES = 65


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
    grids, transform = _grids(density, first_um, spacing_um, measured, apron)
    parts, at = list[bytes | memoryview](), _HEADER_BYTES
    for grid in grids:
        leaves = find_leaves(grid)
        descriptor, head = describe(grid, leaves, transform)
        buffers = _buffers(grid, leaves)
        end = at + len(descriptor) + _OFFSETS.size + len(head) + len(buffers)
        parts += [_placed(descriptor, head, at, end), buffers]
        at = end
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.writelines([_header(parts, len(grids)), *parts])


def is_vdb_of(
    path: Path,
    density: NDArray[np.uint8],
    *,
    first_um: Point,
    spacing_um: Spacing,
    measured: NDArray[Any] | None = None,
    apron: int = 0,
) -> bool:
    """Return whether a file holds the same grids as `write_vdb` writes for the same arguments.

    Header, heads and trees are compared byte by byte. Values are decompressed and then compared.
    Half floats are decompressed by libdeflate, so another program than their writer reads them.
    Raises OSError if the file can't be read.
    """
    content = memoryview(path.read_bytes())
    grids, transform = _grids(density, first_um, spacing_um, measured, apron)
    at = _HEADER_BYTES
    try:
        for grid in grids:
            leaves = find_leaves(grid)
            descriptor, head = describe(grid, leaves, transform)
            _, _, end = _OFFSETS.unpack_from(content, at + len(descriptor))
            start = _placed(descriptor, head, at, end)
            buffers = content[at + len(start) : end]
            if bytes(content[at : at + len(start)]) != start or not _holds(buffers, grid, leaves):
                return False
            at = end
    except (struct.error, RuntimeError, ValueError):  # a buffer is too short or damaged
        return False
    header = _header([content[_HEADER_BYTES:]], len(grids))
    return at == len(content) and bytes(content[:_HEADER_BYTES]) == header


def _grids(
    density: NDArray[np.uint8],
    first_um: Point,
    spacing_um: Spacing,
    measured: NDArray[Any] | None,
    apron: int,
) -> tuple[list[Grid], bytes]:
    """Return the grids of a file, and their transform."""
    rows, (depth, height, width) = density.shape[1], spacing_um
    lowest_um = (first_um[0], first_um[1] + (rows - 1) * height, first_um[2])
    transform = make_transform(zyx_to_xyz(lowest_um), np.array([width, height, depth]))
    grids = [Grid(GRID_NAME, density[:, ::-1], (0, 0, 0), 0, is_half=True)]
    if measured is not None:
        first = (-apron, rows + apron - measured.shape[1], -apron)
        grids.append(Grid(MEASURED_NAME, measured[:, ::-1], first, measured.min(), is_half=False))
    return grids, transform


def _header(body: list[bytes | memoryview], grids: int) -> bytes:
    """Return the header of a file with a number of grids. Its UUID is a hash of the body."""
    hashed = hashlib.sha256()
    for part in body:
        hashed.update(part)
    digest = hashed.hexdigest().upper()
    cuts = (0, 8, 12, 16, 20, 32)
    uuid = "-".join(digest[a:b] for a, b in pairwise(cuts))
    header = struct.pack("<qIII?", MAGIC, _FORMAT, *_LIBRARY, True) + uuid.encode()
    return header + struct.pack("<Ii", 0, grids)


def _placed(descriptor: bytes, head: bytes, at: int, end: int) -> bytes:
    """Return a grid's descriptor and head, with offsets for a grid from `at` to `end`."""
    grid_at = at + len(descriptor) + _OFFSETS.size
    return descriptor + _OFFSETS.pack(grid_at, grid_at + len(head), end) + head


def _buffers(grid: Grid, leaves: Leaves) -> bytes | memoryview:
    """Return every leaf's mask and active values."""
    if grid.is_half:
        return _pack_halves(leaves).data
    width, values = leaves.values.itemsize, leaves.values.data
    parts, start = list[bytes](), 0
    for mask, end in zip(_coded_masks(leaves), leaves.ends, strict=True):
        numbers, size = values[start:end], width * (end - start)
        packed = _pack_floats(numbers)
        if len(packed) < size:
            parts += [mask, _SIZE.pack(len(packed)), packed]
        else:  # a negative size: the numbers are not compressed
            parts += [mask, _SIZE.pack(-size), numbers.tobytes()]
        start = end
    return b"".join(parts)


def _holds(buffers: memoryview, grid: Grid, leaves: Leaves) -> bool:
    """Return whether buffers hold every leaf's mask and active values, and nothing else."""
    unpack = _unpack_halves if grid.is_half else _unpack_floats
    values, start, at = leaves.values.data, 0, 0
    for mask, end in zip(_coded_masks(leaves), leaves.ends, strict=True):
        (size,) = _SIZE.unpack_from(buffers, at + len(mask))
        first, expected = at + len(mask) + _SIZE.size, values[start:end].tobytes()
        packed = buffers[first : first + abs(size)]
        numbers = packed.tobytes() if size < 0 else unpack(packed, len(expected))
        if numbers != expected or buffers[at : at + len(mask)].tobytes() != mask:
            return False
        start, at = end, first + abs(size)
    return at == len(buffers)


def _coded_masks(leaves: Leaves) -> list[bytes]:
    """Return each leaf's mask, and the code of its values."""
    coded = np.pad(leaves.masks, ((0, 0), (0, 1)), constant_values=ONLY_ACTIVE_VALUES[0])
    coded_masks: list[bytes] = coded.view(f"V{coded.shape[1]}").ravel().tolist()
    return coded_masks


def _pack_halves(leaves: Leaves) -> NDArray[np.uint8]:
    """Return every leaf's mask and half floats."""
    halves, ends = leaves.values.view(np.uint16), np.array(leaves.ends, np.int64)
    packed = np.empty(halves.nbytes + HEAD * len(ends) + MAX_BYTES, np.uint8)
    return packed[: pack_halves(leaves.masks, ends, halves, make_space(), packed)]


def _pack_floats(numbers: memoryview) -> bytes:
    """Return float32 numbers in a Blosc frame."""
    return bytes(blosc.compress(numbers, b"lz4", _LZ4_LEVEL, _SHUFFLE))


def _unpack_halves(packed: memoryview, size: int) -> bytes:
    return bytes(deflate_decode(packed.tobytes(), out=size))


def _unpack_floats(packed: memoryview, size: int) -> bytes:
    unpacked_size, _, packed_size = struct.unpack_from("<3I", packed, 4)
    # Blosc allocates memory and reads by these sizes.
    fits = (unpacked_size, packed_size) == (size, len(packed))
    return bytes(blosc.decompress(packed)) if fits else b""


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
