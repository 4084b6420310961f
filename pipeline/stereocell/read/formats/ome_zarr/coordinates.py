"""Read the positions of a Zarr array's voxels, which xarray writes into arrays beside it.

An array names its dimensions, and a one-dimensional array of the same name holds the positions
along each of them. It lies in the group of the array or, in a tree of xarray, in a group around
that. Its `units` are the unit of the positions, and CF's `axis` names the axis.

References: https://docs.xarray.dev/en/stable/internals/zarr-encoding-spec.html
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.abc.store import Store

from stereocell.model.errors import SourceError
from stereocell.read.axis_names import NAME_LISTS, listed_names
from stereocell.read.axis_spacings import MAX_POSITIONS
from stereocell.read.coordinates import steps_of
from stereocell.read.dataset import VoxelArray
from stereocell.read.formats.ome_zarr.store import (
    GuardedStore,
    files_of,
    open_array,
    open_store,
    zarr_boundary,
)
from stereocell.read.formats.ome_zarr.values import with_values
from stereocell.read.formats.ome_zarr.zip_file import is_zipped
from stereocell.read.spacing import Triple, um_per
from stereocell.read.stated_texts import text_of
from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.storage.location import Location


@dataclass(frozen=True, slots=True)
class Positions:
    """The positions along one dimension.

    values  one for each voxel
    unit    unit of the values; empty: not stated
    axis    `t`, `z`, `y` or `x`, from CF's attribute; empty: not stated
    sense   `up` or `down`, from CF's attribute `positive`; empty: not stated
    """

    name: str
    values: NDArray[np.float64]
    unit: str
    axis: str
    sense: str = ""


@dataclass(frozen=True, slots=True)
class Beside:
    """The positions and attributes that lie beside an array.

    positions   positions along each dimension; None: there are none
    attributes  attributes of each group around the array, with the group's name for notes; the
                innermost group is first
    files       files and folders that were read
    """

    positions: tuple[Positions | None, ...]
    attributes: tuple[tuple[str, Mapping[str, Any]], ...] = ()
    files: tuple[str, ...] = ()


def named_dimensions(array: "zarr.Array[Any]") -> dict[str, tuple[str, ...]]:
    """Return the names of an array's dimensions, for each field that states them."""
    fields = {name: array.attrs.get(name) for name in NAME_LISTS}
    stated = getattr(array.metadata, "dimension_names", None)
    fields["dimension_names"] = stated or fields["dimension_names"]
    found = {place: listed_names(named, array.ndim) for place, named in fields.items()}
    return {place: names for place, names in found.items() if names}


def beside(location: Location, store: Store, path: str, array: "zarr.Array[Any]") -> Beside:
    """Return the positions and attributes beside the array at a path, relative to the source."""
    dimensions = next(iter(named_dimensions(array).values()), ())
    groups = list(_groups(location, store, path))
    found = [
        _positions(groups, name, size) for name, size in zip(dimensions, array.shape, strict=False)
    ]
    files = [file for one in found if one is not None for file in one[1]]
    return Beside(
        tuple(None if one is None else one[0] for one in found),
        tuple((group.title, group.attributes) for group in groups),
        tuple(dict.fromkeys(files)),
    )


def notes_beside_scale(
    positions: Sequence[Positions | None], axes: Sequence[str], spacing_um: Triple | None
) -> tuple[str, ...]:
    """Return notes on positions that disagree with an image's scale; the scale is used.

    axes        names of the array's axes, slowest first
    spacing_um  (z, y, x), from the scale; None: not stated
    """
    notes: list[str] = []
    for axis, one in zip(axes, positions, strict=False):
        steps = None if one is None else steps_of(one.values, len(one.values))
        if one is None or steps is None or axis not in tuple("zyx"):
            continue
        if steps.mean < 0:
            notes.append(
                f"positions of {one.name} beside the image descend, while its scale rises: the "
                "voxels are read as stored, so the volume may be mirrored"
            )
        if not steps.is_even:
            notes.append(
                f"positions of {one.name} beside the image are uneven: found steps of "
                f"{steps.least:.5g} to {steps.largest:.5g}: its scale is used"
            )
        if spacing_um is not None and (per := um_per(one.unit)) is not None:
            subject = Subject(
                f"voxel spacing along {axis}", "um", remedy="--spacing-um z,y,x replaces it"
            )
            place = f"the list of positions {one.name}"
            stated = Statement(spacing_um["zyx".index(axis)], "scale")
            notes += settle(
                subject, [stated, Statement(abs(steps.mean) * per, place, Trust.REPEATED)]
            ).notes
    return tuple(notes)


@dataclass(frozen=True, slots=True)
class _Group:
    """A group around an array: its place, its path in the store, and its attributes."""

    location: Location
    store: Store
    path: str
    group: "zarr.Group"

    @property
    def title(self) -> str:
        return f"the group {self.path or self.location.parts[-1]}"

    @property
    def attributes(self) -> Mapping[str, Any]:
        return dict(self.group.attrs)


def _groups(location: Location, store: Store, path: str) -> Iterator[_Group]:
    """Yield the groups around an array, the innermost first.

    If the source is the array itself, only the group in which it lies is yielded.
    """
    inner = path.strip("/")
    if not inner:
        folder = location.source.rstrip("/").rpartition("/")[0]
        is_whole_archive = is_zipped(location) and location.path == location.source
        if is_whole_archive or not folder:
            return
        location = replace(location, source=folder)
        if (group := _group(location, None, "")) is not None:
            yield group
        return
    while inner:
        inner = inner.rpartition("/")[0]
        if (group := _group(location, store, inner)) is not None:
            yield group


def _group(location: Location, store: Store | None, path: str) -> _Group | None:
    try:
        with zarr_boundary(location.shown, "a group"):
            store = store or open_store(location)
            group = zarr.open_group(GuardedStore(store, location), path=path, mode="r")
            return _Group(location, store, path, group)
    except SourceError:
        return None


def _positions(
    groups: Sequence[_Group], name: str, size: int
) -> tuple[Positions, tuple[str, ...]] | None:
    """Return the positions along a dimension and the files that hold them; None: there are none."""
    if not name.strip(".") or "/" in name:
        return None
    for one in groups:
        path = f"{one.path}/{name}".lstrip("/")
        with zarr_boundary(f"{one.location.shown}/{path}", "an array of positions"):
            node = one.group.get(name)
            if not isinstance(node, zarr.Array) or node.shape != (size,):
                continue
            if node.dtype.kind not in "iuf" or not 1 < size <= MAX_POSITIONS:
                continue
            array = open_array(one.location, one.store, path, title="positions")
            values = with_values(one.location.shown, VoxelArray(array, ("x",)))[0].array
            attributes = dict(array.attrs)
            axis = text_of(attributes.get("axis")).lower()
            found = Positions(
                name,
                np.asarray(values[(slice(None),)], np.float64),
                text_of(attributes.get("units")),
                axis if axis in tuple("tzyx") else "",
                text_of(attributes.get("positive")),
            )
        return found, files_of(one.location, [path])
    return None
