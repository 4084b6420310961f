"""Read Nikon ND2 with the library nd2 (BSD; the extra `nd2`). Stage positions are series."""

import os
from contextlib import ExitStack
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.emission_color import color_of_channel
from stereocell.model.errors import SourceError
from stereocell.read.dataset import VoxelArray
from stereocell.read.formats.nd2.frames import BEGIN, Nd2Frames
from stereocell.read.formats.nd2.statements import settle_spacing, volume_of
from stereocell.read.image import MAX_CHANNELS, Color, Image
from stereocell.read.plane_array import PlaneArray
from stereocell.read.series import Candidate, candidate, list_images, read_chosen
from stereocell.read.spacing import grid_of
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_END = b"ND2 CHUNK MAP SIGNATURE 0000001!"
_END_BYTES = 40  # last bytes of a file: the signature and the place of the chunk map
_IN_FRAME = "CYXS"  # axes inside a frame


class _File:
    """An open file with its size along each axis; P counts stage positions."""

    def __init__(self, location: Location, stack: ExitStack) -> None:
        self.where = location.shown
        import nd2 as library

        path = os.path.realpath(location.path)
        _require_end(path, self.where)
        with one_line(self.where, "a complete ND2 file"):
            self.nd2: Any = stack.enter_context(library.ND2File(path))
            self.sizes = {str(axis): int(size) for axis, size in self.nd2.sizes.items()}
            self.dtype = np.dtype(self.nd2.dtype)
            self.spacing, self.notes = settle_spacing(self.nd2, self.sizes)
            frame_bytes = _frame_bytes(self.nd2.attributes)
        self.frames = Nd2Frames(path, self.where, frame_bytes)

    def size(self, axis: str) -> int:
        return self.sizes.get(axis, 1)

    def candidates(self) -> list[Candidate]:
        z, y, x = (self.size(axis) for axis in "ZYX")
        spacing = grid_of((z, y, x), self.spacing).spacing_um
        one = candidate(
            (z, y, x), channels=self.size("C"), times=self.size("T"), spacing_um=spacing
        )
        return [one] * self.size("P")


def _frame_bytes(stated: Any) -> int:
    """Return the bytes of a frame's voxels; 0: they are compressed. Rows may be padded."""
    if stated.compressionType is not None:
        return 0
    row = stated.widthPx * stated.componentCount * stated.bitsPerComponentInMemory // 8
    return int(row + (stated.heightPx - 1) * max(stated.widthBytes or 0, row))


def _require_end(path: str, where: str) -> None:
    """Raise SourceError for a file without the map of its chunks, which is written last."""
    with open(path, "rb") as file:
        begins = file.read(len(BEGIN))
        file.seek(max(0, os.path.getsize(path) - _END_BYTES))
        ends = file.read()
    if begins == BEGIN and not ends.startswith(_END):
        raise SourceError(
            f"{where}: cut short at byte {os.path.getsize(path)}, or never closed: the map of "
            "chunks at the end of an ND2 file is missing, expected a complete ND2 file: copy it "
            "again"
        )


def read_image(location: Location, *, series: int = 0) -> Image:
    """Return the image of one position; 0 is the first. Raises SourceError and UsageError."""
    return read_chosen(location, series, _File, _image)


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each position. Raises SourceError."""
    return list_images(location, _File)


def _image(file: _File, position: int, notes: tuple[str, ...], stack: ExitStack) -> Image:
    for axis, size in file.sizes.items():
        if axis not in "PTCZYX" and size > 1:
            kind = "samples (RGB)" if axis == "S" else f"of axis {axis}"
            raise SourceError(
                f"{file.where}: found {size} {kind}, expected z, y, x, channels, time and positions"
            )
    if (count := file.size("C")) > MAX_CHANNELS:
        raise SourceError(
            f"{file.where}: axis c: found {count} channels, expected at most {MAX_CHANNELS}"
        )
    with one_line(file.where, "an ND2 file with metadata on its axes"):
        _require_distances(file)
        notes = (*notes, *file.notes, *_order_notes(file))
    loops = [axis for axis in file.sizes if axis not in _IN_FRAME]
    lengths = [file.sizes[axis] for axis in loops]

    def number(time: int, depth: int) -> int:
        wanted = {"P": position, "T": time, "Z": depth}
        at = [wanted.get(axis, 0) for axis in loops]
        return int(np.ravel_multi_index(at, lengths)) if loops else 0

    def read(place: tuple[int, ...], rows: slice, columns: slice) -> NDArray[Any]:
        time, depth, channel = place
        file.frames.require(number(time, depth))
        frame = np.asarray(file.nd2.read_frame(number(time, depth))).squeeze()
        return (frame[channel] if count > 1 else frame)[rows, columns]

    shape = (file.size("T"), file.size("Z"), count, file.size("Y"), file.size("X"))
    array = VoxelArray(PlaneArray(shape, file.dtype, read), tuple("tzcyx"))
    with one_line(file.where, "an ND2 file with metadata on its channels"):
        names, colors = _channels(file.nd2, count)
    numbers = [[number(t, z) for z in range(file.size("Z"))] for t in range(file.size("T"))]
    return Image(
        (array,),
        (grid_of(array.shape, file.spacing),),
        names,
        colors,
        1,
        stack.close,
        notes=notes,
        notes_at=partial(_missing_notes, file, numbers),
    )


def _missing_notes(file: _File, numbers: list[list[int]], time: int) -> tuple[str, ...]:
    """Return a note on frames that the file lacks at other time points.

    An acquisition may end early. Raises SourceError where frames of the chosen time point are
    missing.

    numbers  numbers of the frames of each time point
    """
    held = [len(some) - len(file.frames.missing(some)) for some in numbers]
    depth, count = len(numbers[0]), len(numbers)
    if held[time] < depth:
        whole = [t for t, found in enumerate(held) if found == depth]
        instead = f": --time {whole[-1]} is complete" if whole else ""
        raise SourceError(
            f"{file.where}: time point {time}: found {held[time]} of {depth} frames, expected all: "
            f"the acquisition ended early, or the file is damaged{instead}"
        )
    for number in numbers[time]:
        file.frames.require(number)
    total = depth * count
    missing = total - sum(held)
    share = f"{missing} of {total} frames ({missing / total:.2%})"
    note = f"{share} are missing, all at other time points"
    return (note,) if missing else ()


def _require_distances(file: _File) -> None:
    """Raise SourceError where an axis of the images is time, as in a line scan."""
    volume = volume_of(file.nd2)
    for axis, kind in zip("xy", volume.axesInterpretation if volume else (), strict=False):
        if kind != "distance":
            raise SourceError(
                f"{file.where}: axis {axis}: found {kind} (a line scan), expected a distance"
            )


def _order_notes(file: _File) -> tuple[str, ...]:
    """Return a note if planes were taken downwards, since the volume may be a mirror image."""
    loops = [loop.parameters for loop in file.nd2.experiment if loop.type == "ZStackLoop"]
    if all(loop.bottomToTop for loop in loops):
        return ()
    return (
        "the planes were taken from top to bottom, as the Z loop states: they are read in the "
        "order of the file",
    )


def _channels(nd2: Any, count: int) -> tuple[tuple[str | None, ...], tuple[Color | None, ...]]:
    stated = list(getattr(nd2.metadata, "channels", None) or [])[:count]
    names = [(one.channel.name or "").strip() or None for one in stated]
    colors: list[Color | None] = []
    for one in stated:
        color = getattr(one.channel, "color", None)
        rgb = (color.r, color.g, color.b) if color is not None else None
        colors.append(color_of_channel(rgb, getattr(one.channel, "emissionLambdaNm", None)))
    lacking = [None] * (count - len(names))
    return (*names, *lacking), (*colors, *lacking)
