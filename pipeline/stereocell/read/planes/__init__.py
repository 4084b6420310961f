"""A folder of images: planes of TIFF, PNG, JPEG or BMP, or a stack of TIFF for each channel.

The names say which plane, channel and time a file holds: read/planes/names.py guesses, or
`--pattern` tells (read/planes/pattern.py). Wells, sites and series part the files into volumes of
their own, of which one is built. Every file's head is read, its pixels when a window needs them.
"""

import re
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.beside import or_one_of, others_in
from stereocell.read.dataset import VoxelArray
from stereocell.read.image import Color, Image
from stereocell.read.planes.arrays import PlaneArray, StackArray
from stereocell.read.planes.files import TIFF, Head, join, read_head, read_plane
from stereocell.read.planes.listing import list_images, of_one_kind
from stereocell.read.planes.names import guess, in_natural_order, template_of
from stereocell.read.planes.pattern import read_by_pattern
from stereocell.read.planes.place import Place
from stereocell.read.planes.scan_log import find_log, with_log
from stereocell.read.planes.volume import Volume, groups_of, volume_of
from stereocell.read.series import numbers_of
from stereocell.read.spacing import PartialTriple, grid_of
from stereocell.read.tiff import read_image as read_tiff
from stereocell.read.tiff.arrays import RGB_COLORS, RGB_NAMES
from stereocell.read.tiff.open_file import open_tiff
from stereocell.storage.library_errors import collected_log
from stereocell.storage.location import Location

_AXES = ("t", "c", "z", "y", "x")
_SHOWN = 4  # names in a message
_NUMBER = re.compile(r"[0-9]{1,9}$")  # at the end of a channel's name
_EVEN = 0.01  # share of a step along z by which planes may deviate


def read_image(location: Location, *, series: int = 0, pattern: str = "") -> Image:
    """Return one volume of the folder; 0 is the largest, others count from 1 as `list_series` does.

    pattern  how the names are built, as `img_c{c}_z{z}.tif`; empty: guessed

    Raises SourceError where the files make no volume, UsageError where the folder lacks the
    series, or the pattern fits no file.
    """
    where = location.shown
    listed = in_natural_order(list_images(location))
    whole = None if pattern else _set_in(location, listed)
    if whole is not None:
        return whole
    places, notes = _places(location, listed, pattern)
    if held := others_in(location.source, "planes", "tiff"):
        notes.append(f"the folder holds {held} too, which are not read: name one to build it")
    groups = groups_of(places)
    if series > len(groups):
        raise UsageError(
            f"{where}: --series: found {series}, expected {numbers_of(len(groups))} "
            "(`--series list` shows them)"
        )
    number = series or 1 + max(range(len(groups)), key=lambda index: len(groups[index]))
    chosen = groups[number - 1]
    if len(chosen) == 1 and len(listed) > 1 and not (series or pattern):
        raise SourceError(
            f"{where}: found {len(listed)} images whose names make no volume, as "
            f"{listed[0]!r:.100} and {listed[-1]!r:.100}; expected planes or channels that numbers "
            "or words in their names tell; name one of the files, choose by --series (`--series "
            "list` shows them), or tell the names by --pattern"
        )
    if len(groups) > 1:
        why = "asked for" if series else "the largest"
        notes.append(
            f"{len(groups)} series in the names; building --series {number}, {why}: "
            f"{chosen[0].group}"
        )
    first = read_head(join(location.source, chosen[0].path), _named(location, chosen[0]))
    volume = volume_of(where, chosen)
    if chosen[0].plane is not None and first.pages == 1:
        return _of_planes(location, volume, first, notes)
    if first.pages == 1:
        raise SourceError(
            f"{where}: a volume needs at least 2 planes: found images of one plane, and no number "
            f"in their names that counts planes, as {chosen[0].path!r:.100}; expected such "
            f"numbers, or --pattern with {{z}}{or_one_of(location.source, 'planes', 'tiff')}"
        )
    if len(volume.planes) > 1:
        raise SourceError(
            f"{where}: found {first.pages} planes in {chosen[0].path!r:.100}, whose name has a "
            "number of a plane too, expected either"
        )
    return _of_stacks(location, volume, notes)


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each group of files, as `--series` counts them. Raises SourceError."""
    groups = groups_of(_places(location, in_natural_order(list_images(location)), "")[0])
    return tuple(
        f"{i:3d}  {group[0].group or 'all files'}: {len(group)} files, as {group[0].path!r:.100}"
        for i, group in enumerate(groups, start=1)
    )


def _set_in(location: Location, found: list[str]) -> Image | None:
    """Return the image of a folder that holds one TIFF stack, or a set of OME-TIFF; else None.

    The files of a set are one image by their OME-XML, whatever their names say.
    """
    paths = [path for path in found if path.lower().endswith(TIFF)]
    if not paths or len({path.rpartition("/")[0] for path in paths}) > 1:
        return None
    first = Location(join(location.source, paths[0]), True)
    if len(paths) > 1:
        with ExitStack() as stack, collected_log("tifffile"):
            text = open_tiff(first, stack).pages.first.description
        names = set(re.findall(r'FileName\s*=\s*"([^"]*)"', text))
        if "openmicroscopy" not in text or not ("BinaryOnly" in text or len(names) > 1):
            return None
    elif read_head(first.source, f"{location.shown}/{paths[0]}").pages == 1:
        return None
    image = read_tiff(first)
    return replace(image, notes=(f"the folder is read by its file {paths[0]}", *image.notes))


def _places(
    location: Location, found: list[str], pattern: str
) -> tuple[tuple[Place, ...], list[str]]:
    """Return the places of the files, and notes on those that are left out."""
    if pattern:
        own = found if "/" in pattern else [path for path in found if "/" not in path]
        places = read_by_pattern(own, pattern)
        left = len(found) - len(places)
        return places, [f"{left} files whose names the pattern doesn't fit left out"] * (left > 0)
    paths, notes = of_one_kind(found)
    first = read_head(join(location.source, paths[0]), f"{location.shown}/{paths[0]}")
    places = guess(paths, first.pages > 1)
    if 2 * len(places) < len(paths):
        raise SourceError(
            f"{location.shown}: found {len(paths)} images, of which {len(places)} are named "
            f"alike, as {places[0].path!r:.100}, expected one way of naming; name one of the "
            "files, or tell the names by --pattern"
        )
    if len(places) < len(paths):
        notes.append(f"{len(paths) - len(places)} files that are named otherwise left out")
    return places, notes


def _named(location: Location, place: Place) -> str:
    return f"{location.shown}: {place.path!r:.200}"


def _of_planes(location: Location, volume: Volume, first: Head, notes: list[str]) -> Image:
    heads = {}
    for key, place in volume.files.items():
        head = heads[key] = read_head(join(location.source, place.path), _named(location, place))
        if (head.shape, head.dtype, head.pages) != (first.shape, first.dtype, 1):
            found = f"{head.pages} planes" if head.pages > 1 else head.words
            raise SourceError(
                f"{_named(location, place)}: found {found}, expected {first.words} as in "
                f"{volume.files[0, 0, 0].path!r:.100}"
            )
    rows, columns, samples = first.shape
    notes += filter(None, sorted({head.note for head in heads.values()}))
    names, colors = _channels(volume)
    if samples > 1:
        if len(volume.channels) > 1:
            raise SourceError(
                f"{location.shown}: found {first.words} and {len(volume.channels)} channels in the "
                "names, expected either"
            )
        names, colors, description = _of_samples(samples)
        notes.append(description)
    shape = (len(volume.times), len(names), len(volume.planes), rows, columns)
    array = PlaneArray(shape, first.dtype, partial(_load, location, volume, first), samples > 1)
    z, y, x = first.spacing_um
    stepped = (
        z if z is not None else _step([heads[0, 0, n].z_um for n in range(len(volume.planes))])
    )
    log = find_log(location.source, volume.files[0, 0, 0].path)
    spacing, told = with_log((stepped, y, x), log, volume.planes)
    image = _image(
        VoxelArray(array, _AXES), spacing, names, colors, [_read_as(volume), *notes, *told]
    )
    return replace(image, files=(*_files(location, volume), *([log.path] if log else [])))


def _load(
    location: Location, volume: Volume, first: Head, time: int, channel: int, plane: int
) -> NDArray[Any]:
    place = volume.files[time, channel, plane]
    named = _named(location, place)
    pixels = read_plane(join(location.source, place.path), named)
    if pixels.shape != first.shape or pixels.dtype != first.dtype:
        raise SourceError(f"{named}: found another size than at first, expected {first.words}")
    return pixels


def _of_samples(samples: int) -> tuple[tuple[str | None, ...], tuple[Color | None, ...], str]:
    """Return names, colours and a note on colour pixels; alpha is left out."""
    if samples >= 3:
        alpha = "; their alpha is left out" * (samples == 4)
        description = f"colour pixels: built as channels {', '.join(RGB_NAMES)}{alpha}"
        return RGB_NAMES, RGB_COLORS, description
    return (None,), (None,), "grey pixels with alpha: the alpha is left out"


def _step(places_um: list[float | None]) -> float | None:
    """Return the even distance between planes, um, where each says where it lies."""
    known = [z for z in places_um if z is not None]
    if len(known) < max(len(places_um), 2):
        return None
    steps = np.diff(known)
    step = float(np.abs(steps).mean())
    is_even = step > 0 and bool((np.abs(np.abs(steps) - step) <= max(_EVEN * step, 0.02)).all())
    return step if is_even else None


def _of_stacks(location: Location, volume: Volume, notes: list[str]) -> Image:
    first = _open(location, volume, 0, 0)
    level = first.arrays[0]
    inner = level.size("c") if len(first.names) == level.size("c") else len(first.names)
    if inner > 1 and len(volume.channels) > 1:
        raise SourceError(
            f"{location.shown}: found {inner} channels in {volume.files[0, 0, 0].path!r:.100} and "
            f"{len(volume.channels)} in the names, expected either"
        )
    for time, channel, _ in volume.files:
        image = _open(location, volume, time, channel)
        own = image.arrays[0]
        same = (own.shape, own.array.dtype, len(image.names))
        if image.close is not None and image is not first:
            image.close()
        if own.size("t") > 1 or same != (level.shape, level.array.dtype, len(first.names)):
            raise SourceError(
                f"{_named(location, volume.files[time, channel, 0])}: found {own.shape} voxels "
                f"(z, y, x) of {own.array.dtype}, {own.size('t')} times, expected {level.shape} "
                f"of {level.array.dtype} at one time as in {volume.files[0, 0, 0].path!r:.100}"
            )
    names, colors = (first.names, first.colors) if inner > 1 else _channels(volume)
    if first.close is not None:
        first.close()
    shape = (len(volume.times), len(names), *level.shape)
    array = StackArray(
        shape, np.dtype(level.array.dtype), level.chunk, partial(_open, location, volume), inner > 1
    )
    grid = first.grids[0]
    image = _image(
        VoxelArray(array, _AXES),
        grid.spacing_um or grid.partial_um,
        names,
        colors,
        [_read_as(volume), *notes, *first.notes],
    )
    return replace(image, close=array.close, files=_files(location, volume))


def _files(location: Location, volume: Volume) -> tuple[str, ...]:
    return tuple(join(location.source, place.path) for place in volume.files.values())


def _open(location: Location, volume: Volume, time: int, channel: int) -> Image:
    place = volume.files[time, channel, 0]
    return read_tiff(Location(join(location.source, place.path), True))


def _channels(volume: Volume) -> tuple[tuple[str | None, ...], tuple[Color | None, ...]]:
    return tuple(name or None for name in volume.channels), (None,) * len(volume.channels)


def _image(
    array: VoxelArray,
    spacing_um: PartialTriple,
    names: tuple[str | None, ...],
    colors: tuple[Color | None, ...],
    notes: list[str],
) -> Image:
    return Image(
        (array,), (grid_of(array.shape, spacing_um),), names, colors, 1, notes=tuple(notes)
    )


def _read_as(volume: Volume) -> str:
    """Return the note on what the names were taken for."""
    place = volume.files[0, 0, 0]
    parts = []
    if len(volume.channels) > 1:
        shown = ", ".join(volume.channels[:_SHOWN])
        more = ", ..." if len(volume.channels) > _SHOWN else ""
        numbers = [int(found[0]) for name in volume.channels if (found := _NUMBER.search(name))]
        skipped = _skipped(numbers) if len(numbers) == len(volume.channels) else ""
        parts.append(f"{len(volume.channels)} channels ({shown}{more}{skipped})")
    if len(volume.times) > 1:
        skipped = _skipped(volume.times)
        parts.append(f"{len(volume.times)} points in time{f' ({skipped[2:]})' * bool(skipped)}")
    if place.plane is not None:
        first, last, skipped = volume.planes[0], volume.planes[-1], _skipped(volume.planes)
        parts.append(f"{len(volume.planes)} planes ({first} to {last}{skipped})")
    description = " of ".join(parts) or "one stack"
    count = len(volume.files)
    return f"{count} file{'s' * (count != 1)}, named as {template_of(place)}, read as {description}"


def _skipped(numbers: Sequence[int]) -> str:
    """Return the words for the numbers between the least and the largest that no name has."""
    least, largest = min(numbers), max(numbers)
    count = largest - least + 1 - len(set(numbers))
    if not count:
        return ""
    present = set(numbers)
    absent = (number for number in range(least, largest) if number not in present)
    shown = ", ".join(map(str, islice(absent, _SHOWN)))
    return f"; no file is numbered {shown}{', ...' if count > _SHOWN else ''}"
