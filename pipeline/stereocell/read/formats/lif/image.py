"""Read Leica LIF with liffile (BSD; the extra `lif`). A file holds several images, or series.

A person typed the images' names, so they are never shown. Scan orders such as xzy are reordered by
the names of the axes. readlif, the base of bioio-lif, is not used because it is under GPL-3.0.
"""

import os
import struct
from contextlib import ExitStack
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from stereocell.model.color import linear_color
from stereocell.model.errors import SourceError
from stereocell.read.dataset import VoxelArray
from stereocell.read.formats.lif.statements import settle_lengths
from stereocell.read.image import MAX_CHANNELS, Color, Image
from stereocell.read.plane_array import PlaneArray
from stereocell.read.plane_positions import falling_notes
from stereocell.read.series import Candidate, candidate, list_images, read_chosen
from stereocell.read.spacing import Grid
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_BLOCK = struct.Struct("<2I")  # 0x70, and the length of the description that follows
_ABOUT = struct.Struct("<BQBI")  # 0x2A, bytes of voxels, 0x2A, characters of the block's name
_EARLY = struct.Struct("<BIBI")  # like _ABOUT, for early files: the number of bytes has 4 bytes
_MAX_NAME = 1000  # characters of a block's name that are read and compared
_AGAIN = "copy or download it again"
_MARK, _TEST = 0x70, 0x2A
_MAX_BLOCKS = 100_000
_UM_PER_METER = 1e6
_OTHERS = {
    "\u03bb": "wavelengths (a lambda stack)",
    "\u039b": "excitations (a lambda stack)",
    "M": "tiles of a mosaic",
    "S": "samples (RGB)",
}
_COLORS = {
    "red": (255, 0, 0),
    "green": (0, 255, 0),
    "blue": (0, 0, 255),
    "cyan": (0, 255, 255),
    "magenta": (255, 0, 255),
    "yellow": (255, 255, 0),
    "gray": (255, 255, 255),
    "grey": (255, 255, 255),
}


def read_image(location: Location, *, series: int = 0) -> Image:
    """Return one image; 0 is the largest volume. Raises SourceError and UsageError."""
    return read_chosen(location, series, _File, _image)


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each image. Raises SourceError."""
    return list_images(location, _File)


class _File:
    """An open file and its images."""

    def __init__(self, location: Location, stack: ExitStack) -> None:
        import liffile as library

        self.where = location.shown
        with one_line(self.where, "a complete LIF file"):
            path = os.path.realpath(location.path)
            _require_whole(path, self.where)
            self.images: list[Any] = list(stack.enter_context(library.LifFile(path)).images)
            self._candidates = [_candidate(one) for one in self.images]  # reads the XML
        if not self.images:
            raise SourceError(f"{self.where}: found no image, expected one")

    def candidates(self) -> list[Candidate]:
        return self._candidates


def _require_whole(path: str, where: str) -> None:
    """Raise SourceError where the file ends within a block, or where two blocks have one name.

    A file is a chain of blocks, each after its length: first the XML, then voxels. The library
    would read the last block of a name for all images with that name.
    """
    size, at = os.path.getsize(path), 0
    names: set[bytes] = set()
    with open(path, "rb") as file:
        for _ in range(_MAX_BLOCKS):
            file.seek(at)
            head = file.read(_BLOCK.size)
            if not head:
                return
            if len(head) < _BLOCK.size or int.from_bytes(head[:4], "little") != _MARK:
                break
            end = at + _BLOCK.size + _BLOCK.unpack(head)[1]
            if at:
                voxel_bytes, name = _named_block(file)
                end += voxel_bytes
                if name in names:
                    raise SourceError(
                        f"{where}: block of voxels at byte {at}: found the name of another block, "
                        f"expected a name of its own: the file is damaged ({_AGAIN})"
                    )
                names |= {name} if name else set()
            if end > size:
                raise SourceError(
                    f"{where}: cut short at byte {size} of {end} or more, expected a complete LIF "
                    f"file ({_AGAIN})"
                )
            at = end


def _named_block(file: BinaryIO) -> tuple[int, bytes]:
    """Return the length of a block's voxels and its name. Early files have a 4-byte length."""
    about = file.read(_ABOUT.size)
    if len(about) < _EARLY.size:
        return 0, b""
    form = _EARLY if about[5] == _TEST else _ABOUT
    _, voxel_bytes, _, count = form.unpack(about[: form.size].ljust(form.size, b"\0"))
    name = about[form.size :] + file.read(2 * min(count, _MAX_NAME))
    return voxel_bytes, name[: 2 * count]


def _memory_notes(where: str, image: Any) -> tuple[str, ...]:
    """Return a note if the file holds more of an image than the XML describes.

    Raises SourceError if it holds less: the library would read on into the next image.
    """
    memory = image.xml_element.find("./Memory")
    stated = image.memory_block.size if memory is None else int(memory.get("Size", 0))
    held, described = image.memory_block.size, image.nbytes
    if held < max(described, stated):
        raise SourceError(
            f"{where}: found {held} bytes of voxels, expected {max(described, stated)} as in the "
            f"XML: the acquisition ended early, or the file is damaged ({_AGAIN}), or choose "
            "another --series (`--series list` shows them)"
        )
    if described == held:
        return ()
    return (
        f"the XML describes {described} of {held} bytes of the image's voxels "
        f"({described / held:.2%}): the rest is left out",
    )


def _candidate(image: Any) -> Candidate:
    sizes = dict(zip(image.dims, image.shape, strict=True))
    z, y, x, channels, times = (int(sizes.get(axis, 1)) for axis in "ZYXCT")
    others = [f"{size} {_OTHERS.get(axis, axis)}" for axis, size in _other_axes(image).items()]
    return candidate(
        (z, y, x),
        channels=channels,
        times=times,
        spacing_um=settle_lengths(image)[0],
        others=others,
    )


def _other_axes(image: Any) -> dict[str, int]:
    sizes = zip(image.dims, image.shape, strict=True)
    return {axis: int(size) for axis, size in sizes if axis not in "TCZYX" and size > 1}


def _image(file: _File, index: int, notes: tuple[str, ...], stack: ExitStack) -> Image:
    where, image = file.where, file.images[index]
    for axis, size in _other_axes(image).items():
        raise SourceError(
            f"{where}: found {size} {_OTHERS.get(axis, f'of axis {axis}')}, expected z, y, x, "
            "channels and time: choose another --series, or export it from LAS X"
        )
    missing = [axis for axis in "ZYX" if axis not in image.dims]
    if missing:
        raise SourceError(
            f"{where}: a volume needs at least 2 planes: found axes {', '.join(image.dims)}, "
            "expected Z, Y, X: choose another --series (`--series list` shows them)"
        )
    dims = tuple(image.dims)

    def read(place: tuple[int, ...], rows: slice, columns: slice) -> NDArray[Any]:
        found = image.frame(**dict(zip(dims[:-2], place, strict=True)))
        return np.asarray(found)[rows, columns]

    axes = tuple(axis.lower() for axis in dims)
    array = VoxelArray(PlaneArray(image.shape, np.dtype(image.dtype), read), axes)
    with one_line(where, "a LIF file whose XML describes its voxels"):
        notes = (*notes, *_memory_notes(where, image))
    if (count := array.size("c")) > MAX_CHANNELS:
        raise SourceError(
            f"{where}: axis c: found {count} channels, expected at most {MAX_CHANNELS}"
        )
    places = np.asarray(image.coords.get("Z", ()), float) * _UM_PER_METER
    if len(places) > 1:
        notes = (*notes, *falling_notes("position along z", float(places[0]), float(places[-1])))
    names, colors = _channels(image, count)
    spacing, more = settle_lengths(image)
    grid = Grid(array.shape, spacing)
    return Image((array,), (grid,), names, colors, 1, stack.close, notes=(*notes, *more))


def _channels(image: Any, count: int) -> tuple[tuple[str | None, ...], tuple[Color | None, ...]]:
    names: list[str | None] = []
    colors: list[Color | None] = []
    for node in list(image.xml_element.iter("ChannelDescription"))[:count]:
        properties = {p.findtext("Key"): p.findtext("Value") for p in node.iter("ChannelProperty")}
        names.append((properties.get("DyeName") or "").strip() or None)
        rgb = _COLORS.get(node.get("LUTName", "").lower())
        colors.append(linear_color(rgb) if rgb else None)
    lacking = [None] * (count - len(names))
    return (*names, *lacking), (*colors, *lacking)
