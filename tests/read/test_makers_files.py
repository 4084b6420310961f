"""CZI and LIF: CZI written by Zeiss's library, LIF byte by byte; scenes, extras."""

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pylibCZIrw import czi

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.errors import SourceError, UsageError
from stereocell.model.tiling import Box
from stereocell.read.known_formats import known_formats
from support.array_files import SIZE_UM, five, write_czi, write_lif
from support.dicom_series import write_f_nifti
from support.phantoms import f_phantom
from support.reading import read_voxels, refusing, whole

BOX = Box((1, 7, 3), (9, 30, 20))

refusal = refusing(read_voxels, SourceError, UsageError)


# CZI


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.slow
def test_czi_has_channels_times_spacing_and_its_tiles_composed(tmp_path: Path, dtype: Any) -> None:
    body = (f_phantom() // 8).astype(dtype)
    path = write_czi(tmp_path / "it's µ.CZI", {None: five(body)})
    dataset = read.open(path, time=1)
    assert [channel.name for channel in dataset.channels] == ["DAPI", "CD31"]
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    assert dataset.time_points == 2
    for channel in (0, 1):
        np.testing.assert_array_equal(whole(dataset, channel), body + 10 + channel)
        found = dataset.read(channel, BOX).voxels
        np.testing.assert_array_equal(found, (body + 10 + channel)[BOX.slices])
    assert (dataset.dtype, dataset.name) == (dtype, "it's µ")


@pytest.mark.slow
def test_scenes_of_a_czi_are_series(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small, large = f_phantom()[:, :40], f_phantom() + 1
    path = write_czi(tmp_path / "a.czi", {0: small[None, None], 1: large[None, None]})
    dataset = read.open(path)
    assert "2 images; building --series 2, the largest: 16 x 48 x 36" in dataset.notes[0]
    np.testing.assert_array_equal(whole(dataset), large)
    np.testing.assert_array_equal(whole(read.open(path, series=1)), small)
    assert "found 3, expected 1 to 2" in refusal(path, series=3)
    assert main(["plan", str(path), "-o", str(tmp_path / "out"), "--series", "list"]) == 0
    out = capsys.readouterr().out
    assert "1  16 x 40 x 36 voxels" in out
    assert "Jane" not in out
    assert not (tmp_path / "out" / "plan.json").exists()


@pytest.mark.parametrize(
    ("offset", "expected"),
    [
        (16, "stored size"),
        (4, "axis X start"),
        (-1, "axis"),  # the axis's own name
        (None, "compression"),
    ],
)
def test_a_czi_s_directory_that_differs_from_its_tiles_is_refused(
    tmp_path: Path, offset: int | None, expected: str
) -> None:
    path = write_czi(tmp_path / "a.czi", {None: five(f_phantom())})
    content = bytearray(path.read_bytes())
    entries = content.index(b"ZISRAWDIRECTORY") + 32 + 128
    axis = content.index(b"X\0\0\0", entries)
    content[entries + 18 if offset is None else axis + max(offset, 0)] ^= 1
    path.write_bytes(content)
    line = refusal(path)
    assert expected in line
    assert "as in the directory" in line


def test_a_czi_whose_directory_leads_to_no_tile_is_refused(tmp_path: Path) -> None:
    path = write_czi(tmp_path / "a.czi", {None: five(f_phantom())})
    content = bytearray(path.read_bytes())
    first = content.index(b"ZISRAWSUBBLOCK\0")
    content[first + 3] ^= 1
    path.write_bytes(content)
    assert "a.czi" in refusal(path)


@pytest.mark.slow
def test_missing_tiles_of_a_czi_are_reported_with_their_share(tmp_path: Path) -> None:
    path = tmp_path / "a.czi"
    body = five(f_phantom())
    assert not any("tiles" in note for note in read.open(write_czi(path, {None: body})).notes)
    body[1, 1, 9:] = 0
    path.unlink()
    with czi.create_czi(str(path)) as file:
        for t, c, z in np.ndindex(2, 2, 16):
            if (t, c) != (1, 1) or z < 9:
                plane = {"T": t, "C": c, "Z": z}
                file.write(data=np.ascontiguousarray(body[t, c, z][..., None]), plane=plane)
    spacing = {"spacing_um": SIZE_UM}
    assert not any("tiles" in note for note in read.open(path, **spacing).notes)
    dataset = read.open(path, time=1, **spacing)
    np.testing.assert_array_equal(whole(dataset, 1), body[1, 1])
    (note,) = (note for note in dataset.notes if "tiles" in note)
    assert note.startswith("7 of 32 tiles (21.88%) are not stored: read as 0")


@pytest.mark.slow
def test_a_czi_without_tiles_at_a_time_point_is_refused_there(tmp_path: Path) -> None:
    path = tmp_path / "a.czi"
    with czi.create_czi(str(path)) as file:
        for t, z in np.ndindex(3, 16):
            if t != 1:
                data = np.ascontiguousarray(f_phantom()[z][..., None])
                file.write(data=data, plane={"T": t, "C": 0, "Z": z})
    whole(read.open(path, time=2, spacing_um=SIZE_UM))
    assert "time point 1: found none of 16 tiles" in refusal(path, time=1, spacing_um=SIZE_UM)


@pytest.mark.slow
def test_a_czi_whose_metadata_state_more_than_its_tiles_is_reported(tmp_path: Path) -> None:
    path = write_czi(tmp_path / "a.czi", {None: five(f_phantom())})
    content = path.read_bytes()
    assert content.count(b"<SizeZ>16<") == 1
    path.write_bytes(content.replace(b"<SizeZ>16<", b"<SizeZ>24<"))
    (note,) = (note for note in read.open(path).notes if "metadata" in note)
    assert note.startswith("the metadata state 24 along Z, but there are tiles for 16")


@pytest.mark.slow
def test_a_czi_whose_metadata_state_missing_phases_is_reported(tmp_path: Path) -> None:
    path = write_czi(tmp_path / "a.czi", {None: five(f_phantom())})
    content = path.read_bytes()
    path.write_bytes(content.replace(b"<SizeZ>16</SizeZ>", b"<SizeH>16</SizeH>"))
    (note,) = (note for note in read.open(path).notes if "metadata" in note)
    assert note.startswith("the metadata state 16 along H (phases), but there are tiles for 1")


def with_metadata(path: Path, old: bytes, new: bytes) -> None:
    """Replace XML in a CZI; spaces before its last tag keep the length."""
    content = path.read_bytes()
    start = content.index(b"<ImageDocument")
    end = content.index(b"</ImageDocument>", start)
    xml = re.sub(rb">\s+<", b"><", content[start:end])
    xml = re.sub(rb"<Document>.*</Application>", b"", xml).replace(old, new)
    assert new in xml
    assert len(xml) <= end - start
    path.write_bytes(content[:start] + xml.ljust(end - start) + content[end:])


@pytest.mark.slow
def test_an_interval_of_a_czi_that_contradicts_its_scaling_is_reported(tmp_path: Path) -> None:
    path = write_czi(tmp_path / "a.czi", {None: five(f_phantom())})
    interval = b"<Dimensions><Z><Positions><Interval><Increment>9<"
    interval += b"/Increment></Interval></Positions></Z>"
    with_metadata(path, b"<Dimensions>", interval)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    (note,) = (note for note in dataset.notes if "spacing along z" in note)
    assert "the interval between planes states 9 um: Scaling is used" in note


@pytest.mark.slow
def test_a_distance_of_a_czi_that_is_stated_twice_is_reported(tmp_path: Path) -> None:
    path = write_czi(tmp_path / "a.czi", {None: five(f_phantom())})
    twice = b'</Distance><Distance Id="X"><Value>0.5</Value></Distance></Items>'
    with_metadata(path, b"</Distance></Items>", twice)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    assert sum("element Distance in Items" in note for note in dataset.notes) == 1


@pytest.mark.slow
def test_a_czi_of_rgb_or_of_one_plane_is_refused(tmp_path: Path) -> None:
    with czi.create_czi(str(tmp_path / "a.czi")) as file:
        file.write(data=np.zeros((9, 9, 3), np.uint8), plane={"C": 0, "Z": 0, "T": 0})
    assert "found Bgr24" in refusal(tmp_path / "a.czi")
    flat = f_phantom()[None, None, :1]
    assert "at least 2 planes" in refusal(write_czi(tmp_path / "b.czi", {None: flat}))


# LIF


def test_lif_whose_planes_were_taken_downwards_is_noted(tmp_path: Path) -> None:
    path = write_lif(tmp_path / "a.lif", {"a": ("ZYX", f_phantom())})
    assert read.open(path).notes == ()
    upwards, downwards = (
        f'DimID="3" NumberOfElements="16" Origin="0" Length="{length}"'.encode("utf-16-le")
        for length in ("7.5e-06", "-7.5e-6")
    )
    content = path.read_bytes()
    assert upwards in content
    path.write_bytes(content.replace(upwards, downwards))
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    assert "position along z falls from 0 to -7.5 um" in dataset.notes[0]


@pytest.mark.parametrize("axes", ["TCZYX", "CTZYX", "TZCYX", "YCTZX"])
def test_lif_has_its_axes_names_and_colours(tmp_path: Path, axes: str) -> None:
    tczyx = five(f_phantom())
    stored = np.ascontiguousarray(tczyx.transpose(["TCZYX".index(axis) for axis in axes]))
    dataset = read.open(write_lif(tmp_path / "a b.lif", {"Jane Doe": (axes, stored)}), time=1)
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    assert [channel.name for channel in dataset.channels] == ["DAPI", "Channel1"]
    assert [channel.color for channel in dataset.channels] == [(0, 0, 1), (0, 1, 0)]
    for channel in (0, 1):
        np.testing.assert_array_equal(whole(dataset, channel), tczyx[1, channel])
    np.testing.assert_array_equal(dataset.read(0, BOX).voxels, tczyx[1, 0][BOX.slices])
    assert dataset.name == "a b"


def test_images_of_a_lif_are_series_without_their_names(tmp_path: Path) -> None:
    flat = f_phantom()[0]
    path = write_lif(
        tmp_path / "a.lif",
        {"Jane": ("YX", flat), "Joe": ("ZYX", f_phantom()), "Jim": ("ZYX", f_phantom()[:9].copy())},
    )
    dataset = read.open(path)
    assert "3 images; building --series 2, the largest: 16 x 48 x 36" in dataset.notes[0]
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    np.testing.assert_array_equal(whole(read.open(path, series=3)), f_phantom()[:9])
    assert "found axes Y, X" in refusal(path, series=1)
    lines = read.list_series(path)
    assert len(lines) == 3
    assert lines[0].endswith("no volume")
    assert not any(name in "".join(lines) for name in ("Jane", "Joe", "Jim"))


@pytest.mark.parametrize(
    ("recorded", "note"),
    [
        ({"dblVoxelX": 0.25e-6, "dblVoxelY": 0.2e-6, "dblVoxelZ": 0.5e-6}, ""),
        (
            {"dblVoxelZ": 0.5e-6, "dblStepSize": -0.7e-6},
            "voxel spacing along z: Length of the dimension states 0.5 um, dblStepSize of the "
            "scanner states 0.7 um: Length of the dimension is used; --spacing-um z,y,x replaces "
            "it",
        ),
        ({"dblVoxelX": 0.0, "dblStepSize": 0.0}, ""),
    ],
)
def test_lengths_that_a_lif_states_twice_are_compared(
    tmp_path: Path, recorded: dict[str, float], note: str
) -> None:
    path = write_lif(tmp_path / "a.lif", {"a": ("ZYX", f_phantom())}, recorded=recorded)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    assert dataset.notes == ((note,) if note else ())


def test_the_unit_of_a_lif_s_lengths_counts(tmp_path: Path) -> None:
    path = write_lif(tmp_path / "mm.lif", {"a": ("ZYX", f_phantom())}, spacing=1000, unit="mm")
    assert read.open(path).levels[0].spacing_um == pytest.approx(SIZE_UM)
    dataset = read.open(write_lif(tmp_path / "a.lif", {"a": ("ZYX", f_phantom())}, unit=""))
    assert dataset.levels[0].spacing_um == pytest.approx(SIZE_UM)
    assert len(dataset.notes) == 3
    assert dataset.notes[0].startswith("unit of length along z: not stated, m is assumed")
    path = write_lif(tmp_path / "deg.lif", {"a": ("ZYX", f_phantom())}, unit="degree")
    assert "--spacing-um" in refusal(path)


def test_a_lif_without_lengths_asks_for_them(tmp_path: Path) -> None:
    path = write_lif(tmp_path / "a.lif", {"a": ("ZYX", f_phantom())}, spacing=0)
    assert "--spacing-um" in refusal(path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ('NumberOfElements="16"', "found 55296 bytes of voxels, expected"),
        ('Memory Size="55296"', "found 55296 bytes of voxels, expected 99999"),
    ],
)
def test_a_lif_that_holds_less_than_its_xml_states_is_refused(
    tmp_path: Path, change: str, words: str
) -> None:
    """The library would read on into the planes of the next image."""
    images = {"a": ("ZYX", f_phantom()), "b": ("ZYX", f_phantom()[:9].copy())}
    path = write_lif(tmp_path / "a.lif", images)
    other = change.replace('"16"', '"24"').replace("55296", "99999")
    content = path.read_bytes().replace(change.encode("utf-16-le"), other.encode("utf-16-le"))
    path.write_bytes(content)
    assert words in refusal(path, series=1)
    np.testing.assert_array_equal(whole(read.open(path, series=2)), f_phantom()[:9])


def test_a_lif_that_holds_more_than_its_xml_states_is_reported(tmp_path: Path) -> None:
    path = write_lif(tmp_path / "a.lif", {"a": ("ZYX", f_phantom())})
    fewer = 'NumberOfElements="12"'.encode("utf-16-le")
    path.write_bytes(path.read_bytes().replace('NumberOfElements="16"'.encode("utf-16-le"), fewer))
    dataset = read.open(path)
    np.testing.assert_array_equal(whole(dataset), f_phantom()[:12])
    (note,) = dataset.notes
    assert note.startswith("the XML describes 41472 of 55296 bytes of the image's voxels (75.00%)")


def test_blocks_of_a_lif_that_share_a_name_are_refused(tmp_path: Path) -> None:
    images = {"a": ("ZYX", f_phantom()), "b": ("ZYX", f_phantom() + 1)}
    path = write_lif(tmp_path / "a.lif", images)
    content = path.read_bytes()
    name = "Mem1".encode("utf-16-le")
    at = content.rindex(name)
    path.write_bytes(content[: at + 6] + b"0" + content[at + 7 :])
    assert "found the name of another block" in refusal(path)


# all three formats


def test_an_nd2_without_its_end_is_refused_as_cut_short(tmp_path: Path) -> None:
    pytest.importorskip("nd2")
    (tmp_path / "a.nd2").write_bytes(b"\xda\xce\xbe\n" + bytes(5000))
    with pytest.raises(SourceError, match="cut short at byte 5004, or never closed"):
        read.open(tmp_path / "a.nd2")


@pytest.mark.parametrize(
    ("suffix", "library"), [("czi", "pylibCZIrw"), ("lif", "liffile"), ("nd2", "nd2")]
)
def test_without_its_extra_a_format_names_the_command_that_installs_it(
    tmp_path: Path, suffix: str, library: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    begins = {"czi": b"ZISRAWFILE", "lif": b"p\0\0\0....*", "nd2": b"\xda\xce\xbe\n"}
    (tmp_path / f"a.{suffix}").write_bytes(begins[suffix])
    assert f'pip install "stereocell[{suffix}]"' in refusal(tmp_path / f"a.{suffix}")


@pytest.mark.parametrize("suffix", ["czi", "lif", "nd2"])
def test_an_incomplete_file_is_refused_in_one_line(tmp_path: Path, suffix: str) -> None:
    good = b"no image at all"
    if suffix == "czi":
        good = write_czi(tmp_path / "good.czi", {None: f_phantom()[None, None]}).read_bytes()
    if suffix == "lif":
        good = write_lif(tmp_path / "g.lif", {"a": ("ZYX", f_phantom())}).read_bytes()
    for content in (b"", b"no image", good[:100], good[: len(good) // 2]):
        (tmp_path / f"a.{suffix}").write_bytes(content)
        refusal(tmp_path / f"a.{suffix}")
    (tmp_path / f"b.{suffix}").mkdir()
    assert "found a folder" in refusal(tmp_path / f"b.{suffix}")


def test_a_format_of_one_image_has_no_series(tmp_path: Path) -> None:
    path = tmp_path / "a.nii"
    write_f_nifti(path, f_phantom(), SIZE_UM)
    line = refusal(path, series=2)
    formats = known_formats().values()
    takers = [one.title for one in formats if one.has_series]
    assert len(takers) > 6
    assert all(title in line for title in takers)
    with pytest.raises(UsageError, match="--series list: found NIfTI or Analyze, expected"):
        read.list_series(path)
