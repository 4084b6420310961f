"""Channels are found by name and by index, whatever names a source gives them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell import read
from stereocell.model.errors import UsageError
from support.phantoms import write_ome_tiff, write_ome_zarr


def _with_names(folder: Path, names: Sequence[str | None], suffix: str = ".zarr") -> read.Dataset:
    stack = np.zeros((len(names), 2, 8, 8), np.uint8)
    path = folder / f"c{suffix}"
    if suffix == ".zarr":
        channels = [{} if name is None else {"label": name} for name in names]
        write_ome_zarr(path, [stack], axes="czyx", channels=channels)
    else:
        write_ome_tiff(path, stack, axes="CZYX", names=[name or "" for name in names])
    return read.open(path)


def _names(dataset: read.Dataset) -> list[str]:
    return [channel.name for channel in dataset.channels]


def test_channels_are_found_by_name_and_by_index(tiny_zarr_05: Path) -> None:
    dataset = read.open(tiny_zarr_05)
    assert dataset.find_channels(["CD31", "0"]) == (1, 0)
    assert dataset.find_channels(["1", "CD31"]) == (1,)
    with pytest.raises(UsageError, match=r"'cd-31'.*did you mean 'CD31'.*Hoechst, CD31"):
        dataset.find_channels(["cd-31"])
    with pytest.raises(UsageError, match=r"'2': not found, expected an index from 0 to 1"):
        dataset.find_channels(["2"])


@pytest.mark.parametrize("suffix", [".zarr", ".ome.tif"])
def test_missing_names_matter_only_where_channels_are_named(
    tmp_path: Path, voxels: NDArray[np.uint16], suffix: str
) -> None:
    path = tmp_path / f"f{suffix}"
    if suffix == ".zarr":
        write_ome_zarr(path, [voxels], axes="czyx")
    else:
        write_ome_tiff(path, voxels, axes="CZYX")
    dataset = read.open(path)
    assert [channel.name for channel in dataset.channels] == ["Channel0", "Channel1"]
    assert [channel.color for channel in dataset.channels] == [None, None]
    assert not any(channel.is_named for channel in dataset.channels)
    assert dataset.find_channels(["1"]) == (1,)
    # The names that the product makes up for channels without a name can be used, too.
    assert dataset.find_channels(["Channel1", "Channel0"]) == (1, 0)
    expected = "no channel names, expected Channel0 to Channel1, or an index from 0 to 1"
    with pytest.raises(UsageError, match=expected):
        dataset.find_channels(["DNA"])


@pytest.mark.parametrize("suffix", [".zarr", ".ome.tif"])
def test_one_missing_name_leaves_the_others_usable(tmp_path: Path, suffix: str) -> None:
    dataset = _with_names(tmp_path, ["DNA", None, "CD8"], suffix)
    assert _names(dataset) == ["DNA", "Channel1", "CD8"]
    assert dataset.find_channels(["CD8", "1", "DNA"]) == (2, 1, 0)
    assert dataset.find_channels(["Channel1"]) == (1,)
    with pytest.raises(
        UsageError, match=r"'CD3': .*expected one of DNA, Channel1, CD8 or an index from 0 to 2"
    ):
        dataset.find_channels(["CD3"])


def test_a_made_up_name_gives_way_to_a_real_one(tmp_path: Path) -> None:
    dataset = _with_names(tmp_path, ["Channel1", None])
    assert _names(dataset) == ["Channel1", "Channel1_"]
    assert dataset.find_channels(["Channel1", "Channel1_"]) == (0, 1)


def test_equal_names_are_numbered(tmp_path: Path) -> None:
    dataset = _with_names(tmp_path, ["DNA", "CD8", "DNA"])
    assert _names(dataset) == ["DNA (channel 0)", "CD8", "DNA (channel 2)"]
    assert dataset.find_channels(["DNA (channel 2)"]) == (2,)
    with pytest.raises(UsageError, match=r"'DNA': not found.*DNA \(channel 0\), CD8, DNA"):
        dataset.find_channels(["DNA"])


def test_names_that_differ_only_by_case_are_numbered(tmp_path: Path) -> None:
    # On Windows and macOS their files would be the same.
    names = _names(_with_names(tmp_path, ["CD3", "cd3", "CD31"]))
    assert names == ["CD3 (channel 0)", "cd3 (channel 1)", "CD31"]


def test_names_that_look_numbered_already_are_numbered_too(tmp_path: Path) -> None:
    names = _names(_with_names(tmp_path, ["DNA", "DNA (channel 0)", "DNA"]))
    assert len(set(names)) == 3


def test_odd_names_are_cleaned_or_count_as_missing(tmp_path: Path) -> None:
    dataset = _with_names(tmp_path, ["\x00\n\ud800", "a\nb\x07", "///", " "])
    assert _names(dataset) == ["Channel0", "a b", "///", "Channel3"]
    assert [channel.is_named for channel in dataset.channels] == [False, True, True, False]
    assert dataset.find_channels(["///"]) == (2,)
