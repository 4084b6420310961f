"""Pixels that pad a DICOM image don't count as measured ones."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest
from numpy.typing import NDArray
from pydicom.uid import ImplicitVRLittleEndian, JPEGLosslessSV1, RLELossless

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.tiling import Box
from stereocell.read.dataset import Dataset
from support.dicom_reading import whole
from support.dicom_series import compress, grid, image, save

SHAPE = (6, 30, 26)
OUTSIDE = np.hypot(*np.meshgrid(np.arange(30) - 14.5, np.arange(26) - 12.5, indexing="ij")) > 12


def measured() -> NDArray[np.int16]:
    """Return stored values of a CT: one voxel is 24 (-1000 HU), all others are 30 or more."""
    values = np.random.default_rng(0).integers(30, 1500, SHAPE).astype(np.int16)
    values[2, 15, 13] = 24
    return values


def write(folder: Path, stored: NDArray[Any], **tags: Any) -> Path:
    options: dict[str, Any] = {"modality": "CT", "intercept": -1024.0}
    options |= {key: tags.pop(key) for key in list(tags) if key[0].islower()}
    for k, plane in enumerate(stored):
        ds = image(np.ascontiguousarray(plane), grid(shape=SHAPE), k, number=k + 1, **options)
        for name, value in tags.items():
            vr = "SS" if ds.PixelRepresentation else "US"
            ds.add_new(name, vr, value)
        save(ds, folder / f"{k}.dcm")
    return folder


def padded(stored: NDArray[Any], value: int) -> NDArray[Any]:
    return np.where(OUTSIDE, np.asarray(value, stored.dtype), stored)


def as_stored(dataset: Dataset) -> NDArray[Any]:
    """Return voxels as the files store them, (slice, row, column).

    The axes of a dataset are canonical: (anterior, inferior, left).
    """
    return whole(dataset).transpose(1, 0, 2)[::-1, ::-1]


def test_padding_becomes_the_smallest_measured_value(tmp_path: Path) -> None:
    stored = measured()
    dataset = read.open(write(tmp_path / "s", padded(stored, -2000), PixelPaddingValue=-2000))
    inside = np.where(OUTSIDE, 24, stored)
    assert np.array_equal(as_stored(dataset), inside - 1024)


def test_a_region_has_the_values_of_the_full_volume(tmp_path: Path) -> None:
    folder = write(tmp_path / "s", padded(measured(), -2000), PixelPaddingValue=-2000)
    box = Box((5, 4, 0), (25, 6, 20))  # without the slice that holds the smallest value
    part = read.open(folder).read(0, box).voxels
    assert np.array_equal(part, whole(read.open(folder))[box.slices])
    assert part.min() == -1000


@pytest.mark.slow
def test_the_window_of_padded_ct_is_that_of_the_measured_values(tmp_path: Path) -> None:
    folder = write(tmp_path / "s", padded(measured(), -2000), PixelPaddingValue=-2000)
    # the preset of CT has its own window
    flags = ["-o", str(tmp_path / "out"), "--preset", "none"]
    assert main(["slices", str(folder), *flags]) == 0
    low, high = json.loads((tmp_path / "out" / "slices.json").read_text("utf-8"))["window"]
    assert -1000 <= low < -900
    assert high < 500


@pytest.mark.parametrize(("value", "limit"), [(-2000, -1990), (-1990, -2000), (2900, 3000)])
def test_a_padding_range_may_start_at_either_end(tmp_path: Path, value: int, limit: int) -> None:
    stored = padded(measured(), value)
    stored[:, 0, 0], stored[:, 0, 1] = limit, (value + limit) // 2
    folder = write(tmp_path / "s", stored, PixelPaddingValue=value, PixelPaddingRangeLimit=limit)
    assert np.array_equal(as_stored(read.open(folder)), np.where(OUTSIDE, 24, measured()) - 1024)


@pytest.mark.parametrize("bits", [16, 12])
def test_unsigned_padding_is_read_without_a_stated_vr(tmp_path: Path, bits: int) -> None:
    """In implicit VR the sign of the pixels determines the type of the padding."""
    value = 63536 if bits == 16 else 4095  # -2000 if it were signed
    stored = measured().astype(np.uint16)
    folder = write(tmp_path / "s", padded(stored, value), PixelPaddingValue=value, bits=bits)
    for path in folder.iterdir():
        ds = pydicom.dcmread(path)
        ds.file_meta.TransferSyntaxUID = ImplicitVRLittleEndian
        ds.save_as(path, enforce_file_format=True, implicit_vr=True)
    assert np.array_equal(as_stored(read.open(folder)), np.where(OUTSIDE, 24, measured()) - 1024)


def test_padding_above_the_stored_bits_is_ignored(tmp_path: Path) -> None:
    """12 bits of 16 are stored: 0x8000 is outside them, and is not air."""
    stored = padded(measured().astype(np.uint16), 0x8000)
    folder = write(tmp_path / "s", stored, PixelPaddingValue=0x8000, bits=12)
    assert np.array_equal(as_stored(read.open(folder)), np.where(OUTSIDE, 24, measured()) - 1024)


def test_padding_of_inverted_images_is_compared_with_stored_values(tmp_path: Path) -> None:
    """MONOCHROME1: the highest stored value is black."""
    stored = padded(measured().astype(np.uint16), 0)
    folder = write(
        tmp_path / "s", stored, PixelPaddingValue=0, bits=12, photometric="MONOCHROME1",
        intercept=0.0,
    )  # fmt: skip
    inside = 4095 - measured().astype(np.int64)
    expected = np.where(OUTSIDE, inside[:, ~OUTSIDE].min(), inside)
    assert np.array_equal(as_stored(read.open(folder)), expected)


def test_no_signal_stays_0_in_mr(tmp_path: Path) -> None:
    """A brain is cut out on 0: its smallest value, 24, is not the background."""
    folder = write(
        tmp_path / "s", padded(measured(), 0), PixelPaddingValue=0, modality="MR", intercept=0.0
    )
    assert np.array_equal(as_stored(read.open(folder)), np.where(OUTSIDE, 0, measured()))


def test_padding_within_the_range_is_kept(tmp_path: Path) -> None:
    stored = padded(measured(), 1024)
    folder = write(tmp_path / "s", stored, PixelPaddingValue=1024)
    assert np.array_equal(as_stored(read.open(folder)), stored - 1024)


def test_a_slice_of_padding_alone_gets_the_smallest_value_of_the_others(tmp_path: Path) -> None:
    stored = padded(measured(), -2000)
    stored[4] = -2000
    dataset = read.open(write(tmp_path / "s", stored, PixelPaddingValue=-2000))
    assert np.unique(as_stored(dataset)[4]).tolist() == [-1000]


@pytest.mark.slow
@pytest.mark.parametrize("syntax", [JPEGLosslessSV1, RLELossless])
def test_compressed_images_are_padded_in_the_same_way(tmp_path: Path, syntax: str) -> None:
    stored = padded(measured(), -2000)
    folder = write(tmp_path / "s", stored, PixelPaddingValue=-2000)
    for path in folder.iterdir():
        compress(path, syntax)
    inside = np.where(OUTSIDE, 24, measured())
    assert np.array_equal(as_stored(read.open(folder)), inside - 1024)


def test_padding_is_kept_if_there_is_nothing_else(tmp_path: Path) -> None:
    stored = np.full(SHAPE, -2000, np.int16)
    dataset = read.open(write(tmp_path / "s", stored, PixelPaddingValue=-2000))
    assert np.unique(whole(dataset)).tolist() == [-3024]
