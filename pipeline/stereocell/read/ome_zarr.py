"""OME-Zarr 0.4 (Zarr v2) and 0.5 (Zarr v3), read by zarr-python.

bioio's reader, which stands on zarr-python, is not used. Only its JSON metadata would be left in
use, and its import took 1.5 s of each process, four times as long as zarr's:
- `physical_pixel_sizes` leaves out the units, and takes the first coordinate transformation for a
  scale without checking; this module composes all transformations.
- `xarray_dask_data` builds a graph over all chunks of the dataset for every window; this module
  reads the window from the Zarr array.
- `channel_names` is "" where a label is missing.

References: OME-Zarr 0.5, https://ngff.openmicroscopy.org/0.5/
"""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import zarr
from zarr.abc.store import Store

from stereocell.model.color import linear_color
from stereocell.model.errors import SourceError, UsageError
from stereocell.read import bare_zarr
from stereocell.read.dataset import VoxelArray
from stereocell.read.image import MAX_CHANNELS, Color, Image
from stereocell.read.label_notes import notes_of_ngff
from stereocell.read.spacing import Grid, Triple, um_per
from stereocell.read.zarr_collections import (
    ZarrTree,
    describe_group,
    image_of_level,
    is_collection,
    labels_evidence,
    notes_on_labels,
    part_of,
    series_of,
)
from stereocell.read.zarr_store import (
    GuardedStore,
    files_of,
    notes_on_names,
    open_array,
    open_store,
    quiet,
)
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_MAX_LEVELS = 64  # most levels of the pyramid


def read_image(location: Location, *, axes: str = "", is_part: bool = False) -> Image:
    """Return the first multiscale image of a group, or a bare array (bare_zarr.py).

    The group may be a container of series, if it holds one image.

    axes     the user's `--axes`, for a bare array
    is_part  it is the one image of a container, and no container itself

    Raises SourceError where there is no image, or where there are several groups of images;
    UsageError where `axes` doesn't fit.
    """
    where = location.shown
    with quiet(), one_line(where, "the group of one OME-Zarr 0.4 or 0.5 image, or a Zarr array"):
        store = open_store(location)
        guard = GuardedStore(store, location)
        node = zarr.open(guard, mode="r")
    if isinstance(node, zarr.Array):
        if not axes and (image := image_of_level(location)):
            raise SourceError(
                f"{where}: found a level of an OME-Zarr image, expected the image, as {image} "
                "(--level picks the level), or its axes by --axes"
            )
        return bare_zarr.read_array(location, store, "", axes=axes)
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
            return read_image(part_of(location, series[0]), axes=axes, is_part=True)
        if multiscales is None and not is_collection(ome):
            only = bare_zarr.read_only_array(location, store, node, axes=axes)
            if only is not None:
                return only
        raise SourceError(
            f"{where}: no multiscales: {describe_group(ome, series, tree)}; expected the "
            "attribute `multiscales` of an image"
        )
    with one_line(f"{where}: multiscales[0]", "axes, datasets and scales as OME-Zarr 0.4 and 0.5"):
        names, units = _axes(multiscales[0])
        datasets = list(multiscales[0]["datasets"])
        paths = [str(dataset["path"]) for dataset in datasets]
        placements = [_placement(multiscales[0], dataset, len(names)) for dataset in datasets]
    if not 0 < len(paths) <= _MAX_LEVELS:
        raise SourceError(
            f"{where}: multiscales[0].datasets: found {len(paths) or 'none'}, expected a level, "
            f"and at most {_MAX_LEVELS}"
        )
    if axes:
        raise UsageError(
            f"{where}: --axes {axes}: the image names its axes, {', '.join(names)}; expected none"
        )
    missing = [axis for axis in "zyx" if axis not in names]
    if missing:
        raise SourceError(
            f"{where}: one plane (2D): a volume needs at least 2 planes: no axis {missing[0]} "
            f"among {', '.join(names)}"
        )
    version = metadata.zarr_format
    arrays = tuple(_level(location, store, path, names, version) for path in paths)
    grids = tuple(
        _grid(level, units, scale, shift)
        for level, (scale, shift) in zip(arrays, placements, strict=True)
    )
    omero = ome.get("omero", {})
    channels = omero.get("channels", []) if isinstance(omero, Mapping) else omero
    titles, colors = _channels(where, channels, arrays[0].size("c"))
    return Image(
        arrays,
        grids,
        titles,
        colors,
        len(multiscales),
        files=files_of(location, paths),
        notes=(*notes_on_names(level.array for level in arrays), *notes_on_labels(tree)),
        labels=labels_evidence(ome, location),
        objects=notes_of_ngff(ome.get("image-label")),
    )


def _axes(multiscale: Mapping[str, Any]) -> tuple[tuple[str, ...], tuple[float | None, ...]]:
    """Return the axes' names and their units in um (None: no unit of length).

    Raises ValueError where the metadata are not of OME-Zarr 0.4 or 0.5 or repeat a name.
    """
    axes = multiscale["axes"]
    if not all(isinstance(axis, Mapping) for axis in axes):
        raise ValueError("axes are not of OME-Zarr 0.4 or 0.5")
    names = tuple(str(axis["name"]).lower() for axis in axes)
    if len(set(names)) != len(names):
        raise ValueError(f"axes {', '.join(names)} name one twice")
    return names, tuple(um_per(axis.get("unit")) for axis in axes)


def _placement(
    multiscale: Mapping[str, Any], dataset: Mapping[str, Any], dimensions: int
) -> tuple[list[float] | None, list[float] | None]:
    """Return scale and translation of a level, in the axes' units; None: not stated.

    The level's own transformations come first, then those of the whole image. Raises ValueError
    where a transformation is invalid.
    """
    scale: list[float] | None = None
    shift: list[float] | None = None
    own = dataset.get("coordinateTransformations", [])
    for step in [*own, *multiscale.get("coordinateTransformations", [])]:
        kind = step["type"]
        values = [float(value) for value in step.get(kind, [])]
        if kind == "identity":
            continue
        if kind not in ("scale", "translation") or len(values) != dimensions:
            raise ValueError(
                f"coordinateTransformations: found {kind} of {len(values)} numbers "
                f"for {dimensions} axes"
            )
        if kind == "scale":
            scale = [a * b for a, b in zip(scale or [1.0] * dimensions, values, strict=True)]
            shift = shift and [a * b for a, b in zip(shift, values, strict=True)]
        else:
            shift = [a + b for a, b in zip(shift or [0.0] * dimensions, values, strict=True)]
    return scale, shift


def _grid(
    level: VoxelArray,
    units: tuple[float | None, ...],
    scale: Sequence[float] | None,
    shift: Sequence[float] | None,
) -> Grid:
    spacing = None if scale is None else _spatial(level.axes, units, scale)
    # A scale without a unit is no length: writers that lack the spacing state 1.0.
    offset = None if shift is None or spacing is None else _spatial(level.axes, units, shift)
    return Grid(level.shape, spacing, offset)


def _spatial(
    axes: tuple[str, ...], units: tuple[float | None, ...], values: Sequence[float]
) -> Triple | None:
    picked = []
    for axis in "zyx":
        unit = units[axes.index(axis)]
        if unit is None:
            return None
        picked.append(values[axes.index(axis)] * unit)
    z, y, x = picked
    return z, y, x


def _channels(
    where: str, channels: Any, count: int
) -> tuple[tuple[str | None, ...], tuple[Color | None, ...]]:
    if not isinstance(channels, list):
        raise SourceError(f"{where}: omero.channels: found {channels!r:.60}, expected a list")
    if count > MAX_CHANNELS:
        raise SourceError(f"{where}: axis c: found {count}, expected at most {MAX_CHANNELS}")
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


def _level(
    location: Location, store: Store, path: str, axes: tuple[str, ...], zarr_format: Any
) -> VoxelArray:
    array = open_array(location, store, path, zarr_format=zarr_format)
    if array.ndim != len(axes):
        raise SourceError(
            f"{location.shown}: level {path!r:.80}: found {array.ndim} dimensions, "
            f"expected {len(axes)} as `axes`"
        )
    return VoxelArray(array, axes)
