"""A dataset of an HDF5 file, by h5py: `FILE.h5:/KEY`.

HDF5 has no convention for axes and voxel sizes. Known here: `element_size_um` of PlantSeg (z, y,
x), `axistags` of ilastik (JSON of vigra), HDF5's own dimension labels, and `resolution`, `spacing`
or `voxel_size` where a unit stands beside them. Without axes three dimensions are z, y, x.

References: https://kreshuklab.github.io/plant-seg/, https://www.ilastik.org/documentation/
"""

import json
from collections.abc import Sequence
from itertools import islice

import h5py

from stereocell.model.errors import SourceError, UsageError
from stereocell.read import bdv_hdf5
from stereocell.read.array_axes import settle_axes
from stereocell.read.array_spacing import ATTRIBUTES, spacing_from
from stereocell.read.dataset import VoxelArray
from stereocell.read.hdf5_tree import Hdf5Array, Hdf5Tree
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.series import likely_image
from stereocell.read.spacing import Grid, Triple
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_LISTED = 12  # datasets that a message names


def read_image(location: Location, *, axes: str = "", series: int = 0, xml: str = "") -> Image:
    """Return the image of one dataset. Raises SourceError where it can't be read, or is unclear.

    series, xml  a view of BigDataViewer and the XML that lists it, where the XML was named
    """
    tree = Hdf5Tree(location, "an HDF5 file that is whole")
    try:
        # all of it asks h5py, which may fail at any name or attribute of a damaged file
        with one_line(tree.where, "an HDF5 file that is whole"):
            if not location.key and bdv_hdf5.is_container(tree):
                if axes:
                    raise UsageError(
                        f"{tree.where}: --axes {axes}: BigDataViewer's axes are z, y, x, expected "
                        "none"
                    )
                return bdv_hdf5.read_image(tree, location, series=series, xml=xml)
            image = _image(tree, location, axes)
            tree.end_texts()
            return image
    except BaseException:
        tree.close()
        raise


def _image(tree: Hdf5Tree, location: Location, axes: str) -> Image:
    dataset, notes = _choose(tree, location.key)
    where = f"{location.path}:{dataset.name}"
    voxels = Hdf5Array(dataset, where)
    names, assumed = settle_axes(where, voxels.shape, axes, named=_named(tree, dataset))
    array = VoxelArray(voxels, names)
    if array.size("c") > MAX_CHANNELS:
        raise SourceError(
            f"{where}: axis c: found {array.size('c')}, expected at most {MAX_CHANNELS}"
        )
    unnamed = (None,) * array.size("c")
    grid = Grid(array.shape, _spacing(tree, dataset, names))
    return Image(
        (array,), (grid,), unnamed, unnamed, 1, tree.close,
        notes=(*notes, *assumed), files=tree.files,
    )  # fmt: skip


def _choose(tree: Hdf5Tree, key: str) -> tuple[h5py.Dataset, tuple[str, ...]]:
    """Return the dataset of a key, or the only volume below it, and notes."""
    node = tree.find(key)
    if isinstance(node, h5py.Dataset):
        return node, ()
    if not isinstance(node, h5py.Group):
        raise SourceError(f"{tree.where}:{key}: found a named type, expected a dataset")
    found = list(islice(tree.volumes(node), _LISTED + 1))
    if len(found) == 1:
        return found[0], (f"dataset {found[0].name}, the only volume of the file",)
    if not found:
        others = [f"{one.name} {one.shape} {one.dtype}" for one in tree.datasets(node, _LISTED)]
        held = f" but {', '.join(others):.300}" if others else ""
        raise SourceError(
            f"{tree.where}{':' + key if key else ''}: found no volume{held}, "
            "expected a dataset of numbers with at least three axes longer than 1"
        )
    listed = ", ".join(f"{one.name} {one.shape} {one.dtype}" for one in found[:_LISTED])
    more = ", ..." if len(found) > _LISTED else ""
    raise SourceError(
        f"{tree.where}{':' + key if key else ''}: several datasets: found {listed}{more}, "
        f"expected one, as {tree.where}:{likely_image([str(one.name) for one in found])}"
    )


def _named(tree: Hdf5Tree, dataset: h5py.Dataset) -> tuple[str, ...]:
    """Return the axes' names of ilastik or of HDF5's labels; empty: there are none."""
    tags = tree.attribute(dataset, "axistags")
    if isinstance(tags, str):
        try:
            return tuple(str(axis["key"]).lower() for axis in json.loads(tags)["axes"])
        except (ValueError, LookupError, TypeError):
            return ()
    labels = tree.attribute(dataset, "DIMENSION_LABELS")
    if labels is None or len(labels) != dataset.ndim:
        return ("",) * dataset.ndim
    return tuple(str(label).lower() for label in labels)


def _spacing(tree: Hdf5Tree, dataset: h5py.Dataset, axes: Sequence[str]) -> Triple | None:
    """Return the spacing (z, y, x), um, of attributes of the dataset or of a group above it."""
    nodes: list[h5py.Group | h5py.Dataset] = [dataset, dataset.parent, dataset.file["/"]]
    for node in nodes:
        found = {name: tree.attribute(node, name) for name in ATTRIBUTES}
        if (spacing := spacing_from(found, axes)) is not None:
            return spacing
    return None
