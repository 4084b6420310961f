"""HDF5 and Imaris files, written by h5py: axes, voxel sizes, padding, links."""

import json
import struct
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from stereocell import read
from stereocell.model.errors import SourceError, UsageError
from stereocell.model.tiling import Box
from stereocell.read.hdf5_file import texts as hdf5_texts
from stereocell.read.hdf5_file.types import require_standard
from support.array_files import SIZE_UM, characters, write_bdv_xml, write_ims
from support.phantoms import F_BODY, f_phantom
from support.reading import refusing, whole


def write(path: Path, name: str = "raw", voxels: Any = None, **attributes: Any) -> Path:
    with h5py.File(path, "a") as file:
        dataset = file.create_dataset(name, data=f_phantom() if voxels is None else voxels)
        dataset.attrs.update(attributes)
    return path


refusal = refusing(read.open, SourceError, UsageError)


def test_the_only_volume_is_read_and_named(tmp_path: Path) -> None:
    path = write(tmp_path / "Ann's µ data.H5", "a/b/raw", element_size_um=SIZE_UM)
    write(path, "table", np.zeros((5, 2)))
    dataset = read.open(path)
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert dataset.levels[0].spacing_um == SIZE_UM
    assert dataset.name == "Ann's µ data"
    assert dataset.notes[0] == "dataset /a/b/raw: the only volume of the file"
    assert "z, y, x are assumed" in dataset.notes[1]


@pytest.mark.parametrize("key", [":/raw", ":raw", ":/group/../raw"])
def test_a_key_chooses_among_datasets(tmp_path: Path, key: str) -> None:
    path = write(tmp_path / "a.h5", element_size_um=SIZE_UM)
    write(path, "label", f_phantom() // 1000)
    if ".." in key:
        assert "'..' not found" in refusal(f"{path}{key}") or "'group'" in refusal(f"{path}{key}")
        return
    assert whole(read.open(f"{path}{key}")).max() == F_BODY
    line = refusal(path)
    assert "/label (16, 48, 36) uint16, /raw (16, 48, 36) uint16" in line
    assert line.endswith(f"expected one, such as {path}:/raw")
    assert "expected one of label, raw" in refusal(f"{path}:/none")


@pytest.mark.slow
def test_axes_come_from_tags_labels_and_the_user(tmp_path: Path) -> None:
    body = f_phantom()
    stored = np.stack([body, body + 1], axis=-1)  # z, y, x, c
    tags = json.dumps({"axes": [{"key": key} for key in "zyxc"]})
    tagged = write(tmp_path / "tags.h5", voxels=stored, axistags=tags, element_size_um=SIZE_UM)
    labelled = write(tmp_path / "labels.h5", voxels=stored, element_size_um=SIZE_UM)
    with h5py.File(labelled, "a") as file:
        for dim, label in zip(file["raw"].dims, "zyxc", strict=True):
            dim.label = label
    bare = write(tmp_path / "bare.h5", voxels=stored, element_size_um=SIZE_UM)
    for dataset in (read.open(tagged), read.open(labelled), read.open(bare, axes="zyxc")):
        np.testing.assert_array_equal(whole(dataset, 1), body + 1)
        assert not any("assumed" in note for note in dataset.notes)
    assert "--axes zyxc" in refusal(bare)
    assert "--axes zyx: found axes of length 16, 48, 36, 2, expected 4" in refusal(bare, axes="zyx")
    series = write(tmp_path / "t.h5", voxels=stored.transpose(3, 2, 1, 0))
    dataset = read.open(series, axes="txyz", spacing_um=SIZE_UM, time=1)
    np.testing.assert_array_equal(whole(dataset), body + 1)


@pytest.mark.parametrize(
    ("attributes", "expected"),
    [
        ({"resolution": (40.0, 4.0, 4.0), "units": "nm"}, (0.04, 0.004, 0.004)),
        ({"spacing": (2.0, 1.0, 1.0), "unit": "micrometer"}, (2.0, 1.0, 1.0)),
        ({"resolution": (40.0, 4.0, 4.0), "units": [b"nm", b"nm", b"um"]}, (0.04, 0.004, 4.0)),
    ],
)
def test_sizes_with_a_unit_become_um(
    tmp_path: Path, attributes: dict[str, Any], expected: tuple[float, ...]
) -> None:
    found = read.open(write(tmp_path / "a.hdf5", **attributes)).levels[0].spacing_um
    assert found == pytest.approx(expected)


def test_a_size_without_a_unit_is_not_a_length(tmp_path: Path) -> None:
    assert "--spacing-um" in refusal(write(tmp_path / "a.h5", resolution=(40.0, 4.0, 4.0)))


def test_links_in_the_folder_are_followed_and_others_refused(tmp_path: Path) -> None:
    (tmp_path / "home").mkdir()
    write(tmp_path / "secret.h5", element_size_um=SIZE_UM)
    write(tmp_path / "home" / "b.h5", element_size_um=SIZE_UM)
    path = tmp_path / "home" / "a.h5"
    with h5py.File(path, "w") as file:
        file["near"] = h5py.ExternalLink("b.h5", "/raw")
        file["soft"] = h5py.SoftLink("/near")
        file["far"] = h5py.ExternalLink("../secret.h5", "/raw")
        file["absolute"] = h5py.ExternalLink(str(tmp_path / "secret.h5"), "/raw")
        file["circle"] = h5py.SoftLink("/circle")
        file.create_dataset("outside", (4, 5, 6), "u1", external=[("x.raw", 0, 120)])
        layout = h5py.VirtualLayout((4, 5, 6), "u1")
        layout[:] = h5py.VirtualSource("../secret.h5", "raw", (16, 48, 36))[:4, :5, :6]
        file.create_virtual_dataset("virtual", layout)
    for key in ("near", "soft"):
        np.testing.assert_array_equal(whole(read.open(f"{path}:/{key}")), f_phantom())
    for key in ("far", "absolute"):
        assert "expected a file in" in refusal(f"{path}:/{key}")
    assert "links form a circle" in refusal(f"{path}:/circle")
    for key in ("outside", "virtual"):
        assert "voxels lie in other files" in refusal(f"{path}:/{key}")


@pytest.mark.slow
def test_a_filter_of_hdf5plugin_is_read(tmp_path: Path) -> None:
    import hdf5plugin

    with h5py.File(tmp_path / "a.h5", "w") as file:
        made = file.create_dataset("raw", data=f_phantom(), chunks=(8, 8, 8), **hdf5plugin.Blosc())
        made.attrs["element_size_um"] = SIZE_UM
    np.testing.assert_array_equal(whole(read.open(tmp_path / "a.h5")), f_phantom())


def test_an_unknown_filter_is_named_with_a_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path / "a.h5")
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file.create_dataset("raw", data=f_phantom(), compression="lzf")
    monkeypatch.setattr(h5py.h5z, "filter_avail", lambda code: False)
    assert 'pip install "stereocell[hdf5]"' in refusal(tmp_path / "b.h5")


@pytest.mark.parametrize("suffix", [".h5", ".ims"])
def test_an_incomplete_file_is_refused_in_one_line(tmp_path: Path, suffix: str) -> None:
    path = write(tmp_path / "a.h5", voxels=np.zeros((9, 300, 300)))
    content = path.read_bytes()
    for damaged in (b"", b"no HDF5 at all", content[:512], content[: len(content) // 2]):
        (tmp_path / f"b{suffix}").write_bytes(damaged)
        refusal(tmp_path / f"b{suffix}")
    half = f"cut short at byte {len(content) // 2} of {len(content)}"
    assert half in refusal(tmp_path / f"b{suffix}")
    (tmp_path / f"c{suffix}").mkdir()
    assert "found a folder" in refusal(tmp_path / f"c{suffix}")
    refusal(write(tmp_path / f"d{suffix}", "flat", np.zeros((40, 30))))


def test_imaris_has_its_true_size_levels_times_names_and_colours(tmp_path: Path) -> None:
    czyx = np.stack([f_phantom(), f_phantom()[::-1]])
    path = write_ims(tmp_path / "a b.ims", czyx)
    dataset = read.open(path, time=1)
    assert [level.shape for level in dataset.levels] == [(16, 48, 36), (16, 24, 18)]
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    assert dataset.levels[1].spacing_um == pytest.approx((0.5, 0.4, 0.5))
    assert dataset.levels[1].origin_um == pytest.approx((0.0, 0.1, 0.125))
    assert [channel.name for channel in dataset.channels] == ["DAPI", "CD31"]
    assert dataset.channels[0].color == (0.0, 0.0, 1.0)
    assert dataset.channels[1].color == pytest.approx((1.0, 0.2159, 0.0), abs=1e-3)
    for channel in (0, 1):
        np.testing.assert_array_equal(whole(dataset, channel), czyx[channel] + 1)
    assert dataset.time_points == 2


def test_imaris_units_become_um(tmp_path: Path) -> None:
    path = write_ims(tmp_path / "a.ims", f_phantom()[None].repeat(2, 0), unit="nm")
    assert read.open(path).levels[0].spacing_um == pytest.approx([s / 1000 for s in SIZE_UM])


def test_imaris_that_claims_more_than_it_holds_is_refused(tmp_path: Path) -> None:
    path = write_ims(tmp_path / "a.ims", f_phantom()[None].repeat(2, 0))
    with h5py.File(path, "a") as file:
        group = file["DataSet/ResolutionLevel 0/TimePoint 0/Channel 0"]
        group.attrs["ImageSizeZ"] = characters("1000")
    assert "ImageSizeZ: found 1000, expected 1 to 21" in refusal(path)
    with h5py.File(path, "a") as file:
        file["DataSet/ResolutionLevel 0/TimePoint 0/Channel 0"].attrs["ImageSizeZ"] = characters(
            "16"
        )
        del file["DataSet/ResolutionLevel 0/TimePoint 1/Channel 1"]
    dataset = read.open(path, time=1)
    with pytest.raises(SourceError, match="Channel 1"):
        whole(dataset, 1)


def test_bigdataviewer_s_setups_are_channels_of_unsigned_numbers(tmp_path: Path) -> None:
    body = f_phantom() * 60  # beyond int16
    with h5py.File(tmp_path / "a b.h5", "w") as file:
        for setup, time in np.ndindex(2, 2):
            for level in (0, 1):
                step = 2**level
                part = (body + 10 * setup + time)[:, ::step, ::step]
                path = f"t{time + 18:05d}/s{setup:02d}/{level}/cells"
                file.create_dataset(path, data=part.view(np.int16), chunks=(4, 8, 8))
            if time == 0:
                file[f"s{setup:02d}/resolutions"] = [[1.0, 1.0, 1.0], [2.0, 2.0, 1.0]]
    assert "--spacing-um" in refusal(tmp_path / "a b.h5")
    write_bdv_xml(tmp_path, "a b.h5", "nanometer")
    dataset = read.open(tmp_path / "a b.h5", time=1)
    assert [channel.name for channel in dataset.channels] == ["DAPI", "CD31"]
    assert [level.shape for level in dataset.levels] == [(16, 48, 36), (16, 24, 18)]
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    assert dataset.levels[1].spacing_um == pytest.approx((0.5, 0.4, 0.5))
    assert (dataset.dtype, dataset.time_points) == (np.uint16, 2)
    np.testing.assert_array_equal(whole(dataset, 1), body + 11)
    assert "2 setups of BigDataViewer" in dataset.notes[0]
    cells = read.open(f"{tmp_path / 'a b.h5'}:/t00018/s00/0/cells", spacing_um=SIZE_UM)
    assert whole(cells).shape == (16, 48, 36)
    assert "BigDataViewer's axes" in refusal(tmp_path / "a b.h5", axes="zyx")


# --- damage to parts of the file without a checksum


F32 = bytes.fromhex("11201f0004000000 00002000 17080017 7f000000")
F64 = bytes.fromhex("11203f0008000000 00004000 340b0034 ff030000")
U16 = bytes.fromhex("1000000002000000 00001000")


def damage(path: Path, part: bytes, offset: int, value: int) -> None:
    """Set one byte of a file, `offset` bytes behind the beginning of `part`.

    The file contains `part` exactly once.
    """
    content = bytearray(path.read_bytes())
    assert content.count(part) == 1
    content[content.index(part) + offset] = value
    path.write_bytes(content)


def window_refusal(source: Path) -> str:
    with pytest.raises(SourceError) as caught:
        whole(read.open(source, spacing_um=SIZE_UM))
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("dtype", "part", "offset", "value"),
    [
        ("f4", F32, 16, 0x77),  # the exponent's bias
        ("f4", F32, 1, 0x00),  # whether the mantissa's first bit is implied
        ("f8", F64, 15, 0x30),  # the bits of the mantissa
        ("u2", U16, 10, 12),  # the bits in use
    ],
    ids=["bias", "implied bit", "mantissa", "bits"],
)
def test_a_number_of_a_nonstandard_form_is_refused(
    tmp_path: Path, dtype: str, part: bytes, offset: int, value: int
) -> None:
    path = write(tmp_path / "a.h5", voxels=f_phantom().astype(dtype))
    damage(path, part, offset, value)
    assert "expected IEEE floats or integers that use all bits" in window_refusal(path)


def test_a_voxel_size_of_a_nonstandard_form_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.h5", element_size_um=SIZE_UM)
    damage(path, F64, 16, 0xFE)
    assert "attribute 'element_size_um'" in window_refusal(path)


@pytest.mark.parametrize("dtype", ["<f2", ">f4", "<f8", ">i2", "<u4", "|i1", "|b1"])
def test_standard_numbers_of_either_byte_order_are_read(tmp_path: Path, dtype: str) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("raw", data=(f_phantom() // 1000).astype(dtype))
        require_standard(file["raw"].id.get_type(), "raw")


def test_numbers_of_few_bits_are_read_if_the_filter_n_bit_packs_them(tmp_path: Path) -> None:
    body = f_phantom() % 4096
    with h5py.File(tmp_path / "a.h5", "w") as file:
        twelve_bits = h5py.h5t.STD_U16LE.copy()
        twelve_bits.set_precision(12)
        creation = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        creation.set_chunk((8, 48, 36))
        creation.set_filter(h5py.h5z.FILTER_NBIT)
        space = h5py.h5s.create_simple(body.shape)
        h5py.h5d.create(file.id, b"raw", twelve_bits, space, creation)
        file["raw"][:] = body
        assert file["raw"].id.get_storage_size() < 0.8 * body.nbytes
    dataset = read.open(tmp_path / "a.h5", spacing_um=SIZE_UM)
    np.testing.assert_array_equal(whole(dataset), body)


def write_chunks(path: Path, libver: str = "earliest", **options: Any) -> dict[Any, bytes]:
    """Write chunks of 8 planes; return the first bytes of each chunk's entry in a B-tree."""
    with h5py.File(path, "w", libver=libver) as file:
        raw = file.create_dataset("raw", data=f_phantom(), chunks=(8, 48, 36), **options)
        found: list[Any] = []
        raw.id.chunk_iter(found.append)
        return {
            one.chunk_offset[0]: struct.pack(
                "<II5Q", one.size, one.filter_mask, *one.chunk_offset, 0, one.byte_offset
            )
            for one in found
        }


@pytest.mark.parametrize(
    ("offset", "value", "expected"),
    [
        (36, 0x20, "no look-up finds"),  # the position within a voxel, which is always 0
        (8, 8, "twice"),
        (8, 16, "off the grid"),
        (43, 1, "bytes beyond the end of the file"),
        (41, 0x3F, "of another chunk"),
        (4, 1, "another size"),  # the chunk is compressed, but the entry says that it isn't
    ],
)
def test_an_index_of_chunks_that_contradicts_itself_is_refused(
    tmp_path: Path, offset: int, value: int, expected: str
) -> None:
    path = tmp_path / "a.h5"
    entries = write_chunks(path, compression="gzip")
    damage(path, entries[0], offset, value)
    line = window_refusal(path)
    assert "/raw: index of chunks: (" in line
    assert expected in line


@pytest.mark.slow
def test_an_index_of_many_chunks_is_compared_where_a_window_reads(tmp_path: Path) -> None:
    body = np.random.default_rng(0).integers(0, 256, (40, 100, 100), np.uint8)
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        raw = file.create_dataset("raw", data=body, chunks=(1, 5, 2))
        assert raw.id.get_num_chunks() == 40_000
        place, other = (20, 50, 60), (30, 0, 0)
        chunk, shared = (raw.id.get_chunk_info_by_coord(at) for at in (place, other))
    entry = struct.pack("<II5Q", 10, 0, *place, 0, chunk.byte_offset)
    damage(path, entry, 32, 1)  # the position within a voxel, which is always 0
    dataset = read.open(path, spacing_um=SIZE_UM)
    apart, across = Box((0, 0, 0), (19, 100, 100)), Box((19, 48, 58), (22, 56, 63))
    np.testing.assert_array_equal(dataset.read(0, apart).voxels, body[apart.slices])
    with pytest.raises(SourceError, match=r"\(20, 50, 60\): found an entry that no look-up finds"):
        dataset.read(0, across)
    damage(path, struct.pack("<Q", shared.byte_offset), 0, chunk.byte_offset & 0xFF)
    with pytest.raises(SourceError, match="bytes beyond the end of the file or of another chunk"):
        read.open(path, spacing_um=SIZE_UM).read(0, apart)


@pytest.mark.parametrize("libver", ["earliest", "latest"])
@pytest.mark.parametrize("most", [None, (None, 48, 36), (None, None, 36), (16, 48, 36)])
def test_an_index_of_any_kind_is_read_with_chunks_that_are_not_stored(
    tmp_path: Path, libver: str, most: Any
) -> None:
    body = f_phantom()
    body[4:12] = 0
    with h5py.File(tmp_path / "a.h5", "w", libver=libver) as file:
        raw = file.create_dataset("raw", body.shape, body.dtype, chunks=(4, 11, 9), maxshape=most)
        raw[:4], raw[12:] = body[:4], body[12:]
    dataset = read.open(tmp_path / "a.h5", spacing_um=SIZE_UM)
    np.testing.assert_array_equal(whole(dataset), body)


@pytest.mark.parametrize("name", ["axistags", "unit", "label", "scale"])
@pytest.mark.slow
def test_a_heap_of_texts_that_makes_hdf5_loop_without_end_is_refused_at_a_time_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """A heap object has 0 bytes, so HDF5 2.0 looks for the next object at the same place."""
    path = write(tmp_path / "a.h5", resolution=SIZE_UM)
    with h5py.File(path, "a") as file:
        if name in ("label", "scale"):
            for dim in file["raw"].dims:
                dim.label = "depth of it"
            if name == "scale":
                file["z"] = np.arange(16.0)
                file["z"].make_scale("z")
                file["raw"].dims[0].attach_scale(file["z"])
        else:
            file["raw"].attrs[name] = "depth of it"
    content = bytearray(path.read_bytes())
    last = content.rindex(b"depth of it\0\0\0\0\0") + 16  # the heap's next object
    if name == "scale":
        last += 24  # that object is the reference to the scale
    content[last + 8 : last + 16] = bytes(8)  # size of the free space after it
    path.write_bytes(content)
    monkeypatch.setattr(hdf5_texts, "_MOST_S", 1.0)
    line = window_refusal(path)
    assert "did not end within 1 s" in line
    assert ("dimension scales of /raw" in line) == (name == "scale")
