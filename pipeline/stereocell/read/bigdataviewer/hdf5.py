"""BigDataViewer's HDF5: `t00000/s00/0/cells`, one dataset for each time point, setup and level.

Datasets of int16 hold unsigned 16-bit numbers, since Java has no unsigned type. An XML beside the
container states names and voxel sizes of the setups.
References: https://imagej.net/plugins/bdv/index
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.bigdataviewer.image import chosen_view, common_levels, image_of
from stereocell.read.bigdataviewer.times import with_times
from stereocell.read.bigdataviewer.xml import read_described
from stereocell.read.hdf5_file.tree import Hdf5Array, Hdf5Tree
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.spacing import Triple
from stereocell.storage.location import Location

_MAX_LEVELS = 64


class _Cells:
    """The voxels of one setup at one time point; int16 is read as the uint16 that it holds."""

    def __init__(self, array: Hdf5Array) -> None:
        self.shape, self.chunks = array.shape, array.chunks
        stored = np.dtype(array.dtype)
        is_unsigned = stored.kind == "i" and stored.itemsize == 2
        self.dtype = np.dtype(np.uint16) if is_unsigned else stored
        self._array = array

    @property
    def dataset(self) -> h5py.Dataset:
        """The h5py dataset, so that its stored chunks can be counted."""
        return self._array.dataset

    def __getitem__(self, key: Any) -> NDArray[Any]:
        found = np.asarray(self._array[key])
        return found.astype(self.dtype, copy=False)  # int16 -1 becomes uint16 65535


def is_container(tree: Hdf5Tree) -> bool:
    """Return whether a file has the groups of BigDataViewer."""
    return bool(_named(tree, r"t\d{5,}") and _named(tree, r"s\d{2,}"))


def read_image(tree: Hdf5Tree, location: Location, *, series: int = 0, xml: str = "") -> Image:
    """Return the image of a view, whose setups are channels. Raises SourceError and UsageError.

    series  counts the views as listed in the XML, from 1; 0: the largest
    xml     path of the XML that the user named; empty: the user named the container
    """
    times, setups = _named(tree, r"t\d{5,}"), _named(tree, r"s\d{2,}")[:MAX_CHANNELS]
    described, every = read_described(location.path, xml), [int(name[1:]) for name in setups]
    described.require_views(tree.where, every, [int(name[1:]) for name in times])
    numbers, notes = chosen_view(tree.where, described, every, series, xml)
    setups = [name for name, number in zip(setups, every, strict=True) if number in numbers]
    points = [int(name[1:]) for name in times]
    taken = described.taken(tree.where, numbers, points)
    groups = [
        [
            f"/{t}/{s}" if (point, number) in taken else None
            for number, s in zip(numbers, setups, strict=True)
        ]
        for point, t in zip(points, times, strict=True)
    ]
    count, level_notes = _common_levels(tree, groups, setups)
    levels = [
        [
            [None if group is None else _cells(tree, f"{group}/{level}/cells") for group in row]
            for row in groups
        ]
        for level in range(count)
    ]
    factors = [_factors(tree, f"/{setups[0]}/resolutions", level) for level in range(count)]
    image = image_of(tree.where, levels, factors, None, described.among(numbers))
    image = with_times(tree.where, image, described, numbers, points)
    return replace(
        image, close=tree.close, files=tree.files, notes=(*notes, *level_notes, *image.notes)
    )


def _common_levels(
    tree: Hdf5Tree, groups: Sequence[Sequence[str | None]], setups: Sequence[str]
) -> tuple[int, tuple[str, ...]]:
    """Return the number of levels that all setups have, and a note if some have more.

    groups  paths of the views, by time point and setup; None: a missing view
    """
    counts = []
    for place, setup in enumerate(setups):
        group = next((row[place] for row in groups if row[place]), None)
        if group is not None:
            counts.append(_count_levels(tree, group, setup))
    return common_levels(counts)


def _count_levels(tree: Hdf5Tree, group: str, setup: str) -> int:
    """Return the number of levels of a view. Raises SourceError if the file lacks stated levels."""
    first = tree.find(group)
    names = set(first) if isinstance(first, h5py.Group) else set()
    count = next((n for n in range(_MAX_LEVELS) if str(n) not in names), _MAX_LEVELS)
    if count == 0:
        raise SourceError(f"{tree.where}: {group}: found no level, expected 0/cells")
    stated = _stated_levels(tree, f"/{setup}/resolutions")
    if stated > count:
        raise SourceError(
            f"{tree.where}: {group}: found {count} levels, expected {stated} as in "
            f"/{setup}/resolutions: a part is missing: copy it again"
        )
    return count


def _named(tree: Hdf5Tree, pattern: str) -> list[str]:
    return sorted(name for name in tree.root if re.fullmatch(pattern, name))


def _cells(tree: Hdf5Tree, path: str) -> _Cells:
    node = tree.find(path)
    if not isinstance(node, h5py.Dataset):
        raise SourceError(f"{tree.where}: {path}: found no dataset, expected one with axes z, y, x")
    return _Cells(Hdf5Array(node, f"{tree.where}: {path}"))


def _stated_levels(tree: Hdf5Tree, path: str) -> int:
    node = tree.find(path)
    return len(node) if isinstance(node, h5py.Dataset) and node.shape else 0


def _factors(tree: Hdf5Tree, path: str, level: int) -> Triple | None:
    """Return level 0's voxels per voxel (z, y, x); the table has a row x, y, z for each level."""
    node = tree.find(path)
    table = np.zeros((0, 3))
    if isinstance(node, h5py.Dataset):
        table = np.atleast_2d(Hdf5Array(node, f"{tree.where}: {path}")[()])
    if level >= len(table) or table.shape[1] != 3 or not np.all(table[level] > 0):
        return None
    x, y, z = (float(value) for value in table[level])
    return z, y, x
