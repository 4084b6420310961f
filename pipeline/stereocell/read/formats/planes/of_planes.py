"""Read a volume from files that hold one plane each."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.formats.planes.agreement import (
    drift_notes_of_planes,
    dtype_of_planes,
    notes_of_planes,
    require_one_kind,
    settle_depth_of_planes,
    settle_sizes,
)
from stereocell.read.formats.planes.arrays import PlaneArray
from stereocell.read.formats.planes.files import read_head, read_plane
from stereocell.read.formats.planes.head import Head
from stereocell.read.formats.planes.scan_log import find_log, with_log
from stereocell.read.formats.planes.volume_files import Key, VolumeFiles
from stereocell.read.image import RGB_COLORS, RGB_NAMES, Color, Image
from stereocell.read.value_scale import values_of

Channels = tuple[tuple[str | None, ...], tuple[Color | None, ...]]


def image_of_planes(files: VolumeFiles, notes: list[str]) -> Image:
    """Return the image of a volume of planes. Raises SourceError where they differ in kind."""
    where, volume = files.location.shown, files.volume
    heads = _heads(files)
    first, every = heads[0, 0, 0], list(heads.values())
    by_name = {files.name(key): head for key, head in heads.items()}
    require_one_kind(where, by_name)
    rows, columns, samples = first.shape
    notes = [*notes, *notes_of_planes(every)]
    channels = files.channels
    if samples > 1:
        if len(volume.channels) > 1:
            raise SourceError(
                f"{where}: found {first.words} and {len(volume.channels)} channels in the names, "
                "expected only one of the two"
            )
        channels, description = _of_samples(samples)
        notes.append(description)
    shape = (len(volume.times), len(channels[0]), len(volume.planes), rows, columns)
    dtype = dtype_of_planes(every)
    array = PlaneArray(shape, dtype, partial(_load, files, heads, dtype), samples > 1)
    (z, y, x), size_notes = settle_sizes({name: one.spacing_um for name, one in by_name.items()})
    one_stack = [heads[0, 0, n] for n in range(len(volume.planes))]
    depth, depth_notes = settle_depth_of_planes(one_stack, z)
    depth_notes += drift_notes_of_planes(one_stack, (depth, y, x))
    log = find_log(files.location.source, files.name((0, 0, 0)))
    spacing, log_notes = with_log((depth, y, x), log, volume.planes)
    image = files.image(array, spacing, channels, [*notes, *size_notes, *depth_notes, *log_notes])
    return replace(image, files=(*files.paths, *([log.path] if log else [])))


def _heads(files: VolumeFiles) -> dict[Key, Head]:
    """Return the heads of all files. Raises SourceError where their planes differ in size."""
    heads: dict[Key, Head] = {}
    for key in files.volume.files:
        head = heads[key] = read_head(files.path(key), files.shown(key))
        first = heads[0, 0, 0]
        if (head.shape, head.dtype, head.pages) != (first.shape, first.dtype, 1):
            found = f"{head.pages} planes" if head.pages > 1 else head.words
            raise SourceError(
                f"{files.shown(key)}: found {found}, expected {first.words}, as in "
                f"{files.name((0, 0, 0))!r:.100}"
            )
    return heads


def _load(
    files: VolumeFiles, heads: Mapping[Key, Head], dtype: np.dtype[Any], *place: int
) -> NDArray[Any]:
    time, channel, plane = place
    key = (time, channel, plane)
    head, shown = heads[key], files.shown(key)
    pixels = read_plane(files.path(key), shown)
    if pixels.shape != head.shape or pixels.dtype != head.dtype:
        raise SourceError(f"{shown}: found a size that has changed, expected {head.words}")
    return values_of(pixels, head.values, dtype)


def _of_samples(samples: int) -> tuple[Channels, str]:
    """Return names and colours of the channels of colour pixels, and a note. Alpha is left out."""
    if samples >= 3:
        alpha = "; their alpha is left out" * (samples == 4)
        description = f"colour pixels: read as channels {', '.join(RGB_NAMES)}{alpha}"
        return (RGB_NAMES, RGB_COLORS), description
    return ((None,), (None,)), "grey pixels with alpha: the alpha is left out"
