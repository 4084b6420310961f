"""Read Zeiss CZI with pylibCZIrw (the extra `czi`), which composes the tiles of a mosaic.

pylibCZIrw is Zeiss's own library, under LGPL-3.0. czifile (BSD) needs Python 3.12 and composes a
mosaic as a whole, not a window of it; bioio-czi builds on pylibCZIrw. Only the finest level is
read. Scenes are series. The library decodes in C++, so it runs in a child process
(storage/child_process.py), and voxels come back through a pipe.

References: https://zeiss.github.io/libczi/
"""

import math
import re
from collections import Counter
from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from stereocell.model.emission_color import color_of_channel
from stereocell.model.errors import SourceError
from stereocell.read.dataset import VoxelArray
from stereocell.read.formats.czi.file import CziFile, CziMetadata, Rectangle
from stereocell.read.image import MAX_CHANNELS, Color, Image
from stereocell.read.plane_array import PlaneArray
from stereocell.read.repeats import record_xml
from stereocell.read.series import Candidate, candidate, list_images, read_chosen
from stereocell.read.spacing import PartialTriple, grid_of
from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.storage.child_process import Child
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_TYPES = {"Gray8": "u1", "Gray16": "u2", "Gray32Float": "f4"}
_OTHERS = {"V": "views", "H": "phases", "I": "illuminations", "R": "rotations", "B": "blocks"}
_UM_PER_METER = 1e6
_ABSENT = "read as 0, which the format uses for tiles that were not acquired; they may be lost"
_INTERVAL = "Metadata/Information/Image/Dimensions/Z/Positions/Interval/Increment"
_DEPTH = Subject("voxel spacing along z", "um", 0.01, "--spacing-um z,y,x replaces it")
_MAX_DIGITS = 10  # digits; a size with as many or more in the metadata counts as not stated


class _File:
    """A file that is open in a child process: its bounds, scenes and metadata."""

    def __init__(self, location: Location, stack: ExitStack) -> None:
        self.where = location.shown
        with one_line(self.where, "a complete CZI file"):
            self._child = stack.enter_context(Child(CziFile, location.path, self.where))
            stated: CziMetadata = self._child.call("metadata")
            self.metadata = _parsed(stated.metadata)
        self.bounds, self.types, self._tiles = stated.bounds, stated.types, stated.tiles
        x, y = self.bounds.get("X", (0, 0)), self.bounds.get("Y", (0, 0))
        all_of_it = (x[0], y[0], x[1] - x[0], y[1] - y[0])
        self.scenes: Sequence[tuple[int | None, Rectangle]] = stated.scenes or [(None, all_of_it)]
        self.spacing, self.spacing_notes = _spacing(self.metadata)

    def read(self, window: Rectangle, plane: dict[str, int], scene: int | None) -> NDArray[Any]:
        """Return the pixels of a window of a plane. Raises SourceError and ChildError."""
        voxels: NDArray[Any] = self._child.call("read", window, plane, scene)
        return voxels

    def size(self, axis: str) -> int:
        low, high = self.bounds.get(axis, (0, 1))
        return high - low

    def absent_notes(self, scene: int | None, time: int) -> tuple[str, ...]:
        """Return a note on tiles that are missing at a time point; they are read as 0.

        Each plane is compared with the one that has the most tiles. Raises SourceError where no
        plane has any.
        """
        if not self._tiles:
            return ()
        first, last = self.bounds.get("T", (0, 1))
        held = {time: Counter[tuple[int, ...]]() for time in range(first, last)}
        for (of_scene, (channel, at, depth)), count in self._tiles.items():
            if at in held and scene in (None, of_scene):
                held[at][channel, depth] += count
        most = max((count for planes in held.values() for count in planes.values()), default=0)
        total = most * self.size("C") * self.size("Z")
        absent = total - held[first + time].total()
        if absent == total:
            raise SourceError(
                f"{self.where}: time point {time}: found none of {total} tiles, expected some: the "
                "acquisition ended early, or the file is damaged: choose another --time"
            )
        note = f"{absent} of {total} tiles ({absent / total:.2%}) are not stored: {_ABSENT}"
        return (note,) if absent else ()

    def candidates(self) -> list[Candidate]:
        return [
            candidate(
                (self.size("Z"), height, width),
                channels=self.size("C"),
                times=self.size("T"),
                spacing_um=grid_of((1, 1, 1), self.spacing).spacing_um,
            )
            for _, (_, _, width, height) in self.scenes
        ]


def read_image(location: Location, *, series: int = 0) -> Image:
    """Return one scene; 0 is the largest. Raises SourceError, and UsageError for no such scene."""
    return read_chosen(location, series, _File, _image)


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each scene. Raises SourceError."""
    return list_images(location, _File)


def _image(file: _File, index: int, notes: tuple[str, ...], stack: ExitStack) -> Image:
    for axis, kind in _OTHERS.items():
        if file.size(axis) > 1:
            raise SourceError(
                f"{file.where}: {kind} ({axis}): found {file.size(axis)}, expected one: export one "
                "of them from ZEN"
            )
    found = sorted(set(file.types))
    if len(found) != 1 or found[0] not in _TYPES:
        raise SourceError(
            f"{file.where}: pixel types: found {', '.join(found) or 'none'}, expected one of "
            f"{', '.join(_TYPES)} in all channels (for a colour image, export its channels as "
            "OME-TIFF from ZEN)"
        )
    scene, (left, top, width, height) = file.scenes[index]
    shape = (file.size("T"), file.size("C"), file.size("Z"), height, width)
    if not 0 < shape[1] <= MAX_CHANNELS or min(shape) < 1:
        raise SourceError(
            f"{file.where}: size (t, c, z, y, x): found {shape}, expected 1 or more along each axis"
        )
    first = {axis: file.bounds.get(axis, (0, 1))[0] for axis in "TCZ"}

    def read(place: tuple[int, ...], rows: slice, columns: slice) -> NDArray[Any]:
        plane = {axis: first[axis] + at for axis, at in zip("TCZ", place, strict=True)}
        y, x = top + rows.start, left + columns.start
        roi = (x, y, columns.stop - columns.start, rows.stop - rows.start)
        return file.read(roi, plane, scene)

    array = VoxelArray(PlaneArray(shape, np.dtype(_TYPES[found[0]]), read), tuple("tczyx"))
    names, colors = _channels(file.metadata, shape[1])
    return Image(
        (array,),
        (grid_of(array.shape, file.spacing),),
        names,
        colors,
        1,
        stack.close,
        notes=(*notes, *_size_notes(file), *file.spacing_notes),
        notes_at=partial(file.absent_notes, scene),
    )


def _size_notes(file: _File) -> tuple[str, ...]:
    """Return a note for each axis along which the metadata and the tiles differ in number."""
    notes = []
    sizes = {axis: file.size(axis) for axis in ("C", "Z", "T", *_OTHERS)}
    for axis, held in {**sizes, "S": len(file.scenes)}.items():
        text = file.metadata.findtext(f"Metadata/Information/Image/Size{axis}", "")
        stated = int(text) if text.isdecimal() and len(text) < _MAX_DIGITS else 0
        if stated and stated != held:
            why = "the acquisition ended early, or a part is missing"
            reason = why if stated > held else "all of them are read"
            notes.append(
                f"the metadata state {stated} along {_named(axis)}, but there are tiles for "
                f"{held}: {reason}"
            )
    return tuple(notes)


def _named(axis: str) -> str:
    kind = {**_OTHERS, "S": "scenes"}.get(axis)
    return f"{axis} ({kind})" if kind else axis


def _parsed(text: str) -> ElementTree.Element:
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("metadata with a DOCTYPE")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"metadata: {error}") from None
    record_xml(root, "the metadata")
    return root


def _spacing(metadata: ElementTree.Element) -> tuple[PartialTriple, tuple[str, ...]]:
    """Return the spacing (z, y, x), um, and notes. None for each one not stated, or 0.

    The scaling is in m. The interval between planes, in um, states the spacing along z as well.
    """
    found: dict[str, float | None] = dict.fromkeys("ZYX")
    for node in metadata.findall("Metadata/Scaling/Items/Distance"):
        axis, length = str(node.get("Id")), _number(node.findtext("Value", "")) * _UM_PER_METER
        if length > 0 and found.get(axis) is None:
            found[axis] = length
    statements = [] if found["Z"] is None else [Statement(found["Z"], "Scaling")]
    step = abs(_number(metadata.findtext(_INTERVAL, "")))
    if step > 0:
        statements.append(Statement(step, "the interval between planes", Trust.REPEATED))
    if not statements:
        return (None, found["Y"], found["X"]), ()
    settled = settle(_DEPTH, statements)
    return (settled.number, found["Y"], found["X"]), settled.notes


def _number(text: str) -> float:
    """Return a finite number; 0: the text is not one."""
    try:
        number = float(text)
    except ValueError:
        return 0.0
    return number if math.isfinite(number) else 0.0


def _channels(
    metadata: ElementTree.Element, count: int
) -> tuple[tuple[str | None, ...], tuple[Color | None, ...]]:
    nodes = metadata.findall("Metadata/Information/Image/Dimensions/Channels/Channel")
    shown = {
        node.get("Id"): node
        for node in metadata.findall("Metadata/DisplaySetting/Channels/Channel")
    }
    names: list[str | None] = []
    colors: list[Color | None] = []
    for node in nodes[:count]:
        names.append((node.get("Name") or "").strip() or None)
        display = shown.get(node.get("Id"))
        text = node.findtext("Color") or (display.findtext("Color") if display is not None else "")
        light = node.findtext("EmissionWavelength"), node.findtext("Fluor") or ""
        colors.append(color_of_channel(_color(text or ""), *light))
    lacking = [None] * (count - len(names))
    return (*names, *lacking), (*colors, *lacking)


def _color(text: str) -> tuple[int, int, int] | None:
    """Return R, G and B from `#AARRGGBB` or `#RRGGBB`."""
    match = re.fullmatch(r"#(?:[0-9a-fA-F]{2})?([0-9a-fA-F]{6})", text.strip())
    if match is None:
        return None
    red, green, blue = bytes.fromhex(match[1])
    return red, green, blue
