"""Read N5 block by block: a dataset, a pyramid `s0`, `s1`, ..., or a BigDataViewer container.

zarr-python reads no N5 since version 3. tensorstore (20 MB) does, but it opens every file below the
source wherever a link leads, and unpacks blocks of any size. A block is simple: a header of 16-bit
and 32-bit numbers, then one of the usual codecs. So this package decodes it itself.

N5 lists axes fastest first, also in the paths of its blocks; here everything is reversed to z, y,
x. The voxels of an absent block are read as 0.

References: https://github.com/saalfeldlab/n5 (the specification in its README)
"""

import os
import re
import struct
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.array_axes import settle_stated_axes
from stereocell.read.bigdataviewer.described import Described
from stereocell.read.bigdataviewer.image import chosen_view, common_levels, grids_of, image_of
from stereocell.read.bigdataviewer.times import with_times
from stereocell.read.bigdataviewer.xml import read_described
from stereocell.read.dataset import VoxelArray
from stereocell.read.formats.n5.blocks import unpack_block
from stereocell.read.formats.n5.files import N5Files
from stereocell.read.formats.n5.statements import named_axes, order_note, settle_spacing
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.series import SeveralDatasetsError
from stereocell.read.spacing import Triple
from stereocell.read.stated_numbers import numbers_of
from stereocell.read.value_scale import ignored_note, scaled
from stereocell.storage.location import Location

_MAX_LEVELS = 64
_MAX_TIMES = 100_000
_LISTED = 12  # datasets that a message names at most
_TYPES = {f"{kind}{bits}" for kind in ("int", "uint") for bits in (8, 16, 32, 64)}
_TYPES |= {"float32", "float64"}


class N5Array:
    """A dataset's voxels, axes slowest first; only the blocks that a window touches are read."""

    def __init__(self, files: N5Files, path: str, attributes: Mapping[str, Any]) -> None:
        where = f"{files.where}/{path}".rstrip("/")
        sizes, blocks = (_whole(where, attributes, name) for name in ("dimensions", "blockSize"))
        kind = attributes.get("dataType")
        if kind not in _TYPES:
            raise SourceError(f"{where}: dataType: found {kind!r:.40}, expected uint8, uint16, ...")
        if len(sizes) != len(blocks):
            raise SourceError(
                f"{where}: blockSize: found {len(blocks)} numbers, expected {len(sizes)}"
            )
        self.shape: tuple[int, ...] = tuple(reversed(sizes))
        self.chunks: tuple[int, ...] = tuple(reversed(blocks))
        self.dtype = np.dtype(kind).newbyteorder(">")
        packing = attributes.get("compression", attributes.get("compressionType", "raw"))
        self._packing = packing if isinstance(packing, Mapping) else {"type": packing}
        self._files, self._path = files, path

    def __getitem__(self, key: Any) -> NDArray[Any]:
        """Return the voxels at whole numbers and slices; slices have step 1 and lie inside."""
        bounds = [
            part.indices(size)[:2] if isinstance(part, slice) else (int(part), int(part) + 1)
            for part, size in zip(key, self.shape, strict=True)
        ]
        found = np.zeros([stop - start for start, stop in bounds], self.dtype)
        spans = [range(a // n, -(-b // n)) for (a, b), n in zip(bounds, self.chunks, strict=True)]
        for index in product(*spans):
            if (block := self._block(index)) is None:
                continue
            starts = [i * n for i, n in zip(index, self.chunks, strict=True)]
            into, out = [], []
            for (low, high), start, size in zip(bounds, starts, block.shape, strict=True):
                first, last = max(low, start), min(high, start + size)
                into.append(slice(first - low, max(last, first) - low))
                out.append(slice(first - start, max(last, first) - start))
            found[tuple(into)] = block[tuple(out)]
        kept = tuple(slice(None) if isinstance(part, slice) else 0 for part in key)
        return found[kept]

    @property
    def folder(self) -> str:
        """The path or address of the container, to which the paths of blocks are relative."""
        return self._files.source

    def path_of(self, index: Sequence[int]) -> str:
        """Return the path of a block below the source."""
        return "/".join([self._path, *map(str, reversed(index))]).lstrip("/")

    def _block(self, index: Sequence[int]) -> NDArray[Any] | None:
        path = self.path_of(index)
        content = self._files.read(path)
        if content is None:
            if self._files.read(f"{self._path}/attributes.json".lstrip("/")) is None:
                raise OSError("attributes.json was removed after it was opened")
            return None
        try:
            triples = zip(index, self.chunks, self.shape, strict=True)
            least = [min(n, size - i * n) for i, n, size in triples]
            return unpack_block(content, least, self.chunks, self.dtype, self._packing)
        except struct.error:
            raise OSError(f"block {path} is cut short ({len(content)} bytes)") from None


def read_image(location: Location, *, axes: str = "", series: int = 0, xml: str = "") -> Image:
    """Return the image of a dataset, a pyramid or a container. Raises SourceError and UsageError.

    series, xml  number of a BigDataViewer view, and path of the XML if the user named it
    """
    if location.is_local and not os.path.isdir(location.source):
        raise SourceError(f"{location.shown}: found a file, expected a folder of N5")
    files = N5Files(location)
    attributes = files.attributes("")
    if "dimensions" in attributes:
        above = files.above()
        return _pyramid(files, above, [("", attributes)], axes)
    if "dimensions" in files.attributes("s0"):
        return _pyramid(files, attributes, _levels(files, ""), axes)
    if "dimensions" in files.attributes("timepoint0/s0"):
        number = re.fullmatch(r"setup(\d+)", os.path.basename(location.source))
        described = Described({})
        if location.is_local and number:
            described = read_described(os.path.dirname(location.source))
        own = int(number[1]) if number else 0
        return _container(files, {own: ""}, described.alone(own))
    if "dimensions" in files.attributes("setup0/timepoint0/s0"):
        numbers = files.numbered("setup")[:MAX_CHANNELS]
        if not numbers:
            numbers = list(range(_count(files, "setup{}/timepoint0/s0", MAX_CHANNELS)))
        described = read_described(location.source, xml) if location.is_local else Described({})
        folders = {number: f"setup{number}/" for number in numbers}
        return _container(files, folders, described, (series, xml))
    found = files.datasets(_LISTED + 1)
    if len(found) == 1:
        return _pyramid(files, attributes, [(found[0], files.attributes(found[0]))], axes)
    if not found:
        raise SourceError(
            f"{files.where}: no dataset: found no attributes.json with `dimensions`, expected one "
            "here or in s0 below"
        )
    labels = {f"/{path}": path for path in found}
    raise SeveralDatasetsError.of(files.where, files.where, labels, most=_LISTED)


def _levels(files: N5Files, path: str) -> list[tuple[str, Mapping[str, Any]]]:
    """Return the paths and attributes of `s0`, `s1`, ... below a path."""
    found: list[tuple[str, Mapping[str, Any]]] = []
    for index in range(_MAX_LEVELS):
        level = f"{path}/s{index}".lstrip("/")
        if "dimensions" not in (attributes := files.attributes(level)):
            break
        found.append((level, attributes))
    return found


def _pyramid(
    files: N5Files,
    group: Mapping[str, Any],
    levels: Sequence[tuple[str, Mapping[str, Any]]],
    axes: str,
) -> Image:
    arrays = [N5Array(files, path, attributes) for path, attributes in levels]
    finest = levels[0][1]
    shape = arrays[0].shape
    stated = named_axes(finest, group)
    names, notes = settle_stated_axes(files.where, shape, axes, stated)
    if any(len(array.shape) != len(names) for array in arrays):
        raise SourceError(
            f"{files.where}: levels: found different numbers of dimensions, expected {len(names)} "
            "in each"
        )
    valued = [scaled(files.where, array, finest) for array in arrays]
    voxels = tuple(VoxelArray(array, names) for array, _ in valued)
    if (count := voxels[0].size("c")) > MAX_CHANNELS:
        raise SourceError(
            f"{files.where}: axis c: found {count} channels, expected at most {MAX_CHANNELS}"
        )
    spacing, spacing_notes = settle_spacing(finest, group, names)
    scales = [_factors(group, attributes, i, names) for i, (_, attributes) in enumerate(levels)]
    grids = grids_of([v.shape for v in voxels], spacing, scales)
    unnamed = (None,) * count
    read = tuple(files.address(path) for path, _ in levels)
    notes = (*notes, *order_note(stated, names, axes), *spacing_notes, *valued[0][1])
    if ignored := ignored_note("the group", group):
        notes = (*notes, ignored)
    return Image(voxels, grids, unnamed, unnamed, 1, notes=notes, files=read)


def _container(
    files: N5Files,
    folders: Mapping[int, str],
    described: Described,
    view: tuple[int, str] = (0, ""),
) -> Image:
    """Return the image of a view in BigDataViewer's container: its setups are channels.

    folders    folders of the setups, by number, each with a final slash
    described  setups and time points of the XML
    view       number of the view as listed in the XML, from 1 (0: the largest), and the path of the
               XML that the user named
    """
    times = sorted({time for folder in folders.values() for time in _times(files, folder)})
    described.require_views(files.where, list(folders), times)
    numbers, notes = chosen_view(files.where, described, list(folders), *view)
    taken = described.taken(files.where, numbers, times)
    levels, level_notes = _common_levels(files, folders, numbers, taken)
    first, path = numbers[0], levels[0][0].rpartition("/")[0]

    def view_of(time: int, number: int, level: int) -> N5Array | None:
        if (time, number) not in taken:
            return None
        return _dataset(files, f"{folders[number]}timepoint{time}/s{level}")

    views = [
        [[view_of(time, number, index) for number in numbers] for time in times]
        for index in range(len(levels))
    ]
    group = files.attributes(folders[first].rstrip("/"))
    stated, more = settle_spacing(files.attributes(path), {}, "zyx")
    scales = [_factors(group, attributes, i, "zyx") for i, (_, attributes) in enumerate(levels)]
    image = image_of(files.where, views, scales, stated, described.among(numbers))
    image = with_times(files.where, image, described, numbers, times)
    return replace(image, notes=(*notes, *level_notes, *more, *image.notes))


def _common_levels(
    files: N5Files,
    folders: Mapping[int, str],
    numbers: Sequence[int],
    taken: Collection[tuple[int, int]],
) -> tuple[list[tuple[str, Mapping[str, Any]]], tuple[str, ...]]:
    """Return the levels of the first setup that all setups have, and notes.

    taken  views that were taken, as pairs of time point and setup

    Raises SourceError where a setup lacks levels that its attributes count.
    """
    every = []
    for number in numbers:
        times = [time for time, setup in taken if setup == number]
        if not times:
            continue
        levels = _levels(files, f"{folders[number]}timepoint{min(times)}")
        factors = files.attributes(folders[number].rstrip("/")).get("downsamplingFactors")
        if isinstance(factors, list) and len(factors) > len(levels):
            raise SourceError(
                f"{files.where}: {folders[number]}: found {len(levels)} levels, expected "
                f"{len(factors)}, as in downsamplingFactors: a part is missing: copy it again"
            )
        every.append(levels)
    fewest, notes = common_levels([len(levels) for levels in every])
    return every[0][:fewest], notes


def _times(files: N5Files, folder: str) -> list[int]:
    """Return the numbers of a setup's time points. At an address they are counted one by one."""
    found = files.numbered(f"{folder}timepoint")[:_MAX_TIMES]
    return found or list(range(_count(files, f"{folder}timepoint{{}}/s0", _MAX_TIMES)))


def _dataset(files: N5Files, path: str) -> N5Array:
    return N5Array(files, path, files.attributes(path))


def _count(files: N5Files, pattern: str, most: int) -> int:
    count = 0
    while count < most and "dimensions" in files.attributes(pattern.format(count)):
        count += 1
    return count


def _factors(
    group: Mapping[str, Any], level: Mapping[str, Any], index: int, axes: Sequence[str]
) -> Triple | None:
    """Return level 0's voxels per voxel, (z, y, x); None: not stated."""
    stated = level.get("downsamplingFactors")
    for name in ("downsamplingFactors", "scales"):
        every = group.get(name)
        if stated is None and isinstance(every, list) and index < len(every):
            stated = every[index]
    found = numbers_of(stated)
    along = dict(zip(reversed(axes), found, strict=False))
    if len(found) == 3:
        along = dict(zip(reversed([a for a in axes if a in "zyx"]), found, strict=True))
    values = [along.get(axis, 0.0) for axis in "zyx"]
    return (values[0], values[1], values[2]) if min(values) > 0 else None


def _whole(where: str, attributes: Mapping[str, Any], name: str) -> list[int]:
    values = attributes.get(name)
    if not isinstance(values, list) or not all(
        isinstance(value, int) and 0 < value < 1 << 40 for value in values
    ):
        raise SourceError(f"{where}: {name}: found {values!r:.60}, expected sizes above 0")
    return values
