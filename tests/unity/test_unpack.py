"""The Unity package's own readers of zstd and KTX2 return the original bytes."""

import struct
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import zstandard

from stereocell.formats.ktx2 import encode_2d, encode_3d

Run = Callable[..., subprocess.CompletedProcess[bytes]]


def kinds() -> list[bytes]:
    """Return contents for frames: noise, runs, words, smooth voxels, and lengths at limits."""
    rng = np.random.default_rng(7)
    noise = rng.integers(0, 256, 70_000, dtype=np.uint8).tobytes()
    few = rng.choice([3, 3, 3, 9, 200], 50_000).astype(np.uint8).tobytes()
    skewed = np.minimum(rng.geometric(0.15, 300_000), 255).astype(np.uint8).tobytes()
    z, y, x = np.meshgrid(*(np.arange(n) for n in (24, 90, 100)), indexing="ij")
    wave = 127 + 100 * np.sin(x / 9) * np.sin(y / 7) * np.cos(z / 5)
    smooth = (wave + rng.normal(0, 2, wave.shape)).clip(0, 255).astype(np.uint8).tobytes()
    words = b" ".join(rng.choice([b"tile", b"channel", b"voxel", b"um", b"lod0"], 9000))
    far = noise[:5000] + bytes(200_000) + noise[:5000] + few[:3000] + noise[1000:4000]
    short = [
        b"",
        b"a",
        b"ab" * 2,
        bytes(1),
        bytes(131_072),
        bytes(131_073),
        noise[:255],
        noise[:256],
    ]
    return [noise, few, skewed, smooth, words, far, *short]


def unpack(run: Run, frames: list[tuple[bytes, int]]) -> list[bytes | None]:
    """Return the unpacked bytes of each frame; None if the frame is refused."""
    data = struct.pack("<i", len(frames))
    for frame, size in frames:
        data += struct.pack("<ii", len(frame), size) + frame
    done = run("zstd", data=data)
    assert done.returncode == 0, done.stderr.decode()
    found: list[bytes | None] = []
    at = 0
    for _, size in frames:
        failed = done.stdout[at]
        found.append(None if failed else done.stdout[at + 1 : at + 1 + size])
        at += 1 if failed else 1 + size
    assert at == len(done.stdout)
    return found


@pytest.mark.slow
def test_frames_unpack_to_what_was_packed(run: Run) -> None:
    plain, frames = [], []
    for content in kinds():
        for level in (-5, 1, 3, 9, 19, 22):
            for flags in ({}, {"write_checksum": True}, {"write_content_size": False}):
                packer = zstandard.ZstdCompressor(level=level, **flags)
                plain.append(content)
                frames.append((packer.compress(content), len(content)))
    assert unpack(run, frames) == plain


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_frames_of_random_contents_unpack(run: Run, seed: int) -> None:
    """Blocks have literals of few and of many symbols, and copies from near and far."""
    rng = np.random.default_rng(seed)
    plain, frames = [], []
    for _ in range(60):
        parts = [b""]
        for _ in range(rng.integers(1, 40)):
            symbols = rng.integers(1, 256)
            parts.append(rng.integers(0, symbols, rng.integers(1, 3000), np.uint8).tobytes())
            parts.append(parts[rng.integers(len(parts))])
        plain.append(b"".join(parts))
        packer = zstandard.ZstdCompressor(level=int(rng.integers(-3, 20)))
        frames.append((packer.compress(plain[-1]), len(plain[-1])))
    assert unpack(run, frames) == plain


@pytest.mark.slow
def test_a_damaged_frame_never_crashes_and_a_cut_one_is_refused(run: Run) -> None:
    rng = np.random.default_rng(1)
    frames: list[tuple[bytes, int]] = []
    cut = []  # indices of the frames that were cut
    for content in kinds()[:6]:
        whole = zstandard.compress(content[:60_000])
        size = min(60_000, len(content))
        cut += range(len(frames), len(frames) + 40)
        frames += [(whole[:end], size) for end in rng.integers(0, len(whole), 40)]
        for at in rng.integers(0, min(len(whole), 400), 60):
            bad = bytearray(whole)
            bad[at] ^= 1 << rng.integers(8)
            frames.append((bytes(bad), size))
        frames += [(whole, size + 1), (whole, max(0, size - 1)), (whole[::-1], size)]
    found = unpack(run, frames)
    assert sum(each is None for each in found) > len(found) / 2
    assert all(found[i] is None for i in cut)


def test_each_level_of_a_volume_and_a_table_are_read(run: Run, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    levels = [
        rng.integers(0, 256, shape, np.uint8) for shape in ((7, 13, 21), (3, 6, 10), (1, 3, 5))
    ]
    (tmp_path / "v.ktx2").write_bytes(encode_3d(levels).data)
    for k, level in enumerate(levels):
        assert run("ktx2", tmp_path / "v.ktx2", k).stdout == level.tobytes()
    table = rng.integers(0, 256, (5, 256, 4), np.uint8)
    (tmp_path / "t.ktx2").write_bytes(encode_2d(table).data)
    assert run("ktx2", tmp_path / "t.ktx2", 0).stdout == table.tobytes()


@pytest.mark.parametrize("at", [0, 12, 20, 24, 28, 40, 44, 80, 88, 96])
def test_a_texture_with_a_damaged_header_is_refused(run: Run, tmp_path: Path, at: int) -> None:
    data = bytearray(encode_3d([np.full((4, 5, 6), 7, np.uint8)]).data)
    data[at] ^= 0x41
    (tmp_path / "v.ktx2").write_bytes(data)
    done = run("ktx2", tmp_path / "v.ktx2", 0)
    if at == 40:  # a wrong number of levels may go unnoticed
        assert done.returncode in (0, 1)
    else:
        assert done.returncode == 1
    assert done.stderr.count(b"\n") <= 1
    assert run("ktx2", tmp_path / "v.ktx2", 99).returncode == 1
