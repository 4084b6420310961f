"""The index of a set is compared with the files that it describes; missing parts are reported."""

import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import tifffile
import zarr
from zarr.codecs import BloscCodec, BytesCodec, GzipCodec, ZstdCodec

from stereocell import read
from stereocell.model.errors import SourceError
from stereocell.model.tiling import Box
from stereocell.planning import input_files
from support import phantoms
from support.array_files import characters, write_bdv_xml, write_ims, write_n5
from support.reading import refusing
from support.tiff_files import write_ndtiff

BODY = phantoms.f_phantom()
BOTH = np.stack([BODY, BODY + 7])
UM = (1.0, 1.0, 1.0)
NS = "http://www.openmicroscopy.org/Schemas/OME/2016-06"


@pytest.fixture(autouse=True)
def fresh() -> None:
    input_files.forget()


def whole(path: Path) -> read.Dataset:
    """Open a source and read all its channels."""
    dataset = read.open(path, spacing_um=UM)
    for channel in range(len(dataset.channels)):
        dataset.read(channel, dataset.levels[0].box)
    return dataset


refusal = refusing(whole)


# --- TIFF


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 0.97])
def test_an_index_of_ndtiff_that_is_cut_short_is_refused(tmp_path: Path, share: float) -> None:
    path = write_ndtiff(tmp_path / "x_NDTiffStack.tif", BOTH, ["DAPI", "GFP"])
    assert len(whole(path).channels) == 2
    index = tmp_path / "NDTiff.index"
    content = index.read_bytes()
    index.write_bytes(content[: int(share * len(content))])
    assert re.search(r"found \d+ of 32 images \(\d+ of 32 in 'x_NDTiffStack.tif'\)", refusal(path))


def test_a_file_of_ndtiff_that_the_index_does_not_name_is_refused(tmp_path: Path) -> None:
    path = write_ndtiff(tmp_path / "x_NDTiffStack.tif", BOTH, ["DAPI", "GFP"])
    shutil.copy(path, tmp_path / "x_NDTiffStack_1.tif")
    assert "found 32 of 64 images (0 of 32 in 'x_NDTiffStack_1.tif')" in refusal(path)


def test_the_share_of_pages_that_the_ome_xml_leaves_out_is_reported(tmp_path: Path) -> None:
    path = phantoms.write_ome_tiff(tmp_path / "a.ome.tif", BODY)
    assert not any("OME-XML" in note for note in whole(path).notes)
    content = path.read_bytes()
    path.write_bytes(content.replace(b'SizeZ="16"', b'SizeZ="12"'))
    (note,) = (note for note in whole(path).notes if "OME-XML" in note)
    assert note == "the OME-XML describes 12 of 16 pages in the files; 4 are left out (25%)"


@pytest.mark.parametrize("compression", [None, "zlib"])
def test_pages_that_imagej_s_description_does_not_count_are_reported(
    tmp_path: Path, compression: str | None
) -> None:
    path = tmp_path / "a.tif"
    about = {"axes": "ZYX"}
    tifffile.imwrite(path, BODY, imagej=True, metadata=about, compression=compression)
    assert whole(path).notes == ()
    damaged = path.read_bytes().replace(b"slices=16", b"slices=12")
    path.write_bytes(damaged.replace(b"images=16", b"images=12"))
    dataset = whole(path)
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, BODY[:12])
    (note,) = dataset.notes
    assert note == "the file's description counts 12 of 16 pages: the others are left out (25%)"


@pytest.mark.parametrize("name", ["a.ome.tif", "a.tif"])
def test_the_share_of_tiles_that_are_not_stored_is_reported(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    body = np.random.default_rng(0).integers(0, 99, (2, 32, 32)).astype(np.uint16)
    tifffile.imwrite(path, body, tile=(16, 16), metadata={"axes": "ZYX"})
    with tifffile.TiffFile(path, mode="r+") as tiff:
        for tag in ("TileOffsets", "TileByteCounts"):
            first, second, *_ = tiff.pages[1].tags[tag].value
            tiff.pages[1].tags[tag].overwrite((first, second, 0, 0))
    body[1, 16:] = 0
    dataset = whole(path)
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, body)
    (note,) = (note for note in dataset.notes if "not stored" in note)
    assert note.startswith("2 of 8 strips or tiles (25.00%) are not stored: read as 0")


def test_tiles_that_a_smaller_level_does_not_store_are_reported(tmp_path: Path) -> None:
    path = phantoms.write_ome_tiff(tmp_path / "a.ome.tif", BODY, tile=(16, 16), levels=2)
    with tifffile.TiffFile(path, mode="r+") as tiff:
        page = tiff.series[0].levels[1].pages[0]
        for tag in ("TileOffsets", "TileByteCounts"):
            stored = page.tags[tag].value
            page.tags[tag].overwrite((0,) * len(stored))
        count = len(stored) * len(tiff.series[0].levels[1].pages)
    (note,) = (note for note in whole(path).notes if "not stored" in note)
    assert note.startswith(f"level 1: {len(stored)} of {count} strips or tiles")


def write_set(folder: Path) -> list[Path]:
    """Write an OME-TIFF as two files of eight planes, each with the OME-XML of both."""
    names = ["a.ome.tif", "b.ome.tif"]
    planes = "".join(
        f'<TiffData FirstZ="{8 * i}" IFD="0" PlaneCount="8"><UUID FileName="{name}">urn:uuid:{i}'
        "</UUID></TiffData>"
        for i, name in enumerate(names)
    )
    for i, name in enumerate(names):
        text = (
            f'<OME xmlns="{NS}" UUID="urn:uuid:{i}"><Image ID="Image:0"><Pixels ID="Pixels:0" '
            f'DimensionOrder="XYZCT" Type="uint16" SizeX="36" SizeY="48" SizeZ="16" SizeC="1" '
            f'SizeT="1"><Channel ID="C:0" SamplesPerPixel="1"/>{planes}</Pixels></Image></OME>'
        )
        part = BODY[8 * i : 8 * i + 8]
        tifffile.imwrite(folder / name, part, description=text, metadata=None)
    return [folder / name for name in names]


def test_a_set_of_ome_tiff_whose_other_file_is_cut_short_is_refused(tmp_path: Path) -> None:
    first, second = write_set(tmp_path)
    np.testing.assert_array_equal(whole(first).read(0, whole(first).levels[0].box).voxels, BODY)
    content = second.read_bytes()
    with tifffile.TiffFile(second) as tiff:
        ends = [page.dataoffsets[0] + page.databytecounts[0] for page in tiff.pages]
    for size in (max(ends) - 100, len(content) // 2, 0):
        second.write_bytes(content[:size])
        refusal(first)
    second.unlink()
    assert "a file of the set is missing" in refusal(first)


# --- Imaris


def lose(*paths: str) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        for path in paths:
            del file[path]

    return change


def cut_planes(file: h5py.File) -> None:
    for time, channel in np.ndindex(2, 2):
        group = file[f"DataSet/ResolutionLevel 0/TimePoint {time}/Channel {channel}"]
        data = group["Data"][:8]
        del group["Data"]
        group["Data"] = data
        group.attrs["ImageSizeZ"] = characters("8")


def count_times(file: h5py.File) -> None:
    info = file.create_group("DataSetInfo/TimeInfo")
    info.attrs["DatasetTimePoints"] = characters("3")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lose(
                *(
                    f"DataSet/ResolutionLevel {level}/TimePoint {time}/Channel 1"
                    for level in (0, 1)
                    for time in (0, 1)
                )
            ),
            "found 1 channels, expected 2 as in /DataSetInfo",
        ),
        (
            lose("DataSet/ResolutionLevel 0/TimePoint 0/Channel 0"),
            "found 0 groups Channel|found Channel 1 and no Channel 0",
        ),
        (lose("DataSet/ResolutionLevel 0/TimePoint 0"), "TimePoint"),
        (lose("DataSet/ResolutionLevel 0"), "ResolutionLevel"),
        (count_times, "found 2 time points, expected 3 as in /DataSetInfo"),
        (cut_planes, "ImageSizeZ: found 8, expected 16 as Z of /DataSetInfo/Image"),
    ],
)
def test_counts_in_the_metadata_of_imaris_are_compared_with_its_datasets(
    tmp_path: Path, change: Callable[[h5py.File], None], words: str
) -> None:
    path = write_ims(tmp_path / "a.ims", BOTH)
    assert len(whole(path).channels) == 2
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(SourceError, match=words):
        whole(path)


# --- BigDataViewer


def write_bdv_hdf5(path: Path) -> Path:
    with h5py.File(path, "w") as file:
        for setup, time, level in np.ndindex(3, 3, 2):
            part = BODY[:, :: 2**level, :: 2**level] + 10 * setup + time
            file[f"t{time:05d}/s{setup:02d}/{level}/cells"] = part.view(np.int16)
            file.require_group(f"s{setup:02d}")
        for setup in range(3):
            file[f"s{setup:02d}/resolutions"] = [[1.0, 1.0, 1.0], [2.0, 2.0, 1.0]]
    return path


def write_bdv_n5(path: Path) -> Path:
    for setup, time, level in np.ndindex(3, 3, 2):
        part = np.ascontiguousarray(BODY[:, :: 2**level, :: 2**level])
        factors = [2**level, 2**level, 1]
        write_n5(
            path / f"setup{setup}" / f"timepoint{time}" / f"s{level}",
            part,
            downsamplingFactors=factors,
        )
        (path / f"setup{setup}" / "attributes.json").write_text(
            '{"downsamplingFactors": [[1, 1, 1], [2, 2, 1]]}'
        )
    return path


def describe(folder: Path, container: str, setups: int, times: str) -> None:
    """Write the XML of a container, with its setups and time points."""
    write_bdv_xml(folder, container, "nm")
    file = folder / "b.xml"
    text = file.read_text("utf-8")
    end = text.index("</ViewSetups>")
    more = "".join(
        f"<ViewSetup><id>{i}</id><name>s{i}</name></ViewSetup>" for i in range(2, setups)
    )
    text = f"{text[:end]}{more}{text[end:]}"
    file.write_text(text.replace("</SequenceDescription>", f"{times}</SequenceDescription>"))


RANGE = '<Timepoints type="range"><first>0</first><last>{}</last></Timepoints>'
PATTERN = '<Timepoints type="pattern"><integerpattern>0-1, {}</integerpattern></Timepoints>'
MISSING = "<MissingViews>{}</MissingViews>".format(
    "".join(f'<MissingView timepoint="3" setup="{s}"/>' for s in range(3))
)


@pytest.mark.parametrize("kind", ["h5", "n5"])
@pytest.mark.parametrize(
    ("lost", "setups", "times", "words"),
    [
        ((), 3, RANGE.format(2), ""),
        ((), 3, PATTERN.format(2), ""),
        ((), 3, RANGE.format(3) + MISSING, ""),
        ((), 4, RANGE.format(2), "found 3 of 4 setups in the XML, missing 3"),
        ((), 3, RANGE.format(3), "found 3 of 4 time points in the XML, missing 3"),
        (("setup", 1), 3, RANGE.format(2), "found 2 of 3 setups in the XML, missing 1"),
        (("setup", 1), 0, "", "found 2 of 3 setups up to 2, missing 1"),
        (("time", 1), 3, RANGE.format(2), "found 2 of 3 time points in the XML, missing 1"),
        (("time", 1), 0, "", "found 2 of 3 time points up to 2, missing 1"),
        (("level", 1), 3, RANGE.format(2), "found 1 levels, expected 2"),
    ],
)
def test_views_of_bigdataviewer_are_compared_with_its_xml(
    tmp_path: Path,
    kind: str,
    lost: tuple[str, int] | tuple[()],
    setups: int,
    times: str,
    words: str,
) -> None:
    path = tmp_path / f"a.{kind}"
    (write_bdv_hdf5 if kind == "h5" else write_bdv_n5)(path)
    if setups:
        describe(tmp_path, path.name, setups, times)
    for name in views(kind, *lost) if lost else ():
        if kind == "n5":
            shutil.rmtree(path / name)
        else:
            with h5py.File(path, "r+") as file:
                del file[name]
    if words:
        assert words in refusal(path)
    else:
        assert len(whole(path).channels) == 3


def test_a_group_with_a_huge_number_is_refused_without_listing_smaller_ones(
    tmp_path: Path,
) -> None:
    path = tmp_path / "a.h5"
    write_bdv_hdf5(path)
    with h5py.File(path, "r+") as file:
        file.move("t00002", "t999999999999")
    line = refusal(path)
    assert "found 3 of 1000000000000 time points up to 999999999999, missing 2, 3, " in line


def views(kind: str, part: str, number: int) -> Iterator[str]:
    """Yield the groups of a setup, a time point or a level."""
    if part == "setup":
        yield from [f"setup{number}"] if kind == "n5" else [f"s{number:02d}"]
        if kind == "h5":
            yield from (f"t{time:05d}/s{number:02d}" for time in range(3))
        return
    if part == "time" and kind == "h5":
        yield f"t{number:05d}"
        return
    for setup in range(3):
        if part == "time":
            yield f"setup{setup}/timepoint{number}"
            continue
        for time in range(3):
            n5, h5 = f"setup{setup}/timepoint{time}/s{number}", f"t{time:05d}/s{setup:02d}/{number}"
            yield n5 if kind == "n5" else h5


# --- shards


@pytest.mark.parametrize("place", ["start", "end"])
@pytest.mark.parametrize("inner", [None, BloscCodec(), ZstdCodec(), GzipCodec()])
def test_a_whole_shard_is_read_and_one_that_is_cut_short_is_refused(
    tmp_path: Path, place: str, inner: Any
) -> None:
    path = phantoms.write_ome_zarr(tmp_path / "a.ome.zarr", [BODY])
    codec = zarr.codecs.ShardingCodec(
        chunk_shape=(4, 12, 18),
        codecs=[BytesCodec(), *([inner] if inner else [])],
        index_location=place,
    )
    array: Any = zarr.open_group(path).create_array(
        "0", shape=BODY.shape, dtype="u2", chunks=(8, 24, 36), serializer=codec,
        compressors=None, overwrite=True,
    )  # fmt: skip
    array[:] = BODY
    dataset = whole(path)
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, BODY)
    last = Box((12, 36, 18), BODY.shape)
    np.testing.assert_array_equal(dataset.read(0, last).voxels, BODY[last.slices])
    shard = path / "0/c/1/1/0"
    content = shard.read_bytes()
    for size in (len(content) - 1, len(content) // 2):
        shard.write_bytes(content[:size])
        refusal(path)
        with pytest.raises(SourceError, match="expected chunks that are whole"):
            read.open(path).read(0, last)


# --- folders of planes


def test_a_plane_that_is_missing_from_a_folder_is_refused_wherever_it_is(tmp_path: Path) -> None:
    for z, channel in np.ndindex(5, 2):
        tifffile.imwrite(tmp_path / f"s_z{z:02d}_ch{channel}.tif", BODY[z])
    assert whole(tmp_path).levels[0].shape == (5, 48, 36)
    for file in sorted(tmp_path.iterdir()):
        content = file.read_bytes()
        file.unlink()
        assert f"missing '{file.name}'" in refusal(tmp_path)
        file.write_bytes(content)
