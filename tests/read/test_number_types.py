"""Number types that builds don't accept are converted, and a note says what is lost."""

from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray

from stereocell import read
from stereocell.model.errors import SourceError
from stereocell.model.tiling import Box
from support.phantoms import write_ome_zarr

SHAPE = (3, 16, 20)
KINDS = {
    "int8": ("int16", "without loss"),
    "bool": ("uint8", "without loss"),
    "float16": ("float32", "without loss"),
    "float64": ("float32", "7 of 16 digits"),
    "int32": ("float32", "24 of 32 bits"),
    "uint32": ("float32", "24 of 32 bits"),
    "int64": ("float32", "24 of 64 bits"),
    "uint64": ("float32", "24 of 64 bits"),
}


def values(kind: str) -> NDArray[Any]:
    drawn = np.random.default_rng(3).integers(-90, 90, SHAPE)
    if kind == "bool":
        return drawn > 0
    if kind[0] == "u":
        drawn = drawn + 90
    return drawn.astype(kind)


def write(folder: Path, stored: NDArray[Any], suffix: str) -> Path:
    path = folder / f"x{suffix}"
    if suffix == ".zarr":
        return write_ome_zarr(path, [stored], version="0.4")
    if suffix == ".nii":
        image = nibabel.Nifti1Image(stored.transpose(2, 1, 0), np.eye(4), dtype=stored.dtype)
        image.header.set_xyzt_units("mm")
        nibabel.save(image, path)
        return path
    sizes = {"PhysicalSizeZ": 1, "PhysicalSizeY": 1, "PhysicalSizeX": 1}
    tifffile.imwrite(path, stored, ome=True, metadata={"axes": "ZYX", **sizes})
    return path


NOT_OF_OME = ("float16", "int64", "uint64")


@pytest.mark.parametrize(
    ("kind", "suffix"),
    [
        *((kind, ".zarr") for kind in KINDS),
        *((kind, ".ome.tif") for kind in KINDS if kind not in NOT_OF_OME),
    ],
)
def test_the_type_of_a_build_and_a_note(tmp_path: Path, kind: str, suffix: str) -> None:
    stored = values(kind)
    dataset = read.open(write(tmp_path, stored, suffix))
    built, lost = KINDS[kind]
    assert dataset.dtype == built
    assert dataset.stored_dtype == kind
    (note,) = dataset.notes
    assert note.startswith(f"voxels are {kind}: read as {built}, ")
    assert lost in note
    box = Box((1, 2, 3), (3, 15, 20))
    read_voxels = dataset.read(0, box).voxels
    assert read_voxels.dtype == built
    np.testing.assert_array_equal(read_voxels, stored[box.slices].astype(built))
    assert dataset.read_stored(0, box).dtype == kind
    np.testing.assert_array_equal(dataset.read_stored(0, box), stored[box.slices])


@pytest.mark.parametrize("kind", ["uint8", "uint16", "int16", "float32"])
def test_types_that_builds_accept_are_not_converted(tmp_path: Path, kind: str) -> None:
    dataset = read.open(write(tmp_path, values(kind), ".zarr"))
    assert dataset.notes == ()
    assert dataset.dtype == dataset.stored_dtype == kind


def test_labels_of_a_nifti_keep_numbers_that_float32_rounds(tmp_path: Path) -> None:
    stored = np.full(SHAPE, 16_777_217, np.int32)  # 2^24 + 1
    stored[0] = 3
    dataset = read.open(write(tmp_path, stored, ".nii"))
    found = set(np.unique(dataset.read_stored(0, dataset.levels[0].box)))
    assert found == {3, 16_777_217}
    assert dataset.dtype == np.float32


def test_a_float64_beyond_float32_is_refused(tmp_path: Path) -> None:
    stored = values("float64")
    stored[1, 2, 3] = 1e300
    dataset = read.open(write(tmp_path, stored, ".ome.tif"))
    with pytest.raises(SourceError) as caught:
        dataset.read(0, dataset.levels[0].box)
    assert "found voxels beyond 1e+30" in str(caught.value)
