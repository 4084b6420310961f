"""Decode what the server encodes: a brick, a frame of the websocket, the volume of a tree.

docs/brick-stream.md describes the bytes. The product itself decodes them in the viewer.
"""

import numpy as np
import zstandard
from numpy.typing import NDArray

from stereocell.formats.brick_stream import (
    BRICKS_FRAME,
    ENTRY,
    FRAME,
    TABLE_FRAME,
    VERSION,
    BrickFormatError,
    Frame,
    Part,
)
from stereocell.formats.voxel_bvh import EMPTY, STORED, STREAM_BRICK, Bvh, Bytes3


def decode_brick(frame: bytes) -> Bytes3:
    """Return a brick, uint8 (18, 18, 18), (z, y, x), from its zstd frame.

    Raises BrickFormatError for other bytes.
    """
    try:
        size = zstandard.get_frame_parameters(frame).content_size
        if size != STORED**3:
            raise BrickFormatError(f"a brick of {size} bytes, expected {STORED**3}")
        data = zstandard.decompress(frame)
    except zstandard.ZstdError as error:
        raise BrickFormatError(f"a brick that is no zstd frame: {error}") from None
    return np.frombuffer(data, dtype=np.uint8).reshape(STORED, STORED, STORED)


def decode_frame(data: bytes) -> Frame:
    """Return a binary frame; the `data` of a table is unpacked. Raises BrickFormatError."""
    if len(data) < FRAME.size:
        raise BrickFormatError(f"a frame of {len(data)} bytes, expected {FRAME.size} or more")
    kind, version, _, sequence, view, count = FRAME.unpack_from(data)
    if kind not in (TABLE_FRAME, BRICKS_FRAME) or version != VERSION:
        raise BrickFormatError(f"a frame of kind {kind}, version {version}")
    end = FRAME.size + count * ENTRY.size
    if end > len(data):
        raise BrickFormatError(f"{count} parts in {len(data)} bytes")
    parts = []
    for tree, at, length in ENTRY.iter_unpack(data[FRAME.size : end]):
        content = data[end : end + length]
        end += length
        if kind == TABLE_FRAME and end <= len(data):
            content = zstandard.decompress(content)
        parts.append(Part(tree, at, content))
    if end != len(data):
        raise BrickFormatError(f"parts end at byte {end} of {len(data)}")
    return Frame(kind, sequence, view, tuple(parts))


def first_children(nodes: NDArray[np.void]) -> NDArray[np.int64]:
    """Return the index of each node's first child, int64 (n + 1,). The last value is n.

    nodes  records of NODE (n,)
    """
    counts = np.bitwise_count(nodes["child_mask"]).astype(np.int64)
    return 1 + np.concatenate([[0], np.cumsum(counts)])


def reassemble(bvh: Bvh) -> Bytes3:
    """Return the volume of the leaves, uint8 (z, y, x); an empty node is filled with `constant`."""
    volume = np.zeros(bvh.size, dtype=np.uint8)
    brick = iter(bvh.bricks)
    for node in bvh.nodes:
        is_empty = node["flags"] & EMPTY
        stored = None if is_empty else next(brick)
        if not is_empty and node["level"] > 0:
            continue
        edge = STREAM_BRICK << int(node["level"])
        box = tuple(slice(int(node[axis]) * edge, (int(node[axis]) + 1) * edge) for axis in "zyx")
        part = volume[box]
        if stored is None:
            part[:] = node["constant"]
        else:
            z, y, x = part.shape
            part[:] = stored[1 : z + 1, 1 : y + 1, 1 : x + 1]
    return volume
