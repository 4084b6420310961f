"""XXH32 compared with its authors' values, and with the checksums of LZ4 frames."""

import imagecodecs
import numpy as np
import pytest

from stereocell.kernels.xxhash import xxh32


@pytest.mark.parametrize(("seed", "expected"), [(0, 0x02CC5D05), (2654435761, 0x36B78AE7)])
def test_the_hash_of_no_bytes_is_the_one_its_authors_state(seed: int, expected: int) -> None:
    assert xxh32(b"", seed) == expected


@pytest.mark.parametrize("size", [1, 3, 4, 15, 16, 17, 31, 32, 1000, 65_537])
def test_the_hash_equals_the_checksum_at_the_end_of_an_lz4_frame(size: int) -> None:
    data = np.random.default_rng(size).integers(0, 256, size, np.uint8).tobytes()
    frame = imagecodecs.lz4f_encode(data, contentchecksum=True)
    assert xxh32(data) == int.from_bytes(frame[-4:], "little")
