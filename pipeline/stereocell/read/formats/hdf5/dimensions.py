"""Find the dimensions of an HDF5 dataset, by each convention that names them.

| convention | names | positions along a dimension |
|---|---|---|
| vigra, ilastik | `axistags` | its `resolution`, if a unit is stated beside it |
| HDF5 | `DIMENSION_LABELS` | |
| netCDF-4, xarray, HDF5's dimension scales | the scales' names, and CF's `axis` | the scales |
| NeXus | `axes` of the group or of its signal | the fields of these names |
| EMD of NCEM and tomviz | `name` of `dim1`, `dim2`, ... | `dim1`, `dim2`, ... |
| Zarr's xarray, funlib and others | `_ARRAY_DIMENSIONS`, `axis_names`, ... (read/axis_names.py) | |
| MATLAB, Octave | columns first: an array V(y, x, z) is stored as z, x, y | |
| Velox | y, x, frame | |
| Data Exchange | theta, y, x if angles lie beside the dataset | |

References: https://docs.unidata.ucar.edu/nug/, https://emdatasets.com/format/,
https://manual.nexusformat.org/classes/base_classes/NXdata.html, HDF5 Dimension Scale Specification.
"""

from dataclasses import dataclass
from typing import Any

import h5py

from stereocell.model.errors import SourceError
from stereocell.read.axis_names import NAME_LISTS, axis_of, listed_names
from stereocell.read.hdf5_file.tree import Hdf5Tree
from stereocell.read.repeats import load_json
from stereocell.read.statements import Statement, Trust

_EMD = "emd_group_type"
_MATLAB = "MATLAB_class"
_OCTAVE = "OCTAVE_NEW_FORMAT"
_VELOX = "/Data/Image/"  # FEI's EMD: a group for each image, with Data (y, x, frame) and Metadata
_MINC = "/minc-2.0/image/"
_BY_COLUMNS = ("z", "x", "y")


@dataclass(frozen=True, slots=True)
class Described:
    """The dimensions of a dataset by one convention.

    names  names of the dimensions, slowest first, with their place in the file
    scales the dataset of positions along each dimension; None: there is none
    steps  the length of a voxel along each dimension and its unit; None: not stated
    """

    names: Statement
    scales: tuple[h5py.Dataset | None, ...] = ()
    steps: tuple[tuple[float, str] | None, ...] = ()


def describe(tree: Hdf5Tree, dataset: h5py.Dataset) -> list[Described]:
    """Return the dimensions by each convention that the file follows, the best known first."""
    found = [
        _vigra(tree, dataset),
        *_scales(tree, dataset),
        _labels(tree, dataset),
        _nexus(tree, dataset),
        _emd(tree, dataset),
        *_listed(tree, dataset),
        _velox(dataset),
        _projections(dataset),
        _by_columns(dataset),
    ]
    return [one for one in found if one is not None]


def _vigra(tree: Hdf5Tree, dataset: h5py.Dataset) -> Described | None:
    tags = tree.attribute(dataset, "axistags")
    if not isinstance(tags, str):
        return None
    try:
        axes: list[dict[str, Any]] = load_json(tags, "axistags")["axes"]
        names = tuple(str(axis["key"]) for axis in axes)
        steps = tuple(
            (float(axis.get("resolution") or 0), str(axis.get("description", ""))) for axis in axes
        )
    except (ValueError, LookupError, TypeError, AttributeError):
        return None
    if len(names) != dataset.ndim:
        return None
    return Described(
        Statement(names, "axistags"), steps=tuple(one if one[0] > 0 else None for one in steps)
    )


def _labels(tree: Hdf5Tree, dataset: h5py.Dataset) -> Described | None:
    labels = tree.texts(dataset, "DIMENSION_LABELS")
    if not any(labels):
        return None
    return Described(Statement(labels, "DIMENSION_LABELS"))


def _scales(tree: Hdf5Tree, dataset: h5py.Dataset) -> list[Described]:
    """Return the dimensions as the first scale of each describes them, then as further ones do."""
    scales = tree.scales(dataset)
    if not any(scales) or len(scales) != dataset.ndim:
        return []
    every = [
        tuple(nodes[rank] if rank < len(nodes) else None for nodes in scales)
        for rank in range(max(map(len, scales)))
    ]
    names = tuple("" if node is None else _scale_name(tree, node) for node in every[0])
    stated = Statement(names, "the list of dimension scales")
    return [Described(stated, nodes) for nodes in every]


def _scale_name(tree: Hdf5Tree, scale: h5py.Dataset) -> str:
    """Return the axis of a scale: CF's `axis`, else its name in the file, else its title."""
    axis = tree.attribute(scale, "axis")
    if isinstance(axis, str) and axis.strip().lower() in tuple("tzyx"):
        return axis.strip()
    name = str(scale.name).rpartition("/")[2]
    if len(axis_of(name)) == 1:
        return name
    title = tree.attribute(scale, "NAME")
    return title if isinstance(title, str) and len(axis_of(title)) == 1 else name


def _nexus(tree: Hdf5Tree, dataset: h5py.Dataset) -> Described | None:
    group, own = dataset.parent, str(dataset.name).rpartition("/")[2]
    named, place = tree.texts(dataset, "axes"), f"axes of {dataset.name}"
    if not named and tree.attribute(group, "signal") in (None, own):
        named, place = tree.texts(group, "axes"), f"axes of {group.name}"
    if len(named) == 1:  # one text for all axes: NeXus before 2014, and some writers
        named = tuple(named[0].strip("[] ").replace(",", ":").split(":"))
    if len(named) != dataset.ndim:
        return None
    scales = tuple(dataset_beside(group, name.strip()) for name in named)
    return Described(Statement(tuple(name.strip() for name in named), place), scales)


def _emd(tree: Hdf5Tree, dataset: h5py.Dataset) -> Described | None:
    group = dataset.parent
    if _EMD not in group.attrs and "dim1" not in group:
        return None
    scales = tuple(dataset_beside(group, f"dim{index + 1}") for index in range(dataset.ndim))
    if any(one is None for one in scales):
        return None
    stated = [tree.attribute(one, "name") for one in scales if one is not None]
    names = tuple(name if isinstance(name, str) else "" for name in stated)
    return Described(Statement(names, f"the list of names dim1 to dim{dataset.ndim}"), scales)


def _listed(tree: Hdf5Tree, dataset: h5py.Dataset) -> list[Described]:
    """Return the dimensions by each attribute that lists names of axes."""
    found = []
    for name in NAME_LISTS:
        texts = tree.texts(dataset, name) if name in dataset.attrs else ()
        names = listed_names(texts, dataset.ndim)
        # A list of texts in `axes` is NeXus and has positions: _nexus reads it.
        if names and not (name == "axes" and len(texts) == dataset.ndim):
            found.append(Described(Statement(names, name)))
    return found


def _velox(dataset: h5py.Dataset) -> Described | None:
    is_velox = str(dataset.name).startswith(_VELOX) and "Metadata" in dataset.parent
    if not is_velox or dataset.ndim != 3:
        return None
    return Described(Statement(("y", "x", "t"), "the convention of Velox"))


def _projections(dataset: h5py.Dataset) -> Described | None:
    """Return the axes of projections, which Data Exchange stores beside their angles."""
    angles = dataset_beside(dataset.parent, "theta")
    if angles is None or dataset.ndim != 3 or angles.shape != dataset.shape[:1]:
        return None
    return Described(Statement(("theta", "y", "x"), "theta of Data Exchange"))


def _by_columns(dataset: h5py.Dataset) -> Described | None:
    """Return the order of a file of MATLAB or Octave, whose arrays are rows, columns, planes."""
    program = "MATLAB" if _MATLAB in dataset.attrs else ""
    if _OCTAVE in dataset.parent.attrs:
        program = "Octave"
    if not program:
        return None
    long = [place for place, size in enumerate(dataset.shape) if size > 1]
    names: tuple[str, ...] = _BY_COLUMNS
    if len(long) == len(_BY_COLUMNS):
        order = dict(zip(long, _BY_COLUMNS, strict=True))
        names = tuple(order.get(place, "_") for place in range(dataset.ndim))
    reason = f"since {program} stores an array of rows, columns and planes, V(y, x, z)"
    return Described(Statement(names, reason, Trust.ASSUMED))


def dataset_beside(group: h5py.Group, name: str) -> h5py.Dataset | None:
    """Return a dataset of a group by its name; None: the file itself holds none."""
    if not name or "/" in name or not isinstance(group.get(name, getlink=True), h5py.HardLink):
        return None
    node = group[name]
    return node if isinstance(node, h5py.Dataset) else None


def require_plain(where: str, dataset: h5py.Dataset) -> None:
    """Raise SourceError for a dataset of MINC, whose planes are scaled one by one."""
    if str(dataset.name).startswith(_MINC):
        raise SourceError(
            f"{where}: found a volume of MINC, whose planes each have their own scale, expected "
            "another format: convert it to NIfTI with `mnc2nii IN.mnc OUT.nii`"
        )
