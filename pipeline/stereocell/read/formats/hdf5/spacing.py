"""Find the voxel spacing and the directions of a dataset's axes in an HDF5 file.

They are stated by positions along dimensions (dimensions.py), and by attributes of the dataset and
of the groups around it. read/axis_spacings.py compares them.
"""

from collections.abc import Sequence

import h5py
import numpy as np

from stereocell.read.array_spacing import ATTRIBUTES
from stereocell.read.axis_spacings import MAX_POSITIONS, AxisSpacings, SettledSpacing
from stereocell.read.formats.hdf5.dimensions import Described
from stereocell.read.hdf5_file.tree import Hdf5Array, Hdf5Tree
from stereocell.read.spacing import um_per
from stereocell.read.statements import Trust
from stereocell.read.value_scale import ATTRIBUTES as PACKING
from stereocell.read.value_scale import scaled


def settle_spacing(
    tree: Hdf5Tree, dataset: h5py.Dataset, axes: Sequence[str], described: Sequence[Described]
) -> SettledSpacing:
    """Return the spacing of a dataset and the directions of its axes, with notes.

    axes  names of the dataset's axes, slowest first
    """
    spacings = AxisSpacings(axes)
    for one in described:
        for place, axis in enumerate(axes):
            scale, step = (parts[place] if parts else None for parts in (one.scales, one.steps))
            if scale is not None:
                _add_positions(spacings, place, tree, scale, dataset.shape[place])
            if step is not None and (per := um_per(step[1])) is not None:
                spacings.add(axis, step[0] * per, f"the resolution of {one.names.place}")
    nodes: list[h5py.Group | h5py.Dataset] = [dataset, dataset.parent, dataset.file["/"]]
    for node in nodes:
        found = {name: tree.attribute(node, name) for name in ATTRIBUTES}
        trust = Trust.STATED if node is dataset else Trust.REPEATED
        spacings.add_attributes(found, str(node.name), trust)
    return spacings.settled()


def _add_positions(
    spacings: AxisSpacings, place: int, tree: Hdf5Tree, scale: h5py.Dataset, count: int
) -> None:
    """Add the positions that a one-dimensional dataset holds; other datasets are ignored."""
    if scale.ndim != 1 or scale.dtype.kind not in "iuf" or not 1 < scale.size <= MAX_POSITIONS:
        return
    attributes = {name: tree.attribute(scale, name) for name in PACKING}
    values, _ = scaled(f"{tree.where}:{scale.name}", Hdf5Array(scale, tree.where), attributes)
    positions = np.asarray(values[(slice(None),)], np.float64)
    unit = tree.attribute(scale, "units")
    text = unit if isinstance(unit, str) else ""
    spacings.add_positions(place, str(scale.name), positions, text, count)
    positive = tree.attribute(scale, "positive")
    spacings.add_sense(place, str(scale.name), positive if isinstance(positive, str) else "")
