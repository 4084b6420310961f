"""Read a dataset of an HDF5 file with h5py: `FILE.h5:/KEY`, also netCDF-4, MATLAB 7.3 and EMD.

HDF5 itself has no convention for axes, voxel sizes and value scales. dimensions.py knows the usual
conventions for dimensions, spacing.py those for sizes, and values.py those for packed values. Three
dimensions without names are z, y, x.

References: https://kreshuklab.github.io/plant-seg/, https://www.ilastik.org/documentation/
"""

from itertools import islice

import h5py

from stereocell.model.errors import SourceError, UsageError
from stereocell.read.array_axes import settle_stated_axes
from stereocell.read.bigdataviewer import hdf5 as bdv_hdf5
from stereocell.read.dataset import VoxelArray
from stereocell.read.flipped_array import FlippedArray
from stereocell.read.formats.hdf5.dimensions import describe, require_plain
from stereocell.read.formats.hdf5.itk import is_of_itk, itk_image
from stereocell.read.formats.hdf5.spacing import settle_spacing
from stereocell.read.formats.hdf5.values import value_attributes
from stereocell.read.hdf5_file.tree import Hdf5Array, Hdf5Tree
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.series import SeveralDatasetsError
from stereocell.read.spacing import grid_of
from stereocell.read.value_scale import scaled
from stereocell.storage.library_errors import one_line
from stereocell.storage.location import Location

_LISTED = 12  # datasets that a message names at most


def read_image(location: Location, *, axes: str = "", series: int = 0, xml: str = "") -> Image:
    """Return the image of one dataset. Raises SourceError for unreadable or ambiguous sources.

    series, xml  number of a BigDataViewer view, and path of the XML if the user named it
    """
    tree = Hdf5Tree(location, "a complete HDF5 file")
    try:
        # h5py may fail at any name or attribute of a damaged file.
        with one_line(tree.where, "a complete HDF5 file"):
            if not location.key and bdv_hdf5.is_container(tree):
                if axes:
                    raise UsageError(
                        f"{tree.where}: --axes {axes}: BigDataViewer's axes are z, y, x, expected "
                        "no --axes"
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
    require_plain(where, dataset)
    if not axes and is_of_itk(dataset):
        return itk_image(tree, dataset, notes)
    described = describe(tree, dataset)
    stored = Hdf5Array(dataset, where)
    statements = [one.names for one in described]
    names, axes_notes = settle_stated_axes(where, stored.shape, axes, statements)
    attributes, scale_notes = value_attributes(tree, dataset)
    values, value_notes = scaled(where, stored, attributes)
    found = settle_spacing(tree, dataset, names, described)
    if any(found.flips):
        values = FlippedArray(values, found.flips)
    array = VoxelArray(values, names)
    if array.size("c") > MAX_CHANNELS:
        raise SourceError(
            f"{where}: axis c: found {array.size('c')} channels, expected at most {MAX_CHANNELS}"
        )
    unnamed = (None,) * array.size("c")
    grid = grid_of(array.shape, found.spacing_um, found.hint)
    return Image(
        (array,), (grid,), unnamed, unnamed, 1, tree.close,
        notes=(*notes, *axes_notes, *found.notes, *value_notes, *scale_notes), files=tree.files,
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
        return found[0], (f"dataset {found[0].name}: the only volume of the file",)
    if not found:
        others = [f"{one.name} {one.shape} {one.dtype}" for one in tree.datasets(node, _LISTED)]
        held = f" but {', '.join(others):.300}" if others else ""
        raise SourceError(
            f"{tree.where}{':' + key if key else ''}: found no volume{held}, "
            "expected a dataset of numbers with at least three axes longer than 1"
        )
    labels = {f":{one.name}": f"{one.name} {one.shape} {one.dtype}" for one in found}
    where = f"{tree.where}{':' + key if key else ''}"
    raise SeveralDatasetsError.of(where, tree.where, labels, most=_LISTED)
