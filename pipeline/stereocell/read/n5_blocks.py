"""Decode a block of N5: its header and codecs. A block that unpacks to much more is refused.

The header is of big-endian numbers: mode (16 bits; 0: dense), number of dimensions (16), the size
along each (32), fastest first. Blocks at the edge are smaller than `blockSize`.
"""

import math
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import zstandard
from numcodecs import blosc, lz4
from numpy.typing import NDArray

from stereocell.read.packed_stream import PACKINGS, unpack

_MOST_BEHIND = 1 << 20  # bytes that a block may unpack to beyond its voxels
_LZ4_HEADER = struct.Struct("<8sBiii")  # magic, token, packed and unpacked bytes, checksum
_LZ4_RAW = 0x10  # token of a part that is stored as it is
_BLOSC_HEADER = struct.Struct("<4B3I")  # last three, bytes: unpacked, of a block, packed


def unpack_block(
    content: bytes, most: Sequence[int], dtype: np.dtype[Any], packing: Mapping[str, Any]
) -> NDArray[Any]:
    """Return a block's voxels, axes slowest first.

    most     the largest block's size, slowest first
    packing  `compression` of the attributes

    Raises OSError, ValueError or a codec's error for damage, struct.error for a header cut short.
    """
    mode, dimensions = struct.unpack_from(">HH", content)
    if mode != 0 or dimensions != len(most):
        raise OSError(f"a block of mode {mode} and {dimensions} dimensions, not 0 and {len(most)}")
    shape = struct.unpack_from(f">{dimensions}I", content, 4)[::-1]
    if any(n > m for n, m in zip(shape, most, strict=True)):
        raise OSError(f"a block of {shape} voxels, over the {tuple(most)} of its attributes")
    size = math.prod(shape) * dtype.itemsize
    found = _unpack(content[4 + 4 * dimensions :], size, packing)
    if len(found) < size:
        raise OSError(f"a block is cut short ({len(found)} of {size} bytes)")
    return np.frombuffer(found[:size], dtype).reshape(shape)


def _unpack(data: bytes, size: int, packing: Mapping[str, Any]) -> bytes:
    kind = packing.get("type")
    if kind == "raw":
        return data
    if kind == "gzip" and packing.get("useZlib"):
        kind = "zlib"
    if kind in PACKINGS:
        return unpack(data, size, kind, most_behind=_MOST_BEHIND)
    if kind == "zstd":
        return zstandard.ZstdDecompressor().decompress(_fitting_zstd(data, size))
    if kind == "blosc":
        *_, unpacked, _, packed = _BLOSC_HEADER.unpack_from(data)
        if unpacked > size or packed > len(data):
            raise OSError(f"a block of {unpacked} bytes, {size} are expected, or cut short")
        return bytes(blosc.decompress(data))
    if kind == "lz4":
        return _unpack_lz4(data, size)
    raise OSError(f"compression {kind!r:.40}, not raw, gzip, bzip2, xz, zstd, blosc or lz4")


def _fitting_zstd(data: bytes, size: int) -> bytes:
    stated: int = zstandard.get_frame_parameters(data).content_size
    if stated > size:  # so too where it isn't stated
        raise OSError(f"a block of {stated} bytes, {size} are expected")
    return data


def _unpack_lz4(data: bytes, size: int) -> bytes:
    """Return the content of Java's LZ4BlockOutputStream, a run of packed parts."""
    parts, left, at = [], size, 0
    while left > 0:
        magic, token, packed, unpacked, _ = _LZ4_HEADER.unpack_from(data, at)
        at += _LZ4_HEADER.size
        if magic != b"LZ4Block" or not 0 < unpacked <= left or not 0 < packed <= len(data) - at:
            raise OSError("a block is damaged, or cut short")
        part = data[at : at + packed]
        is_raw = token & 0xF0 == _LZ4_RAW
        parts.append(part if is_raw else lz4.decompress(struct.pack("<I", unpacked) + part))
        left, at = left - unpacked, at + packed
    return b"".join(bytes(part) for part in parts)
