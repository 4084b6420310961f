"""XXH32 against the values of its authors, and against the checksums of frames of LZ4."""

import imagecodecs
import numpy as np
import pytest

from stereocell.kernels.xxhash import xxh32


@pytest.mark.parametrize(("seed", "expected"), [(0, 0x02CC5D05), (2654435761, 0x36B78AE7)])
def test_the_hash_of_nothing_is_that_of_its_authors(seed: int, expected: int) -> None:
    assert xxh32(b"", seed) == expected


@pytest.mark.parametrize("size", [1, 3, 4, 15, 16, 17, 31, 32, 1000, 65_537])
def test_the_hash_is_that_at_the_end_of_a_frame_of_lz4(size: int) -> None:
    data = np.random.default_rng(size).integers(0, 256, size, np.uint8).tobytes()
    frame = imagecodecs.lz4f_encode(data, contentchecksum=True)
    assert xxh32(data) == int.from_bytes(frame[-4:], "little")
