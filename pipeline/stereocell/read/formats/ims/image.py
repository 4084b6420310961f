"""Read Imaris 5.5 (.ims), HDF5 with levels, time points and channels, with h5py.

Datasets are padded to whole chunks; their true size is in the attributes beside them (`ImageSizeX`)
and, for the finest level, in `DataSetInfo/Image` too. The extents there give the voxel spacing.
Attributes are arrays of characters.

References: https://imaris.oxinst.com/support/imaris-file-format
"""

import re
from collections.abc import Callable
from functools import partial
from typing import Any

import h5py
import numpy as np

from stereocell.model.color import linear_color
from stereocell.model.errors import SourceError
from stereocell.read.dataset import VoxelArray
from stereocell.read.formats.ims.statements import settle_lengths, size_notes
from stereocell.read.hdf5_file.tree import Hdf5Array, Hdf5Tree
from stereocell.read.image import MAX_CHANNELS, Color, Image
from stereocell.read.spacing import Grid, Triple
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_MAX_LEVELS = 64
_MAX_TIMES = 1_000_000
_FINEST = "/DataSet/ResolutionLevel 0/TimePoint 0"
_CHANNEL = re.compile(r"Channel \d+")
_NO_NAME = "(name not specified)"  # Imaris writes this where a channel has no name


class _Level:
    """A level's voxels (t, c, z, y, x) without padding. A dataset is opened at its first use.

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
                    f"time point {time}, channel {channel}: found {found.dtype} {found.shape}, "
                    f"expected {self.dtype} {self.shape[2:]}"
                )
            self._held[time, channel] = found
        return self._held[time, channel][tuple(place)]


def read_image(location: Location) -> Image:
    """Return the image of the file. Raises SourceError where it isn't an Imaris 5.5 file."""
    tree = Hdf5Tree(location, "a complete Imaris 5.5 file (HDF5)")
    try:
        # h5py may fail at any name or attribute of a damaged file.
        with one_line(tree.where, "a complete Imaris 5.5 file (HDF5)"):
            image = _image(tree)
            tree.end_texts()
            return image
    except BaseException:
        tree.close()
        raise


def _image(tree: Hdf5Tree) -> Image:
    times = _count(tree, "/DataSet/ResolutionLevel 0", "TimePoint", _MAX_TIMES)
    channels = _count(tree, _FINEST, "Channel", MAX_CHANNELS)
    levels = _count(tree, "/DataSet", "ResolutionLevel", _MAX_LEVELS)
    _require_stated(tree, times, channels)
    arrays = [_level(tree, level, times, channels) for level in range(levels)]
    info = "/DataSetInfo/Image"
    unit = tree.attribute(tree.find(info), "Unit")
    extents, notes = settle_lengths(partial(_number, tree, info), unit, arrays[0].shape)
    grids = []
    for array in arrays:
        shape = array.shape
        spacing = extents and _triple(e / n for e, n in zip(extents, shape, strict=True))
        half = spacing and _triple(0.5 * s for s in spacing)
        grids.append(Grid(shape, spacing, half))
    notes = (*notes, *size_notes(_stated_size(tree, 0), arrays[0].shape))
    names, colors = zip(*(_channel(tree, index) for index in range(channels)), strict=True)
    return Image(
        tuple(arrays), tuple(grids), names, colors, 1, tree.close, notes=notes, files=tree.files
    )


def _require_stated(tree: Hdf5Tree, times: int, channels: int) -> None:
    """Raise SourceError where the metadata state more time points or channels than the file has.

    FileTimePoints counts the time points of this file; in a series of files DatasetTimePoints is
    larger.
    """
    info = tree.find("/DataSetInfo")
    names = set(info) if isinstance(info, h5py.Group) else set()
    stated = {"channels": sum(1 for name in names if _CHANNEL.fullmatch(name)), "time points": 0}
    if "TimeInfo" in names:
        counts = [
            _number(tree, "/DataSetInfo/TimeInfo", name)
            for name in ("FileTimePoints", "DatasetTimePoints")
        ]
        stated["time points"] = int(next((n for n in counts if n is not None), 0))
    for noun, found in (("channels", channels), ("time points", times)):
        if stated[noun] > found:
            raise SourceError(
                f"{tree.where}: /DataSet: found {found} {noun}, expected {stated[noun]} as in "
                "/DataSetInfo: a part is missing: copy or export it again"
            )


def _count(tree: Hdf5Tree, path: str, kind: str, most: int) -> int:
    """Return the number of groups `KIND 0`, `KIND 1`, ... below a path."""
    node = tree.find(path)
    names = set(node) if isinstance(node, h5py.Group) else set()
    count = 0
    while count < len(names) and f"{kind} {count}" in names:
        count += 1
    beyond = [int(n[len(kind) + 1 :]) for n in names if re.fullmatch(rf"{kind} \d+", n)]
    if count and max(beyond) >= count:
        raise SourceError(
            f"{tree.where}: {path}: found {kind} {max(beyond)} and no {kind} {count}, expected "
            "all of them: a part is missing: copy or export it again"
        )
    if not 0 < count <= most:
        raise SourceError(
            f"{tree.where}: {path}: found {count} groups {kind}, expected 1 to {most} in Imaris 5.5"
        )
    return count


def _level(tree: Hdf5Tree, level: int, times: int, channels: int) -> VoxelArray:
    def find(time: int, channel: int) -> Hdf5Array:
        path = f"/DataSet/ResolutionLevel {level}/TimePoint {time}/Channel {channel}/Data"
        node = tree.find(path)
        shape = node.shape or () if isinstance(node, h5py.Dataset) else None
        if shape is None or len(shape) != 3:
            held = "no dataset" if shape is None else f"a dataset of shape {shape}"
            raise SourceError(f"{tree.where}: {path}: found {held}, expected one with axes z, y, x")
        return Hdf5Array(node, f"{tree.where}: {path}")

    first = find(0, 0)
    group = f"/DataSet/ResolutionLevel {level}/TimePoint 0/Channel 0"
    stated = _stated_size(tree, level)
    if level == 0:
        _require_size(tree, group, stated)
    size = [n if s is None else int(s) for s, n in zip(stated, first.shape, strict=True)]
    for axis, found, most in zip("ZYX", size, first.shape, strict=True):
        if not 0 < found <= most:
            raise SourceError(
                f"{tree.where}: {group}: ImageSize{axis}: found {found}, expected 1 to {most}"
            )
    return VoxelArray(_Level((times, channels, *size), first, find), tuple("tczyx"))


def _stated_size(tree: Hdf5Tree, level: int) -> list[float | None]:
    """Return the voxels (z, y, x) of a level without its padding; None for each one not stated."""
    group = f"/DataSet/ResolutionLevel {level}/TimePoint 0/Channel 0"
    stated = [_number(tree, group, f"ImageSize{axis}") for axis in "ZYX"]
    if level == 0 and None in stated:
        stated = [_number(tree, "/DataSetInfo/Image", axis) for axis in "ZYX"]
    return stated


def _require_size(tree: Hdf5Tree, group: str, stated: list[float | None]) -> None:
    """Raise SourceError where the finest level is smaller than DataSetInfo states.

    stated  sizes (z, y, x) in the attributes beside the dataset
    """
    for axis, own in zip("ZYX", stated, strict=True):
        whole = _number(tree, "/DataSetInfo/Image", axis)
        if own is not None and whole is not None and int(own) < int(whole):
            raise SourceError(
                f"{tree.where}: {group}: ImageSize{axis}: found {int(own)}, expected {int(whole)} "
                f"as {axis} of /DataSetInfo/Image: a part is missing: copy or export it again"
            )


def _number(tree: Hdf5Tree, path: str, name: str) -> float | None:
    """Return a number from an attribute; None: absent. Raises SourceError for another text."""
    text = tree.attribute(tree.find(path), name)
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
    name, color = tree.attribute(node, "Name"), tree.attribute(node, "Color")
    mode = tree.attribute(node, "ColorMode")
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
