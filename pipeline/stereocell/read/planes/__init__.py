"""A folder of images: numbered planes of TIFF, PNG or JPEG, or a stack of TIFF for each channel.

The names say which plane, channel and time a file holds: read/planes/names.py guesses, or
`--pattern` tells (read/planes/pattern.py). Wells, sites and series part the files into volumes of
their own, of which one is built. Every file's head is read, its pixels when a window needs them.
"""

import os
import re
from collections import Counter
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.dataset import VoxelArray
from stereocell.read.image import MAX_CHANNELS, Color, Image, linear_color
from stereocell.read.planes.arrays import PlaneArray, StackArray
from stereocell.read.planes.files import JPEG, PNG, TIFF, Head, join, read_head, read_plane
from stereocell.read.planes.names import guess, in_natural_order, template_of
from stereocell.read.planes.pattern import read_by_pattern
from stereocell.read.planes.place import Place, natural
from stereocell.read.spacing import PartialTriple, grid_of
from stereocell.read.tiff import read_image as read_tiff
from stereocell.read.tiff.open_file import open_tiff
from stereocell.storage.library_errors import collected_log
from stereocell.storage.location import Location, require_own

_KINDS = {"TIFF": TIFF, "PNG": PNG, "JPEG": JPEG}
_AXES = ("t", "c", "z", "y", "x")
_SHOWN = 4  # names in a message
_SPARSE = 20  # times as many numbers as files between the first and the last: not one row
_EVEN = 0.01  # share of a step along z by which planes may deviate
_RGB: tuple[Color, ...] = tuple(
    linear_color(rgb) for rgb in ((255, 0, 0), (0, 255, 0), (0, 0, 255))
)


@dataclass(frozen=True, slots=True)
class _Volume:
    """The files of one group, sorted: `files[time, channel, plane]`; plane 0 alone of stacks."""

    group: str
    times: tuple[int, ...]
    channels: tuple[str, ...]
    planes: tuple[int, ...]
    files: dict[tuple[int, int, int], Place]


def read_image(location: Location, series: int = 0, pattern: str = "") -> Image:
    """Return one volume of the folder; 0 is the largest, others count from 1 as `list_series` does.

    pattern  how the names are built, as `img_c{c}_z{z}.tif`; empty: guessed

    Raises SourceError where the files make no volume, UsageError where the folder lacks the
    series, or the pattern fits no file.
    """
    where = location.shown
    listed = in_natural_order(_listed(location))
    whole = None if pattern else _set_in(location, listed)
    if whole is not None:
        return whole
    places, notes = _places(location, listed, pattern)
    groups = _groups(places)
    if series > len(groups):
        raise UsageError(
            f"{where}: --series: found {series}, expected 1 to {len(groups)} "
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
    volume = _volume_of(where, chosen)
    if chosen[0].plane is not None and first.pages == 1:
        return _of_planes(location, volume, first, notes)
    if first.pages == 1:
        raise SourceError(
            f"{where}: a volume needs at least 2 planes: found images of one plane, and no number "
            f"in their names that counts planes, as {chosen[0].path!r:.100}; expected such "
            "numbers, or --pattern with {z}"
        )
    if len(volume.planes) > 1:
        raise SourceError(
            f"{where}: found {first.pages} planes in {chosen[0].path!r:.100}, whose name has a "
            "number of a plane too, expected either"
        )
    return _of_stacks(location, volume, notes)


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each group of files, as `--series` counts them. Raises SourceError."""
    groups = _groups(_places(location, in_natural_order(_listed(location)), "")[0])
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
    paths, notes = _of_one_kind(found)
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


def _listed(location: Location) -> list[str]:
    """Return the images in the folder and below, relative to it, with `/`. Raises SourceError."""
    root = location.source
    found = []
    for at, folders, names in os.walk(root):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in names:
            if name.lower().endswith(TIFF + PNG + JPEG) and not name.startswith("."):
                found.append(os.path.relpath(os.path.join(at, name), root).replace(os.sep, "/"))
    for path in found:
        named = f"{location.shown}: {path!r:.200}"
        require_own(join(root, path), [location.folder], named=named)
    return found


def _of_one_kind(found: list[str]) -> tuple[list[str], list[str]]:
    """Return the files that the guess is about, and notes on the others.

    Images in the folder itself go before those below it, the commonest kind before others,
    planes before thumbnails and before MetaXpress' projections (`ZStep_0`).
    """
    notes = []
    top = [path for path in found if "/" not in path]
    if any("zstep_" in path.lower().rpartition("/")[0] for path in found):
        top = []  # MetaXpress puts projections into the folder, planes below it
    paths = top or found
    if top and len(top) < len(found):
        notes.append(f"{len(found) - len(top)} images in folders below left out")
    by_kind = {
        kind: [path for path in paths if path.lower().endswith(suffixes)]
        for kind, suffixes in _KINDS.items()
    }
    kind = max(by_kind, key=lambda one: len(by_kind[one]))  # of equally many the first
    if len(by_kind[kind]) < len(paths):
        notes.append(
            f"images of several kinds: {len(by_kind[kind])} {kind} are read, "
            f"{len(paths) - len(by_kind[kind])} others left out"
        )
    paths = by_kind[kind]
    for is_other, noun in ((_is_thumb, "thumbnails"), (_is_projection, "projections")):
        kept = [path for path in paths if not is_other(path)]
        if kept and len(kept) < len(paths):
            notes.append(f"{len(paths) - len(kept)} {noun} left out")
            paths = kept
    return paths, notes


def _is_thumb(path: str) -> bool:
    return "_thumb" in path.rpartition("/")[2].lower()


def _is_projection(path: str) -> bool:
    return "zstep_0/" in f"/{path.lower()}"


def _groups(places: Sequence[Place]) -> list[list[Place]]:
    groups: dict[str, list[Place]] = {}
    for place in places:
        groups.setdefault(place.group, []).append(place)
    return [groups[name] for name in sorted(groups, key=natural)]


def _named(location: Location, place: Place) -> str:
    return f"{location.shown}: {place.path!r:.200}"


def _volume_of(where: str, places: Sequence[Place]) -> _Volume:
    """Return a group's files by time, channel and plane. Raises SourceError for gaps and doubles.

    Where the planes' numbers go on from channel to channel, each channel's are counted anew.
    """
    channels = sorted({place.channel for place in places}, key=natural)
    times = sorted({place.time for place in places})
    if len(channels) > MAX_CHANNELS:
        raise SourceError(
            f"{where}: found {len(channels)} channels by the names, expected at most {MAX_CHANNELS}"
        )
    by_stack: dict[tuple[int, int], dict[int, Place]] = {}
    for place in places:
        stack = by_stack.setdefault((times.index(place.time), channels.index(place.channel)), {})
        other = stack.setdefault(place.plane or 0, place)
        if other is not place:
            raise SourceError(
                f"{where}: found two files for one plane, {other.path!r:.100} and "
                f"{place.path!r:.100}, expected one (--pattern tells names apart)"
            )
    numbers = sorted({number for stack in by_stack.values() for number in stack})
    own = [_every(where, sorted(stack)) for stack in by_stack.values()]
    if len(by_stack) > 1 and len({tuple(planes) for planes in own}) > 1:
        is_apart = all(
            planes == sorted(s) for planes, s in zip(own, by_stack.values(), strict=True)
        )
        if is_apart and len({len(planes) for planes in own}) == 1:
            by_stack = {
                key: {n: stack[number] for n, number in enumerate(sorted(stack))}
                for key, stack in by_stack.items()
            }
            numbers = list(range(len(own[0])))
    planes = _every(where, numbers)
    files = {}
    missing = []
    for key in np.ndindex(len(times), len(channels)):
        stack = by_stack.get((key[0], key[1]), {})
        for n, number in enumerate(planes):
            if number in stack:
                files[key[0], key[1], n] = stack[number]
            else:
                missing.append(_missing(places, times[key[0]], channels[key[1]], number))
    if missing:
        shown = ", ".join(missing[:_SHOWN]) + (", ..." if len(missing) > _SHOWN else "")
        raise SourceError(
            f"{where}: found {len(files)} of {len(files) + len(missing)} planes ("
            f"{len(channels)} channels, {len(planes)} planes, {len(times)} times by the names), "
            f"missing {shown}; expected all of them, or --pattern where the names mean something "
            "else"
        )
    return _Volume(places[0].group, tuple(times), tuple(channels), tuple(planes), files)


def _every(where: str, numbers: Sequence[int]) -> list[int]:
    """Return the numbers from the first to the last, in their usual step."""
    if len(numbers) < 2:
        return list(numbers)
    step = Counter(b - a for a, b in pairwise(numbers)).most_common(1)[0][0]
    if any((number - numbers[0]) % step for number in numbers):
        step = 1
    if (numbers[-1] - numbers[0]) // step > _SPARSE * len(numbers):
        raise SourceError(
            f"{where}: found {len(numbers)} planes numbered {numbers[0]} to "
            f"{numbers[-1]!s:.20} by the names, expected numbers in a row, or --pattern where "
            "they mean something else"
        )
    return list(range(numbers[0], numbers[-1] + 1, step))


def _missing(places: Sequence[Place], time: int, channel: str, plane: int) -> str:
    """Return the words for a plane that is not there: the path that it would have."""
    for place in places:
        if place.time == time and place.channel == channel and place.plane is not None:
            return repr(place.path_of(plane))
    return f"plane {plane} of channel {channel or '0'!r} at time {time}"


def _of_planes(location: Location, volume: _Volume, first: Head, notes: list[str]) -> Image:
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
    names, colors = _channels(volume)
    if samples > 1:
        if len(volume.channels) > 1:
            raise SourceError(
                f"{location.shown}: found {first.words} and {len(volume.channels)} channels in the "
                "names, expected either"
            )
        names, colors, told = _of_samples(samples)
        notes.append(told)
    shape = (len(volume.times), len(names), len(volume.planes), rows, columns)
    array = PlaneArray(shape, first.dtype, partial(_load, location, volume, first), samples > 1)
    z, y, x = first.spacing_um
    stepped = (
        z if z is not None else _step([heads[0, 0, n].z_um for n in range(len(volume.planes))])
    )
    return _image(
        VoxelArray(array, _AXES), (stepped, y, x), names, colors, [_read_as(volume), *notes]
    )


def _load(
    location: Location, volume: _Volume, first: Head, time: int, channel: int, plane: int
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
        told = f"colour pixels: built as channels Red, Green, Blue{alpha}"
        return ("Red", "Green", "Blue"), _RGB, told
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


def _of_stacks(location: Location, volume: _Volume, notes: list[str]) -> Image:
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
    return replace(image, close=array.close)


def _open(location: Location, volume: _Volume, time: int, channel: int) -> Image:
    place = volume.files[time, channel, 0]
    return read_tiff(Location(join(location.source, place.path), True))


def _channels(volume: _Volume) -> tuple[tuple[str | None, ...], tuple[Color | None, ...]]:
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


def _read_as(volume: _Volume) -> str:
    """Return the note on what the names were taken for."""
    place = volume.files[0, 0, 0]
    parts = []
    if len(volume.channels) > 1:
        shown = ", ".join(volume.channels[:_SHOWN])
        more = ", ..." if len(volume.channels) > _SHOWN else ""
        parts.append(f"{len(volume.channels)} channels ({shown}{more})")
    if len(volume.times) > 1:
        parts.append(f"{len(volume.times)} points in time")
    if place.plane is not None:
        parts.append(f"{len(volume.planes)} planes ({volume.planes[0]} to {volume.planes[-1]})")
    told = " of ".join(parts) or "one stack"
    count = len(volume.files)
    return f"{count} file{'s' * (count != 1)}, named as {template_of(place)}, read as {told}"
