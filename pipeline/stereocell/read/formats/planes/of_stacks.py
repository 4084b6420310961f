"""Read a volume from files that hold a stack each: one for each channel or each time point."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from stereocell.model.errors import SourceError
from stereocell.read.formats.planes.agreement import settle_sizes
from stereocell.read.formats.planes.arrays import StackArray
from stereocell.read.formats.planes.volume_files import VolumeFiles
from stereocell.read.formats.tiff.image import read_image as read_tiff
from stereocell.read.image import Color, Image
from stereocell.read.spacing import PartialTriple
from stereocell.read.value_scale import ScaledArray
from stereocell.storage.location import Location


@dataclass(frozen=True, slots=True)
class _Stack:
    """The metadata of one file's stack.

    stored  dtype of the numbers in the file
    dtype   dtype of their values
    color   colour of its first channel
    """

    shape: tuple[int, int, int]
    stored: np.dtype[Any]
    dtype: np.dtype[Any]
    channels: int
    color: Color | None
    times: int
    spacing_um: PartialTriple
    notes: tuple[str, ...]

    @property
    def words(self) -> str:
        z, y, x = self.shape
        several = f" and {self.channels} channels" if self.channels > 1 else ""
        times = f" at {self.times} time points" if self.times > 1 else ""
        return f"{z} x {y} x {x} voxels (z, y, x) of {self.stored.name}{several}{times}"


def image_of_stacks(files: VolumeFiles, notes: list[str]) -> Image:
    """Return the image of a volume of stacks. Raises SourceError where they differ in kind."""
    volume = files.volume
    first = _open(files, 0, 0)
    level, names, colors = first.arrays[0], first.names, first.colors
    _close(first)
    if len(names) > 1 and len(volume.channels) > 1:
        raise SourceError(
            f"{files.location.shown}: found {len(names)} channels in "
            f"{files.name((0, 0, 0))!r:.100} and {len(volume.channels)} in the names, expected "
            "only one of the two"
        )
    stacks = {files.name(key): _stack(files, *key[:2]) for key in volume.files}
    _require_alike(files, stacks)
    dtype = np.result_type(*{one.dtype for one in stacks.values()})
    is_inner = len(names) > 1
    shape = (len(volume.times), len(names) if is_inner else len(volume.channels), *level.shape)
    array = StackArray(shape, dtype, level.chunk, partial(_open, files), is_inner)
    spacing, size_notes = settle_sizes({name: one.spacing_um for name, one in stacks.items()})
    if not is_inner:
        names, _ = files.channels
        colors = tuple(stacks[files.name((0, n, 0))].color for n in range(len(names)))
    image = files.image(array, spacing, (names, colors), [*notes, *_notes(stacks), *size_notes])
    return replace(image, close=array.close, files=files.paths)


def _stack(files: VolumeFiles, time: int, channel: int) -> _Stack:
    image = _open(files, time, channel)
    level, grid = image.arrays[0], image.grids[0]
    stored: Any = level.array
    while isinstance(stored, ScaledArray):
        stored = stored.stored
    _close(image)
    return _Stack(
        level.shape,
        np.dtype(stored.dtype),
        np.dtype(level.array.dtype),
        len(image.names),
        image.colors[0],
        level.size("t"),
        grid.spacing_um or grid.partial_um,
        image.notes,
    )


def _require_alike(files: VolumeFiles, stacks: dict[str, _Stack]) -> None:
    name, first = next(iter(stacks.items()))
    for key in files.volume.files:
        one = stacks[files.name(key)]
        found, expected = ((n.shape, n.stored, n.channels) for n in (one, first))
        if found != expected or one.times > 1:
            raise SourceError(
                f"{files.shown(key)}: found {one.words}, expected {replace(first, times=1).words} "
                f"at one time point, as in {name!r:.100}"
            )


def _notes(stacks: dict[str, _Stack]) -> list[str]:
    """Return the notes of all files without repeats, with the first file if not all have one."""
    found: dict[str, list[str]] = {}
    for name, stack in stacks.items():
        for note in stack.notes:
            found.setdefault(note, []).append(name)
    return [
        note if len(names) == len(stacks) else f"{_named(names)}: {note}"
        for note, names in found.items()
    ]


def _named(names: list[str]) -> str:
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return f"{names[0]!r:.100}{more}"


def _open(files: VolumeFiles, time: int, channel: int) -> Image:
    return read_tiff(Location(files.path((time, channel, 0)), True))


def _close(image: Image) -> None:
    if image.close is not None:
        image.close()
