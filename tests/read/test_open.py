"""Readers of files that zarr and tifffile wrote directly: axes, dtypes, units, levels."""

from itertools import permutations
from pathlib import Path
from typing import Any

import h5py
import nrrd
import numpy as np
import pytest
import tifffile
import zarr
from numpy.typing import NDArray

from stereocell import read
from stereocell.model.errors import SourceError, UsageError
from stereocell.model.tiling import Box
from support.array_files import write_czi
from support.phantoms import UNITS, f_phantom, write_ome_tiff, write_ome_zarr

BOX = Box((1, 3, 5), (4, 30, 21))
FORMATS = ("tiny_zarr_04", "tiny_zarr_05", "tiny_tiff")


def in_order(czyx: NDArray[Any], axes: str) -> NDArray[Any]:
    """Return an array (c, z, y, x) with its axes in another order; `t` is an axis of length 1."""
    return np.moveaxis(czyx[None], range(5), ["tczyx".index(a) for a in "tczyx"]).transpose(
        ["tczyx".index(axis) for axis in axes]
    )


@pytest.mark.parametrize("fixture", FORMATS)
def test_metadata_and_voxels_are_read_as_written(
    fixture: str, request: pytest.FixtureRequest, voxels: NDArray[np.uint16]
) -> None:
    dataset = read.open(request.getfixturevalue(fixture))
    assert dataset.name == fixture.replace("_zarr_", "").replace("_tiff", "")
    assert dataset.dtype == np.uint16
    assert [level.shape for level in dataset.levels] == [(6, 40, 56), (6, 20, 28)]
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.2))
    assert dataset.levels[1].spacing_um == pytest.approx((0.5, 0.4, 0.4))
    assert [channel.name for channel in dataset.channels] == ["Hoechst", "CD31"]
    assert dataset.channels[0].color == (0.0, 0.0, 1.0)
    assert dataset.channels[1].color == pytest.approx((0.0, 1.0, 0.2158605), abs=1e-6)  # linear
    assert all(channel.is_named for channel in dataset.channels)
    assert dataset.notes == ()
    assert (dataset.time_points, dataset.images) == (1, 1)
    for channel in (0, 1):
        volume = dataset.read(channel, BOX)
        np.testing.assert_array_equal(volume.voxels, voxels[channel][BOX.slices])
        assert volume.voxels.dtype == np.uint16
        assert volume.spacing_um == pytest.approx((0.5, 0.2, 0.2))
        assert volume.origin_um == pytest.approx((0.5, 0.6, 1.0))
    coarse = dataset.read(1, Box((0, 2, 4), (6, 20, 28)), level=1)
    np.testing.assert_array_equal(coarse.voxels, voxels[1, :, 4::2, 8::2])
    # A coarse voxel averages a block of fine ones, so its centre lies half a fine voxel farther.
    assert coarse.origin_um == pytest.approx((0.0, 2 * 0.4 + 0.1, 4 * 0.4 + 0.1))


ZARR_AXES = ["zyx", "xyz", "yxz", "czyx", "cxyz", "tczyx", "tcyzx", "tzyx", "zcyx"]


@pytest.mark.parametrize("version", ["0.4", "0.5"])
@pytest.mark.parametrize("axes", ZARR_AXES)
def test_zarr_axes_in_any_order_give_the_same_f(tmp_path: Path, axes: str, version: str) -> None:
    body = f_phantom()
    stored = in_order(np.stack([body, body]) if "c" in axes else body[None], "tczyx")
    stored = stored.transpose(
        ["tczyx".index(a) for a in axes] + ["tczyx".index(a) for a in "tczyx" if a not in axes]
    )
    stored = stored.reshape(stored.shape[: len(axes)])
    path = write_ome_zarr(tmp_path / "f.zarr", [stored], axes=axes, version=version)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.2))
    volume = dataset.read(len(dataset.channels) - 1, dataset.levels[0].box)
    np.testing.assert_array_equal(volume.voxels, body)


@pytest.mark.parametrize("order", ["".join(p) for p in permutations("TCZ")])
def test_tiff_planes_in_any_order_give_the_same_f(tmp_path: Path, order: str) -> None:
    body = f_phantom()
    tczyx = np.stack([np.stack([body * (1 + t) + c for c in range(2)]) for t in range(3)])
    stored = tczyx.transpose(["TCZYX".index(axis) for axis in order + "YX"])
    path = write_ome_tiff(tmp_path / "f.ome.tif", stored, axes=order + "YX")
    dataset = read.open(path, time=2)
    assert dataset.time_points == 3
    assert dataset.notes == ("3 time points; building --time 2",)
    volume = dataset.read(1, dataset.levels[0].box)
    np.testing.assert_array_equal(volume.voxels, tczyx[2, 1])


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "int16", "float32", ">u2", ">i2", ">f4"])
@pytest.mark.parametrize("suffix", [".zarr", ".ome.tif"])
def test_dtypes_are_kept_in_native_order(tmp_path: Path, dtype: str, suffix: str) -> None:
    body = (f_phantom() // 4).astype(dtype)
    path = tmp_path / f"f{suffix}"
    if suffix == ".zarr":
        write_ome_zarr(path, [body], version="0.4")
    else:
        tifffile.imwrite(
            path,
            body,
            byteorder=">" if dtype[0] == ">" else None,
            ome=True,
            metadata={"axes": "ZYX", "PhysicalSizeZ": 1, "PhysicalSizeY": 1, "PhysicalSizeX": 1},
        )
    dataset = read.open(path)
    volume = dataset.read(0, dataset.levels[0].box)
    assert dataset.dtype == np.dtype(dtype).newbyteorder("=")
    assert volume.voxels.dtype == np.dtype(dtype).newbyteorder("=")
    np.testing.assert_array_equal(volume.voxels, body)


@pytest.mark.parametrize(
    ("unit", "um"),
    [
        ("nanometer", 1e-3),
        ("micrometer", 1.0),
        ("millimeter", 1e3),
        ("meter", 1e6),
        ("inch", 25400),
    ],
)
def test_zarr_units_become_um(tmp_path: Path, unit: str, um: float) -> None:
    path = write_ome_zarr(tmp_path / "f.zarr", [f_phantom()], units=dict.fromkeys("zyx", unit))
    assert read.open(path).levels[0].spacing_um == pytest.approx((0.5 * um, 0.2 * um, 0.2 * um))


@pytest.mark.parametrize(("unit", "um"), [("nm", 1e-3), ("\u00b5m", 1.0), ("mm", 1e3), ("m", 1e6)])
def test_tiff_units_become_um(tmp_path: Path, unit: str, um: float) -> None:
    path = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(), unit=unit)
    assert read.open(path).levels[0].spacing_um == pytest.approx((0.5 * um, 0.2 * um, 0.2 * um))


def test_all_transformations_are_composed_and_a_translation_places_the_level(
    tmp_path: Path,
) -> None:
    body = f_phantom()
    path = write_ome_zarr(
        tmp_path / "f.zarr",
        [body, body[:, ::4, ::4]],
        scales=[{"z": 1, "y": 0.1, "x": 0.1}, {"z": 1, "y": 0.4, "x": 0.4}],
        translations=[{"z": 3, "y": 5, "x": 7}, {"z": 3, "y": 5.2, "x": 7.1}],
        image_transformations=[{"type": "scale", "scale": [2.0, 2.0, 2.0]}],
    )
    fine, coarse = read.open(path).levels
    assert fine.spacing_um == pytest.approx((2.0, 0.2, 0.2))
    assert fine.origin_um == (0.0, 0.0, 0.0)
    assert coarse.spacing_um == pytest.approx((2.0, 0.8, 0.8))
    assert coarse.origin_um == pytest.approx((0.0, 0.4, 0.2))
    # A given spacing stretches the levels and their places alike.
    coarse = read.open(path, spacing_um=(4.0, 1.0, 1.0)).levels[1]
    assert coarse.spacing_um == pytest.approx((4.0, 4.0, 4.0))
    assert coarse.origin_um == pytest.approx((0.0, 2.0, 1.0))


def test_odd_sizes_halve_to_a_whole_factor(tmp_path: Path) -> None:
    path = write_ome_tiff(tmp_path / "f.ome.tif", np.ones((3, 41, 57), np.uint8), levels=3)
    levels = read.open(path).levels
    assert [level.shape for level in levels] == [(3, 41, 57), (3, 21, 29), (3, 11, 15)]
    assert levels[2].spacing_um == pytest.approx((0.5, 0.8, 0.8))


@pytest.mark.parametrize("suffix", [".zarr", ".ome.tif"])
def test_a_given_spacing_replaces_a_missing_one(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"f{suffix}"
    if suffix == ".zarr":
        write_ome_zarr(path, [f_phantom()], units={})
    else:
        write_ome_tiff(path, f_phantom(), spacing=None)
    with pytest.raises(SourceError, match=r"voxel size: not found .* --spacing-um z,y,x"):
        read.open(path)
    assert read.open(path, spacing_um=(3.0, 1.0, 2.0)).levels[0].spacing_um == (3.0, 1.0, 2.0)


@pytest.mark.parametrize("bad", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, float("nan"))])
def test_a_given_spacing_must_be_a_length(tiny_tiff: Path, bad: tuple[float, float, float]) -> None:
    with pytest.raises(UsageError, match=r"--spacing-um is .*, expected z,y,x in um"):
        read.open(tiny_tiff, spacing_um=bad)


@pytest.mark.parametrize("fixture", FORMATS)
def test_a_window_out_of_range_raises_a_value_error(
    fixture: str, request: pytest.FixtureRequest
) -> None:
    dataset = read.open(request.getfixturevalue(fixture))
    for channel, box, level in (
        (2, BOX, 0),
        (0, BOX, 2),
        (0, Box((0, 0, 0), (7, 1, 1)), 0),
        (0, Box((-1, 0, 0), (1, 1, 1)), 0),
        (0, Box((1, 1, 1), (1, 2, 2)), 0),
    ):
        with pytest.raises(ValueError, match=r"doesn't exist|leaves level"):
            dataset.read(channel, box, level)


@pytest.mark.parametrize("path", ["0", "0/"])
def test_absent_chunks_are_the_fill_value(tiny_zarr_05: Path, path: str) -> None:
    metadata = tiny_zarr_05 / "zarr.json"
    metadata.write_text(metadata.read_text("utf-8").replace('"path": "0"', f'"path": "{path}"'))
    assert f'"path": "{path}"' in metadata.read_text("utf-8")
    (tiny_zarr_05 / "0/c/0/0/0/0").unlink()
    volume = read.open(tiny_zarr_05).read(0, Box((0, 0, 0), (2, 16, 17)))
    assert not volume.voxels[:, :, :16].any()
    assert volume.voxels[:, :, 16].all()


def test_chunks_of_a_removed_array_are_not_read_as_fill_value(tiny_zarr_05: Path) -> None:
    dataset = read.open(tiny_zarr_05)
    (tiny_zarr_05 / "0").rename(tiny_zarr_05 / "elsewhere")
    with pytest.raises(SourceError, match=r"0/zarr.json was removed after it was opened"):
        dataset.read(0, Box((0, 0, 0), (2, 16, 17)))


def test_pages_of_a_file_are_closed(tiny_tiff: Path) -> None:
    dataset = read.open(tiny_tiff)
    assert dataset.on_close is not None
    dataset.on_close()
    del dataset  # closing twice does no harm; an open file would be a ResourceWarning


def test_unused_units_of_time_and_channel_do_no_harm(tmp_path: Path) -> None:
    stack = np.stack([f_phantom()] * 2)
    path = write_ome_zarr(tmp_path / "t.zarr", [stack], axes="tzyx", units=UNITS)
    assert read.open(path, time=1).time == 1


@pytest.mark.parametrize("suffix", [".zarr", ".ome.tif"])
def test_further_images_are_noted(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"two{suffix}"
    body = f_phantom()
    if suffix == ".zarr":
        write_ome_zarr(path, [body])
        group = zarr.open_group(path, mode="r+")
        ome: Any = group.attrs["ome"]
        group.attrs["ome"] = {**ome, "multiscales": ome["multiscales"] * 2}
    else:
        sizes = {"PhysicalSizeZ": 1, "PhysicalSizeY": 1, "PhysicalSizeX": 1}
        with tifffile.TiffWriter(path, ome=True) as writer:
            for voxels in (body, body[::-1]):
                writer.write(voxels, metadata={"axes": "ZYX", **sizes})
    dataset = read.open(path)
    (note,) = dataset.notes
    if suffix == ".zarr":
        words = "2 images in the group; building --series 1, the first; not built: --series 2: 16 x"
        assert note.startswith(words)
        assert len(read.list_series(path)) == 2
    else:
        assert note.startswith("2 images; building --series 1, the largest: 16 x 48 x 36 voxels")
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, body)


@pytest.mark.slow
def test_a_format_is_recognised_by_the_first_bytes_if_the_name_is_unknown(tmp_path: Path) -> None:
    body = f_phantom()
    tifffile.imwrite(tmp_path / "a.dat", body, photometric="minisblack")
    nrrd.write(str(tmp_path / "b.nrrd"), body, index_order="C")
    with h5py.File(tmp_path / "c.mat", "w") as file:
        file["raw"] = body
    write_czi(tmp_path / "d.czi", {None: body[None, None]})
    (tmp_path / "b.nrrd").rename(tmp_path / "b")
    (tmp_path / "d.czi").rename(tmp_path / "d.CZI (1)")
    for name in ("a.dat", "b", "c.mat", "d.CZI (1)"):
        dataset = read.open(tmp_path / name, spacing_um=(2.0, 1.0, 1.0))
        np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, body)


def test_a_folder_of_planes_and_other_files_is_read_as_planes(tmp_path: Path) -> None:
    folder = tmp_path / "export.lif"
    folder.mkdir()
    for z, plane in enumerate(f_phantom()):
        tifffile.imwrite(folder / f"z{z:03d}.tif", plane)
    with h5py.File(folder / "all.h5", "w") as file:
        file["raw"] = f_phantom() + 1
    dataset = read.open(folder, spacing_um=(2.0, 1.0, 1.0))
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, f_phantom())


def test_an_address_of_a_local_format_is_refused_with_the_advice_to_copy() -> None:
    with pytest.raises(SourceError, match="CZI at an address, expected a path on this machine"):
        read.open("https://nowhere.invalid/a.czi")


def test_raw_voxels_are_refused_with_the_name_of_their_header(tmp_path: Path) -> None:
    (tmp_path / "a.raw").write_bytes(bytes(range(100)))
    with pytest.raises(SourceError, match="unknown format: found"):
        read.open(tmp_path / "a.raw")
    (tmp_path / "a.mhd").write_text("NDims = 3")
    with pytest.raises(
        SourceError, match=r"found the voxels that a\.mhd describes, expected that header file"
    ):
        read.open(tmp_path / "a.raw")
