"""OME-Zarr of versions 0.1 to 0.6, in folders and zip files, and the remedies in refusals."""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr

from stereocell import read
from stereocell.model.errors import SourceError, UsageError
from support.phantoms import f_phantom, write_ome_zarr
from support.reading import read_voxels

BODY = f_phantom()
UM = (0.5, 0.2, 0.25)
AXES = [{"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]


def write_early(path: Path, version: str, voxels: Any, axes: Any = None) -> Path:
    """Write an image without transformations, in the form of OME-Zarr before 0.4."""
    group = zarr.open_group(path, mode="w", zarr_format=2)
    array = group.create_array("0", shape=voxels.shape, dtype=voxels.dtype)
    array[...] = voxels
    image: dict[str, Any] = {"version": version, "datasets": [{"path": "0"}]}
    group.attrs["multiscales"] = [image | ({"axes": axes} if axes else {})]
    return path


def write_systems(path: Path, steps: Any, systems: Any = None, image_steps: Any = ()) -> Path:
    """Write an image of version 0.6 whose level has these transformations."""
    group = zarr.open_group(path, mode="w", zarr_format=3)
    group.create_array("0", shape=BODY.shape, dtype="u2")[...] = BODY
    image: dict[str, Any] = {
        "coordinateSystems": systems or [{"name": "intrinsic", "axes": AXES}],
        "datasets": [{"path": "0", "coordinateTransformations": steps}],
    }
    if image_steps:
        image["coordinateTransformations"] = image_steps
    group.attrs["ome"] = {"version": "0.6", "multiscales": [image]}
    return path


@pytest.mark.parametrize(
    ("version", "axes"),
    [("0.1", None), ("0.2", None), ("0.3", list("tczyx")), ("0.3", list("zyx"))],
)
def test_versions_before_0_4_are_read_if_the_spacing_is_given(
    tmp_path: Path, version: str, axes: Any
) -> None:
    stored = BODY if axes == list("zyx") else BODY[None, None]
    path = write_early(tmp_path / "a.zarr", version, stored, axes)
    with pytest.raises(SourceError, match=rf"OME-Zarr {version} states none.*--spacing-um"):
        read.open(path)
    dataset = read.open(path, spacing_um=UM)
    assert dataset.levels[0].spacing_um == UM
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, BODY)
    assert any("names no axes" in note for note in dataset.notes) == (axes is None)


def test_an_image_of_0_1_with_three_axes_is_read_by_the_users_axes(tmp_path: Path) -> None:
    path = write_early(tmp_path / "a.zarr", "0.1", BODY)
    with pytest.raises(SourceError, match=r"found 3 dimensions, expected 5, .*--axes"):
        read.open(path, spacing_um=UM)
    np.testing.assert_array_equal(read_voxels(path, spacing_um=UM, axes="zyx"), BODY)
    named = write_early(tmp_path / "b.zarr", "0.3", BODY, list("zyx"))
    with pytest.raises(UsageError, match="names its axes"):
        read.open(named, spacing_um=UM, axes="zyx")


@pytest.mark.parametrize(
    "steps",
    [
        [{"type": "scale", "scale": list(UM), "input": "0", "output": "intrinsic"}],
        [
            {
                "type": "sequence", "input": "0", "output": {"name": "intrinsic"},
                "transformations": [
                    {"type": "scale", "scale": list(UM)},
                    {"type": "translation", "translation": [1, 2, 3]},
                ],
            }
        ],
        [
            {
                "type": "affine", "input": "0", "output": "intrinsic",
                "affine": [[0.5, 0, 0, 4], [0, 0.2, 0, 5], [0, 0, 0.25, 6]],
            }
        ],
    ],
)  # fmt: skip
def test_coordinate_systems_of_0_6_are_read(tmp_path: Path, steps: Any) -> None:
    path = write_systems(tmp_path / "a.zarr", steps)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == UM
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, BODY)
    assert dataset.notes == ()


def test_a_transformation_to_another_coordinate_system_is_noted_and_not_applied(
    tmp_path: Path,
) -> None:
    scale = {"type": "scale", "scale": list(UM), "input": "0", "output": "own"}
    further = {"type": "scale", "scale": [2, 2, 2], "input": "own", "output": "stage"}
    systems = [{"name": "stage", "axes": AXES}, {"name": "own", "axes": AXES}]
    dataset = read.open(write_systems(tmp_path / "a.zarr", [scale], systems, [further]))
    assert dataset.levels[0].spacing_um == UM
    assert any("left out: coordinate systems stage" in note for note in dataset.notes)


def test_a_system_without_units_leads_on_to_one_that_has_them(tmp_path: Path) -> None:
    voxels = [{"name": name, "type": "space"} for name in "zyx"]
    systems = [{"name": "voxels", "axes": voxels}, {"name": "physical", "axes": AXES}]
    own = {"type": "scale", "scale": [1, 1, 1], "input": "0", "output": "voxels"}
    onwards = {"type": "scale", "scale": list(UM), "input": "voxels", "output": "physical"}
    dataset = read.open(write_systems(tmp_path / "a.zarr", [own], systems, [onwards]))
    assert dataset.levels[0].spacing_um == UM


def test_steps_of_0_6_without_names_of_systems_are_all_applied(tmp_path: Path) -> None:
    steps = [{"type": "scale", "scale": [1, 0.4, 0.5]}, {"type": "scale", "scale": [0.5] * 3}]
    dataset = read.open(write_systems(tmp_path / "a.zarr", steps))
    assert dataset.levels[0].spacing_um == UM


@pytest.mark.parametrize(
    "step",
    [
        {"type": "rotation", "rotation": [[0, 1, 0], [1, 0, 0], [0, 0, 1]]},
        {"type": "affine", "affine": [[1, 0.1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]},
        {"type": "displacements", "path": "field"},
    ],
)
def test_a_rotated_grid_is_refused_with_a_remedy_that_works(
    tmp_path: Path, step: dict[str, Any]
) -> None:
    path = write_systems(tmp_path / "a.zarr", [step | {"input": "0", "output": "intrinsic"}])
    with pytest.raises(SourceError, match=rf"OME-Zarr 0.6: .*{step['type']}.*{path}/0 --axes zyx"):
        read.open(path)
    np.testing.assert_array_equal(read_voxels(path / "0", axes="zyx", spacing_um=UM), BODY)


@pytest.mark.parametrize("name", ["a.ozx", "a.ome.zarr.zip", "a.zip"])
@pytest.mark.parametrize(("version", "top"), [("0.4", ""), ("0.5", ""), ("0.5", "a.ome.zarr/")])
def test_a_zip_file_is_read_without_unpacking(
    tmp_path: Path, name: str, version: str, top: str
) -> None:
    folder = write_ome_zarr(tmp_path / "x.ome.zarr", [BODY], version=version, chunks=(8, 24, 18))
    labels = zarr.open_group(folder).create_group("labels")
    labels.attrs["labels"] = ["cells"]
    write_ome_zarr(folder / "labels" / "cells", [BODY], version=version)
    with zipfile.ZipFile(tmp_path / name, "w") as archive:
        archive.comment = json.dumps({"ome": {"version": version}}).encode()
        for file in sorted(path for path in folder.rglob("*") if path.is_file()):
            archive.write(file, top + file.relative_to(folder).as_posix())
    dataset = read.open(tmp_path / name)
    whole = read.open(folder)
    assert dataset.name == "a"
    assert dataset.levels == whole.levels
    assert dataset.fingerprint == whole.fingerprint
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, BODY)
    assert dataset.files == (str(tmp_path / name),)
    assert any("label images" in note for note in dataset.notes)
    np.testing.assert_array_equal(read_voxels(tmp_path / name / "labels" / "cells"), BODY)


def test_a_zip_file_that_unpacks_to_more_than_its_array_is_refused(tmp_path: Path) -> None:
    folder = write_ome_zarr(tmp_path / "x.ome.zarr", [BODY], compressors=None)
    chunk = folder / "0" / "c" / "0" / "0" / "0"
    chunk.write_bytes(bytes(5 << 20))
    with zipfile.ZipFile(tmp_path / "a.ozx", "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(path for path in folder.rglob("*") if path.is_file()):
            archive.write(file, file.relative_to(folder).as_posix())
    dataset = read.open(tmp_path / "a.ozx")
    with pytest.raises(SourceError, match="5242880 bytes, more than"):
        dataset.read(0, dataset.levels[0].box)


def test_a_zip_file_of_other_content_is_refused_as_a_zip_archive(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("notes.txt", "none")
    with pytest.raises(SourceError, match="a zip archive"):
        read.open(tmp_path / "a.zip")


def test_an_archive_of_ome_zarr_without_a_group_is_named(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.ozx", "w") as archive:
        archive.writestr("notes.txt", "none")
    with pytest.raises(SourceError, match="a zip archive without a Zarr group, expected OME-Zarr"):
        read.open(tmp_path / "a.ozx")


def test_an_unknown_version_is_named_with_a_remedy_that_works(tmp_path: Path) -> None:
    path = write_systems(tmp_path / "a.ome.zarr", [{"type": "scale", "scale": list(UM)}])
    group = zarr.open_group(path, mode="a")
    image = group.attrs["ome"]["multiscales"][0]
    group.attrs["ome"] = {"version": "0.9", "multiscales": [image]}
    dataset = read.open(path)
    np.testing.assert_array_equal(read_voxels(path), BODY)
    assert any("OME-Zarr 0.9: this version is unknown" in note for note in dataset.notes)
    group.attrs["ome"] = {"version": "0.9", "multiscales": [{"levels": [{"path": "0"}]}]}
    with pytest.raises(SourceError, match=r"OME-Zarr 0\.9, an unknown version") as caught:
        read.open(path)
    assert f"{path}/0 --axes zyx --spacing-um z,y,x" in str(caught.value)
    np.testing.assert_array_equal(read_voxels(path / "0", axes="zyx", spacing_um=UM), BODY)
