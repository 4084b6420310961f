"""TIFF without OME-XML: axes, spacings, names and colours of files that tifffile writes."""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray

from conftest import Server
from stereocell import read
from stereocell.model.errors import SourceError, UsageError
from stereocell.model.tiling import Box
from stereocell.read.spacing import Triple
from support.tiff_files import write_lsm, write_ndtiff, write_stk

GIVEN: Triple = (2.0, 1.0, 1.0)
# tifffile would take 3 or 4 planes for RGB
SIZES = {"T": 3, "Z": 5, "C": 2, "Y": 12, "X": 14, "S": 3}
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def counted(axes: str, dtype: str = "uint16") -> NDArray[Any]:
    shape = tuple(SIZES[axis] for axis in axes)
    return np.random.default_rng(5).integers(0, 250, shape).astype(dtype)


def read_whole(source: Path | str, **options: Any) -> None:
    dataset = read.open(source, **options)
    dataset.read(0, dataset.levels[0].box)


def refusal(source: Path | str, **options: Any) -> str:
    with pytest.raises(SourceError) as caught:
        read_whole(source, **options)
    line = str(caught.value)
    assert "\n" not in line
    assert str(source) in line
    assert "expected" in line
    return line


def hold_voxels(dataset: read.Dataset, stored: NDArray[Any], axes: str) -> None:
    """Assert that all channels of a dataset equal an array whose axes are these letters."""
    found = dict(zip(axes, range(len(axes)), strict=True))
    for channel in range(len(dataset.channels)):
        key: list[Any] = [slice(None)] * len(axes)
        for axis, index in (("T", dataset.time), ("C", channel), ("S", channel)):
            if axis in found:
                key[found[axis]] = index
        np.testing.assert_array_equal(
            dataset.read(channel, dataset.levels[0].box).voxels, stored[tuple(key)]
        )


@pytest.mark.parametrize("axes", ["ZYX", "ZCYX", "TZYX", "TZCYX"])
@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float32"])
@pytest.mark.parametrize("unit", ["micron", "\\u00B5m", "um"])
def test_imagej_hyperstacks_are_read(tmp_path: Path, axes: str, dtype: str, unit: str) -> None:
    stored = counted(axes, dtype)
    path = tmp_path / "a stack's \u00b5.TIF"
    tifffile.imwrite(
        path, stored, imagej=True, resolution=(5.0, 4.0),
        metadata={"axes": axes, "spacing": 0.5, "unit": unit},
    )  # fmt: skip
    dataset = read.open(path, time=SIZES["T"] - 1 if "T" in axes else 0)
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.25, 0.2))
    assert dataset.time_points == (3 if "T" in axes else 1)
    assert len(dataset.channels) == (2 if "C" in axes else 1)
    assert not any("doesn't state" in note for note in dataset.notes)
    hold_voxels(dataset, stored, axes)


def test_imagej_colours_and_names_of_channels_are_read(tmp_path: Path) -> None:
    ramp, none = np.arange(256, dtype=np.uint8), np.zeros(256, np.uint8)
    path = tmp_path / "x.tif"
    tifffile.imwrite(
        path, counted("ZCYX"), imagej=True,
        metadata={
            "axes": "ZCYX", "LUTs": [np.stack([none, ramp, none]), np.stack([ramp] * 3)],
            "Labels": ["DAPI", "CD31"] * 5, "mode": "composite",
        },
    )  # fmt: skip
    dataset = read.open(path, spacing_um=GIVEN)
    assert [channel.name for channel in dataset.channels] == ["DAPI", "CD31"]
    assert [channel.color for channel in dataset.channels] == [GREEN, None]


@pytest.mark.parametrize(
    "labels",
    [
        [f"c:{i % 2 + 1}/2 z:{i // 2 + 1}/5 - Jane Doe.lif" for i in range(10)],
        ["Jane Doe"] * 10,
        [str(i) for i in range(10)],
    ],
)
def test_labels_of_slices_are_not_names_of_channels(tmp_path: Path, labels: list[str]) -> None:
    path = tmp_path / "x.tif"
    metadata = {"axes": "ZCYX", "Labels": labels, "Info": "Patient = Jane Doe"}
    tifffile.imwrite(path, counted("ZCYX"), imagej=True, metadata=metadata)
    dataset = read.open(path, spacing_um=GIVEN)
    assert [channel.name for channel in dataset.channels] == ["Channel0", "Channel1"]
    assert "Doe" not in repr(dataset.notes)


@pytest.mark.parametrize(
    ("metadata", "expected"),
    [
        ({"unit": "um"}, "found y 0.25 um, x 0.2 um, but none along z (ImageJ leaves out a depth"),
        ({"unit": "um"}, "--spacing-um z,0.25,0.2"),
        ({"unit": "pixel", "spacing": 2.0}, "voxel size: not found with a unit of length"),
        ({"spacing": 2.0}, "voxel size: not found with a unit of length"),
        ({"unit": "um", "spacing": 0.0}, "voxel size z of level 0: found 0 um"),
    ],
)
def test_an_incomplete_spacing_of_imagej_is_reported(
    tmp_path: Path, metadata: dict[str, Any], expected: str
) -> None:
    path = tmp_path / "x.tif"
    metadata = {"axes": "ZYX", **metadata}
    tifffile.imwrite(path, counted("ZYX"), imagej=True, resolution=(5.0, 4.0), metadata=metadata)
    assert expected in refusal(path)
    assert read.open(path, spacing_um=GIVEN).levels[0].spacing_um == GIVEN


def test_a_stack_of_imagej_with_one_directory_is_read(tmp_path: Path) -> None:
    """Over 4 GB ImageJ writes one directory, and its description states how many planes follow."""
    stored = counted("TZCYX").astype(">u2")
    path = tmp_path / "big.tif"
    words = "ImageJ=1.54f\nimages=30\nchannels=2\nslices=5\nframes=3\nhyperstack=true\n"
    tifffile.imwrite(
        path, stored[0, 0, 0], byteorder=">", description=words, metadata=None, software=False
    )
    with tifffile.TiffFile(path) as tiff:
        assert tiff.pages.first.dataoffsets[0] + stored[0, 0, 0].nbytes == path.stat().st_size
    with path.open("ab") as file:
        file.write(stored.tobytes()[stored[0, 0, 0].nbytes :])
    dataset = read.open(path, time=2, spacing_um=GIVEN)
    hold_voxels(dataset, stored, "TZCYX")
    content = path.read_bytes()
    path.write_bytes(content[:-7])
    expected = f"cut short at byte {len(content) - 7} of {len(content)} or more"
    assert expected in refusal(path, spacing_um=GIVEN)


@pytest.mark.parametrize("bigtiff", [False, True])
@pytest.mark.parametrize("byteorder", ["<", ">"])
@pytest.mark.parametrize("options", [{}, {"compression": "zlib"}, {"tile": (16, 16)}])
@pytest.mark.parametrize("suffix", [".tif", ".TIFF", ".btf", ".tf8", ".dat"])
def test_pages_of_unknown_kind_are_slices_and_a_note_says_so(
    tmp_path: Path, bigtiff: bool, byteorder: Any, options: dict[str, Any], suffix: str
) -> None:
    stored = counted("ZYX")
    path = tmp_path / f"pages{suffix}"
    with tifffile.TiffWriter(path, bigtiff=bigtiff, byteorder=byteorder) as writer:
        for plane in stored:
            writer.write(plane, metadata=None, contiguous=False, **options)
    dataset = read.open(path, spacing_um=GIVEN)
    hold_voxels(dataset, stored, "ZYX")
    assert dataset.notes == ("the file doesn't state what its pages are: read as 5 slices along z",)


@pytest.mark.parametrize("axes", ["ZYX", "CZYX", "TZCYX", "ZTYX", "ZYXS", "CYXZ"])
def test_axes_that_tifffile_writes_are_read(tmp_path: Path, axes: str) -> None:
    stored = counted(axes, "uint8" if "S" in axes else "uint16")
    path = tmp_path / "x.tif"
    metadata = {"axes": axes, "spacing": 0.5, "unit": "um"}
    photometric: Any = "rgb" if "S" in axes else "minisblack"
    tifffile.imwrite(
        path, stored, metadata=metadata, resolution=(5.0, 4.0), photometric=photometric
    )
    dataset = read.open(path)
    assert dataset.levels[0].shape == (5, 12, 14)
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.25, 0.2))
    if axes == "CYXZ":
        stored, axes = stored.transpose(0, 3, 1, 2), "CZYX"
    hold_voxels(dataset, stored, axes)


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ((20, 3, 12, 14), "20 slices along z of 3 channels"),
        ((3, 20, 12, 14), "3 channels of 20 slices along z"),
    ],
)
def test_two_unknown_axes_are_planes_and_few_channels(
    tmp_path: Path, shape: tuple[int, ...], expected: str
) -> None:
    stored = np.arange(np.prod(shape), dtype=np.uint16).reshape(shape)
    tifffile.imwrite(tmp_path / "x.tif", stored, photometric="minisblack")
    dataset = read.open(tmp_path / "x.tif", spacing_um=GIVEN)
    assert dataset.notes == (f"the file doesn't state what its pages are: read as {expected}",)
    hold_voxels(dataset, stored, "ZCYX" if shape[1] == 3 else "CZYX")


@pytest.mark.parametrize("shape", [(20, 30, 12, 14), (5, 5, 12, 14), (2, 3, 20, 12, 14)])
def test_unnamed_axes_that_no_guess_fits_are_refused(
    tmp_path: Path, shape: tuple[int, ...]
) -> None:
    tifffile.imwrite(tmp_path / "x.tif", np.zeros(shape, np.uint8), photometric="minisblack")
    assert "expected pages whose axes are named" in refusal(tmp_path / "x.tif", spacing_um=GIVEN)


@pytest.mark.parametrize("is_planar", [False, True])
def test_colour_pixels_become_three_channels(tmp_path: Path, is_planar: bool) -> None:
    stored = np.random.default_rng(1).integers(0, 255, (5, 12, 14, 4)).astype(np.uint8)
    written = stored.transpose(0, 3, 1, 2) if is_planar else stored
    tifffile.imwrite(
        tmp_path / "x.tif", written, photometric="rgb", extrasamples=["unassalpha"],
        planarconfig="separate" if is_planar else "contig", metadata=None,
    )  # fmt: skip
    dataset = read.open(tmp_path / "x.tif", spacing_um=GIVEN)
    assert [channel.name for channel in dataset.channels] == ["Red", "Green", "Blue"]
    assert [channel.color for channel in dataset.channels] == [RED, GREEN, BLUE]
    assert "the alpha of its pixels is left out" in dataset.notes
    hold_voxels(dataset, stored, "ZYXS")


def test_colour_pixels_of_an_ome_tiff_become_channels(tmp_path: Path) -> None:
    stored = counted("ZYXS", "uint8")
    sizes = {"PhysicalSizeX": 1.0, "PhysicalSizeY": 1.0, "PhysicalSizeZ": 2.0}
    tifffile.imwrite(
        tmp_path / "x.ome.tif", stored, ome=True, photometric="rgb",
        metadata={"axes": "ZYXS", **sizes},
    )  # fmt: skip
    dataset = read.open(tmp_path / "x.ome.tif")
    assert [channel.name for channel in dataset.channels] == ["Red", "Green", "Blue"]
    assert dataset.levels[0].spacing_um == (2.0, 1.0, 1.0)
    hold_voxels(dataset, stored, "ZYXS")


def test_planes_that_an_lsm_s_description_does_not_count_are_reported(tmp_path: Path) -> None:
    stored = np.random.default_rng(5).integers(0, 250, (5, 3, 48, 36)).astype(np.uint8)
    channels = {"a": (0, 255, 0), "b": (255, 0, 0), "c": (255, 255, 255)}
    path = write_lsm(tmp_path / "a.lsm", stored, (1.5, 0.4, 0.3), channels)
    content = bytearray(path.read_bytes())
    depth = content.index(struct.pack("<I", 67127628)) + 16
    struct.pack_into("<i", content, depth, 4)
    path.write_bytes(content)
    (note,) = read.open(path).notes
    assert note == "the file's description counts 4 of 5 pages: the others are left out (20%)"


@pytest.mark.parametrize("suffix", [".lsm", ".LSM", ".tif"])
def test_zeiss_lsm_is_read(tmp_path: Path, suffix: str) -> None:
    stored = np.random.default_rng(5).integers(0, 250, (5, 3, 12, 14)).astype(np.uint8)
    channels = {"Ch2-T1": (0, 255, 0), "ChS1-T2": (255, 0, 0), "T PMT": (255, 255, 255)}
    path = write_lsm(tmp_path / f"cells{suffix}", stored, (1.5, 0.4, 0.3), channels)
    with tifffile.TiffFile(path) as tiff:
        assert [series.axes for series in tiff.series] == ["ZCYX", "ZSYX"]  # with thumbnails
        np.testing.assert_array_equal(tiff.series[0].asarray(), stored)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx((1.5, 0.4, 0.3))
    assert [channel.name for channel in dataset.channels] == list(channels)
    assert [channel.color for channel in dataset.channels] == [GREEN, RED, None]
    assert dataset.notes == ()
    hold_voxels(dataset, stored, "ZCYX")


@pytest.mark.parametrize("suffix", [".stk", ".STK", ".tif"])
def test_metamorph_stk_is_read(tmp_path: Path, suffix: str) -> None:
    stored = counted("ZYX")
    path = write_stk(tmp_path / f"cells{suffix}", stored, (1.5, 0.4, 0.3))
    np.testing.assert_array_equal(tifffile.imread(path), stored)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx((1.5, 0.4, 0.3))
    hold_voxels(dataset, stored, "ZYX")


def test_a_centimetre_of_the_tags_counts_and_a_printer_s_inch_does_not(tmp_path: Path) -> None:
    for unit, expected in (
        ("CENTIMETER", "found y 0.25 um, x 0.2 um, but none along z"),
        ("INCH", "not found"),
    ):
        path = tmp_path / f"{unit}.tif"
        tifffile.imwrite(path, counted("ZYX"), resolution=(5e4, 4e4), resolutionunit=unit)
        assert expected in refusal(path)


def test_a_larger_image_after_a_preview_is_read(tmp_path: Path) -> None:
    stored = counted("ZYX")
    path = tmp_path / "x.tif"
    with tifffile.TiffWriter(path) as writer:
        writer.write(np.zeros((5, 6), np.uint8), metadata=None)
        for plane in stored:
            writer.write(plane, metadata=None, contiguous=False)
    dataset = read.open(path, spacing_um=GIVEN)
    hold_voxels(dataset, stored, "ZYX")
    assert "1 other image in the file left out: the largest is built" in dataset.notes


def test_a_window_reads_the_chunks_that_it_touches(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "x.tif"
    tifffile.imwrite(path, np.zeros((50, 64, 64), np.uint16), tile=(16, 16), compression="zlib")
    dataset = read.open(path, spacing_um=GIVEN)
    assert dataset.arrays[0].chunk == (1, 16, 16)
    sizes: list[int] = []
    once = tifffile.FileHandle.read

    def counting(self: tifffile.FileHandle, size: int = -1, /) -> bytes:
        content = once(self, size)
        sizes.append(len(content))
        return content

    monkeypatch.setattr(tifffile.FileHandle, "read", counting)
    dataset.read(0, Box((3, 0, 0), (5, 20, 16)))
    assert len(sizes) <= 4


CUTS = (0.02, 0.3, 0.6, 0.9, 0.98)


@pytest.mark.parametrize("kind", ["imagej", "shaped", "pages", "zlib", "stk", "lsm"])
def test_a_file_that_is_cut_short_is_reported_as_such(tmp_path: Path, kind: str) -> None:
    stored = np.random.default_rng(2).integers(0, 60000, (9, 40, 40)).astype(np.uint16)
    path = tmp_path / "x.tif"
    if kind == "stk":
        write_stk(path, stored, GIVEN)
    elif kind == "lsm":
        write_lsm(path, stored[:, None], GIVEN, {"A": (255, 0, 0)})
    elif kind in ("pages", "zlib"):
        with tifffile.TiffWriter(path) as writer:
            for plane in stored:
                compression = "zlib" if kind == "zlib" else None
                writer.write(plane, metadata=None, contiguous=False, compression=compression)
    else:
        metadata = {"axes": "ZYX"}
        tifffile.imwrite(path, stored, imagej=kind == "imagej", metadata=metadata)
    content = path.read_bytes()
    read.open(path, spacing_um=GIVEN)
    for share in CUTS:
        short = content[: int(share * len(content))]
        path.write_bytes(short)
        line = refusal(path, spacing_um=GIVEN)
        found = line.partition(f"cut short at byte {len(short)} of ")[2].split()
        if kind == "lsm" and not found:
            continue  # its channels' names are stored after the planes
        assert len(short) < int(found[0]) <= len(content)


@pytest.mark.parametrize(
    ("head", "expected"),
    [
        (b"", "an empty file"),
        (b"<!DOCTYPE html><html>", "an HTML page"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:1\n", "git lfs pull"),
        (b"PK\x03\x04" + bytes(50), "a zip archive (unzip it"),
        (b"\x1f\x8b\x08" + bytes(50), "a gzip file"),
        (b"\x89PNG\r\n\x1a\n" + bytes(50), "a PNG image"),
        (b"\x89HDF\r\n\x1a\n", "HDF5 file"),
        (bytes(4000), "zeros"),
        (b"just some words", "a text file"),
        (b"\x01\x02\x03\x04\xff", "begins with the bytes 01 02 03 04"),
    ],
)
@pytest.mark.parametrize("name", ["x.tif", "x.ome.tif", "x.lsm", "x.stk", "x.zip"])
def test_a_file_that_is_not_tiff_is_named_by_its_first_bytes(
    tmp_path: Path, head: bytes, expected: str, name: str
) -> None:
    (tmp_path / name).write_bytes(head)
    assert f"found {expected}" in refusal(tmp_path / name) or expected in refusal(tmp_path / name)


def test_broken_ome_xml_is_refused_with_a_description_of_the_pages(tmp_path: Path) -> None:
    text = '<?xml version="1.0"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Im'
    path = tmp_path / "x.ome.tif"
    tifffile.imwrite(path, counted("ZYX"), description=text, metadata=None)
    line = refusal(path)
    assert "OME-XML: unclosed token" in line
    assert "without it the file is generic, IYX of 5 x 12 x 14, uint16" in line


def test_a_name_of_ome_tiff_without_ome_xml_is_noted(tmp_path: Path) -> None:
    path = tmp_path / "x.ome.tif"
    tifffile.imwrite(path, counted("ZYX"), imagej=True, metadata={"axes": "ZYX"})
    dataset = read.open(path, spacing_um=GIVEN)
    assert "the name says OME-TIFF, but the file has no OME-XML" in dataset.notes[0]


def companion_set(folder: Path, stored: NDArray[Any], names: list[str]) -> str:
    """Write a plane in each file, all without metadata, and return the OME-XML of the set."""
    ns = "http://www.openmicroscopy.org/Schemas/OME/2016-06"
    planes = ""
    for index, (name, plane) in enumerate(zip(names, stored, strict=True)):
        uuid = f"urn:uuid:00000000-0000-0000-0000-00000000000{index}"
        pointer = f'<OME xmlns="{ns}" UUID="{uuid}"><BinaryOnly MetadataFile="x.companion.ome" UUID="urn:uuid:9"/></OME>'  # noqa: E501
        tifffile.imwrite(folder / name, plane, description=pointer, metadata=None)
        planes += f'<TiffData FirstZ="{index}" IFD="0" PlaneCount="1"><UUID FileName="{name}">{uuid}</UUID></TiffData>'  # noqa: E501
    z, y, x = stored.shape
    pixels = (
        f'ID="Pixels:0" DimensionOrder="XYZCT" Type="uint16" SizeX="{x}" SizeY="{y}" SizeZ="{z}" '
        'SizeC="1" SizeT="1" PhysicalSizeX="1" PhysicalSizeY="1" PhysicalSizeZ="2"'
    )
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<OME xmlns="{ns}" UUID="urn:uuid:9">'
        f'<Image ID="Image:0"><Pixels {pixels}><Channel ID="Channel:0:0" Name="DAPI"/>{planes}'
        "</Pixels></Image></OME>\n"
    )


def test_a_set_of_files_with_its_ome_xml_beside_them_is_read(tmp_path: Path) -> None:
    stored = counted("ZYX")
    names = [f"x-Z{index}.ome.tiff" for index in range(5)]
    text = companion_set(tmp_path, stored, names)
    (tmp_path / "x.companion.ome").write_text(text)
    for name in [*names, "x.companion.ome"]:
        dataset = read.open(tmp_path / name)
        assert dataset.levels[0].spacing_um == (2.0, 1.0, 1.0)
        assert dataset.channels[0].name == "DAPI"
        hold_voxels(dataset, stored, "ZYX")
    (tmp_path / names[2]).unlink()
    assert "found 4 planes, expected 5" in refusal(tmp_path / names[0])
    (tmp_path / "x.companion.ome").unlink()
    assert "MetadataFile 'x.companion.ome': not found" in refusal(tmp_path / names[0])


def test_a_companion_elsewhere_is_not_read(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    folder.mkdir()
    text = companion_set(folder, counted("ZYX"), [f"x-Z{index}.ome.tiff" for index in range(5)])
    (tmp_path / "x.companion.ome").write_text(text)
    (folder / "x.companion.ome").symlink_to(tmp_path / "x.companion.ome")
    assert "expected a file in" in refusal(folder / "x-Z0.ome.tiff")


def test_axes_are_those_that_the_user_names(tmp_path: Path) -> None:
    stored = counted("ZCYX")
    path = tmp_path / "x.tif"
    tifffile.imwrite(path, stored[:, 0], imagej=True, metadata={"axes": "TYX"})
    line = refusal(path, spacing_um=GIVEN)
    assert "found 1 along z, and 5 time points, expected slices: --axes zyx reads" in line
    hold_voxels(read.open(path, axes="zyx", spacing_um=GIVEN), stored[:, 0], "ZYX")
    tifffile.imwrite(path, stored, photometric="minisblack")
    for axes in ("zcyx", "Z,C,Y,X"):
        dataset = read.open(path, axes=axes, spacing_um=GIVEN)
        assert dataset.notes == ()
        hold_voxels(dataset, stored, "ZCYX")
    dataset = read.open(path, axes="tzyx", time=3, spacing_um=GIVEN)
    hold_voxels(dataset, stored, "TZYX")
    sizes = {"PhysicalSizeX": 1.0, "PhysicalSizeY": 1.0, "PhysicalSizeZ": 2.0}
    ome = tmp_path / "x.ome.tif"
    tifffile.imwrite(ome, stored[:, 0], ome=True, metadata={"axes": "TYX", **sizes})
    assert "--axes zyx reads the time points as slices" in refusal(ome)
    hold_voxels(read.open(ome, axes="zyx"), stored[:, 0], "ZYX")


@pytest.mark.parametrize("axes", ["zyx", "zzyx", "tcyx", "zcyq", "zcyxt"])
def test_axes_that_do_not_fit_are_refused(tmp_path: Path, axes: str) -> None:
    tifffile.imwrite(tmp_path / "x.tif", counted("ZCYX"), photometric="minisblack")
    with pytest.raises(UsageError, match=r"found axes of length 5, 2, 12, 14, expected 4 letters"):
        read.open(tmp_path / "x.tif", axes=axes, spacing_um=GIVEN)


@pytest.mark.parametrize("option", [{"axes": "zyx"}, {"pattern": "{z}"}, {"series": 2}])
def test_an_option_of_another_format_is_refused(tmp_path: Path, option: dict[str, Any]) -> None:
    (name,) = option
    if name != "pattern":
        source = tmp_path / "x.nii"
        source.write_bytes(bytes(344) + b"n+1\0")
    else:
        source = tmp_path / "x.tif"
        tifffile.imwrite(source, counted("ZYX"))
    with pytest.raises(UsageError, match=rf"--{name} .*: found .*, expected .* or no --{name}"):
        read.open(source, **option)


def test_ndtiff_is_read_with_its_index(tmp_path: Path) -> None:
    stored = counted("CZYX")
    path = write_ndtiff(tmp_path / "x_NDTiffStack.tif", stored, ["DAPI", "GFP"])
    with tifffile.TiffFile(path) as tiff:
        assert tiff.series[0].kind == "ndtiff"
        np.testing.assert_array_equal(tiff.asarray(), stored)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == (2.0, 0.5, 0.5)
    assert [channel.name for channel in dataset.channels] == ["DAPI", "GFP"]
    assert not dataset.notes
    hold_voxels(dataset, stored, "CZYX")
    index = tmp_path / "NDTiff.index"
    index.write_bytes(index.read_bytes().replace(b"x_NDTiffStack.tif", b"../NDTiffStack.tif"[:17]))
    assert "NDTiff.index: '../" in refusal(path)


@pytest.mark.parametrize("photometric", ["minisblack", "rgb"])
def test_planes_that_were_written_one_by_one_are_a_stack(tmp_path: Path, photometric: Any) -> None:
    """A loop over `TiffWriter.write` makes them: each plane is a separate array to tifffile."""
    planes = counted("ZYX") if photometric == "minisblack" else counted("ZYXS")[..., :3]
    with tifffile.TiffWriter(tmp_path / "x.tif") as writer:
        for plane in planes:
            writer.write(plane, photometric=photometric)
    dataset = read.open(tmp_path / "x.tif", spacing_um=GIVEN)
    assert dataset.levels[0].shape == planes.shape[:3]
    colours = planes[..., None] if photometric == "minisblack" else planes
    for channel in range(colours.shape[-1]):
        found = dataset.read(channel, dataset.levels[0].box).voxels
        np.testing.assert_array_equal(found, colours[..., channel])
    assert any(f"read as {len(planes)} slices along z" in note for note in dataset.notes)


def test_a_companion_that_names_no_file_is_refused(tmp_path: Path) -> None:
    text = companion_set(tmp_path, counted("ZYX"), [f"x-Z{index}.ome.tiff" for index in range(5)])
    source = tmp_path / "y.companion.ome"
    for content, expected in (
        (text.replace("x-Z0", "gone"), "FileName: found 'gone.ome.tiff'"),
        (text.replace("x-Z0", "../x-Z0"), "leads to"),
        (text[:200], "OME-XML:"),
        ("", "found an empty file (copy or download it again), expected OME-XML"),
    ):
        source.write_text(content)
        assert expected in refusal(source)


def test_a_file_at_an_address_is_read_or_reported_as_cut_short(
    tmp_path: Path, serve: Callable[[Path], Server]
) -> None:
    stored = counted("ZYX")
    with tifffile.TiffWriter(tmp_path / "x.tif") as writer:
        for plane in stored:
            writer.write(plane, metadata=None, contiguous=False)
    content = (tmp_path / "x.tif").read_bytes()
    server = serve(tmp_path)
    hold_voxels(read.open(f"{server.url}/x.tif", spacing_um=GIVEN), stored, "ZYX")
    for kept in (1, 5, 700, len(content) - 600, len(content) - 10):
        (tmp_path / f"{kept}.tif").write_bytes(content[:kept])
        assert f"{kept}.tif: " in refusal(f"{server.url}/{kept}.tif", spacing_um=GIVEN)
