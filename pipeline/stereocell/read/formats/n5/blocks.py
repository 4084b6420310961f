"""Decode a block of N5: its header and codecs. A block that unpacks to much more is refused.

The header consists of big-endian numbers: mode (16 bits; 0: dense), number of dimensions (16), and
the size along each (32), fastest first. Blocks at the edge are smaller than `blockSize`.
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
_LZ4_MAGIC = b"LZ4Block"
_LZ4_RAW = 0x10  # token of a part that is stored uncompressed
# seed and used bits of the checksum, the XXH32 of the unpacked bytes
_LZ4_SEED, _LZ4_BITS = 0x9747B28C, 0x0FFFFFFF
_ZSTD_UNKNOWN = 1 << 62  # larger sizes mean that a frame states none
_BLOSC_HEADER = struct.Struct("<4B3I")  # last three, in bytes: unpacked, of a block, packed


def unpack_block(
    content: bytes,
    least: Sequence[int],
    most: Sequence[int],
    dtype: np.dtype[Any],
    packing: Mapping[str, Any],
) -> NDArray[Any]:
    """Return a block's voxels, axes slowest first.

    least    size of the part of the dataset at the block's place, slowest first
    most     size of the largest block
    packing  `compression` in the attributes

    Raises OSError, ValueError or a codec's error for damage, struct.error for a header cut short.
    """
    mode, dimensions = struct.unpack_from(">HH", content)
    if mode != 0 or dimensions != len(most):
        raise OSError(
            f"found a block of mode {mode} with {dimensions} dimensions, expected mode 0 "
            f"with {len(most)}"
        )
    shape = struct.unpack_from(f">{dimensions}I", content, 4)[::-1]
    if any(n > m for n, m in zip(shape, most, strict=True)):
        raise OSError(f"found a block of {shape} voxels, expected at most {tuple(most)}")
    if any(n < m for n, m in zip(shape, least, strict=True)):
        raise OSError(f"found a block of {shape} voxels, expected at least {tuple(least)}")
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
        return _unpack_zstd(data, size)
    if kind == "blosc":
        *_, unpacked, _, packed = _BLOSC_HEADER.unpack_from(data)
        if unpacked > size or packed > len(data):
            raise OSError(
                f"found a block of {unpacked} bytes packed in {packed}, expected at most {size} in "
                f"{len(data)}"
            )
        return bytes(blosc.decompress(data))
    if kind == "lz4":
        return _unpack_lz4(data, size)
    raise OSError(
        f"compression: found {kind!r:.40}, expected raw, gzip, bzip2, xz, zstd, blosc or lz4"
    )


def _unpack_zstd(data: bytes, size: int) -> bytes:
    """Return the content of a frame, whose size may not be stated: Java's streams don't."""
    stated: int = zstandard.get_frame_parameters(data).content_size
    if size < stated < _ZSTD_UNKNOWN:
        raise OSError(f"found a block of {stated} bytes, expected {size}")
    if stated < _ZSTD_UNKNOWN:
        return zstandard.ZstdDecompressor().decompress(data)
    return zstandard.ZstdDecompressor().stream_reader(data).read(size + _MOST_BEHIND)


def _unpack_lz4(data: bytes, size: int) -> bytes:
    """Return the content of Java's LZ4BlockOutputStream, a sequence of compressed parts."""
    from stereocell.kernels.xxhash import xxh32  # imported here, since numba is slow to import

    parts, left, at = [], size, 0
    while left > 0:
        magic, token, packed, unpacked, checksum = _LZ4_HEADER.unpack_from(data, at)
        at += _LZ4_HEADER.size
        if magic != _LZ4_MAGIC or not 0 < unpacked <= left or not 0 < packed <= len(data) - at:
            raise OSError("a block is damaged, or cut short")
        part = data[at : at + packed]
        is_raw = token & 0xF0 == _LZ4_RAW
        part = part if is_raw else bytes(lz4.decompress(struct.pack("<I", unpacked) + part))
        if len(part) != unpacked or xxh32(part, _LZ4_SEED) & _LZ4_BITS != checksum:
            raise OSError("a block is damaged: its checksum differs")
        parts.append(part)
        left, at = left - unpacked, at + packed
    if at < len(data):  # an empty part marks the end
        magic, _, packed, unpacked, _ = _LZ4_HEADER.unpack_from(data, at)
        if magic != _LZ4_MAGIC or packed or unpacked:
            raise OSError("a block is damaged after its voxels")
    return b"".join(parts)
