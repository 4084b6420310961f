"""Read any other format with bioio and those of its plugins that are installed with StereoCell.

StereoCell doesn't depend on bioio: importing it takes 2 s, and most of its plugins need further
libraries. A plugin may open files beside the source, so this module is used only for files that no
other format recognises.

References: https://bioio-devs.github.io/bioio/
"""

import os
import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.dataset import VoxelArray
from stereocell.read.format import Format
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.series import Candidate, candidate, choose, lines
from stereocell.read.spacing import Grid, Triple, um_per
from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_MADE_UP = re.compile(r"Channel:\d+(:\d+)*")  # bioio's name for a channel without one
_GIVEN = "--spacing-um z,y,x replaces it"
_UNIT = Subject("unit of the voxel size", remedy=_GIVEN)


class _DaskArray:
    """bioio's voxels (t, c, z, y, x); only the chunks that a window touches are read."""

    def __init__(self, array: Any) -> None:
        self.shape: tuple[int, ...] = tuple(int(n) for n in array.shape)
        self.chunks: tuple[int, ...] = tuple(int(n) for n in array.chunksize)
        self.dtype = np.dtype(array.dtype)
        self._array = array

    def __getitem__(self, key: Any) -> NDArray[Any]:
        return np.asarray(self._array[key].compute(scheduler="synchronous"))


def can_read(location: Location) -> bool:
    """Return whether bioio is installed and one of its plugins reads a file on this machine."""
    if not location.is_local or find_spec("bioio") is None or not os.path.isfile(location.path):
        return False
    from bioio_base.exceptions import UnsupportedFileFormatError

    with one_line(location.shown, "a file that a plugin of bioio reads"):
        try:
            _open(location)
        except UnsupportedFileFormatError:
            return False
    return True


def read_image(location: Location, *, series: int = 0) -> Image:
    """Return one scene; 0 is the largest. Raises SourceError, and UsageError for no such scene."""
    where = location.shown
    with one_line(where, "a complete file that a plugin of bioio reads"):
        image = _open(location)
        candidates = _candidates(image)
    index, notes = choose(where, candidates, series)
    with one_line(where, "a complete file that a plugin of bioio reads"):
        image.set_scene(index)
        array = VoxelArray(_DaskArray(image.dask_data), tuple(image.dims.order.lower()))
        names = [None if _MADE_UP.fullmatch(name) else name for name in image.channel_names or ()]
    if (count := array.size("c")) > MAX_CHANNELS:
        raise SourceError(
            f"{where}: axis c: found {count} channels, expected at most {MAX_CHANNELS}"
        )
    named = (*names[:count], *[None] * (count - len(names)))
    spacing, more = _settle_spacing(image)
    grid = Grid(array.shape, spacing)
    notes = ("read by bioio", *notes, *_sign_notes(image), *more)
    return Image(
        (array,), (grid,), named, (None,) * count, 1, title=Path(location.path).stem, notes=notes
    )


def _sign_notes(image: Any) -> tuple[str, ...]:
    """Return a note for each axis along which the voxel size is negative."""
    sizes = [(axis, getattr(image.physical_pixel_sizes, axis)) for axis in "ZYX"]
    return tuple(
        f"voxel size along {axis.lower()}: found {size:g} um: the sign is ignored and the voxels "
        "stay as stored, so the volume may be mirrored"
        for axis, size in sizes
        if size is not None and size < 0
    )


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each scene. Raises SourceError."""
    with one_line(location.shown, "a complete file that a plugin of bioio reads"):
        return lines(_candidates(_open(location)))


def _open(location: Location) -> Any:
    import bioio

    return bioio.BioImage(location.path)


def _candidates(image: Any) -> list[Candidate]:
    found = []
    for index in range(len(image.scenes)):
        image.set_scene(index)
        sizes = {axis: int(getattr(image.dims, axis, 1)) for axis in "TCZYX"}
        z, y, x = (sizes[axis] for axis in "ZYX")
        found.append(
            candidate(
                (z, y, x),
                channels=sizes["C"],
                times=sizes["T"],
                spacing_um=_settle_spacing(image)[0],
            )
        )
    return found


def _settle_spacing(image: Any) -> tuple[Triple | None, tuple[str, ...]]:
    """Return the spacing (z, y, x), um, and notes; None: a plugin does not state all three.

    A plugin states each size twice, as `physical_pixel_sizes` and `scale`. The unit is separate, in
    `dimension_properties`, if a plugin knows one.
    """
    found: list[float] = []
    notes: list[str] = []
    has_units = True
    for axis in "ZYX":
        size = getattr(image.physical_pixel_sizes, axis)
        if size is None:
            return None, ()
        unit = _part(image, "dimension_properties", axis, "unit")
        per = 1.0 if unit is None else um_per(str(unit))
        if per is None:
            return None, ()
        has_units &= unit is not None
        statements = [Statement(abs(float(size)) * per, "physical_pixel_sizes")]
        if (scale := _part(image, "scale", axis)) is not None:
            statements.append(Statement(abs(float(scale)) * per, "scale", Trust.REPEATED))
        settled = settle(
            Subject(f"voxel spacing along {axis.lower()}", "um", 1e-3, _GIVEN), statements
        )
        found.append(settled.number)
        notes += settled.notes
    if not has_units:
        notes += settle(
            _UNIT, [Statement("um", "as in most plugins of bioio", Trust.ASSUMED)]
        ).notes
    return (found[0], found[1], found[2]), tuple(notes)


def _part(value: Any, *names: str) -> Any:
    """Return a nested attribute of an object; None: absent, as in other versions of bioio."""
    for name in names:
        value = getattr(value, name, None)
    return value


FORMAT = Format(
    title="a file for an installed plugin of bioio",
    open=read_image,
    list_series=list_series,
    may_hold=can_read,
)
