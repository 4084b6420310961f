"""Imaris 5.5 (.ims): HDF5 with levels, time points and channels, read by h5py.

The datasets are padded to whole chunks; the true size stands beside them (`ImageSizeX`), of the
finest level in `DataSetInfo/Image` too. The extents there give the voxel spacing. Attributes are
arrays of characters.

References: https://imaris.oxinst.com/support/imaris-file-format
"""

from collections.abc import Callable
from typing import Any

import h5py
import numpy as np

from stereocell.model.color import linear_color
from stereocell.model.errors import SourceError
from stereocell.read.dataset import VoxelArray
from stereocell.read.hdf5_tree import Hdf5Array, Hdf5Tree, attribute
from stereocell.read.image import MAX_CHANNELS, Color, Image
from stereocell.read.spacing import Grid, Triple, um_per
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_MAX_LEVELS = 64
_MAX_TIMES = 1_000_000
_FINEST = "/DataSet/ResolutionLevel 0/TimePoint 0"
_NO_NAME = "(name not specified)"  # Imaris's own
_UNIT = "um"  # where the file states none, as Imaris has it


class _Level:
    """A level's voxels (t, c, z, y, x), without the padding; a dataset is opened on its first use.

    find  returns the dataset of (time, channel)
    """

    def __init__(
        self, shape: tuple[int, ...], first: Hdf5Array, find: Callable[[int, int], Hdf5Array]
    ) -> None:
        self.shape = shape
        self.dtype = first.dtype
        self.chunks: tuple[int, ...] = (1, 1, *first.chunks)
        self._first, self._find = first, find
        self._held: dict[tuple[int, int], Hdf5Array] = {}

    def __getitem__(self, key: Any) -> Any:
        time, channel, *place = key
        if (time, channel) not in self._held:
            found = self._find(time, channel)
            if found.dtype != self.dtype or any(
                n < m for n, m in zip(found.shape, self.shape[2:], strict=True)
            ):
                raise ValueError(
                    f"time point {time}, channel {channel}: found {found.dtype} {found.shape}"
                )
            self._held[time, channel] = found
        return self._held[time, channel][tuple(place)]


def read_image(location: Location) -> Image:
    """Return the image of the file. Raises SourceError where it isn't one of Imaris 5.5."""
    tree = Hdf5Tree(location, "an Imaris 5.5 file (HDF5), whole")
    try:
        # all of it asks h5py, which may fail at any name or attribute of a damaged file
        with one_line(tree.where, "an Imaris 5.5 file (HDF5), whole"):
            return _image(tree)
    except BaseException:
        tree.close()
        raise


def _image(tree: Hdf5Tree) -> Image:
    times = _count(tree, "/DataSet/ResolutionLevel 0", "TimePoint", _MAX_TIMES)
    channels = _count(tree, _FINEST, "Channel", MAX_CHANNELS)
    levels = _count(tree, "/DataSet", "ResolutionLevel", _MAX_LEVELS)
    extents = _extents(tree)
    arrays, grids = [], []
    for level in range(levels):
        array = _level(tree, level, times, channels)
        shape = array.shape
        spacing = extents and _triple(e / n for e, n in zip(extents, shape, strict=True))
        half = spacing and _triple(0.5 * s for s in spacing)
        arrays.append(array)
        grids.append(Grid(shape, spacing, half))
    names, colors = zip(*(_channel(tree, index) for index in range(channels)), strict=True)
    return Image(tuple(arrays), tuple(grids), names, colors, 1, tree.close, files=tree.files)


def _count(tree: Hdf5Tree, path: str, kind: str, most: int) -> int:
    """Return the number of groups `KIND 0`, `KIND 1`, ... below a path."""
    node = tree.find(path)
    names = set(node) if isinstance(node, h5py.Group) else set()
    count = 0
    while count < len(names) and f"{kind} {count}" in names:
        count += 1
    if not 0 < count <= most:
        raise SourceError(
            f"{tree.where}: {path}: found {count} of {kind}, expected 1 to {most} as Imaris 5.5"
        )
    return count


def _level(tree: Hdf5Tree, level: int, times: int, channels: int) -> VoxelArray:
    def find(time: int, channel: int) -> Hdf5Array:
        path = f"/DataSet/ResolutionLevel {level}/TimePoint {time}/Channel {channel}/Data"
        node = tree.find(path)
        if not isinstance(node, h5py.Dataset) or len(node.shape or ()) != 3:
            raise SourceError(f"{tree.where}: {path}: expected a dataset z, y, x")
        return Hdf5Array(node, f"{tree.where}: {path}")

    first = find(0, 0)
    group = f"/DataSet/ResolutionLevel {level}/TimePoint 0/Channel 0"
    stated = [_number(tree, group, f"ImageSize{axis}") for axis in "ZYX"]
    if level == 0 and None in stated:
        stated = [_number(tree, "/DataSetInfo/Image", axis) for axis in "ZYX"]
    size = [n if s is None else int(s) for s, n in zip(stated, first.shape, strict=True)]
    for axis, found, most in zip("ZYX", size, first.shape, strict=True):
        if not 0 < found <= most:
            raise SourceError(
                f"{tree.where}: {group}: ImageSize{axis}: found {found}, expected 1 to {most}"
            )
    return VoxelArray(_Level((times, channels, *size), first, find), tuple("tczyx"))


def _extents(tree: Hdf5Tree) -> Triple | None:
    """Return the lengths (z, y, x) of the volume in um; None: not stated."""
    info = tree.find("/DataSetInfo/Image")
    unit = um_per(attribute(info, "Unit") or _UNIT)
    ends = [
        (
            _number(tree, "/DataSetInfo/Image", f"ExtMin{i}"),
            _number(tree, "/DataSetInfo/Image", f"ExtMax{i}"),
        )
        for i in (2, 1, 0)
    ]
    if unit is None:
        return None
    lengths = [(high - low) * unit for low, high in ends if low is not None and high is not None]
    return _triple(lengths) if len(lengths) == 3 else None


def _number(tree: Hdf5Tree, path: str, name: str) -> float | None:
    """Return a number of an attribute; None: there is none. Raises SourceError for another text."""
    text = attribute(tree.find(path), name)
    if text is None:
        return None
    try:
        value = float(text)
    except (TypeError, ValueError):
        value = float("nan")
    if not np.isfinite(value):
        raise SourceError(f"{tree.where}: {path}: {name}: found {text!r:.40}, expected a number")
    return value


def _channel(tree: Hdf5Tree, index: int) -> tuple[str | None, Color | None]:
    info = tree.find("/DataSetInfo")
    if not isinstance(info, h5py.Group) or f"Channel {index}" not in info:
        return None, None
    node = tree.find(f"/DataSetInfo/Channel {index}")
    name, color = attribute(node, "Name"), attribute(node, "Color")
    mode = attribute(node, "ColorMode")
    parts: list[float] = []
    if isinstance(color, str) and mode in (None, "BaseColor"):
        try:
            parts = [float(part) for part in color.split()]
        except ValueError:
            parts = []
    is_color = len(parts) == 3 and all(0 <= part <= 1 for part in parts)
    red, green, blue = (round(255 * part) for part in parts) if is_color else (0, 0, 0)
    title = name.strip() if isinstance(name, str) and name != _NO_NAME else ""
    return title or None, linear_color((red, green, blue)) if is_color else None


def _triple(values: Any) -> Triple:
    z, y, x = values
    return float(z), float(y), float(x)
