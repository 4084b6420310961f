"""NaN and infinity are places without a measurement: read as the channel's darkest value."""

import warnings
from collections.abc import Callable
from pathlib import Path

import h5py
import mrcfile
import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray

from stereocell import read
from stereocell.model.errors import SourceError
from stereocell.model.tiling import Box
from stereocell.read import unmeasured
from support.phantoms import write_ome_tiff, write_ome_zarr

VOXELS = np.random.default_rng(0).normal(100, 20, (2, 12, 40, 36)).astype(np.float32)
LOWEST = (-3.5, 7.25)  # smallest value of each of the two channels; one voxel has it


def with_gaps() -> NDArray[np.float32]:
    voxels = VOXELS.copy()
    voxels[:, :, :9] = np.nan
    voxels[0, 3, 20, 5], voxels[0, 4, 21, 6] = np.inf, -np.inf
    for channel, least in enumerate(LOWEST):
        voxels[channel, 11, 30, 30] = least
    return voxels


def _zarr(folder: Path, voxels: NDArray[np.float32]) -> Path:
    return write_ome_zarr(folder / "a.zarr", [voxels], axes="czyx", chunks=(1, 4, 16, 12))


def _tiff(folder: Path, voxels: NDArray[np.float32]) -> Path:
    return write_ome_tiff(folder / "a.ome.tif", voxels, axes="CZYX")


def _hdf5(folder: Path, voxels: NDArray[np.float32]) -> Path:
    with h5py.File(folder / "a.h5", "w") as file:
        file.create_dataset("raw", data=voxels, chunks=(1, 5, 16, 16))
        file["raw"].attrs["element_size_um"] = (1.0, 1.0, 1.0)
        file["raw"].dims[0].label = "c"
        for index, axis in enumerate("zyx", 1):
            file["raw"].dims[index].label = axis
    return folder / "a.h5"


@pytest.mark.parametrize("write", [_zarr, _tiff, _hdf5])
def test_unmeasured_voxels_are_read_as_the_channel_s_smallest_value(
    tmp_path: Path, write: Callable[[Path, NDArray[np.float32]], Path]
) -> None:
    voxels = with_gaps()
    dataset = read.open(write(tmp_path, voxels))
    for channel, least in enumerate(LOWEST):
        expected = np.where(np.isfinite(voxels[channel]), voxels[channel], np.float32(least))
        whole = dataset.read(channel, dataset.levels[0].box).voxels
        np.testing.assert_array_equal(whole, expected)
        # A window has the same value as the whole, so tiles agree where they meet.
        box = Box((0, 4, 2), (3, 14, 20))
        np.testing.assert_array_equal(dataset.read(channel, box).voxels, expected[box.slices])


def test_all_levels_use_the_same_smallest_value(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The window is found on a coarse level and recognises the padding of the fine one by value."""
    fine = with_gaps()[0]
    coarse = fine.reshape(6, 2, 20, 2, 18, 2).mean((1, 3, 5))
    least = coarse[np.isfinite(coarse)].min()
    scales = [dict.fromkeys("zyx", 1.0), dict.fromkeys("zyx", 2.0)]
    path = write_ome_zarr(tmp_path / "a.zarr", [fine, coarse], scales=scales)
    gap = Box((0, 0, 0), (1, 2, 2))
    dataset = read.open(path)
    assert least > LOWEST[0]
    for level in (1, 0):
        assert (dataset.read(0, gap, level).voxels == np.float32(LOWEST[0])).all()
    monkeypatch.setattr("stereocell.read.dataset.MAX_SEARCHED", fine.size - 1)
    assert read.open(path).darkest(0) == least


def test_all_slabs_are_searched_for_the_smallest_value(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dataset = read.open(_zarr(tmp_path, with_gaps()))
    for slab_bytes in (1, 3000, 30_000):
        monkeypatch.setattr(unmeasured, "_SLAB_BYTES", slab_bytes)
        assert unmeasured.least_finite(dataset.arrays[0], 0, 0) == LOWEST[0]


def test_integers_are_not_searched_for_gaps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stereocell.read.dataset.least_finite", None)
    dataset = read.open(write_ome_tiff(tmp_path / "a.ome.tif", VOXELS.astype(np.uint16), "CZYX"))
    assert dataset.read(0, dataset.levels[0].box).voxels.dtype == np.uint16
    assert dataset.share_of_gaps(0, [dataset.levels[0].box], 0) == 0.0


def test_the_share_of_gaps_counts_only_the_boxes(tmp_path: Path) -> None:
    dataset = read.open(_zarr(tmp_path, with_gaps()))
    boxes = [Box((0, 0, 0), (2, 9, 36)), Box((0, 9, 0), (2, 36, 36))]
    assert dataset.share_of_gaps(1, boxes, 0) == pytest.approx(9 / 36)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_channel_without_finite_voxels_is_refused(tmp_path: Path, value: float) -> None:
    voxels = VOXELS.copy()
    voxels[1] = value
    dataset = read.open(_tiff(tmp_path, voxels))
    dataset.read(0, dataset.levels[0].box)
    with pytest.raises(SourceError, match="'Channel1', level 0: found no finite voxel"):
        dataset.read(1, Box((0, 0, 0), (2, 2, 2)))


def test_handedness_is_kept_in_a_map_with_nan(tmp_path: Path) -> None:
    voxels = with_gaps()[0]
    with warnings.catch_warnings(), mrcfile.new(tmp_path / "a.mrc") as file:
        warnings.simplefilter("ignore")  # on NaN
        file.set_data(voxels)
        file.voxel_size = 10_000.0
    dataset = read.open(tmp_path / "a.mrc")
    expected = np.where(np.isfinite(voxels), voxels, np.float32(LOWEST[0]))[:, ::-1]
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, expected)


def test_unmeasured_voxels_of_a_tiff_of_doubles_are_replaced(tmp_path: Path) -> None:
    voxels = with_gaps()[0].astype(np.float64)
    tifffile.imwrite(tmp_path / "a.tif", voxels, photometric="minisblack")
    dataset = read.open(tmp_path / "a.tif", spacing_um=(1, 1, 1))
    assert float(dataset.read(0, dataset.levels[0].box).voxels.min()) == LOWEST[0]
