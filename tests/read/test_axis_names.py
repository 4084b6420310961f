"""Names of axes in HDF5, Zarr and N5, in each attribute and word that writers use."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import zarr

from stereocell import read
from stereocell.model.errors import SourceError
from support.array_files import write_n5
from support.dicom_reading import whole
from support.phantoms import f_phantom

SPACING = {"z": 0.5, "y": 0.2, "x": 0.25}  # um
ASSUMED = "assumed"


def turned(axes: str) -> Any:
    """Return the phantom with its axes z, y, x in another order."""
    return np.ascontiguousarray(f_phantom().transpose(["zyx".index(axis) for axis in axes]))


def write_hdf5(path: Path, order: str, **attributes: Any) -> Path:
    with h5py.File(path, "w") as file:
        attrs = file.create_dataset("raw", data=turned(order)).attrs
        attrs["voxel_size"], attrs["units"] = [SPACING[axis] for axis in order], "um"
        for name, value in attributes.items():
            attrs[name] = value
    return path


def write_zarr(path: Path, order: str, **attributes: Any) -> Path:
    own: Any = {"voxel_size": [SPACING[axis] for axis in order], "units": ["um"], **attributes}
    zarr.create_array(path, data=turned(order), chunks=(16, 16, 16), attributes=own)
    return path


def write_netcdf(path: Path, scales: dict[str, dict[str, Any]], axes: str) -> Path:
    """Write the phantom with a dimension scale for each axis, as netCDF-4 does.

    scales  attributes of the scales by their names, in the order of the axes
    """
    with h5py.File(path, "w") as file:
        variable = file.create_dataset("ct", data=turned(axes))
        for place, (name, attributes) in enumerate(scales.items()):
            steps = SPACING[axes[place]] * np.arange(variable.shape[place])
            scale = file.create_dataset(name, data=steps)
            for field, text in attributes.items():
                scale.attrs.create(field, [text], dtype=h5py.string_dtype())  # NC_STRING
            scale.make_scale(name)
            variable.dims[place].attach_scale(scale)
    return path


def require_phantom(dataset: read.Dataset) -> None:
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert dataset.levels[0].spacing_um == pytest.approx(tuple(SPACING.values()))
    assert not [note for note in dataset.notes if ASSUMED in note]


@pytest.mark.parametrize("unit", ["\u00b5m", "um"])
def test_texts_that_netcdf_stores_as_arrays_of_one_are_read(tmp_path: Path, unit: str) -> None:
    scales = {
        name: {"units": unit, "axis": axis}
        for name, axis in zip("abc", ("X", "Y", "Z"), strict=True)
    }
    require_phantom(read.open(write_netcdf(tmp_path / "a.nc", scales, "xyz")))


def test_a_depth_that_counts_downwards_is_noted(tmp_path: Path) -> None:
    scales = {"depth": {"units": "um", "positive": "down"}, "y": {"units": "um"}}
    scales["x"] = {"units": "um", "positive": "down"}
    hdf5 = read.open(write_netcdf(tmp_path / "a.nc", scales, "zyx"))
    group = zarr.open_group(tmp_path / "a.zarr", mode="w")
    write_zarr(tmp_path / "a.zarr" / "ct", "zyx", _ARRAY_DIMENSIONS=list(scales))
    steps = SPACING["z"] * np.arange(len(f_phantom()))
    group.create_array("depth", data=steps, attributes=scales["depth"])
    for dataset in (hdf5, read.open(tmp_path / "a.zarr" / "ct")):
        require_phantom(dataset)
        (note,) = [note for note in dataset.notes if "count downwards" in note]
        assert "a mirror image where y points north" in note


@pytest.mark.parametrize("kind", ["array of one", "one for each axis", "bytes"])
def test_units_of_an_hdf5_dataset_may_be_one_text_or_one_for_each_axis(
    tmp_path: Path, kind: str
) -> None:
    text = h5py.string_dtype()
    units = {
        "array of one": np.array(["um"], dtype=text),
        "one for each axis": np.array(["um"] * 3, dtype=text),
        "bytes": np.array([b"um"] * 3),
    }
    path = write_hdf5(tmp_path / "a.h5", "zyx", units=units[kind], axis_names=list("zyx"))
    require_phantom(read.open(path))


@pytest.mark.parametrize(
    "names",
    [("width", "height", "depth"), ("lon", "lat", "lev"), ("lon", "lat", "height"),
     ("cols", "rows", "slices")],
)  # fmt: skip
@pytest.mark.parametrize("kind", ["hdf5", "zarr"])
def test_words_of_photography_and_earth_science_name_axes(
    tmp_path: Path, kind: str, names: tuple[str, ...]
) -> None:
    if kind == "hdf5":
        scales = {name: {"units": "um"} for name in names}
        require_phantom(read.open(write_netcdf(tmp_path / "a.nc", scales, "xyz")))
    else:
        path = write_zarr(tmp_path / "a.zarr", "xyz", _ARRAY_DIMENSIONS=list(names))
        require_phantom(read.open(path))


@pytest.mark.parametrize(
    ("field", "value"),
    [("axis_names", list("xyz")), ("axis_labels", list("XYZ")), ("axisLabels", list("xyz")),
     ("axes", "xyz"), ("axis_order", "x, y, z"), ("dims", "['x', 'y', 'z']")],
)  # fmt: skip
@pytest.mark.parametrize("kind", ["hdf5", "zarr"])
def test_attributes_that_name_the_axes_are_read(
    tmp_path: Path, kind: str, field: str, value: Any
) -> None:
    write = write_hdf5 if kind == "hdf5" else write_zarr
    path = write(tmp_path / ("a.h5" if kind == "hdf5" else "a.zarr"), "xyz", **{field: value})
    require_phantom(read.open(path))


def test_names_on_the_group_around_a_zarr_array_count(tmp_path: Path) -> None:
    zarr.open_group(tmp_path / "g.zarr", mode="w", attributes={"axis_names": list("xyz")})
    write_zarr(tmp_path / "g.zarr" / "raw", "xyz")
    require_phantom(read.open(tmp_path / "g.zarr" / "raw"))


def test_names_of_axes_that_python_writes_into_n5_are_slowest_first(tmp_path: Path) -> None:
    path = tmp_path / "a.n5"
    write_n5(path, turned("xyz"), axis_names=list("xyz"), resolution=[0.5, 0.2, 0.25], units="um")
    require_phantom(read.open(path))


def test_axes_that_funlib_marks_as_not_spatial_are_channels(tmp_path: Path) -> None:
    zarr.create_array(
        tmp_path / "a.zarr", data=np.stack([f_phantom(), f_phantom() + 1]), chunks=(1, 16, 16, 16),
        zarr_format=2, attributes={
            "axis_names": ["c^", "z", "y", "x"], "units": ["nm"] * 3,
            "voxel_size": [1000 * size for size in SPACING.values()], "offset": [0, 0, 0],
        },
    )  # fmt: skip
    dataset = read.open(tmp_path / "a.zarr")
    require_phantom(dataset)
    assert len(dataset.channels) == 2


@pytest.mark.parametrize("kind", ["hdf5", "zarr"])
def test_a_name_that_means_an_axis_keeps_it_beside_others(tmp_path: Path, kind: str) -> None:
    """The depth is the last dimension; the names of the others mean no axes."""
    names = ["Alpha", "Beta", "depth"]
    if kind == "hdf5":
        path = write_netcdf(tmp_path / "a.nc", {name: {"units": "um"} for name in names}, "yxz")
    else:
        path = write_zarr(tmp_path / "a.zarr", "yxz", axis_names=names)
    dataset = read.open(path)
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    (note,) = [note for note in dataset.notes if ASSUMED in note]
    assert "names Alpha, Beta, depth are not all axes of a volume: y, x are assumed" in note


def test_names_that_leave_more_than_one_choice_ask_for_the_axes(tmp_path: Path) -> None:
    path = write_zarr(tmp_path / "a.zarr", "zyx", axis_names=["x", "x", "depth"])
    with pytest.raises(SourceError, match=r"the names x, x, depth, expected three, .* --axes"):
        read.open(path)
