"""An array that keeps decoded chunks returns what the array itself returns, and decodes less."""

from typing import Any

import numpy as np
import pytest

from stereocell.read import decoded_chunks
from stereocell.read.decoded_chunks import DecodedChunks, forget_chunks


class Stored:
    """An array of chunks that counts how many voxels were decoded."""

    shape, chunks, dtype = (3, 10, 11, 13), (1, 4, 5, 6), np.dtype(np.uint16)

    def __init__(self) -> None:
        self.voxels = np.arange(np.prod(self.shape), dtype=self.dtype).reshape(self.shape)
        self.decoded = 0

    def __getitem__(self, key: Any) -> np.ndarray:
        found = self.voxels[key]
        self.decoded += found.size
        return found


def test_every_window_equals_that_of_the_array() -> None:
    stored, random = Stored(), np.random.default_rng(0)
    kept = DecodedChunks(stored)
    for _ in range(300):
        start = [int(random.integers(0, n)) for n in stored.shape]
        stop = [
            int(random.integers(a + 1, n + 1)) for a, n in zip(start, stored.shape, strict=True)
        ]
        key = (start[0], *(slice(a, b) for a, b in zip(start[1:], stop[1:], strict=True)))
        assert (kept[key] == stored.voxels[key]).all()
        assert kept[key].shape == stored.voxels[key].shape
    everything = (slice(None),) * 4
    assert (kept[everything] == stored.voxels).all()
    assert stored.decoded <= 3 * stored.voxels.size  # missing chunks are read with those between


def test_a_chunk_is_decoded_once_until_all_are_forgotten() -> None:
    stored = Stored()
    kept = DecodedChunks(stored)
    key = (0, slice(0, 4), slice(5, 10), slice(2, 3))
    kept[key][:] = 0  # the kept chunk does not change
    assert (kept[key] == stored.voxels[key]).all()
    assert stored.decoded == 4 * 5 * 6
    forget_chunks()
    assert (kept[key] == stored.voxels[key]).all()
    assert stored.decoded == 2 * 4 * 5 * 6


def test_kept_chunks_have_a_bounded_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decoded_chunks, "MOST_BYTES", 3 * 4 * 5 * 6 * 2)
    forget_chunks()
    stored = Stored()
    kept = DecodedChunks(stored)
    for time in (0, 1, 2):
        for z in (0, 5, 9):
            kept[time, slice(z, z + 1), slice(0, 5), slice(0, 6)]
    assert sum(chunk.nbytes for chunk in decoded_chunks._kept.values()) <= decoded_chunks.MOST_BYTES
    assert (kept[(slice(None),) * 4] == stored.voxels).all()  # too large, and read as a whole
    forget_chunks()
