"""Python's zlib decompresses the streams of packed leaves, each without those before it."""

import zlib

import numpy as np
import pytest

from stereocell.kernels.deflate import MAX_BYTES, MAX_NUMBERS, make_space
from stereocell.kernels.vdb_leaves import HEAD, pack_halves


def pack(blocks: list[np.ndarray]) -> list[bytes]:
    """Return the buffer of each leaf, whose active values are a block of 16-bit numbers."""
    halves = np.concatenate(blocks).astype(np.uint16)
    ends = np.cumsum([len(block) for block in blocks])
    packed = np.zeros(halves.nbytes + HEAD * len(blocks) + MAX_BYTES, np.uint8)
    masks = np.arange(64 * len(blocks), dtype=np.uint8).reshape(-1, 64)
    left = packed[: pack_halves(masks, ends, halves, make_space(), packed)].tobytes()
    buffers = []
    while left:
        end = HEAD + abs(size_of(left))
        buffers.append(left[:end])
        left = left[end:]
    return buffers


def size_of(buffer: bytes) -> int:
    """Return the size of a leaf's values; a negative size: they are not compressed."""
    return int(np.frombuffer(buffer[HEAD - 8 : HEAD], "<i8")[0])


def numbers_of(buffer: bytes) -> np.ndarray:
    size = size_of(buffer)
    values = buffer[HEAD:]
    return np.frombuffer(zlib.decompress(values) if size > 0 else values, "<u2")


def fibonacci_block() -> np.ndarray:
    """Return numbers whose bytes have very different counts, so that some get long codes."""
    counts = [1, 1]
    while sum(counts) + sum(counts[-2:]) <= MAX_NUMBERS:
        counts.append(sum(counts[-2:]))
    values = np.repeat(np.arange(len(counts)), counts) * 257
    return np.random.default_rng(2).permutation(values)


BLOCKS = {
    "one number": np.array([700]),
    "two equal numbers": np.array([9, 9]),
    "a number 512 times": np.full(MAX_NUMBERS, 0x3C00),
    "all different": np.arange(MAX_NUMBERS) * 128,
    "every byte": np.arange(MAX_NUMBERS) % 256 * 257,
    "a repeat at the largest distance": np.r_[1, 2, np.arange(3, MAX_NUMBERS - 1), 1, 2],
    "a repeat of the longest length": np.r_[np.arange(129), np.arange(129), np.arange(130)],
    "Fibonacci counts": fibonacci_block(),
}


@pytest.mark.parametrize("name", BLOCKS)
def test_zlib_reads_the_same_numbers(name: str) -> None:
    (found,) = pack([BLOCKS[name]])
    np.testing.assert_array_equal(numbers_of(found), BLOCKS[name])


def test_each_stream_is_read_without_those_before_it() -> None:
    blocks = [block for block in BLOCKS.values() for _ in range(2)]
    for block, buffer in zip(blocks, pack(blocks), strict=True):
        np.testing.assert_array_equal(numbers_of(buffer), block)


def test_noise_of_every_width_is_read_back_and_never_grows() -> None:
    rng = np.random.default_rng(5)
    blocks = [
        rng.normal(0, 2.0 ** rng.uniform(-1, 15), rng.integers(1, MAX_NUMBERS + 1)).astype(np.int16)
        for _ in range(400)
    ]
    for block, buffer in zip(blocks, pack(blocks), strict=True):
        np.testing.assert_array_equal(numbers_of(buffer), block.view(np.uint16))
        assert len(buffer) <= HEAD + block.nbytes


def test_a_block_of_few_values_becomes_no_longer_than_by_zlib() -> None:
    levels = np.round(np.arange(256) / 255, 6).astype(np.float16).view(np.uint16)
    rng = np.random.default_rng(7)
    blocks = [
        levels[np.clip(rng.normal(60, 9, MAX_NUMBERS), 0, 255).astype(int)] for _ in range(50)
    ]
    ours = sum(len(buffer) - HEAD for buffer in pack(blocks))
    assert ours <= sum(len(zlib.compress(block.tobytes(), 1)) for block in blocks)
