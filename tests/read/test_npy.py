"""NumPy's .npy is read a window at a time, in either order; what it doesn't state is noted."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.errors import SourceError, UsageError
from stereocell.model.tiling import Box
from support.phantoms import f_phantom

SPACING_UM = (0.5, 0.2, 0.2)
BODY = f_phantom()
BOTH = np.stack([BODY, BODY[:, :, ::-1]])
BOX = Box((2, 5, 7), (9, 31, 30))


def put(folder: Path, voxels: NDArray[Any], **options: Any) -> Path:
    np.save(folder / "f.npy", voxels, **options)
    return folder / "f.npy"


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("dtype", ["<u2", ">u2", "u1", ">i2", ">f4", "<f8"])
@pytest.mark.parametrize("voxels", [BODY % 251, BOTH % 251], ids=["zyx", "czyx"])
def test_windows_agree_with_numpy(
    tmp_path: Path, voxels: NDArray[Any], dtype: str, order: Any
) -> None:
    path = put(tmp_path, np.asarray(voxels, dtype, order=order))
    dataset = read.open(path, spacing_um=SPACING_UM)
    assert (dataset.name, dataset.levels[0].spacing_um) == ("f", SPACING_UM)
    expected = np.load(path).reshape(-1, *BODY.shape)
    assert len(dataset.channels) == len(expected)
    for channel, body in enumerate(expected):
        found = dataset.read(channel, BOX).voxels
        assert (found == body[BOX.slices]).all()
        assert found.dtype.isnative


def test_a_window_reads_only_its_own_planes(tmp_path: Path) -> None:
    path = put(tmp_path, BODY)
    dataset = read.open(path, spacing_um=SPACING_UM)
    with open(path, "r+b") as file:
        file.truncate(path.stat().st_size - BODY[0].nbytes)  # without its last plane
    assert (dataset.read(0, BOX).voxels == BODY[BOX.slices]).all()
    with pytest.raises(SourceError, match="expected chunks that are whole"):
        dataset.read(0, dataset.levels[0].box)


def test_axes_are_assumed_with_a_note_or_given(tmp_path: Path) -> None:
    path = put(tmp_path, BOTH)
    (note,) = read.open(path, spacing_um=SPACING_UM).notes
    assert note.startswith("order of the axes: not stated, c, z, y, x is assumed")
    dataset = read.open(put(tmp_path, np.moveaxis(BOTH, 0, -1)), spacing_um=SPACING_UM, axes="zyxc")
    assert dataset.notes == ()
    assert (dataset.read(1, BOX).voxels == BOTH[1][BOX.slices]).all()
    with pytest.raises(UsageError, match="--axes zy: "):
        read.open(path, axes="zy")


@pytest.mark.parametrize(
    ("voxels", "words"),
    [
        (BODY > 500, "dtype: found bool, a mask, expected integers or floats"),
        (BODY[:2, :2, :2].astype(object), "dtype: found Python objects, expected integers"),
        (np.zeros((4, 4, 4), [("\u03bb", "f4")]), "dtype: found records, expected integers"),
        (BODY.astype(complex), "dtype of level 0: found complex128"),
        (BODY[0], "a volume needs at least 2 planes: found 2 dimensions"),
        (BOTH[None], "expected three, or give them with --axes"),
        (BODY, "voxel size: not found with a unit of length, expected .* --spacing-um z,y,x"),
    ],
)
@pytest.mark.filterwarnings("ignore:Stored array in format:UserWarning")
def test_an_array_that_is_not_a_volume_is_refused_in_one_line(
    tmp_path: Path, voxels: NDArray[Any], words: str
) -> None:
    with pytest.raises(SourceError, match=words) as caught:
        read.open(put(tmp_path, voxels))
    assert "\n" not in str(caught.value)


def test_a_damaged_file_is_refused_in_a_line(tmp_path: Path) -> None:
    path = put(tmp_path, BODY)
    content = path.read_bytes()
    for damaged in (content[:7], content[:40], content[:-1], content.replace(b"shape", b"shope")):
        path.write_bytes(damaged)
        with pytest.raises(SourceError, match=r"f\.npy: .*expected "):
            read.open(path, spacing_um=SPACING_UM)
    path.write_bytes(b"<html>")
    with pytest.raises(SourceError, match=r"an HTML page .* expected NumPy's \.npy"):
        read.open(path)


def test_the_format_is_recognised_by_its_first_bytes_and_at_an_address(tmp_path: Path) -> None:
    path = put(tmp_path, BODY)
    other = path.rename(tmp_path / "f.dat")
    assert read.open(other, spacing_um=SPACING_UM).levels[0].shape == BODY.shape
    with pytest.raises(
        SourceError, match=r"f\.tif: found a NumPy array, .* rename it to end in \.npy"
    ):
        read.open(other.rename(tmp_path / "f.tif"))
    with pytest.raises(SourceError, match=r"NumPy's \.npy at an address, expected a path on this"):
        read.open("s3://bucket/f.npy")


def test_the_command_plans_it(tmp_path: Path) -> None:
    path, out = put(tmp_path, BODY, allow_pickle=False), tmp_path / "out"
    assert main(["plan", str(path), "-o", str(out), "--spacing-um", "0.5,0.2,0.2"]) == 0
    assert (out / "plan.json").is_file()
