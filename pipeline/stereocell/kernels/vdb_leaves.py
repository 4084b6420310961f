"""Cut a volume into the leaves of an OpenVDB tree, blocks of 8^3 voxels, and pack them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import in_place, kernel, part
from stereocell.kernels.deflate import Space, write_stream

LEAF = 8  # voxels along an edge of a leaf
VOXELS = LEAF**3
ONLY_ACTIVE_VALUES = 0  # code: inactive voxels have the value of the background
HEAD = VOXELS // 8 + 1 + 8  # bytes before the values of a leaf: mask, code, size


@part
def _copy(
    voxels: NDArray[Any],
    back: int,
    low: int,
    left: int,
    planes: tuple[int, int],
    rows: tuple[int, int],
    columns: tuple[int, int],
    table: NDArray[Any] | None,
    block: NDArray[Any],
) -> None:
    """Copy the voxels of a leaf, from the planes, rows and columns in it, to their places.

    The arguments are those of `cut_leaves`, and the index of the leaf's first voxel. With constant
    ranges the compiler unrolls the loops.
    """
    for i in range(columns[0], columns[1]):
        for j in range(rows[0], rows[1]):
            for k in range(planes[0], planes[1]):
                voxel = voxels[back + k, low + j, left + i]
                if table is None:
                    block[(i * LEAF + j) * LEAF + k] = voxel
                else:
                    block[(i * LEAF + j) * LEAF + k] = table[voxel]


@kernel
def cut_leaves(
    voxels: NDArray[Any],
    corners: NDArray[np.int64],
    table: NDArray[Any] | None,
    background: Any,
    masks: NDArray[np.uint8],
    active: NDArray[Any],
) -> NDArray[np.int64]:
    """Return the number of active voxels in each leaf, int64 (n,), and fill `masks` and `active`.

    voxels      (z, y, x); voxels outside count as background
    corners     (n, 3), index (x, y, z) of the first voxel of each leaf, which may be negative
    table       (256,), the number that is stored for each voxel, which is then uint8; None: the
                voxels are stored
    background  number of inactive voxels, of the dtype of `active`
    masks       (n, 64), a bit for each voxel of a leaf, in the order (x, y, z) with z first
    active      (512 n,). At the end it starts with the numbers of active voxels, leaf by leaf, in
                the order of the masks
    """
    depth, height, width = voxels.shape
    counts = np.zeros(len(corners), np.int64)
    end = 0
    for leaf in range(len(corners)):
        left, low, back = corners[leaf]
        block = active[end : end + VOXELS]
        is_whole = min(left, low, back) >= 0
        if is_whole and left + LEAF <= width and low + LEAF <= height and back + LEAF <= depth:
            _copy(voxels, back, low, left, (0, LEAF), (0, LEAF), (0, LEAF), table, block)
            inactive = 0
            for place in range(VOXELS):
                inactive += block[place] == background
            if not inactive:
                masks[leaf] = 255
                counts[leaf] = VOXELS
                end += VOXELS
                continue
        else:
            for place in range(VOXELS):
                block[place] = background
            planes = max(-back, 0), min(LEAF, depth - back)
            rows = max(-low, 0), min(LEAF, height - low)
            columns = max(-left, 0), min(LEAF, width - left)
            _copy(voxels, back, low, left, planes, rows, columns, table, block)
        count = 0
        for line in range(LEAF * LEAF):
            bits = 0
            for k in range(LEAF):
                value = block[line * LEAF + k]
                is_active = value != background
                block[count] = value  # at or before its place; an inactive value is replaced
                count += is_active
                bits |= is_active << k
            masks[leaf, line] = bits
        counts[leaf] = count
        end += count
    return counts


@in_place
def pack_halves(
    masks: NDArray[np.uint8],
    ends: NDArray[np.int64],
    halves: NDArray[np.uint16],
    space: Space,
    out: NDArray[np.uint8],
) -> int:
    """Write the buffers of leaves of half floats: mask, code, size, and compressed active values.

    masks   (n, 64), see `cut_leaves`
    ends    (n,), number of active values up to the end of each leaf
    halves  active values of all leaves
    space   of `make_space`
    out     long enough for all values, HEAD bytes for each leaf, and MAX_BYTES

    Returns the number of bytes. Values that become no shorter are stored as they are, with a
    negative size.
    """
    at, start = 0, 0
    for leaf in range(len(ends)):
        end, values = ends[leaf], at + HEAD
        size = write_stream(halves, start, end, space, out, values) - values
        if size >= 2 * (end - start):
            size = 2 * (start - end)
            for k in range(start, end):
                out[values + 2 * (k - start)] = halves[k] & 255
                out[values + 2 * (k - start) + 1] = halves[k] >> 8
        for k in range(VOXELS // 8):
            out[at + k] = masks[leaf, k]
        out[values - 9] = ONLY_ACTIVE_VALUES
        for k in range(8):
            out[values - 8 + k] = size >> 8 * k & 255
        at, start = values + abs(size), end
    return at
