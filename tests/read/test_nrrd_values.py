"""Values at each voxel of NRRD: diffusion, vectors, tensors and colours get names."""

from pathlib import Path
from typing import Any

import nibabel
import nrrd
import numpy as np
import pytest

from stereocell import read

SHAPE = (4, 6, 5)
SPACE = {"space": "left-posterior-superior", "space origin": [0, 0, 0]}


def write(path: Path, constants: list[float], kind: str, axis: int, **fields: Any) -> read.Dataset:
    """Write one image per constant along an axis of the file (0: the fastest), and open it."""
    voxels = np.zeros((*SHAPE, len(constants)), np.int16) + np.array(constants, np.int16)
    voxels[1, 2, 3] += 500
    directions: list[Any] = [[2.0, 0, 0], [0, 2.0, 0], [0, 0, 2.0]]
    directions.insert(axis, [np.nan] * 3)
    kinds = ["space"] * 3
    kinds.insert(axis, kind)
    header = {**SPACE, "space directions": np.array(directions), "kinds": kinds, **fields}
    nrrd.write(str(path), np.moveaxis(voxels, -1, axis), header)
    return read.open(path)


def levels(path: Path) -> list[int]:
    """Return the constant of each time point's image, which is its smallest voxel."""
    found = []
    for time in range(read.open(path).time_points):
        dataset = read.open(path, time=time)
        found.append(int(dataset.read(0, dataset.levels[0].box).voxels.min()))
    return found


GRADIENTS = ("0 0 0", "1 0 0", "0 0.5 0", "0 0 1", "0 0 0")


def diffusion(gradients: tuple[str, ...]) -> dict[str, str]:
    numbered = {f"DWMRI_gradient_{n:04d}": text for n, text in enumerate(gradients)}
    return {"modality": "DWMRI", "DWMRI_b-value": "1000", **numbered}


@pytest.mark.parametrize("axis", [0, 3])
@pytest.mark.parametrize("encoding", ["raw", "gzip"])
def test_images_of_diffusion_are_time_points_with_their_b_values(
    tmp_path: Path, axis: int, encoding: str
) -> None:
    path = tmp_path / "a.nrrd"
    fields = {**diffusion(GRADIENTS), "encoding": encoding}
    dataset = write(path, [0, 10, 20, 30, 40], "list", axis, **fields)
    assert (dataset.time_points, len(dataset.channels)) == (5, 1)
    assert levels(path) == [0, 10, 20, 30, 40]
    (note,) = [one for one in dataset.notes if "diffusion" in one]
    assert note.endswith(
        "b 0 s/mm2 at 0, 4, b 250 s/mm2 at 2, b 1000 s/mm2 in 2 directions at 1, 3"
    )


@pytest.mark.parametrize("axis", [0, 3])
def test_an_image_without_diffusion_weighting_comes_first(tmp_path: Path, axis: int) -> None:
    path = tmp_path / "a.nrrd"
    gradients = ("1 0 0", "0 0.5 0", "0 0 0")
    dataset = write(path, [10, 20, 30], "list", axis, **diffusion(gradients))
    assert levels(path) == [30, 20, 10]
    assert any("in the order of b-values and not of the file" in note for note in dataset.notes)


def test_b_matrices_state_b_values(tmp_path: Path) -> None:
    rows = ("0 0 0 0 0 0", "800 0 0 0 0 0")
    fields = {f"DWMRI_B-matrix_{n:04d}": row for n, row in enumerate(rows)}
    dataset = write(tmp_path / "a.nrrd", [0, 10], "list", 3, modality="DWMRI", **fields)
    assert any("b 0 s/mm2 at 0, b 800 s/mm2 at 1" in note for note in dataset.notes)


def test_missing_gradients_are_noted(tmp_path: Path) -> None:
    fields = diffusion(GRADIENTS[:3])
    dataset = write(tmp_path / "a.nrrd", [0, 10, 20, 30], "list", 3, **fields)
    assert dataset.time_points == 4
    assert any("DWMRI_gradient states only 3 of them" in note for note in dataset.notes)


@pytest.mark.parametrize(
    ("kind", "count", "names"),
    [
        ("vector", 3, ["x", "y", "z"]),
        ("3D-symmetric-matrix", 6, ["xx", "xy", "xz", "yy", "yz", "zz"]),
        ("RGB-color", 3, ["Red", "Green", "Blue"]),
        ("complex", 2, ["real part", "imaginary part"]),
    ],
)
def test_parts_of_a_value_are_named_channels(
    tmp_path: Path, kind: str, count: int, names: list[str]
) -> None:
    dataset = write(tmp_path / "a.nrrd", list(range(count)), kind, 0)
    assert [channel.name for channel in dataset.channels] == names
    assert (dataset.channels[0].color is not None) == (kind == "RGB-color")
    note = f"{count} values at each voxel (kind {kind}) are read as channels: {', '.join(names)}"
    assert note in dataset.notes


def test_values_of_an_unknown_kind_are_noted(tmp_path: Path) -> None:
    dataset = write(tmp_path / "a.nrrd", [1, 2, 3, 4], "list", 0)
    assert "4 values at each voxel (kind list) are read as channels" in dataset.notes


@pytest.mark.parametrize(("b_values", "order"), [("0 995 1000", [0, 10, 20]),
                                                 ("1000 5 500", [10, 20, 0])])  # fmt: skip
def test_b_values_beside_a_nifti_name_its_images(
    tmp_path: Path, b_values: str, order: list[int]
) -> None:
    voxels = np.zeros((*SHAPE, 3), np.int16) + np.array([0, 10, 20], np.int16)
    path = tmp_path / "dwi.nii.gz"
    nibabel.save(nibabel.Nifti1Image(voxels, np.diag([2.0, 2, 2, 1])), path)
    (tmp_path / "dwi.bval").write_text(b_values + "\n", "utf-8")
    assert levels(path) == order
    (note,) = [one for one in read.open(path).notes if "diffusion" in one]
    assert "3 images at a place are of diffusion (the .bval file beside it)" in note
    assert "b 0 s/mm2 at 0" in note


def test_b_values_for_another_number_of_images_are_noted(tmp_path: Path) -> None:
    path = tmp_path / "dwi.nii"
    nibabel.save(nibabel.Nifti1Image(np.ones((*SHAPE, 3), np.int16), np.eye(4)), path)
    (tmp_path / "dwi.bval").write_text("0 1000", "utf-8")
    assert any(
        ".bval file beside it: found 2 b-values, expected 3" in note
        for note in read.open(path).notes
    )
