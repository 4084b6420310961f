"""Slices of micro-CT scanners: grey BMP, and the voxel size in the log beside them."""

from pathlib import Path

import imageio.v3 as imageio
import numpy as np
import pytest
import tifffile
from PIL import Image as Pillow

from stereocell import read
from stereocell.model.errors import SourceError

VOXELS = np.random.default_rng(1).integers(0, 256, (5, 12, 16), np.uint8)
LOG = "[System]\nScanner=SkyScan1272\n[Acquisition]\n{}[Reconstruction]\nOperator=Ann Other\n{}"


def scan(folder: Path, ending: str, log: str, *, step: int = 1) -> read.Dataset:
    folder.mkdir(exist_ok=True)
    for plane, pixels in enumerate(VOXELS):
        path = folder / f"bone_rec{plane * step + 40:08d}{ending}"
        if ending == ".tif":
            tifffile.imwrite(path, pixels)
        else:
            imageio.imwrite(path, pixels)
    preview = folder / f"bone_rec_spr{ending}"
    imageio.imwrite(preview, np.zeros((60, 30), np.uint8))
    (folder / "bone_rec.log").write_text(log, encoding="latin-1")
    return read.open(folder)


@pytest.mark.parametrize("ending", [".bmp", ".tif", ".png"])
def test_slices_have_the_voxel_size_of_their_log(tmp_path: Path, ending: str) -> None:
    dataset = scan(tmp_path / "s", ending, LOG.format("", "Pixel Size (um)=9.92\n"))
    assert dataset.levels[0].spacing_um == pytest.approx((9.92, 9.92, 9.92))
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, VOXELS)
    assert "the voxel size comes from the scanner's log: 9.92 um" in dataset.notes
    assert not any("Ann Other" in note for note in dataset.notes)


def test_sizes_that_disagree_are_noted(tmp_path: Path) -> None:
    sizes = ("Image Pixel Size (um)=4,96\n", "Pixel Size (um)=9.92\nSection to Section Step=2\n")
    dataset = scan(tmp_path / "s", ".bmp", LOG.format(*sizes))
    assert dataset.levels[0].spacing_um == pytest.approx((19.84, 9.92, 9.92))
    notes = " ".join(dataset.notes)
    assert "[Reconstruction] of the log states 9.92 um, [Acquisition] of the log states" in notes
    assert "step from slice to slice: the log states 2 pixels" in notes


def test_a_size_that_a_log_states_twice_is_noted(tmp_path: Path) -> None:
    dataset = scan(tmp_path / "s", ".bmp", LOG.format("", "Pixel Size (um)=5\nPixel Size (um)=9\n"))
    assert dataset.levels[0].spacing_um == pytest.approx((9, 9, 9))
    assert "of the log: its last line states 9, an earlier line states 5" in " ".join(dataset.notes)


def test_numbers_of_slices_count_lines_of_the_camera(tmp_path: Path) -> None:
    log = LOG.format("", "Pixel Size (um)=10\n")
    dataset = scan(tmp_path / "s", ".bmp", log, step=5)
    assert dataset.levels[0].spacing_um == pytest.approx((50, 10, 10))
    assert "the slices' numbering states 5 pixels" in " ".join(dataset.notes)


@pytest.mark.parametrize(("count", "is_reported"), [(48, True), (len(VOXELS), False)])
def test_a_log_that_counts_other_slices_is_noted(
    tmp_path: Path, count: int, is_reported: bool
) -> None:
    lines = f"Sections Count={count}\nPixel Size (um)=9.92\n"
    dataset = scan(tmp_path / "s", ".bmp", LOG.format("", lines))
    expected = f"found {len(VOXELS)} images, and the log states {count}"
    assert any(expected in note for note in dataset.notes) == is_reported


@pytest.mark.parametrize("log", ["", "[Reconstruction]\nPixel Size (um)=none\n", "Pixel Size=3\n"])
def test_a_log_without_a_size_is_ignored(tmp_path: Path, log: str) -> None:
    with pytest.raises(SourceError, match="voxel size: not found"):
        scan(tmp_path / "s", ".bmp", log)


@pytest.mark.parametrize(
    ("mode", "expected"),
    [("P", "found pixels of kind P, expected grey"), ("1", "of kind 1, expected")],
)
def test_bmp_of_other_pixels_is_refused(tmp_path: Path, mode: str, expected: str) -> None:
    for plane in range(3):
        image = Pillow.new(mode, (9, 8))
        if mode == "P":
            image.putpalette([value for i in range(256) for value in (i, 0, 255 - i)])
        image.save(tmp_path / f"s{plane}.bmp")
    with pytest.raises(SourceError, match=expected):
        read.open(tmp_path)


def test_a_bmp_that_is_cut_short_is_refused(tmp_path: Path) -> None:
    dataset = scan(tmp_path / "s", ".bmp", LOG.format("", "Pixel Size (um)=10\n"))
    path = tmp_path / "s/bone_rec00000041.bmp"
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.raises(SourceError, match=r"bone_rec00000041\.bmp"):
        dataset.read(0, dataset.levels[0].box)
