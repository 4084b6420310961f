"""Convert the numbers of an HDF5 dataset to values, by the conventions of CF and NeXus.

CF's attributes (read/value_scale.py) are attributes of the dataset. NeXus has datasets beside it:
for the field `data` they are `data_scaling_factor` and `data_offset`, before 2018 `scaling_factor`
and `offset`. A value is (stored + offset) * factor.

References: https://manual.nexusformat.org/classes/base_classes/NXdata.html
"""

from typing import Any

import h5py
import numpy as np

from stereocell.model.errors import SourceError
from stereocell.read.formats.hdf5.dimensions import dataset_beside
from stereocell.read.hdf5_file.tree import Hdf5Tree
from stereocell.read.stated_numbers import numbers_of
from stereocell.read.value_scale import ATTRIBUTES, ignored_note


def value_attributes(
    tree: Hdf5Tree, dataset: h5py.Dataset
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the attributes in value_scale.ATTRIBUTES, with NeXus factors in CF's form, and notes.

    Raises SourceError where a factor of NeXus is not a finite number.
    """
    attributes = {name: tree.attribute(dataset, name) for name in ATTRIBUTES}
    groups: dict[str, h5py.Group] = {
        str(node.name): node for node in (dataset.parent, dataset.file["/"])
    }
    ignored = [
        ignored_note(f"the group {name}", {one: tree.attribute(node, one) for one in ATTRIBUTES})
        for name, node in groups.items()
    ]
    notes = list(filter(None, ignored))
    factor, offset = (_number_beside(tree, dataset, name) for name in ("scaling_factor", "offset"))
    if factor is None and offset is None:
        return attributes, tuple(notes)
    named = " and ".join(one[0] for one in (factor, offset) if one is not None)
    if attributes["scale_factor"] is not None or attributes["add_offset"] is not None:
        notes.append(f"values: {named} of NeXus are not used, since CF's attributes are there too")
        return attributes, tuple(notes)
    slope = 1.0 if factor is None else factor[1]
    intercept = slope * (0.0 if offset is None else offset[1])
    notes.append(f"values: {named} are applied by NeXus's rule: (stored + offset) * factor")
    return {**attributes, "scale_factor": slope, "add_offset": intercept}, tuple(notes)


def _number_beside(tree: Hdf5Tree, dataset: h5py.Dataset, name: str) -> tuple[str, float] | None:
    """Return the name and the value of a NeXus number for a dataset; None: there is none."""
    group, own = dataset.parent, str(dataset.name).rpartition("/")[2]
    if not _is_nexus(tree, dataset):
        return None
    forms = [f"{own}_{name}"]
    if tree.attribute(group, "signal") in (None, own):
        forms.append(name)
    for form in forms:
        node = dataset_beside(group, form)
        if node is None or node.size != 1 or node.dtype.kind not in "iuf":
            continue
        (value,) = numbers_of(np.ravel(node[()])) or [np.nan]
        if not np.isfinite(value) or (name == "scaling_factor" and not value):
            raise SourceError(
                f"{tree.where}:{node.name}: found {value:g}, expected one finite number other "
                "than 0: correct it, or remove it to read the voxels as they are stored"
            )
        return form, value
    return None


def _is_nexus(tree: Hdf5Tree, dataset: h5py.Dataset) -> bool:
    """Return whether a dataset lies in a NeXus group that holds data."""
    kind = tree.attribute(dataset.parent, "NX_class")
    return isinstance(kind, str) and kind.strip() in ("NXdata", "NXdetector")
