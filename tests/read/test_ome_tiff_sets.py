"""Sets of OME-TIFF: the OME-XML is compared with the files that it names, by UUID and page.

The OME-XML is written by ome-types, the files by tifffile.
"""

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray
from ome_types.model import OME, Channel, Image, Pixels, TiffData

from stereocell import read
from stereocell.model.errors import SourceError, UsageError
from stereocell.read import list_series
from support.phantoms import f_phantom
from support.reading import refusing

BODY = f_phantom()
NAMES = ("a.ome.tif", "b.ome.tif")
COMPANION = "x.companion.ome"


def uuid(number: int) -> str:
    return f"urn:uuid:00000000-0000-0000-0000-{number:012d}"


def block(z: int, name: str = "", number: int = 0, ifd: int = 0, count: int = 8) -> TiffData:
    """Return the entry of OME-XML that assigns pages of a file to planes.

    z       the first plane
    name    file name; "": the file that holds the OME-XML
    number  number of the UUID of the named file
    ifd     the first page
    count   number of planes and pages
    """
    stated = TiffData.UUID(value=uuid(number), file_name=name) if name else None
    return TiffData(first_z=z, ifd=ifd, plane_count=count, uuid=stated)


def image(number: int, blocks: Sequence[TiffData]) -> Image:
    depth, height, width = BODY.shape
    return Image(
        id=f"Image:{number}",
        pixels=Pixels(
            id=f"Pixels:{number}", dimension_order="XYZCT", type="uint16",
            size_x=width, size_y=height, size_z=depth, size_c=1, size_t=1,
            channels=[Channel(id=f"Channel:{number}:0", samples_per_pixel=1)],
            tiff_data_blocks=list(blocks),
        ),
    )  # fmt: skip


def described(blocks: Sequence[TiffData], own: int | None = None, more: Any = ()) -> str:
    """Return OME-XML with these entries.

    own  number of the UUID that the file states as its own; None: it states none
    """
    root = OME(uuid=uuid(own) if own is not None else None, images=[image(0, blocks), *more])
    return str(root.to_xml())


def write(path: Path, voxels: NDArray[Any], text: str) -> None:
    tifffile.imwrite(path, voxels, description=text.encode(), metadata=None)


def write_set(
    folder: Path,
    stated: Sequence[int | None] = (1, 2),
    names: Sequence[str] = NAMES,
    first: int = 1,
) -> None:
    """Write the two halves of the phantom, which the OME-XML names by two UUIDs from `first` on.

    stated  number of the UUID that each file states as its own; None: it states none
    names   names of the files on the disk
    """
    folder.mkdir(exist_ok=True)
    blocks = [block(8 * i, name, i + first) for i, name in enumerate(NAMES)]
    for half, number, name in zip((BODY[:8], BODY[8:]), stated, names, strict=True):
        write(folder / name, half, described(blocks, number))


def whole(path: Path) -> read.Dataset:
    dataset = read.open(path, spacing_um=(1.0, 1.0, 1.0))
    voxels = dataset.read(0, dataset.levels[0].box).voxels
    np.testing.assert_array_equal(voxels, BODY)
    return dataset


refusal = refusing(whole)


@pytest.mark.parametrize("stated", [(1, 2), (None, None), (1, None)])
def test_a_set_is_read_from_each_of_its_files(tmp_path: Path, stated: Any) -> None:
    write_set(tmp_path, stated)
    for name in NAMES:
        assert whole(tmp_path / name).notes == ()


@pytest.mark.parametrize("name", NAMES)
def test_a_file_of_another_set_under_the_right_name_is_refused(tmp_path: Path, name: str) -> None:
    write_set(tmp_path)
    write_set(tmp_path / "other", (3, 4), first=3)
    shutil.copy(tmp_path / "other" / "b.ome.tif", tmp_path)
    line = refusal(tmp_path / "a.ome.tif")
    assert "UUID FileName 'b.ome.tif': found a file with UUID" in line
    assert "of another set, expected" in line
    refusal(tmp_path / name)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    write_set(tmp_path)
    (tmp_path / "b.ome.tif").unlink()
    line = refusal(tmp_path / "a.ome.tif")
    assert "found 8 planes, expected 16: a file of the set is missing: 'b.ome.tif'" in line


def test_a_copy_of_a_file_in_the_place_of_another_one_is_refused(tmp_path: Path) -> None:
    write_set(tmp_path)
    shutil.copy(tmp_path / "a.ome.tif", tmp_path / "b.ome.tif")
    assert "of another set, expected" in refusal(tmp_path / "a.ome.tif")


@pytest.mark.parametrize("names", [("a.ome.tif", "c.ome.tif"), ("b.ome.tif", "a.ome.tif")])
def test_files_that_were_renamed_are_found_by_their_uuids(
    tmp_path: Path, names: tuple[str, str]
) -> None:
    write_set(tmp_path, names=names)
    (note,) = whole(tmp_path / names[0]).notes
    assert note == f"{names[1]!r} has the UUID of 'b.ome.tif': read in its place"
    whole(tmp_path / names[1])


def test_a_set_whose_writer_gave_each_file_the_same_ome_xml_is_read_by_names(
    tmp_path: Path,
) -> None:
    write_set(tmp_path, (1, 1))
    for name in NAMES:
        (note,) = whole(tmp_path / name).notes
        assert note.startswith("'b.ome.tif' states the UUID of another file of its set")


def test_a_single_file_that_states_no_uuid_may_be_renamed(tmp_path: Path) -> None:
    text = described([block(0, "old.ome.tif", 1, count=16)])
    write(tmp_path / "new.ome.tif", BODY, text)
    (note,) = whole(tmp_path / "new.ome.tif").notes
    assert note == "the OME-XML names this file 'old.ome.tif'"


def test_a_uuid_that_two_files_share_is_refused(tmp_path: Path) -> None:
    blocks = [block(0, "a.ome.tif", 3), block(8, "b.ome.tif", 3)]
    for name, half in zip(NAMES, (BODY[:8], BODY[8:]), strict=True):
        write(tmp_path / name, half, described(blocks))
    line = refusal(tmp_path / "a.ome.tif")
    assert "found the files 'a.ome.tif' and 'b.ome.tif', expected one file" in line


def test_empty_uuids_are_accepted_by_the_names_of_their_files(tmp_path: Path) -> None:
    blocks = [block(8 * i, name, i + 1) for i, name in enumerate(NAMES)]
    text = described(blocks).replace(uuid(1), "").replace(uuid(2), "")
    for name, half in zip(NAMES, (BODY[:8], BODY[8:]), strict=True):
        write(tmp_path / name, half, text)
    whole(tmp_path / "a.ome.tif")
    whole(tmp_path / "b.ome.tif")


@pytest.mark.parametrize("half", [BODY[8:, :40], BODY[8:].astype(np.uint8), BODY[8:].view("i2")])
def test_a_file_of_other_planes_is_refused_as_the_set_is_opened(
    tmp_path: Path, half: NDArray[Any]
) -> None:
    write_set(tmp_path, (None, None))
    text = tifffile.tiffcomment(tmp_path / "b.ome.tif")
    write(tmp_path / "b.ome.tif", half, str(text))
    with pytest.raises(SourceError, match=r"'b.ome.tif': found planes of .*, expected \(48, 36\)"):
        read.open(tmp_path / "a.ome.tif")


# --- pages


@pytest.mark.parametrize(
    ("blocks", "words"),
    [
        ([block(0, count=16), block(3, ifd=5, count=1)], "plane T 0, C 0, Z 3: found page 5"),
        ([block(0, count=10), block(8, ifd=8), block(2, ifd=0, count=1)], "expected one page"),
        ([block(0, ifd=1, count=16)], "found 15 planes, expected 16"),
        ([block(0, count=14)], "found 14 planes, expected 16"),
        ([], "planes don't match the OME-XML"),
    ],
)
def test_planes_that_the_ome_xml_names_twice_or_never_are_refused(
    tmp_path: Path, blocks: list[TiffData], words: str
) -> None:
    write(tmp_path / "a.ome.tif", BODY, described(blocks))
    assert words in refusal(tmp_path / "a.ome.tif")


def test_a_plane_that_the_ome_xml_names_twice_alike_is_read(tmp_path: Path) -> None:
    blocks = [block(0, count=16), block(3, ifd=3, count=2)]
    write(tmp_path / "a.ome.tif", BODY, described(blocks))
    whole(tmp_path / "a.ome.tif")


def test_an_image_without_planes_does_not_take_those_of_the_next_one(tmp_path: Path) -> None:
    second = image(1, [block(0, count=16)])
    write(tmp_path / "a.ome.tif", BODY, described([], more=[second]))
    (note,) = whole(tmp_path / "a.ome.tif").notes
    assert "2 images; building --series 2, the largest in this file" in note
    with pytest.raises(SourceError, match="planes don't match the OME-XML"):
        read.open(tmp_path / "a.ome.tif", series=1)


def test_a_file_of_a_set_of_positions_is_read_by_its_own_image(tmp_path: Path) -> None:
    """Each file has the OME-XML of all positions, as Micro-Manager writes them."""
    images = [image(n, [block(0, name, n + 1, count=16)]) for n, name in enumerate(NAMES)]
    for number, (name, voxels) in enumerate(zip(NAMES, (BODY + 1, BODY), strict=True)):
        text = str(OME(uuid=uuid(number + 1), images=images).to_xml())
        write(tmp_path / name, voxels, text)
    (note,) = whole(tmp_path / "b.ome.tif").notes
    assert "2 images; building --series 2, the largest in this file" in note
    other = read.open(tmp_path / "b.ome.tif", series=1, spacing_um=(1.0, 1.0, 1.0))
    np.testing.assert_array_equal(other.read(0, other.levels[0].box).voxels, BODY + 1)


def test_the_largest_image_of_a_file_is_read_and_all_are_listed(tmp_path: Path) -> None:
    path = tmp_path / "a.ome.tif"
    overview = np.zeros((200, 300), np.uint16)
    sizes = {"PhysicalSizeX": 1.0, "PhysicalSizeY": 1.0}
    with tifffile.TiffWriter(path, ome=True) as writer:
        writer.write(overview, metadata={"axes": "YX", **sizes})
        writer.write(BODY[::2], metadata={"axes": "ZYX", "PhysicalSizeZ": 2.0, **sizes})
        writer.write(BODY, metadata={"axes": "ZYX", "PhysicalSizeZ": 1.0, **sizes})
    (note,) = whole(path).notes
    assert "3 images; building --series 3, the largest: 16 x 48 x 36 voxels" in note
    assert len(list_series(path)) == 3
    assert "no volume" in list_series(path)[0]
    smaller = read.open(path, series=2)
    assert smaller.levels[0].spacing_um == (2.0, 1.0, 1.0)
    assert smaller.notes == ()
    np.testing.assert_array_equal(smaller.read(0, smaller.levels[0].box).voxels, BODY[::2])
    with pytest.raises(UsageError, match="--series: found 4, expected 1 to 3"):
        read.open(path, series=4)


# --- companions


def write_companion_set(folder: Path, stated: Sequence[int] = (1, 2), of: int = 9) -> None:
    """Write the set with its OME-XML in a companion of UUID 9; `of` is the UUID in the files."""
    blocks = [block(8 * i, name, i + 1) for i, name in enumerate(NAMES)]
    (folder / COMPANION).write_text(described(blocks, 9))
    for half, number, name in zip((BODY[:8], BODY[8:]), stated, NAMES, strict=True):
        pointer = OME.BinaryOnly(metadata_file=COMPANION, uuid=uuid(of))
        write(folder / name, half, str(OME(uuid=uuid(number), binary_only=pointer).to_xml()))


def test_a_companion_describes_its_files(tmp_path: Path) -> None:
    write_companion_set(tmp_path)
    for name in (*NAMES, COMPANION):
        assert whole(tmp_path / name).notes == ()


@pytest.mark.parametrize("name", [*NAMES, COMPANION])
def test_a_file_that_a_companion_knows_by_another_uuid_is_refused(
    tmp_path: Path, name: str
) -> None:
    write_companion_set(tmp_path, (1, 5))
    line = refusal(tmp_path / name)
    assert "UUID FileName 'b.ome.tif': found a file with UUID" in line


def test_a_companion_of_another_set_is_refused(tmp_path: Path) -> None:
    write_companion_set(tmp_path, (5, 6), of=8)
    assert "it describes another set" in refusal(tmp_path / "a.ome.tif")


def test_a_companion_is_read_regardless_of_the_xml_in_its_files(tmp_path: Path) -> None:
    write_companion_set(tmp_path)
    for name, half in zip(NAMES, (BODY[:8], BODY[8:]), strict=True):
        tifffile.imwrite(tmp_path / name, half, ome=False, metadata=None)
    whole(tmp_path / COMPANION)


def test_a_set_described_in_another_tiff_names_that_file(tmp_path: Path) -> None:
    write_set(tmp_path)
    pointer = OME.BinaryOnly(metadata_file="a.ome.tif", uuid=uuid(1))
    write(tmp_path / "b.ome.tif", BODY[8:], OME(uuid=uuid(2), binary_only=pointer).to_xml())
    assert "MetadataFile 'a.ome.tif'" in refusal(tmp_path / "b.ome.tif")
    whole(tmp_path / "a.ome.tif")
