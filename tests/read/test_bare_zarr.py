"""Zarr arrays without OME-Zarr's metadata, written by zarr-python."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr

from stereocell import read
from stereocell.model.errors import SourceError, UsageError
from stereocell.model.tiling import Box
from support.phantoms import f_phantom, write_ome_zarr

SIZE_UM = (0.5, 0.2, 0.25)


def write(path: Path, version: Any = 3, voxels: Any = None, **options: Any) -> Path:
    body = f_phantom() if voxels is None else voxels
    array = zarr.create_array(
        path, shape=body.shape, dtype=body.dtype, chunks=(8,) * body.ndim, zarr_format=version,
        **options,
    )  # fmt: skip
    array[:] = body
    return path


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("name", ["a.zarr", "it's an array"])
def test_an_array_is_read_as_a_volume(tmp_path: Path, version: int, name: str) -> None:
    path = write(tmp_path / name, version)
    dataset = read.open(path, spacing_um=SIZE_UM)
    box = Box((1, 7, 3), (9, 30, 20))
    np.testing.assert_array_equal(dataset.read(0, box).voxels, f_phantom()[box.slices])
    assert dataset.arrays[0].chunk == (8, 8, 8)
    assert any("assumed" in note for note in dataset.notes)
    with pytest.raises(SourceError, match="--spacing-um"):
        read.open(path)


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_axes_come_from_names_of_dimensions_or_the_user(tmp_path: Path, version: int) -> None:
    body = f_phantom()
    stored = np.stack([body, body + 1], axis=-1)
    attributes = {"element_size_um": SIZE_UM}
    named: dict[str, Any] = {"dimension_names": list("zyxc")} if version == 3 else {}
    if version == 2:
        attributes["_ARRAY_DIMENSIONS"] = list("zyxc")  # type: ignore[assignment]
    lines = write(tmp_path / "a.zarr", version, stored, attributes=attributes, **named)
    bare = write(tmp_path / "b.zarr", version, stored)
    for dataset in (read.open(lines), read.open(bare, axes="zyxc", spacing_um=SIZE_UM)):
        assert dataset.levels[0].spacing_um == SIZE_UM
        np.testing.assert_array_equal(dataset.read(1, dataset.levels[0].box).voxels, body + 1)
        assert dataset.notes == ()
    with pytest.raises(SourceError, match="--axes zyxc"):
        read.open(bare, spacing_um=SIZE_UM)
    with pytest.raises(UsageError, match=r"--axes zyx: .* of length .*, expected 4 letters"):
        read.open(bare, axes="zyx")


def test_a_group_of_several_arrays_lists_them(tmp_path: Path) -> None:
    zarr.open_group(tmp_path / "g.zarr", mode="w")
    write(tmp_path / "g.zarr" / "raw")
    dataset = read.open(tmp_path / "g.zarr", spacing_um=SIZE_UM)
    assert "array raw: the only volume" in dataset.notes[0]
    zarr.open_group(tmp_path / "g.zarr" / "deep", mode="w")
    write(tmp_path / "g.zarr" / "deep" / "label")
    (tmp_path / "g.zarr" / "notes.txt").write_text("of no array")
    with pytest.raises(SourceError, match=r"found deep/label \(16, 48, 36\), raw .* as .*/raw$"):
        read.open(tmp_path / "g.zarr")
    assert read.open(tmp_path / "g.zarr" / "raw", spacing_um=SIZE_UM).name == "g-raw"


def test_axes_of_an_ome_zarr_are_its_own(tiny_zarr_05: Path) -> None:
    with pytest.raises(UsageError, match="names its axes, c, z, y, x"):
        read.open(tiny_zarr_05, axes="czyx")


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_a_level_of_an_image_names_the_image(tmp_path: Path, version: str) -> None:
    both = np.stack([f_phantom(), f_phantom() + 1])
    image = write_ome_zarr(tmp_path / "a b.zarr", [both], "czyx", version)
    with pytest.raises(
        SourceError, match=rf"found a level of an OME-Zarr image, expected the image: {image} "
    ):
        read.open(image / "0", spacing_um=SIZE_UM)
    dataset = read.open(image / "0", spacing_um=SIZE_UM, axes="czyx")
    np.testing.assert_array_equal(dataset.read(1, dataset.levels[0].box).voxels, f_phantom() + 1)


def test_named_axes_without_z_are_not_read_as_others(tmp_path: Path) -> None:
    named = write(tmp_path / "a.zarr", dimension_names=list("tyx"))
    with pytest.raises(SourceError, match=r"one plane .*: found axes t, y, x, .* --axes zyx reads"):
        read.open(named, spacing_um=SIZE_UM)
    assert read.open(named, spacing_um=SIZE_UM, axes="zyx").time_points == 1
    flat = write(tmp_path / "b.zarr", voxels=f_phantom()[None, None, :1])
    with pytest.raises(SourceError, match=r"one plane \(2D\)"):
        read.open(flat, spacing_um=SIZE_UM)


@pytest.mark.parametrize("axes", ["zyx", "tczyx", "T, C, Z, Y, X"])
def test_axes_of_length_1_may_be_left_out(tmp_path: Path, axes: str) -> None:
    path = write(tmp_path / "a.zarr", voxels=f_phantom()[None, None])
    dataset = read.open(path, spacing_um=SIZE_UM, axes=axes)
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, f_phantom())


def test_a_damaged_chunk_is_refused_in_one_line(tmp_path: Path) -> None:
    path = write(tmp_path / "a.zarr")
    chunk = next(file for file in sorted(path.rglob("*")) if file.is_file() and "c" in file.parts)
    chunk.write_bytes(chunk.read_bytes()[:9])
    dataset = read.open(path, spacing_um=SIZE_UM)
    with pytest.raises(
        SourceError, match="expected chunks that are whole: copy or download it again"
    ):
        dataset.read(0, dataset.levels[0].box)


def test_a_chunk_of_gzip_that_does_not_decode_is_named(tmp_path: Path) -> None:
    array = zarr.create_array(
        str(tmp_path / "a.zarr"),
        shape=(8, 16, 16),
        chunks=(4, 16, 16),
        dtype="u2",
        compressors=zarr.codecs.GzipCodec(),
    )
    array[:] = np.arange(8 * 16 * 16).reshape(8, 16, 16)
    chunk = tmp_path / "a.zarr" / "c" / "1" / "0" / "0"
    content = bytearray(chunk.read_bytes())
    content[-6] ^= 1  # a byte of the checksum
    chunk.write_bytes(content)
    dataset = read.open(tmp_path / "a.zarr", spacing_um=SIZE_UM)
    with pytest.raises(SourceError) as caught:
        dataset.read(0, dataset.levels[0].box)
    line = str(caught.value)
    assert ": chunk c/1/0/0: damaged (the library says: Error -3 while decompressing data" in line
    assert line.endswith("), expected chunks that are whole: copy or download it again")
