"""Damaged TIFF files: offsets, sizes and counts that can't belong to one file."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from tifffile import TiffFile, TiffWriter, imwrite

from stereocell import read
from stereocell.model.errors import SourceError

_STACK = np.random.default_rng(1).integers(0, 999, (4, 64, 48), np.uint16)


def _read(path: Path) -> NDArray[np.generic]:
    dataset = read.open(path, spacing_um=(2.0, 1.0, 1.0))
    return dataset.read(0, dataset.levels[0].box).voxels


def _change(path: Path, page: int, tag: str, number: int) -> Path:
    """Overwrite the first value of a tag of a page."""
    with TiffFile(path, mode="r+") as tiff:
        of_page = tiff.pages[page].tags[tag]
        values = (of_page.value,) if of_page.count == 1 else of_page.value
        of_page.overwrite((number, *values[1:]))
    return path


def _offset(path: Path, page: int, index: int) -> int:
    with TiffFile(path) as tiff:
        return tiff.pages[page].dataoffsets[index]


def _write(path: Path, *, is_big: bool = False, **options: object) -> Path:
    with TiffWriter(path, bigtiff=is_big) as writer:
        for plane in _STACK:
            writer.write(plane, metadata=None, contiguous=False, **options)
    return path


LAYOUTS = {
    "one strip": {},
    "strips": {"rowsperstrip": 20},
    "packed strips": {"rowsperstrip": 20, "compression": "zlib"},
    "tiles": {"tile": (32, 32)},
    "packed tiles, BigTIFF": {"tile": (32, 32), "compression": "lzw", "is_big": True},
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_an_offset_into_another_plane_is_refused(tmp_path: Path, layout: str) -> None:
    path = _write(tmp_path / "a.tif", **LAYOUTS[layout])
    np.testing.assert_array_equal(_read(path), _STACK)
    tag = "TileOffsets" if "tile" in LAYOUTS[layout] else "StripOffsets"
    _change(path, 1, tag, _offset(path, 2, 0) + 8)
    with pytest.raises(SourceError, match=r"share the bytes from .* on, expected none"):
        _read(path)


def test_an_offset_into_a_directory_is_refused(tmp_path: Path) -> None:
    path = _write(tmp_path / "a.tif")
    with TiffFile(path) as tiff:
        place = tiff.pages[3].offset
    _change(path, 3, "StripOffsets", place - 8)
    with pytest.raises(SourceError, match="share the bytes from"):
        _read(path)


def test_equal_tiles_that_are_stored_once_are_read(tmp_path: Path) -> None:
    path = _write(tmp_path / "a.tif", tile=(32, 32))
    _change(path, 2, "TileOffsets", _offset(path, 1, 0))
    voxels = _read(path)
    np.testing.assert_array_equal(voxels[2, :32, :32], _STACK[1, :32, :32])
    np.testing.assert_array_equal(voxels[3], _STACK[3])


@pytest.mark.parametrize("layout", ["strips", "tiles"])
@pytest.mark.parametrize("change", [-2, 500])
def test_a_wrong_size_of_an_uncompressed_segment_is_refused(
    tmp_path: Path, layout: str, change: int
) -> None:
    path = _write(tmp_path / "a.tif", **LAYOUTS[layout])
    tag = "TileByteCounts" if layout == "tiles" else "StripByteCounts"
    with TiffFile(path) as tiff:
        size = tiff.pages[1].databytecounts[0]
    _change(path, 1, tag, size + change)
    line = f"{tag}[0]: found {size + change}, expected {size} bytes, since Compression states no"
    with pytest.raises(SourceError, match=re.escape(line)):
        _read(path)


@pytest.mark.parametrize("compression", [None, "tiff_lzw", "tiff_adobe_deflate", "packbits"])
def test_files_of_libtiff_are_read(tmp_path: Path, compression: str | None) -> None:
    """Pillow writes them with libtiff: strips of few rows, directories after the data."""
    planes = [Image.fromarray(plane) for plane in _STACK]
    path = tmp_path / "a.tif"
    planes[0].save(path, save_all=True, append_images=planes[1:], compression=compression)
    np.testing.assert_array_equal(_read(path), _STACK)


@pytest.mark.parametrize(
    ("name", "number", "found"),
    [
        ("slices", 2, "found images=4 and 2 slices"),
        ("images", 2, "found images=2 and 4 slices"),
    ],
)
def test_counts_of_imagej_that_contradict_each_other_are_refused(
    tmp_path: Path, name: str, number: int, found: str
) -> None:
    path = tmp_path / "a.tif"
    imwrite(path, _STACK, imagej=True, metadata={"axes": "ZYX"})
    whole = path.read_bytes()
    assert whole.count(f"{name}=4".encode()) == 1
    path.write_bytes(whole.replace(f"{name}=4".encode(), f"{name}={number}".encode()))
    with pytest.raises(SourceError, match=found):
        _read(path)
