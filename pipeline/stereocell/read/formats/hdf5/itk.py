"""Read an image that ITK or SimpleITK wrote as HDF5: `/ITKImage/0/VoxelData` and its fields.

`Spacing`, `Origin` and `Directions` place it in the patient, as in MetaImage: in LPS, fastest axis
first, a row of `Directions` for each axis. ITK states no unit; its lengths are mm by convention.

References: ITK's HDF5ImageIO, https://docs.itk.org/
"""

from dataclasses import replace

import h5py
import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.read.formats.hdf5.dimensions import dataset_beside
from stereocell.read.hdf5_file.tree import Hdf5Array, Hdf5Tree
from stereocell.read.image import MAX_CHANNELS, Image
from stereocell.read.patient_grid import place
from stereocell.read.plausible_size import size_notes
from stereocell.read.statements import Statement, Subject, Trust, settle

NAME = "ITK"
_VOXELS = "VoxelData"
_AXES = {3: ("k", "j", "i"), 4: ("t", "k", "j", "i")}
_UNIT = Subject("unit of length", remedy="--spacing-um z,y,x replaces it")


def is_of_itk(dataset: h5py.Dataset) -> bool:
    """Return whether a dataset holds the voxels of an image by ITK."""
    is_named = str(dataset.name).rpartition("/")[2] == _VOXELS
    return is_named and dataset_beside(dataset.parent, "Directions") is not None


def itk_image(tree: Hdf5Tree, dataset: h5py.Dataset, notes: tuple[str, ...]) -> Image:
    """Return the image of a dataset by ITK. `notes` come first. Raises SourceError."""
    where = f"{tree.where}:{dataset.name}"
    sizes = _numbers(tree, dataset, "Dimension")
    rank = len(sizes)
    axes = _AXES.get(rank)
    if axes is None or dataset.shape[:rank] != tuple(int(n) for n in reversed(sizes)):
        raise SourceError(
            f"{where}: found voxels {dataset.shape} and Dimension {sizes.tolist()}, expected the "
            "same three or four sizes, slowest and fastest first"
        )
    if dataset.ndim == rank + 1:
        axes = (*axes, "c")
    if dataset.ndim != len(axes) or (len(axes) > rank and dataset.shape[-1] > MAX_CHANNELS):
        raise SourceError(
            f"{where}: found an array of shape {dataset.shape} for an image of {rank} dimensions, "
            f"expected {rank} axes, or one more with at most {MAX_CHANNELS} channels"
        )
    affine = _affine(tree, dataset, rank)
    unit = settle(_UNIT, [Statement("mm", "as in files of ITK", Trust.ASSUMED)]).notes
    lengths = np.linalg.norm(affine[:3, :3], axis=0).tolist()
    all_notes = (*notes, *unit, *size_notes(lengths, [int(n) for n in sizes[:3]]))
    stored = Hdf5Array(dataset, where)
    image = place(where, stored, axes, affine, "Directions").image(
        NAME, notes=all_notes, has_sides=True
    )
    return replace(image, close=tree.close, files=tree.files)


def _affine(tree: Hdf5Tree, dataset: h5py.Dataset, rank: int) -> NDArray[np.float64]:
    """Return the affine (4, 4) from voxels to LPS in mm."""
    spacing, origin = (_numbers(tree, dataset, name) for name in ("Spacing", "Origin"))
    directions = _numbers(tree, dataset, "Directions")
    for name, found, count in (
        ("Spacing", spacing, rank), ("Origin", origin, rank), ("Directions", directions, rank**2)
    ):  # fmt: skip
        if found.size != count:
            raise SourceError(
                f"{tree.where}:{dataset.parent.name}/{name}: found {found.size} numbers, expected "
                f"{count}"
            )
    affine = np.eye(4)
    affine[:3, :3] = directions.reshape(rank, rank)[:3, :3].T * spacing[:3]
    affine[:3, 3] = origin[:3]
    return affine


def _numbers(tree: Hdf5Tree, dataset: h5py.Dataset, name: str) -> NDArray[np.float64]:
    """Return the numbers of a dataset beside the voxels; empty: there is no such dataset."""
    node = dataset_beside(dataset.parent, name)
    if node is None or node.dtype.kind not in "iuf" or node.size > 16:
        return np.zeros(0)
    return np.ravel(np.asarray(Hdf5Array(node, tree.where)[()], np.float64))
