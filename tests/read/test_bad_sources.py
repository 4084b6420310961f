"""Sources that can't be built: one line says what was found, where, and what was expected."""

import json
import re
import shutil
from collections.abc import Callable
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import numcodecs
import numpy as np
import pytest
import tifffile
from zarr.codecs import BloscCodec, GzipCodec, ZstdCodec

from conftest import Server
from stereocell import read
from stereocell.model.errors import SourceError, UsageError
from stereocell.model.tiling import Box
from support.phantoms import f_phantom, write_ome_tiff, write_ome_zarr

Maker = Callable[[Path], Path]

SMALL = np.random.default_rng(0).integers(0, 1000, (6, 48, 48), dtype=np.uint16)


def read_whole(source: str | Path, **options: Any) -> None:
    dataset = read.open(source, **options)
    for index, level in enumerate(dataset.levels):
        dataset.read(0, level.box, index)


def refusal(source: str | Path, **options: Any) -> str:
    """Open `source`, read all of it, and return the line of the SourceError that must be raised."""
    with pytest.raises(SourceError) as caught:
        read_whole(source, **options)
    line = str(caught.value)
    assert "\n" not in line
    assert len(line) < 500
    assert " at 0x" not in line
    assert "expected" in line or "needs" in line
    assert Path(str(source).split("?")[0]).name in line
    return line


def edit(file: Path, change: Callable[[Any], None]) -> None:
    """Change a JSON file in place."""
    content = json.loads(file.read_text("utf-8"))
    change(content)
    file.write_text(json.dumps(content))


def zarr_with(change: Callable[[Any], None], file: str = "zarr.json") -> Maker:
    """Return a function that makes an OME-Zarr 0.5 with a changed JSON `file`."""

    def make(folder: Path) -> Path:
        path = write_ome_zarr(folder / "bad.zarr", [SMALL])
        edit(path / file, change)
        return path

    return make


def multiscale(change: Callable[[Any], None]) -> Maker:
    """Return a function that makes an OME-Zarr 0.5 with a changed first multiscale."""
    return zarr_with(lambda content: change(content["attributes"]["ome"]["multiscales"][0]))


def scale(*values: float) -> Maker:
    """Return a function that makes an OME-Zarr with this scale (z, y, x)."""

    def change(image: Any) -> None:
        image["datasets"][0]["coordinateTransformations"][0]["scale"] = list(values)

    return multiscale(change)


def zarr_of(voxels: np.ndarray[Any, Any], axes: str = "zyx", **options: Any) -> Maker:
    return lambda folder: write_ome_zarr(folder / "bad.zarr", [voxels], axes=axes, **options)


def tiff_of(voxels: np.ndarray[Any, Any], axes: str = "ZYX", **options: Any) -> Maker:
    return lambda folder: write_ome_tiff(folder / "bad.ome.tif", voxels, axes, **options)


def text_file(name: str) -> Maker:
    def make(folder: Path) -> Path:
        (folder / name).write_text("this is not an image")
        return folder / name

    return make


def folder_named(name: str) -> Maker:
    def make(folder: Path) -> Path:
        (folder / name).mkdir()
        return folder / name

    return make


def plain_tiff(folder: Path) -> Path:
    tifffile.imwrite(folder / "plain.tif", SMALL)
    return folder / "plain.tif"


def rgb_tiff(folder: Path) -> Path:
    pixels = np.zeros((16, 16, 3), np.uint8)
    options = {"axes": "YXS"}
    tifffile.imwrite(folder / "rgb.ome.tif", pixels, ome=True, photometric="rgb", metadata=options)
    return folder / "rgb.ome.tif"


def complex_tiff(folder: Path) -> Path:
    options = {"axes": "ZYX", "PhysicalSizeX": 1.0, "PhysicalSizeY": 1.0, "PhysicalSizeZ": 1.0}
    tifffile.imwrite(folder / "c.ome.tif", SMALL.astype(np.complex64), ome=True, metadata=options)
    return folder / "c.ome.tif"


def incomplete_tiff(folder: Path) -> Path:
    """Write a TIFF whose OME-XML promises two planes more than the file holds."""
    path = write_ome_tiff(folder / "few.ome.tif", SMALL)
    xml = tifffile.tiffcomment(path).replace('SizeZ="6"', 'SizeZ="8"')
    tifffile.tiffcomment(path, xml.encode())
    return path


def missing_level(folder: Path) -> Path:
    path = write_ome_zarr(folder / "bad.zarr", [SMALL])
    shutil.rmtree(path / "0")
    return path


def growing_levels(folder: Path) -> Path:
    scales = [{"z": 1, "y": 1, "x": 1}] * 2
    return write_ome_zarr(folder / "bad.zarr", [SMALL[:, ::2, ::2], SMALL], scales=scales)


def mixed_dtypes(folder: Path) -> Path:
    scales = [{"z": 1, "y": 1, "x": 1}] * 2
    return write_ome_zarr(folder / "bad.zarr", [SMALL, SMALL.astype(np.float32)], scales=scales)


CASES: dict[str, tuple[Maker, str]] = {
    "nothing there": (lambda folder: folder / "nothing.zarr", "not found"),
    "unknown format": (text_file("notes.txt"), "unknown format"),
    "text as TIFF": (text_file("bad.ome.tif"), "found a text file, expected TIFF"),
    "text as Zarr": (
        text_file("bad.zarr"),
        r"found a file \(a text file\), expected a folder of OME-Zarr",
    ),
    "empty folder as Zarr": (folder_named("bad.zarr"), "zarr.json"),
    "folder as TIFF": (folder_named("bad.ome.tif"), "found a folder, expected a file"),
    "TIFF without spacing": (plain_tiff, "voxel size: not found.*--spacing-um z,y,x"),
    "flat RGB TIFF": (rgb_tiff, r"at least 2 planes.*a flat image of 3 channels\)"),
    "TIFF with missing planes": (incomplete_tiff, "found 6 planes, expected 8"),
    "TIFF of one plane": (tiff_of(SMALL[:1]), "at least 2 planes: found 1 along z"),
    "flat TIFF": (tiff_of(SMALL[0], "YX", spacing=None), "at least 2 planes: found 1 along z"),
    "flat TIFF with channels": (tiff_of(SMALL, "CYX", spacing=None), "at least 2 planes"),
    "complex TIFF": (complex_tiff, "dtype of level 0: found complex64, expected uint8"),
    "TIFF, negative spacing": (tiff_of(SMALL, spacing=(-1.0, 1.0, 1.0)), "voxel size z of level 0"),
    "TIFF, zero spacing": (tiff_of(SMALL, spacing=(1.0, 0.0, 1.0)), "voxel size y of level 0"),
    "TIFF, NaN spacing": (
        tiff_of(SMALL, spacing=(1.0, 1.0, float("nan"))),
        "voxel size x of level 0",
    ),
    "TIFF, spacing in pixels": (tiff_of(SMALL, unit="pixel"), "voxel size: not found"),
    "no multiscales": (
        zarr_with(lambda content: content["attributes"]["ome"].pop("multiscales")),
        "voxel size: not found",
    ),
    "empty multiscales": (
        zarr_with(lambda content: content["attributes"]["ome"].update(multiscales=[])),
        "found no multiscales, expected the attribute",
    ),
    "no attributes": (
        zarr_with(lambda content: content.pop("attributes")),
        "voxel size: not found",
    ),
    "plate": (
        zarr_with(lambda content: content.update(attributes={"ome": {"plate": {}}})),
        "found a plate",
    ),
    "many series": (
        zarr_with(lambda content: content.update(attributes={"ome": {"bioformats2raw.layout": 3}})),
        "bioformats2raw",
    ),
    "no axes": (multiscale(lambda image: image.pop("axes")), "multiscales.0.*'axes' is missing"),
    "axes without units": (
        multiscale(lambda image: image.update(axes=["z", "y", "x"])),
        "voxel size: not found with a unit",
    ),
    "axis twice": (
        multiscale(lambda image: image["axes"].__setitem__(0, image["axes"][1])),
        "axes y, y, x: two have the same name",
    ),
    "axes too few": (multiscale(lambda image: image["axes"].pop(0)), "axes"),
    "no levels": (multiscale(lambda image: image.update(datasets=[])), "datasets: found none"),
    "level not there": (missing_level, "level '0'"),
    "levels that grow": (growing_levels, "shape .* of level 1"),
    "levels of two dtypes": (mixed_dtypes, "dtype of level 1: found float32"),
    "flat Zarr": (zarr_of(SMALL[0], "yx"), "at least 2 planes: found no axis z"),
    "Zarr of one plane": (zarr_of(SMALL[:1]), "at least 2 planes: found 1 along z"),
    "complex Zarr": (zarr_of(SMALL.astype(np.complex64)), "found complex64, expected uint8"),
    "negative spacing": (scale(-0.5, 1, 1), "voxel size z of level 0: found -0.5 um"),
    "zero spacing": (scale(1, 0, 1), "voxel size y of level 0: found 0 um"),
    "NaN spacing": (scale(1, 1, float("nan")), "voxel size x of level 0: found nan um"),
    "scale of two numbers": (scale(1, 1), "found scale of 2 numbers for 3 axes"),
    "unknown unit": (zarr_of(SMALL, units={"z": "furlong"}), "voxel size: not found .*--spacing"),
    "scale that is no list": (
        multiscale(
            lambda image: image["datasets"][0].update(
                coordinateTransformations=[{"type": "scale", "scale": "big"}]
            )
        ),
        "multiscales.0.",
    ),
    "more names than channels": (
        zarr_of(SMALL, channels=[{"label": "A"}, {"label": "B"}]),
        "omero.channels: found 2 entries, expected 1",
    ),
    "array without shape": (
        zarr_with(lambda content: content.pop("shape"), "0/zarr.json"),
        "level '0'",
    ),
    "unknown codec": (
        zarr_with(lambda content: content["codecs"].append({"name": "brotli9"}), "0/zarr.json"),
        "brotli9",
    ),
    "chunk of a terabyte": (
        zarr_with(
            lambda content: content.update(
                shape=[10000, 10000, 10000],
                chunk_grid={
                    "name": "regular",
                    "configuration": {"chunk_shape": [10000, 10000, 10000]},
                },
            ),
            "0/zarr.json",
        ),
        "expected at most 4 GiB",
    ),
    "nothing but NaN": (
        zarr_of(np.full(SMALL.shape, np.nan, np.float32)),
        "channel 'Channel0', level 0: found no finite voxel: all are NaN or infinite",
    ),
    "beyond float32": (tiff_of(SMALL.astype(np.float64) * 1e300), "found voxels beyond 1e.30"),
}


@pytest.mark.parametrize("suffix", ["tar", "zip", "xz", "tar.gz"])
def test_a_compressed_file_is_refused_with_the_advice_to_unpack_it(
    suffix: str, tmp_path: Path
) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "scan.dcm").write_bytes(b"an image")
    packings = {"tar": "tar", "zip": "zip", "xz": "xztar", "tar.gz": "gztar"}
    packed = shutil.make_archive(str(tmp_path / "p"), packings[suffix], tmp_path / "folder")
    path = Path(packed).rename(tmp_path / f"SCANS.{suffix.upper()}")
    line = refusal(path)
    assert "(unpack it)" in line or "(unzip it" in line or "(gunzip it)" in line
    assert ", expected OME-Zarr" in line


@pytest.mark.parametrize("name", CASES)
def test_a_bad_source_is_refused_in_one_line(name: str, tmp_path: Path) -> None:
    make, message = CASES[name]
    assert re.search(message, refusal(make(tmp_path)))


@pytest.mark.parametrize("time", [-1, 3])
def test_a_time_out_of_range_is_refused(tmp_path: Path, time: int) -> None:
    path = write_ome_zarr(tmp_path / "t.zarr", [np.stack([SMALL] * 3)], axes="tzyx")
    with pytest.raises(UsageError, match=f"--time: found {time}, expected 0 to 2"):
        read.open(path, time=time)


def early_xml_tiff(path: Path, **options: Any) -> Path:
    """Write OME-TIFF with its XML first, so that a cut costs planes and not the metadata."""
    depth, height, width = SMALL.shape
    xml = (
        '<OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image ID="Image:0">'
        '<Pixels ID="Pixels:0" DimensionOrder="XYZCT" Type="uint16" SizeC="1" SizeT="1" '
        f'SizeX="{width}" SizeY="{height}" SizeZ="{depth}" '
        'PhysicalSizeX="1" PhysicalSizeY="1" PhysicalSizeZ="1">'
        f'<Channel ID="Channel:0:0"/><TiffData IFD="0" PlaneCount="{depth}"/>'
        "</Pixels></Image></OME>"
    )
    with tifffile.TiffWriter(path) as writer:
        for index, plane in enumerate(SMALL):
            description = xml if index == 0 else None
            writer.write(plane, description=description, metadata=None, contiguous=False, **options)
    return path


@pytest.mark.parametrize("compression", [None, "zlib", "zstd", "lzw", "jpeg2000"])
@pytest.mark.parametrize("tile", [None, (16, 16)])
def test_a_tiff_that_is_cut_short_anywhere_is_refused(
    tmp_path: Path, compression: str | None, tile: tuple[int, int] | None
) -> None:
    whole = early_xml_tiff(tmp_path / "whole.ome.tif", compression=compression, tile=tile)
    np.testing.assert_array_equal(
        read.open(whole).read(0, Box((0, 0, 0), SMALL.shape)).voxels, SMALL
    )
    content = whole.read_bytes()
    short = tmp_path / "short.ome.tif"
    for kept in (0, 2, 9, 200, *range(900, len(content), 3571), len(content) - 1):
        short.write_bytes(content[:kept])
        refusal(short)


def test_a_tiff_that_ends_within_its_xml_is_refused(tmp_path: Path) -> None:
    content = write_ome_tiff(tmp_path / "whole.ome.tif", SMALL).read_bytes()
    short = tmp_path / "short.ome.tif"
    for kept in (len(content) // 2, len(content) - 40, len(content) - 1):
        short.write_bytes(content[:kept])
        refusal(short)


def test_a_tiff_with_damaged_tiles_is_refused(tmp_path: Path) -> None:
    path = early_xml_tiff(tmp_path / "x.ome.tif", compression="zlib", tile=(16, 16))
    with tifffile.TiffFile(path) as tiff:
        start = tiff.pages[3].dataoffsets[4]  # type: ignore[union-attr]
    content = bytearray(path.read_bytes())
    content[start : start + 40] = bytes(byte ^ 0x5A for byte in content[start : start + 40])
    path.write_bytes(content)
    assert "channel 'Channel0', level 0" in refusal(path)


COMPRESSORS = {
    "0.4 none": ("0.4", None),
    "0.4 blosc": ("0.4", numcodecs.Blosc()),
    "0.4 zstd": ("0.4", numcodecs.Zstd()),
    "0.4 zlib": ("0.4", numcodecs.Zlib()),
    "0.4 gzip": ("0.4", numcodecs.GZip()),
    "0.4 lz4": ("0.4", numcodecs.LZ4()),
    "0.5 none": ("0.5", None),
    "0.5 blosc": ("0.5", BloscCodec(shuffle="shuffle", cname="lz4")),
    "0.5 zstd": ("0.5", ZstdCodec()),
    "0.5 gzip": ("0.5", GzipCodec()),
}


@pytest.mark.parametrize("name", COMPRESSORS)
def test_a_zarr_chunk_that_is_cut_short_is_refused(tmp_path: Path, name: str) -> None:
    version, compressor = COMPRESSORS[name]
    path = write_ome_zarr(
        tmp_path / "c.zarr", [SMALL], version=version, compressors=compressor, chunks=(3, 24, 24)
    )
    chunk = path / ("0/1/0/1" if version == "0.4" else "0/c/1/0/1")
    content = chunk.read_bytes()
    dataset = read.open(path)
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, SMALL)
    for kept in (0, 3, len(content) // 2, len(content) - 1):
        chunk.write_bytes(content[:kept])
        assert "channel 'Channel0', level 0" in refusal(path)
        dataset.read(0, Box((0, 0, 0), (3, 24, 24)))  # the neighbouring chunks are intact


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_zarr_metadata_that_are_cut_short_are_refused(tmp_path: Path, version: str) -> None:
    files = ("zarr.json", "0/zarr.json") if version == "0.5" else (".zattrs", "0/.zarray")
    for file in files:
        path = write_ome_zarr(tmp_path / "m.zarr", [SMALL], version=version)
        content = (path / file).read_bytes()
        for kept in (0, 10, len(content) // 2):
            (path / file).write_bytes(content[:kept])
            refusal(path)


@pytest.mark.parametrize("name", ["missing.zarr", "missing.ome.tif"])
def test_addresses_without_an_image_are_refused(
    tmp_path: Path, serve: Callable[[Path], Server], name: str
) -> None:
    assert "not found, or not reachable" in refusal(f"{serve(tmp_path).url}/{name}")
    refusal(f"http://127.0.0.1:9/{name}")  # no server listens on this port
    refusal(f"nosuchprotocol://host/{name}")


@pytest.mark.slow
def test_a_missing_s3_object_is_refused(s3_bucket: Path) -> None:
    assert s3_bucket.is_dir()
    refusal("s3://bucket/missing.zarr")
    refusal("s3://bucket/missing.ome.tif")


def test_a_source_without_read_permission_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_ome_tiff(tmp_path / "secret.ome.tif", f_phantom())

    def refuse(*args: Any, **kwargs: Any) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tifffile.TiffFile, "__init__", refuse)  # tests may run as root
    assert "Permission denied" in refusal(path)


def test_a_host_that_sends_no_parts_of_files_is_named_as_the_reason(tmp_path: Path) -> None:
    """Python's own server is such a host; files that fit into one read don't need parts."""
    planes = np.random.default_rng(0).integers(0, 1000, (16, 512, 512), dtype=np.uint16)
    axes = {"axes": "ZYX", **dict.fromkeys(("PhysicalSizeX", "PhysicalSizeY", "PhysicalSizeZ"), 1)}
    tifffile.imwrite(tmp_path / "large.ome.tif", planes, compression="zlib", metadata=axes)
    handler = partial(SimpleHTTPRequestHandler, directory=str(tmp_path))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        line = refusal(f"http://127.0.0.1:{server.server_address[1]}/large.ome.tif")
        server.shutdown()
    assert "the host does not send parts of files, expected a complete TIFF" in line
    assert ": ask its operator" in line
