"""XXH32, the checksum of LZ4's formats, over bytes.

N5 stores this checksum with a seed. Among the required packages only imagecodecs computes XXH32,
inside frames of LZ4 and without a seed. The package xxhash would add one more compiled requirement.

Reference: https://github.com/Cyan4973/xxHash/blob/dev/doc/xxhash_spec.md, "XXH32 Algorithm"
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part

_MASK = 0xFFFFFFFF
_P1, _P2, _P3, _P4, _P5 = 2654435761, 2246822519, 3266489917, 668265263, 374761393


@part
def _rotated(value: Any, bits: int) -> Any:
    return ((value << bits) | (value >> (32 - bits))) & _MASK


@part
def _mixed(lane: Any, word: Any) -> Any:
    return (_rotated((lane + word * _P2) & _MASK, 13) * _P1) & _MASK


@kernel
def hash_words(words: NDArray[np.uint32], rest: NDArray[np.uint8], seed: int) -> int:
    """Return the hash of little-endian words and of up to 3 bytes after them."""
    count, size = len(words), 4 * len(words) + len(rest)
    a, b = (seed + _P1 + _P2) & _MASK, (seed + _P2) & _MASK
    c, d = seed & _MASK, (seed - _P1) & _MASK
    stripes = count // 4
    for i in range(0, 4 * stripes, 4):
        a, b = _mixed(a, np.int64(words[i])), _mixed(b, np.int64(words[i + 1]))
        c, d = _mixed(c, np.int64(words[i + 2])), _mixed(d, np.int64(words[i + 3]))
    found = (seed + _P5) & _MASK
    if stripes:
        found = _rotated(a, 1) + _rotated(b, 7) + _rotated(c, 12) + _rotated(d, 18)
    found = (found + size) & _MASK
    for i in range(4 * stripes, count):
        found = (_rotated((found + np.int64(words[i]) * _P3) & _MASK, 17) * _P4) & _MASK
    for byte in rest:
        found = (_rotated((found + np.int64(byte) * _P5) & _MASK, 11) * _P1) & _MASK
    found = ((found ^ (found >> 15)) * _P2) & _MASK
    found = ((found ^ (found >> 13)) * _P3) & _MASK
    return int(found ^ (found >> 16))


def xxh32(data: bytes, seed: int = 0) -> int:
    """Return the hash of bytes, less than 2 ** 32."""
    whole = len(data) // 4 * 4
    words = np.frombuffer(data, "<u4", whole // 4)
    return int(hash_words(words, np.frombuffer(data, np.uint8, offset=whole), seed))
