"""Read OME-Zarr 0.1 to 0.6 (Zarr v2 and v3) from a folder, a zip file or an address.

The arrays are read by zarr-python. The reader of bioio, which builds on it, is not used. Only its
reading of the JSON metadata would be useful, and importing it took 1.5 s in each process, four
times as long as zarr:
- `physical_pixel_sizes` leaves out the units, and takes the first coordinate transformation for a
  scale without checking; this module composes all transformations.
- `xarray_dask_data` builds a graph over all chunks of the dataset for every window; this module
  reads the window from the Zarr array.
- `channel_names` is "" where a label is missing.

References: https://ngff.openmicroscopy.org; ngff.py reads the metadata of all versions
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any
from xml.etree import ElementTree

import zarr
from zarr.abc.store import Store

from stereocell.model.color import linear_color
from stereocell.model.errors import SourceError, UsageError
from stereocell.read.dataset import VoxelArray
from stereocell.read.formats.ome_zarr import bare_zarr, ngff
from stereocell.read.formats.ome_zarr.bioformats2raw import Converted, converted_of, settled_grids
from stereocell.read.formats.ome_zarr.collections import (
    ZarrTree,
    describe_group,
    image_of_level,
    is_collection,
    labels_evidence,
    notes_on_labels,
    part_of,
    series_of,
)
from stereocell.read.formats.ome_zarr.coordinates import beside, notes_beside_scale
from stereocell.read.formats.ome_zarr.ngff import Multiscale
from stereocell.read.formats.ome_zarr.ngff_sides import with_sides
from stereocell.read.formats.ome_zarr.ngff_statements import (
    dimension_names,
    settled_axes,
    version_notes,
)
from stereocell.read.formats.ome_zarr.store import (
    GuardedStore,
    files_of,
    notes_on_names,
    open_array,
    open_store,
    zarr_boundary,
)
from stereocell.read.formats.ome_zarr.values import value_attributes, with_values
from stereocell.read.image import MAX_CHANNELS, Color, Image
from stereocell.read.label_notes import notes_of_ngff
from stereocell.read.modulo import listed, split
from stereocell.read.series import Candidate, choose, lines
from stereocell.read.spacing import Grid, PartialTriple, grid_of
from stereocell.read.value_scale import ignored_note
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_MAX_LEVELS = 64  # levels of a pyramid; an image with more is refused
_MOST_NAMED = 4  # images of a group that a note names


def read_image(location: Location, *, axes: str = "", series: int = 0) -> Image:
    """Return a multiscale image of a group, or a bare array (bare_zarr.py).

    The group may be a container of series that holds one image.

    axes    the user's `--axes`, for a bare array
    series  number of the image as `list_series` counts: the group's images, and the parts along a
            further axis that the OME-XML beside an image describes; 0: the first

    Raises SourceError where there is no image or several groups of images, UsageError where `axes`
    doesn't fit or there is no such series.
    """
    image, root = _read(location, axes)
    if image.images == 1:
        return split(location.shown, image, root, series)
    entries = _entries(location, axes, image, root)
    at, _ = choose(location.shown, [one.candidate for one in entries], series or 1)
    entry = entries[at]
    others = [
        f"--series {n}: {one.candidate.label}" for n, one in enumerate(entries, 1) if n != at + 1
    ]
    more = "; more are in `--series list`" * (len(others) > _MOST_NAMED)
    note = (
        f"{image.images} images in the group; building --series {at + 1}, "
        f"{'asked for' if series else 'the first'}; not built: {'; '.join(others[:_MOST_NAMED])}"
        f"{more}"
    )
    if entry.image:
        image, root = _read(location, axes, index=entry.image)
    image = split(location.shown, image, root, entry.part)
    return replace(image, images=1, notes=(*image.notes, note))


def list_series(location: Location) -> tuple[str, ...]:
    """Return a line for each image of a group and each part along a further axis.

    Raises SourceError.
    """
    entries = _entries(location, "", *_read(location, ""))
    return lines([one.candidate for one in entries])


@dataclass(frozen=True, slots=True)
class _Entry:
    """One line of the list: an image of the group, or a part of it along a further axis.

    image  index of the image among the multiscales
    part   number of the part, from 1
    """

    image: int
    part: int
    candidate: Candidate


def _entries(
    location: Location, axes: str, image: Image, root: ElementTree.Element | None
) -> list[_Entry]:
    """Return the list of a group's images. `image` and `root` are the first one's, already read."""
    found = [_Entry(0, n, one) for n, one in enumerate(listed(image, root), 1)]
    for index in range(1, image.images):
        try:
            parts = listed(*_read(location, axes, index=index))
        except SourceError:
            parts = [Candidate(f"image {index + 1} of `multiscales`, which can't be read", 0)]
        found += [_Entry(index, n, one) for n, one in enumerate(parts, 1)]
    return found


def _read(
    location: Location, axes: str, *, index: int = 0, is_part: bool = False
) -> tuple[Image, ElementTree.Element | None]:
    """Return an image as stored, and the OME-XML beside it if it describes the image.

    index    index of the image among the multiscales
    is_part  whether the group is the only image of a container, so it is not a container itself
    """
    where = location.shown
    with zarr_boundary(where, "the group of one OME-Zarr image, or a Zarr array"):
        store = open_store(location)
        guard = GuardedStore(store, location)
        node = zarr.open(guard, mode="r")
    if isinstance(node, zarr.Array):
        if not axes and (whole := image_of_level(location)):
            raise SourceError(
                f"{where}: found a level of an OME-Zarr image, expected the image: {whole} "
                "(--level picks the level); or give --axes to read only this array"
            )
        return bare_zarr.read_array(location, store, "", axes=axes), None
    metadata = node.metadata
    attributes = metadata.attributes
    ome = attributes.get("ome", attributes)
    if not isinstance(ome, Mapping):
        raise SourceError(f"{where}: attribute `ome`: found {ome!r:.60}, expected a table")
    tree = ZarrTree(location, guard, metadata.zarr_format)
    multiscales = ome.get("multiscales")
    if not isinstance(multiscales, list) or not multiscales:
        series = series_of(ome, tree)
        if len(series) == 1 and not is_part:
            return _read(part_of(location, series[0]), axes, index=index, is_part=True)
        if multiscales is None and not is_collection(ome):
            only = bare_zarr.read_only_array(location, store, node, axes=axes)
            if only is not None:
                return only, None
        held, remedy = describe_group(ome, series, tree)
        raise SourceError(
            f"{where}: found {held}, expected the attribute `multiscales` of an image"
            + (f": {remedy}" if remedy else "")
        )
    converted = converted_of(location)
    one = {**ome, "multiscales": [multiscales[index]]}
    found = replace(_image(tree, store, one, axes, converted), images=len(multiscales))
    if ignored := ignored_note("the image's group", attributes):
        found = replace(found, notes=(*found.notes, ignored))
    is_described = converted is not None and converted.shape == found.arrays[0].shape
    return found, converted.root if converted is not None and is_described else None


def _image(
    tree: ZarrTree,
    store: Store,
    ome: Mapping[str, Any],
    axes: str,
    converted: Converted | None,
) -> Image:
    """Return a multiscale image from a group's OME attributes. Raises SourceError."""
    location, where = tree.location, tree.location.shown
    multiscale = _parsed(tree, ome)
    if not 0 < len(multiscale.paths) <= _MAX_LEVELS:
        raise SourceError(
            f"{where}: multiscales[0].datasets: found {len(multiscale.paths) or 'none'}, expected "
            f"1 to {_MAX_LEVELS} levels"
        )
    levels, notes = _levels(location, store, multiscale, axes, tree.zarr_format)
    missing = [axis for axis in "zyx" if axis not in levels[0].axes]
    if missing:
        raise SourceError(
            f"{where}: one plane (2D): a volume needs at least 2 planes: found no axis "
            f"{missing[0]} among {', '.join(levels[0].axes)}"
        )
    grids, more = _grids(multiscale, levels, converted)
    files = () if converted is None else (converted.path,)
    sided = with_sides(levels, grids, [_of_axis(multiscale, axis) for axis in "zyx"])
    omero = ome.get("omero", {})
    channels = omero.get("channels", []) if isinstance(omero, Mapping) else omero
    titles, colors = _channels(where, channels, levels[0].size("c"))
    return Image(
        sided.arrays,
        sided.grids,
        titles,
        colors,
        len(ome["multiscales"]),
        files=(*files_of(location, multiscale.paths), *files),
        placement=sided.placement,
        has_sides=sided.has_sides,
        acquired=sided.acquired,
        notes=(
            *multiscale.notes,
            *notes,
            *more,
            *sided.notes,
            *_position_notes(tree, store, multiscale.paths[0], levels[0], grids[0]),
            *notes_on_labels(tree),
        ),
        labels=labels_evidence(ome, location),
        objects=notes_of_ngff(ome.get("image-label")),
    )


def _parsed(tree: ZarrTree, ome: Mapping[str, Any]) -> Multiscale:
    """Return the metadata of the only image.

    Raises SourceError; for an unknown version, the message shows how to read the voxels.
    """
    where = tree.location.shown
    version, titled = ngff.version_of(ome), where
    expected = "axes, datasets and scales of OME-Zarr 0.1 to 0.6"
    if not ngff.is_known(version):
        with zarr_boundary(where, "a group whose arrays can be listed"):
            group = zarr.open_group(tree.store, mode="r", zarr_format=tree.zarr_format)
            path = next((name for name, node in group.members() if isinstance(node, zarr.Array)), 0)
        titled = f"{where}: OME-Zarr {version:.20}, an unknown version"
        expected += (
            f"; {where.rstrip('/')}/{path} --axes zyx --spacing-um z,y,x reads the voxels of an "
            "array as stored"
        )
    with one_line(f"{titled}: multiscales[0]", expected):
        parsed = ngff.parse(where, ome)
    versions = version_notes(ome, tree.zarr_format)
    return replace(parsed, notes=(*versions, *parsed.notes))


def _levels(
    location: Location, store: Store, image: Multiscale, axes: str, zarr_format: Any
) -> tuple[tuple[VoxelArray, ...], tuple[str, ...]]:
    """Return the levels with the axes of the image, and notes.

    axes  the user's `--axes`, used where the metadata leave the axes open

    Raises SourceError where a level has another number of axes or the axes contradict each other,
    and UsageError where the metadata already state the axes.
    """
    where, dimensions = location.shown, len(image.names)
    arrays = [open_array(location, store, path, zarr_format=zarr_format) for path in image.paths]
    is_open = not image.names_axes or sorted(dimension_names(arrays[0])) == sorted(image.names)
    is_same = image.names_axes and dimension_names(arrays[0]) == image.names
    if axes and (is_same or not is_open):
        raise UsageError(
            f"{where}: --axes {axes}: the image names its axes, {', '.join(image.names)}, "
            "expected no --axes"
        )
    source = "`axes`" if image.names_axes else f"axes of {image.title} (or give --axes)"
    for path, array in zip(image.paths, arrays, strict=True):
        if array.ndim != dimensions and (image.names_axes or not axes):
            raise SourceError(
                f"{where}: level {path!r:.80}: found {array.ndim} dimensions, "
                f"expected {dimensions}, the number of {source}"
            )
    names, notes = settled_axes(where, arrays[0], image.names, axes)
    for array in arrays[1:]:
        settled_axes(where, array, image.names, axes)
    attributes = value_attributes(arrays[0])
    valued = [with_values(where, VoxelArray(array, names), attributes) for array in arrays]
    levels = tuple(level for level, _ in valued)
    return levels, (*notes, *notes_on_names(arrays), *valued[0][1])


def _grids(
    image: Multiscale, levels: tuple[VoxelArray, ...], converted: Converted | None
) -> tuple[tuple[Grid, ...], tuple[str, ...]]:
    """Return the levels' grids, and notes on the OME-XML beside the image."""
    hint = "" if image.places_voxels else f"{image.title} states none"
    grids = tuple(
        replace(_grid(level, image, scale, shift), hint=hint)
        for level, (scale, shift) in zip(levels, image.placements, strict=True)
    )
    return (grids, ()) if converted is None else settled_grids(grids, converted, levels[0])


def _position_notes(
    tree: ZarrTree, store: Store, path: str, level: VoxelArray, grid: Grid
) -> tuple[str, ...]:
    """Return notes on positions beside the finest level that disagree with its grid.

    Only positions on this machine are read.
    """
    stored: Any = level.array
    while not isinstance(stored, zarr.Array):
        stored = stored.stored
    if not tree.location.is_local:
        return ()
    found = beside(tree.location, store, path, stored)
    return notes_beside_scale(found.positions, level.axes, grid.spacing_um)


def _of_axis(image: Multiscale, axis: str) -> str:
    return image.orientations[image.names.index(axis)] if axis in image.names else ""


def _grid(
    level: VoxelArray,
    image: Multiscale,
    scale: Sequence[float] | None,
    shift: Sequence[float] | None,
) -> Grid:
    # Without a unit, a scale is not a length: writers state 1.0 if they don't know the spacing.
    spacing = _spatial(image.names, image.units, scale)
    grid = grid_of(level.shape, spacing)
    if shift is None or grid.spacing_um is None:
        return grid
    z, y, x = (length or 0.0 for length in _spatial(image.names, image.units, shift))
    return replace(grid, offset_um=(z, y, x))


def _spatial(
    axes: tuple[str, ...], units: tuple[float | None, ...], values: Sequence[float] | None
) -> PartialTriple:
    """Return lengths (z, y, x), um; None: not stated, or without a unit of length."""
    picked: list[float | None] = []
    for axis in "zyx":
        unit = units[axes.index(axis)]
        if unit is None or values is None:
            picked.append(None)
        else:
            picked.append(values[axes.index(axis)] * unit)
    z, y, x = picked
    return z, y, x


def _channels(
    where: str, channels: Any, count: int
) -> tuple[tuple[str | None, ...], tuple[Color | None, ...]]:
    if not isinstance(channels, list):
        raise SourceError(f"{where}: omero.channels: found {channels!r:.60}, expected a list")
    if count > MAX_CHANNELS:
        raise SourceError(
            f"{where}: axis c: found {count} channels, expected at most {MAX_CHANNELS}"
        )
    entries = [entry for entry in channels if isinstance(entry, Mapping)]
    if len(entries) > count:
        raise SourceError(
            f"{where}: omero.channels: found {len(entries)} entries, expected {count} "
            "(the length of axis c)"
        )
    entries += [{}] * (count - len(entries))
    names = tuple(str(entry["label"]).strip() if entry.get("label") else None for entry in entries)
    return names, tuple(_color(entry.get("color")) for entry in entries)


def _color(text: Any) -> Color | None:
    match = re.fullmatch(r"#?([0-9a-fA-F]{6})([0-9a-fA-F]{2})?", str(text))
    if match is None:
        return None
    red, green, blue = bytes.fromhex(match[1])
    return linear_color((red, green, blue))
