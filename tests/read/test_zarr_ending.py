"""A failed read leaves nothing behind that prints when Python exits."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tifffile
import zarr
from zarr.codecs import GzipCodec

from support.server.timeouts import PATIENCE_S

SIDE = 64  # voxels along each axis

_READ = """
import sys
import stereocell
from stereocell.model.errors import StereoCellError
dataset = stereocell.open_volume(sys.argv[1], spacing_um=(1, 1, 1))
try:
    dataset.read(0, dataset.levels[0].box)
except StereoCellError as error:
    print(type(error).__name__)
"""


def voxels() -> "np.ndarray[tuple[int, int, int], np.dtype[np.uint16]]":
    return np.random.default_rng(3).integers(0, 900, (SIDE, SIDE, SIDE), np.uint16)


def write_zarr(folder: Path) -> tuple[Path, Path]:
    path = folder / "many.zarr"
    array = zarr.create_array(
        path, shape=(SIDE,) * 3, chunks=(SIDE // 4,) * 3, dtype="uint16", compressors=GzipCodec()
    )
    array[:] = voxels()
    return path, path / "c" / "0" / "0" / "0"


def write_tiff(folder: Path) -> tuple[Path, Path]:
    path = folder / "many.tif"
    tifffile.imwrite(path, voxels(), compression="zlib", photometric="minisblack")
    return path, path


@pytest.mark.parametrize("write", [write_zarr, write_tiff])
@pytest.mark.slow
def test_a_damaged_chunk_among_many_prints_nothing_when_python_exits(
    tmp_path: Path, write: Callable[[Path], tuple[Path, Path]]
) -> None:
    source, damaged = write(tmp_path)
    data = bytearray(damaged.read_bytes())
    # the checksum of a chunk, or a page
    place = len(data) - 5 if damaged != source else len(data) // 3
    data[place] ^= 0xFF
    damaged.write_bytes(data)
    ended = subprocess.run(
        [sys.executable, "-c", _READ, source],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert (ended.stdout, ended.stderr, ended.returncode) == ("SourceError\n", "", 0)
