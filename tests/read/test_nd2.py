"""ND2, written byte by byte: its times, positions and channels, and files with faults."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stereocell import read
from stereocell.model.errors import SourceError, UsageError
from support.array_files import five
from support.nd2_files import write_nd2
from support.phantoms import f_phantom
from support.reading import read_voxels, refusing, whole

refusal = refusing(read_voxels, SourceError, UsageError)

ND2 = np.stack([np.stack([five(f_phantom() + 100 * p)[t] for p in (0, 1)]) for t in (0, 1)])
ND2 = ND2.transpose(0, 1, 3, 2, 4, 5).astype(np.uint16)  # t, p, z, c, y, x
ND2_UM = (0.5, 0.25, 0.25)
SMALL = np.arange(4 * 8 * 8, dtype=np.uint16).reshape(1, 1, 4, 1, 8, 8)


@pytest.mark.parametrize(
    ("spacing", "about"), [((0.0, 1.0, 1.0), {}), ((2.0, 1.0, 1.0), {"bCalibrated": False})]
)
def test_an_nd2_without_a_length_asks_for_it(
    tmp_path: Path, spacing: Any, about: dict[str, Any]
) -> None:
    path = tmp_path / "a.nd2"
    write_nd2(path, SMALL, spacing, about=about)
    assert "--spacing-um" in refusal(path)
    assert read.open(path, spacing_um=(2, 1, 1)).levels[0].spacing_um == (2, 1, 1)


@pytest.mark.parametrize(
    ("high", "note"),
    [
        (2.0 * (SMALL.shape[2] - 1), ""),
        (2.0 * (SMALL.shape[2] - 1) + 1.5, ""),  # a range that is not a multiple of the step
        (3.0 * 2.0 * (SMALL.shape[2] - 1), "dZStep of the Z loop states 2 um, its range from"),
    ],
)
def test_the_step_of_an_nd2_is_compared_with_its_range(
    tmp_path: Path, high: float, note: str
) -> None:
    path = tmp_path / "a.nd2"
    write_nd2(path, SMALL, (2.0, 1.0, 1.0), depth_loop={"dZLow": 0.0, "dZHigh": high})
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == (2.0, 1.0, 1.0)
    assert bool(dataset.notes) == bool(note)
    assert note in "".join(dataset.notes)


def test_planes_of_an_nd2_that_were_taken_downwards_are_noted(tmp_path: Path) -> None:
    path = tmp_path / "a.nd2"
    write_nd2(path, SMALL, (2.0, 1.0, 1.0))
    assert read.open(path).notes == ()
    write_nd2(path, SMALL, (2.0, 1.0, 1.0), depth_loop={"iType": 4})
    (note,) = read.open(path).notes
    assert "taken from top to bottom" in note


def test_a_line_scan_of_an_nd2_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.nd2"
    write_nd2(path, SMALL, (2.0, 1.0, 1.0), about={"ePictureYAxis": 2})
    assert "axis y: found time (a line scan)" in refusal(path)


@pytest.mark.parametrize("is_packed", [False, True])
def test_nd2_has_positions_times_and_channels(tmp_path: Path, is_packed: bool) -> None:
    path = tmp_path / "a.nd2"
    write_nd2(path, ND2, ND2_UM, is_packed=is_packed)
    dataset = read.open(path, series=2, time=1)
    assert dataset.levels[0].spacing_um == ND2_UM
    assert [channel.name for channel in dataset.channels] == ["DAPI", "GFP"]
    assert [channel.color for channel in dataset.channels] == [(0, 0, 1), (0, 1, 0)]
    for channel in (0, 1):
        np.testing.assert_array_equal(whole(dataset, channel), f_phantom() + 110 + channel)
    assert "building --series 1" in read.open(path).notes[0]
    assert len(read.list_series(path)) == 2
    assert not any("missing" in note for note in dataset.notes)


def test_missing_frames_of_an_nd2_are_reported_or_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.nd2"
    write_nd2(path, ND2, ND2_UM, without=range(60, 64))  # frames of the last time point
    np.testing.assert_array_equal(whole(read.open(path)), f_phantom())
    whole(read.open(path, time=1))
    (note,) = (note for note in read.open(path, series=2).notes if "missing" in note)
    assert note == "4 of 32 frames (12.50%) are missing, all at other time points"
    line = refusal(path, series=2, time=1)
    assert "time point 1: found 12 of 16 frames" in line
    assert line.endswith("--time 0 is complete")
    write_nd2(path, ND2[:1], ND2_UM, without=[5])
    assert "time point 0: found 15 of 16 frames" in refusal(path)


@pytest.mark.parametrize("is_packed", [False, True])
@pytest.mark.parametrize(
    ("part", "offset", "words"),
    [
        (b"\xda\xce\xbe\n", 0, "another chunk"),
        (b"ImageDataSeq|3!", 13, "another chunk"),
        (b"", 12, "the frame ends at"),
    ],
)
def test_a_frame_that_is_not_where_the_map_of_an_nd2_says_is_refused(
    tmp_path: Path, is_packed: bool, part: bytes, offset: int, words: str
) -> None:
    path = tmp_path / "a.nd2"
    places = write_nd2(path, ND2, ND2_UM, is_packed=is_packed)
    content = bytearray(path.read_bytes())
    content[content.index(part, places[3]) + offset] ^= 0x10
    path.write_bytes(content)
    line = refusal(path)
    assert f"frame 3 at byte {places[3]}" in line
    assert words in line
    assert "as in the map of chunks" in line


def test_a_frame_of_fewer_bytes_than_an_nd2_states_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.nd2"
    places = write_nd2(path, ND2, ND2_UM)
    content = bytearray(path.read_bytes())
    content[places[3] + 9] ^= 0x10
    path.write_bytes(content)
    assert "fewer than its" in refusal(path)


@pytest.mark.skipif("STEREOCELL_DATA" not in os.environ, reason="STEREOCELL_DATA is not set")
def test_a_real_nd2_is_read_as_by_its_library() -> None:
    import nd2

    path = Path(os.environ["STEREOCELL_DATA"]) / "nd2" / "cluster.nd2"
    if not path.exists():
        pytest.skip("no nd2/cluster.nd2 below STEREOCELL_DATA")
    expected = nd2.imread(path)  # T, Z, C, Y, X
    dataset = read.open(path, time=2)
    np.testing.assert_array_equal(whole(dataset, 1), expected[2, :, 1])
