"""The image of a BigDataViewer container: one grid, with the setups as channels."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.bigdataviewer.described import Described, Setup
from stereocell.read.dataset import StoredArray, VoxelArray
from stereocell.read.image import Image
from stereocell.read.series import choose
from stereocell.read.spacing import Grid, Triple
from stereocell.read.statements import Statement, Subject, Trust, omission, settle

# Arrays (z, y, x) of one level, by time point and setup: BigDataViewer's views. None: missing.
Views = Sequence[Sequence[StoredArray | None]]
_REMEDY = "--spacing-um z,y,x replaces it"
_NO_XML = "BigDataViewer states it in an XML, which is not beside the container"
_TOLERANCE = 5e-3  # relative difference of two spacings that needs no note


class BdvLevel:
    """The arrays of one level, one for each time point and setup, as (t, c, z, y, x)."""

    def __init__(self, views: Views) -> None:
        first = next(_present(views))
        self.shape: tuple[int, ...] = (len(views), len(views[0]), *first.shape)
        self.chunks: tuple[int, ...] = (1, 1, *first.chunks)
        self.dtype = first.dtype
        self._views = views

    def view(self, time: int, channel: int) -> StoredArray:
        """Return the array (z, y, x) of one time point and channel."""
        found = self._views[time][channel]
        assert found is not None, "channels without a view at this time are left out beforehand"
        return found

    def of_channels(self, channels: Sequence[int]) -> "BdvLevel":
        """Return the level with some of its channels."""
        return BdvLevel([[row[channel] for channel in channels] for row in self._views])

    def __getitem__(self, key: Any) -> NDArray[Any]:
        time, channel, *place = key
        return np.asarray(self.view(time, channel)[tuple(place)])


def image_of(
    where: str,
    levels: Sequence[Views],
    factors: Sequence[Triple | None],
    stated_um: Triple | None,
    setups: Mapping[int, Setup | None],
) -> Image:
    """Return the image of a container's views, finest level first.

    factors    for each level: level 0's voxels per voxel, (z, y, x); None: not stated
    stated_um  voxel spacing (z, y, x) of level 0 in the container; None: not stated
    setups     setups by number; None: the XML lacks the setup, or there is no XML

    Raises SourceError where the views differ in their grids.
    """
    arrays = []
    for views in levels:
        first = next(_present(views))
        for view in _present(views):
            if view.shape != first.shape or view.dtype != first.dtype or len(first.shape) != 3:
                raise SourceError(
                    f"{where}: setups: found {view.shape} {view.dtype} beside "
                    f"{first.shape} {first.dtype}, expected one grid of three axes"
                )
        arrays.append(VoxelArray(BdvLevel(views), tuple("tczyx")))
    spacing_um, notes = _spacing(setups, stated_um)
    notes = (*notes, *_size_notes(setups, arrays[0].shape), *_setup_notes(setups))
    names = tuple(setup.name if setup is not None else None for setup in setups.values())
    hint = "" if any(setups.values()) else _NO_XML
    return Image(
        tuple(arrays),
        grids_of([array.shape for array in arrays], spacing_um, factors, hint),
        names,
        (None,) * len(names),
        1,
        notes=notes,
    )


def chosen_view(
    where: str, described: Described, setups: Sequence[int], series: int, xml: str
) -> tuple[list[int], tuple[str, ...]]:
    """Return the setups of one view, and notes. Setups without attributes form one view.

    xml  path of the XML that the user named; empty: the user named the container

    Raises UsageError where there is no such view.
    """
    views = described.views(setups)
    index, notes = choose(where, [described.candidate(view) for view in views], series)
    if notes and not xml:
        notes = (f"{notes[0]} (to use --series, name the XML as the source)",)
    return views[index], notes


def common_levels(counts: Sequence[int]) -> tuple[int, tuple[str, ...]]:
    """Return the number of levels that all setups have, and a note if some have more.

    counts  number of levels of each setup
    """
    fewest, most = min(counts), max(counts)
    if fewest == most:
        return fewest, ()
    found = f"{most - fewest} of {most} levels of detail"
    return fewest, (omission(found, f"some setups have only {fewest}"),)


def grids_of(
    shapes: Sequence[tuple[int, int, int]],
    finest: Triple | None,
    scales: Sequence[Triple | None],
    hint: str = "",
) -> tuple[Grid, ...]:
    """Return the grids of the levels; the shape gives the spacing of a level without factors.

    hint  where a missing spacing may be found
    """
    grids = []
    for shape, scale in zip(shapes, scales, strict=True):
        spacing = finest
        if finest is not None and scale is not None:
            z, y, x = (s * f for s, f in zip(finest, scale, strict=True))
            spacing = (z, y, x)
        is_known = scale is not None or shape == shapes[0]
        grids.append(Grid(shape, spacing if is_known else None, hint=hint))
    return tuple(grids)


def _present(views: Views) -> Iterator[StoredArray]:
    return (view for row in views for view in row if view is not None)


def _spacing(
    setups: Mapping[int, Setup | None], stated_um: Triple | None
) -> tuple[Triple | None, tuple[str, ...]]:
    """Return the voxel spacing (z, y, x), um, of all setups, and notes on contradictions."""
    stated = [
        (f"voxelSize of setup {number}", setup.spacing_um)
        for number, setup in setups.items()
        if setup is not None and setup.spacing_um is not None
    ]
    if stated_um is not None:
        stated.append(("the container", stated_um))
    if not stated:
        return None, ()
    chosen, notes = [], list[str]()
    for axis, name in enumerate("zyx"):
        subject = Subject(f"voxel spacing along {name}", "um", _TOLERANCE, _REMEDY)
        found = settle(subject, [Statement(lengths[axis], place) for place, lengths in stated])
        chosen.append(found.number)
        notes += found.notes
    z, y, x = chosen
    return (z, y, x), tuple(notes)


def _size_notes(setups: Mapping[int, Setup | None], shape: tuple[int, int, int]) -> tuple[str, ...]:
    """Return a note for each setup whose size in the XML differs from the container's arrays."""
    z, y, x = (float(size) for size in shape)
    notes = list[str]()
    for number, setup in setups.items():
        if setup is not None and setup.size is not None:
            measured = Statement((x, y, z), "the container", Trust.MEASURED)
            stated = Statement(setup.size, "size in the XML")
            subject = Subject(f"size (x, y, z) of setup {number}", "voxels")
            notes += settle(subject, [measured, stated]).notes
    return tuple(notes)


def _setup_notes(setups: Mapping[int, Setup | None]) -> tuple[str, ...]:
    if len(setups) < 2:
        return ()
    unknown = "" if any(setups.values()) else (
        ", since no XML beside the container states whether they are tiles, angles or channels"
    )  # fmt: skip
    return (f"{len(setups)} setups of BigDataViewer: read as channels{unknown}",)
