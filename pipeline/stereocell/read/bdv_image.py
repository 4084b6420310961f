"""The image of BigDataViewer's container: one grid, whose setups are channels."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.bdv_xml import Described, Setup
from stereocell.read.dataset import StoredArray, VoxelArray
from stereocell.read.image import Image
from stereocell.read.series import choose
from stereocell.read.spacing import Grid, Triple

Views = Sequence[Sequence[StoredArray]]  # of one level: by time, then by setup; each (z, y, x)


class _Level:
    """The views of one level as (t, c, z, y, x)."""

    def __init__(self, views: Views) -> None:
        first = views[0][0]
        self.shape: tuple[int, ...] = (len(views), len(views[0]), *first.shape)
        self.chunks: tuple[int, ...] = (1, 1, *first.chunks)
        self.dtype = first.dtype
        self._views = views

    def view(self, time: int, channel: int) -> StoredArray:
        """Return the array of one view, (z, y, x)."""
        return self._views[time][channel]

    def __getitem__(self, key: Any) -> NDArray[Any]:
        time, channel, *place = key
        return np.asarray(self._views[time][channel][tuple(place)])


def image_of(
    where: str,
    levels: Sequence[Views],
    factors: Sequence[Triple | None],
    spacing_um: Triple | None,
    setups: Mapping[int, Setup],
) -> Image:
    """Return the image of a container's views, finest level first.

    factors     level 0's voxels per voxel, (z, y, x), of each level; None: not stated
    spacing_um  (z, y, x) of level 0; None: the setups of the XML have it, or nobody
    setups      those of the XML, by their indices

    Raises SourceError where the views have not one grid.
    """
    arrays = []
    for views in levels:
        first = views[0][0]
        for view in (one for row in views for one in row):
            if view.shape != first.shape or view.dtype != first.dtype or len(first.shape) != 3:
                raise SourceError(
                    f"{where}: setups: found {view.shape} {view.dtype} beside "
                    f"{first.shape} {first.dtype}, expected one grid of three axes"
                )
        arrays.append(VoxelArray(_Level(views), tuple("tczyx")))
    if 0 in setups and setups[0].spacing_um is not None:
        spacing_um = setups[0].spacing_um
    count = len(levels[0][0])
    note = f"{count} setups of BigDataViewer: taken for channels"
    return Image(
        tuple(arrays),
        grids_of([array.shape for array in arrays], spacing_um, factors),
        tuple(setups[c].name if c in setups else None for c in range(count)),
        (None,) * count,
        1,
        notes=(note,) if count > 1 else (),
    )


def chosen_view(
    where: str, described: Described, setups: Sequence[int], series: int, xml: str
) -> tuple[list[int], tuple[str, ...]]:
    """Return the setups of one view, and notes. Setups without attributes are one view.

    xml  the XML that the user named; empty: the container was named

    Raises UsageError where there is no such view.
    """
    views = described.views(setups)
    index, notes = choose(where, [described.candidate(view) for view in views], series)
    if notes and not xml:
        notes = (f"{notes[0]} (--series needs the name of the XML)",)
    return views[index], notes


def grids_of(
    shapes: Sequence[tuple[int, int, int]], finest: Triple | None, scales: Sequence[Triple | None]
) -> tuple[Grid, ...]:
    """Return the levels' grids; a level without factors is measured by its shape."""
    grids = []
    for shape, scale in zip(shapes, scales, strict=True):
        spacing = finest
        if finest is not None and scale is not None:
            z, y, x = (s * f for s, f in zip(finest, scale, strict=True))
            spacing = (z, y, x)
        grids.append(Grid(shape, None if scale is None and shape != shapes[0] else spacing))
    return tuple(grids)
