"""Read a Zarr array (v2 or v3) without the metadata of OME-Zarr.

Its axes come from `--axes` or from the names of its dimensions (v3, or the attributes in
read/axis_names.py); three unnamed dimensions are z, y, x. Its spacing comes from `--spacing-um`,
from arrays of positions beside it (coordinates.py), or from the attributes in
read/array_spacing.py.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import zarr
from zarr.abc.store import Store

from stereocell.model.errors import SourceError
from stereocell.read.array_axes import settle_stated_axes
from stereocell.read.axis_names import NAME_LISTS, listed_names
from stereocell.read.axis_spacings import AxisSpacings, SettledSpacing
from stereocell.read.dataset import VoxelArray
from stereocell.read.flipped_array import FlippedArray
from stereocell.read.formats.ome_zarr.collections import is_collection, ome_of
from stereocell.read.formats.ome_zarr.coordinates import Beside, beside, named_dimensions
from stereocell.read.formats.ome_zarr.store import (
    files_of,
    notes_on_names,
    open_array,
    zarr_boundary,
)
from stereocell.read.formats.ome_zarr.values import with_values
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.series import SeveralDatasetsError, likely_image
from stereocell.read.spacing import grid_of
from stereocell.read.statements import Statement, Trust
from stereocell.read.value_scale import ignored_note
from stereocell.storage.location import Location

_LISTED = 12  # arrays that a message names at most
_MAX_NODES = 1000  # members of a group that are searched for a volume at most


def read_array(location: Location, store: Store, path: str, *, axes: str = "") -> Image:
    """Return the image of the array at a path of the store, relative to the source.

    axes  the user's `--axes`; empty: none
    """
    array = open_array(location, store, path)
    where = f"{location.shown}/{path}".rstrip("/")
    around = beside(location, store, path, array)
    names, axes_notes = settle_stated_axes(where, array.shape, axes, _named_axes(array, around))
    valued, value_notes = with_values(where, VoxelArray(array, names))
    found = _spacing(array, names, around)
    stored = FlippedArray(valued.array, found.flips) if any(found.flips) else valued.array
    voxels = VoxelArray(stored, names)
    if voxels.size("c") > MAX_CHANNELS:
        raise SourceError(
            f"{where}: axis c: found {voxels.size('c')} channels, expected at most {MAX_CHANNELS}"
        )
    unnamed = (None,) * voxels.size("c")
    ignored = [ignored_note(of, attributes) for of, attributes in around.attributes]
    return Image(
        (voxels,),
        (grid_of(voxels.shape, found.spacing_um, found.hint),),
        unnamed,
        unnamed,
        1,
        notes=(
            *notes_on_names([array]),
            *axes_notes,
            *found.notes,
            *value_notes,
            *filter(None, ignored),
        ),
        files=(*files_of(location, [path]), *around.files),
    )


def _named_axes(array: "zarr.Array[Any]", around: Beside) -> list[Statement]:
    """Return the names of an array's dimensions, for each field that states them.

    CF's `axis` of a dimension's positions takes precedence over the name of the dimension.
    """
    axes = {one.name: one.axis for one in around.positions if one is not None and one.axis}
    return [
        Statement(tuple(axes.get(name, name) for name in named), place)
        for place, named in named_dimensions(array).items()
    ] + [
        Statement(names, f"{field} of {of}", Trust.REPEATED)
        for of, attributes in around.attributes
        for field in NAME_LISTS
        if (names := listed_names(attributes.get(field), array.ndim))
    ]


def _spacing(array: "zarr.Array[Any]", axes: Sequence[str], around: Beside) -> SettledSpacing:
    """Return the spacing of an array and the directions of its axes, with notes."""
    spacings = AxisSpacings(axes)
    for dimension, one in enumerate(around.positions):
        if one is not None:
            size = array.shape[dimension]
            spacings.add_positions(dimension, one.name, one.values, one.unit, size)
            spacings.add_sense(dimension, one.name, one.sense)
    spacings.add_attributes(dict(array.attrs), "the array")
    for of, attributes in around.attributes:
        spacings.add_attributes(attributes, of, Trust.REPEATED)
    return spacings.settled()


def read_only_array(
    location: Location, store: Store, group: "zarr.Group", *, axes: str = ""
) -> Image | None:
    """Return the image of the only volume in a group that holds no OME-Zarr image.

    None: it has no array of three axes, or holds OME-Zarr. Raises SourceError where it has several
    volumes.
    """
    if not location.is_local:  # most addresses can't be listed
        return None
    with zarr_boundary(location.shown, "a group whose arrays can be listed"):
        members = islice(group.members(max_depth=None), _MAX_NODES)
        nodes: list[tuple[str, Any]] = list(members)
    found = [(path, node) for path, node in nodes if _is_volume(node)]
    if not found or any(_is_ome(node) for _, node in nodes):
        return None
    found.sort(key=lambda pair: pair[0])
    if len(found) == 1:
        image = read_array(location, store, found[0][0], axes=axes)
        note = f"array {found[0][0]}: the only volume in a group without `multiscales`"
        return replace(image, notes=(note, *image.notes))
    listed = ", ".join(f"{path} {node.shape}" for path, node in found[:_LISTED])
    more = f" and {len(found) - _LISTED} more" if len(found) > _LISTED else ""
    paths = [path for path, _ in found]
    likely = likely_image(paths)
    raise SeveralDatasetsError(
        f"{location.shown}: no multiscales: found {listed}{more}, expected the attribute "
        f"`multiscales` of an image, or one array, such as {location.shown}/{likely}",
        [f"{location.source}/{path}" for path in paths],
        [f"{path} {node.shape}" for path, node in found],
        paths.index(likely),
    )


def _is_volume(node: Any) -> bool:
    return isinstance(node, zarr.Array) and sum(n > 1 for n in node.shape) >= 3


def _is_ome(node: Any) -> bool:
    if not isinstance(node, zarr.Group):
        return False
    ome = ome_of(node.metadata.attributes)
    return "multiscales" in ome or is_collection(ome)
