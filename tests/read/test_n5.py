"""N5 written by tensorstore: blocks, codecs, pyramids, containers of BigDataViewer."""

import bz2
import json
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import Server
from stereocell import read
from stereocell.model.tiling import Box
from support.array_files import BLOCK, SIZE_UM, write_bdv_xml
from support.array_files import write_n5 as write
from support.phantoms import f_phantom
from support.reading import read_voxels, refusing, whole

BOX = Box((1, 7, 3), (9, 30, 20))
NM: dict[str, Any] = {"pixelResolution": {"dimensions": [250, 200, 500], "unit": "nm"}}


refusal = refusing(read_voxels)


@pytest.mark.parametrize("packing", ["raw", "gzip", "zlib", "bzip2", "xz", "blosc", "zstd"])
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "int16", "float32"])
def test_every_codec_and_number_is_read(tmp_path: Path, packing: str, dtype: str) -> None:
    form: dict[str, Any] = {"type": "gzip", "useZlib": True} if packing == "zlib" else {}
    if packing == "blosc":
        form = {"cname": "lz4", "clevel": 5, "shuffle": 1}
    body = (f_phantom() // 4).astype(dtype)
    dataset = read.open(write(tmp_path / "it's.n5", body, {"type": packing, **form}, **NM))
    np.testing.assert_array_equal(whole(dataset), body)
    np.testing.assert_array_equal(dataset.read(0, BOX).voxels, body[BOX.slices])
    assert dataset.dtype == np.dtype(dtype)
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    assert dataset.arrays[0].chunk == BLOCK[::-1]


@pytest.mark.parametrize("size", [0, 3, 5])
def test_a_block_with_too_few_voxels_for_its_place_is_refused(tmp_path: Path, size: int) -> None:
    path = write(tmp_path / "a.n5", packing={"type": "raw"}, **NM)
    block = path / "1" / "0" / "0"
    content = bytearray(block.read_bytes())
    assert struct.unpack_from(">3I", content, 4) == (16, 12, 8)
    struct.pack_into(">I", content, 4 + 8, size)
    block.write_bytes(content[: 16 + 16 * 12 * size * 2])
    assert f"a block of ({size}, 12, 16) voxels, expected at least (8, 12, 16)" in refusal(path)


def test_an_absent_block_is_zero(tmp_path: Path) -> None:
    path = write(tmp_path / "a.n5", **NM)
    (path / "1" / "0" / "0").unlink()
    expected = f_phantom()
    expected[:8, :12, 16:32] = 0
    np.testing.assert_array_equal(whole(read.open(path)), expected)


@pytest.mark.parametrize("stated", ["levels", "group", "scales"])
def test_a_pyramid_has_its_levels(tmp_path: Path, stated: str) -> None:
    factors = [[1, 1, 1], [2, 2, 1]]
    body = f_phantom()
    for index, part in enumerate((body, body[:, ::2, ::2])):
        own = {"downsamplingFactors": factors[index]} if stated == "levels" else {}
        write(tmp_path / "p.n5" / f"s{index}", part, **own)
    group: dict[str, Any] = {"resolution": [250, 200, 500], "units": ["nm", "nm", "nm"]}
    if stated != "levels":
        group["scales" if stated == "scales" else "downsamplingFactors"] = factors
    (tmp_path / "p.n5" / "attributes.json").write_text(json.dumps(group))
    dataset = read.open(tmp_path / "p.n5")
    assert [level.shape for level in dataset.levels] == [(16, 48, 36), (16, 24, 18)]
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    assert dataset.levels[1].spacing_um == pytest.approx((0.5, 0.4, 0.5))
    np.testing.assert_array_equal(dataset.read(0, Box((0, 0, 0), (9, 9, 9)), 1).voxels,
                                  body[:9, :18:2, :18:2])  # fmt: skip
    # A single level takes the spacing of its group, which is that of level 0.
    assert read.open(tmp_path / "p.n5" / "s0").levels[0].spacing_um == pytest.approx(SIZE_UM)


def test_cosem_s_transform_names_its_axes(tmp_path: Path) -> None:
    about = {"axes": ["z", "y", "x"], "scale": [500, 200, 250], "units": ["nm"] * 3}
    dataset = read.open(write(tmp_path / "a.n5", transform=about))
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)


def bdv(folder: Path, unit: str = "nanometer") -> Path:
    """Write a container of two setups and two time points, and its XML."""
    for setup in (0, 1):
        for time in (0, 1):
            path = folder / "a.n5" / f"setup{setup}" / f"timepoint{time}"
            write(path / "s0", f_phantom() + 10 * setup + time)
        about = folder / "a.n5" / f"setup{setup}" / "attributes.json"
        about.write_text(json.dumps({"downsamplingFactors": [[1, 1, 1]]}))
    write_bdv_xml(folder, "a.n5", unit)
    return folder / "a.n5"


def test_a_container_of_bigdataviewer_has_channels_and_times(tmp_path: Path) -> None:
    dataset = read.open(bdv(tmp_path), time=1)
    assert [channel.name for channel in dataset.channels] == ["DAPI", "CD31"]
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    np.testing.assert_array_equal(whole(dataset, 1), f_phantom() + 11)
    assert dataset.time_points == 2
    one = read.open(tmp_path / "a.n5" / "setup1")
    assert ([c.name for c in one.channels], one.levels[0].spacing_um[0]) == (["CD31"], 0.5)
    np.testing.assert_array_equal(whole(one), f_phantom() + 10)
    assert "--spacing-um" in refusal(bdv(tmp_path / "pixels", unit="pixel"))


def test_the_xml_itself_opens_its_container_if_it_is_in_the_folder(tmp_path: Path) -> None:
    (tmp_path / "home").mkdir()
    bdv(tmp_path / "home")
    dataset = read.open(tmp_path / "home" / "b.xml", time=1)
    np.testing.assert_array_equal(whole(dataset, 1), f_phantom() + 11)
    assert [channel.name for channel in dataset.channels] == ["DAPI", "CD31"]
    (tmp_path / "home" / "a.n5").rename(tmp_path / "a.n5")
    assert "not found" in refusal(tmp_path / "home" / "b.xml")
    (tmp_path / "home" / "a.n5").symlink_to("../a.n5")
    assert "expected a container inside" in refusal(tmp_path / "home" / "b.xml")
    (tmp_path / "home" / "c.xml").write_text("<SpimData><other/></SpimData>")
    assert "found no HDF5 or N5 file" in refusal(tmp_path / "home" / "c.xml")
    (tmp_path / "home" / "d.xml").write_text("<SpimData><other>")
    refusal(tmp_path / "home" / "d.xml")


def test_several_datasets_are_listed(tmp_path: Path) -> None:
    write(tmp_path / "a.n5" / "raw", **NM)
    (tmp_path / "a.n5" / "attributes.json").write_text('{"n5": "2.0.0"}')
    assert read.open(tmp_path / "a.n5").levels[0].spacing_um == pytest.approx(SIZE_UM)
    write(tmp_path / "a.n5" / "deep" / "label")
    assert "found raw, deep/label, expected one" in refusal(tmp_path / "a.n5")


def test_axes_of_more_dimensions_are_given_or_named(tmp_path: Path) -> None:
    both = np.stack([f_phantom(), f_phantom() + 1])
    bare = write(tmp_path / "a.n5", both)
    named = write(tmp_path / "b.n5", both, axes=["x", "y", "z", "c"])
    for dataset in (
        read.open(bare, axes="czyx", spacing_um=SIZE_UM),
        read.open(named, spacing_um=SIZE_UM),
    ):
        np.testing.assert_array_equal(whole(dataset, 1), both[1])
    assert "--axes czyx" in refusal(bare)


def test_only_the_blocks_of_a_window_come_from_an_address(
    tmp_path: Path, serve: Callable[[Path], Server]
) -> None:
    write(tmp_path / "a.n5", **NM)
    server = serve(tmp_path)
    dataset = read.open(f"{server.url}/a.n5")
    dataset.read(0, Box((0, 12, 0), (8, 24, 17)))
    blocks = [path for path in server.gets("/a.n5/") if not path.endswith(".json")]
    assert sorted(set(blocks)) == ["/a.n5/0/1/0", "/a.n5/1/1/0"]


@pytest.mark.parametrize("place", ["0/0/0", "attributes.json", "0"])
def test_links_out_of_the_folder_are_refused(tmp_path: Path, place: str) -> None:
    write(tmp_path / "secret.n5", **NM)
    path = write(tmp_path / "a.n5", **NM)
    target = path / place
    if target.is_dir():
        target.rename(tmp_path / "moved")
    else:
        target.unlink()
    target.symlink_to(tmp_path / "secret.n5" / place)
    assert "expected a file in" in refusal(path)


@pytest.mark.parametrize("packing", ["raw", "gzip", "bzip2", "xz", "blosc", "zstd"])
def test_a_block_that_is_cut_short_is_refused_in_one_line(tmp_path: Path, packing: str) -> None:
    form = {"cname": "zstd", "clevel": 5, "shuffle": 0} if packing == "blosc" else {}
    path = write(tmp_path / "a.n5", packing={"type": packing, **form}, **NM)
    block = path / "0" / "0" / "0"
    content = block.read_bytes()
    for size in (0, 3, 15, 20, len(content) // 2):
        block.write_bytes(content[:size])
        refusal(path)
    block.write_bytes(content[:7] + b"\xff" + content[8:])
    refusal(path)


@pytest.mark.slow
def test_a_decompression_bomb_unpacks_no_further_than_its_block(tmp_path: Path) -> None:
    path = write(tmp_path / "a.n5", packing={"type": "bzip2"}, **NM)
    block = path / "0" / "0" / "0"
    block.write_bytes(block.read_bytes()[:16] + bz2.compress(bytes(1 << 27)))
    assert "unpacks to over" in refusal(path)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("dimensions", [36, -48, 16], "dimensions"),
        ("dimensions", "many", "dimensions"),
        ("dimensions", [36, 48], "at least 2 planes"),
        ("blockSize", [16, 12], "blockSize"),
        ("blockSize", [1 << 20, 1 << 20, 1 << 20], "GiB"),
        ("dataType", "object", "dataType"),
        ("compression", {"type": "jpeg"}, "compression: found 'jpeg'"),
        ("pixelResolution", {"dimensions": "wide", "unit": "nm"}, "--spacing-um"),
        ("pixelResolution", {"dimensions": [10**400] * 3, "unit": "nm"}, "found inf um"),
        ("downsamplingFactors", [10**400] * 3, "found inf um"),
    ],
)
def test_invalid_fields_are_named(tmp_path: Path, field: str, value: Any, message: str) -> None:
    path = write(tmp_path / "a.n5", **NM)
    about = path / "attributes.json"
    fields = json.loads(about.read_text("utf-8")) | {field: value}
    if field == "dimensions" and len(value) == 2:
        fields["blockSize"] = [16, 12]
    about.write_text(json.dumps(fields))
    assert message in refusal(path)


def test_attributes_that_are_not_a_table_are_refused_in_one_line(tmp_path: Path) -> None:
    for index, text in enumerate(("", "[]", "{", "[" * 100_000)):
        (tmp_path / f"{index}.n5").mkdir()
        (tmp_path / f"{index}.n5" / "attributes.json").write_text(text)
        refusal(tmp_path / f"{index}.n5")
    (tmp_path / "empty.n5").mkdir()
    assert "no dataset" in refusal(tmp_path / "empty.n5")


def test_a_file_in_place_of_a_folder_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.n5").write_bytes(b"packed")
    assert "found a file (a text file), expected a folder of N5" in refusal(tmp_path / "a.n5")


CONTRADICTIONS: dict[str, dict[str, Any]] = {
    "transform": {"transform": {"axes": ["z", "y", "x"], "scale": [1, 0.2, 0.25],
                                "units": ["um"] * 3}, **NM},
    "resolution": {**NM, "resolution": [0.25, 0.2, 1], "units": "um"},
}  # fmt: skip


@pytest.mark.parametrize("kind", CONTRADICTIONS)
def test_two_spacing_fields_that_disagree_are_reported(tmp_path: Path, kind: str) -> None:
    dataset = read.open(write(tmp_path / "a.n5", **CONTRADICTIONS[kind]))
    (note,) = [note for note in dataset.notes if "voxel spacing along" in note]
    assert note.startswith("voxel spacing along z:")
    assert {"1 um", "0.5 um"} <= set(re.findall(r"states (.*? um)", note))


def test_a_group_spacing_that_disagrees_with_its_dataset_is_reported(tmp_path: Path) -> None:
    write(tmp_path / "p.n5" / "s0", f_phantom(), **NM)
    group = {"resolution": [0.25, 0.2, 1], "units": ["um"] * 3, "scale_factor": 2}
    (tmp_path / "p.n5" / "attributes.json").write_text(json.dumps(group))
    dataset = read.open(tmp_path / "p.n5")
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    assert any("resolution of the group states 1 um" in note for note in dataset.notes)
    assert any("scale_factor 2 of the group are not applied" in note for note in dataset.notes)
    np.testing.assert_array_equal(whole(dataset), f_phantom())


def test_axes_of_cosem_s_transform_are_slowest_first(tmp_path: Path) -> None:
    about = {"axes": ["x", "y", "z"], "scale": [250, 200, 500], "units": ["nm"] * 3}
    stored = f_phantom().transpose(2, 1, 0)
    dataset = read.open(write(tmp_path / "a.n5", stored, transform=about))
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    path = write(tmp_path / "b.n5", stored, transform=about, axes=["x", "y", "z"])
    assert any("order of the axes: axes of the dataset states z, y, x" in note
               for note in read.open(path).notes)  # fmt: skip


def test_axes_that_list_z_first_are_noted_to_make_x_the_slowest(tmp_path: Path) -> None:
    path = write(tmp_path / "a.n5", axes=["z", "y", "x"])
    dataset = read.open(path, spacing_um=SIZE_UM)
    assert any("N5 lists the fastest axis first" in note for note in dataset.notes)
    turned = read.open(path, axes="zyx", spacing_um=SIZE_UM)
    np.testing.assert_array_equal(whole(turned), f_phantom())
    assert turned.notes == ()


def test_factors_and_fill_values_of_a_dataset_are_applied(tmp_path: Path) -> None:
    about = {**NM, "scale_factor": 2.0, "add_offset": -1024.0, "_FillValue": 3}
    body = f_phantom() + 10
    body[0, 0, 0] = 3
    dataset = read.open(write(tmp_path / "a.n5", body, **about))
    expected = body * 2.0 - 1024
    expected[0, 0, 0] = np.nan
    found = dataset.arrays[0].array[:, :, :]
    np.testing.assert_array_equal(found, expected)
    assert any("scale_factor 2 and add_offset -1024 are applied" in n for n in dataset.notes)
