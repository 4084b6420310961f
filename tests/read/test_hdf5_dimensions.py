"""Axes and voxel spacings of HDF5 by netCDF, NeXus, EMD, MATLAB and vigra, written by h5py."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell import read
from stereocell.model.errors import SourceError
from support.phantoms import f_phantom
from support.reading import whole

SPACING = {"z": 0.5, "y": 0.2, "x": 0.25}  # um
SIZES = dict(zip("zyx", f_phantom().shape, strict=True))


def turned(axes: str) -> NDArray[Any]:
    """Return the phantom with its axes z, y, x in another order."""
    return f_phantom().transpose(["zyx".index(axis) for axis in axes])


def positions(axis: str) -> NDArray[Any]:
    return 3.0 + SPACING[axis] * np.arange(SIZES[axis])


def write_netcdf(path: Path, axes: str, **coordinates: Any) -> Path:
    """Write the phantom as netCDF-4 does: a variable with a coordinate variable for each axis."""
    with h5py.File(path, "w") as file:
        variable = file.create_dataset("ct", data=turned(axes))
        for place, axis in enumerate(axes):
            scale = file.create_dataset(axis, data=coordinates.get(axis, positions(axis)))
            scale.attrs["units"] = "um"
            scale.make_scale(axis)
            variable.dims[place].attach_scale(scale)
    return path


def write_emd(path: Path, axes: str, units: str = "[u_m]", **names: str) -> Path:
    """Write the phantom as NCEM's EMD and tomviz do: `dim1`, `dim2`, `dim3` beside `data`."""
    with h5py.File(path, "w") as file:
        group = file.create_group("data/tomography")
        group.attrs["emd_group_type"] = 1
        group["data"] = turned(axes)
        for number, axis in enumerate(axes, start=1):
            dim = group.create_dataset(f"dim{number}", data=positions(axis))
            dim.attrs["name"] = np.bytes_(names.get(axis, axis))
            dim.attrs["units"] = np.bytes_(units)
    return path


def write_nexus(path: Path, axes: str, *, is_old: bool) -> Path:
    with h5py.File(path, "w") as file:
        group = file.create_group("entry/data")
        group["counts"] = turned(axes)
        for axis in axes:
            group.create_dataset(axis, data=positions(axis)).attrs["units"] = "micrometre"
        if is_old:
            group["counts"].attrs["axes"] = ":".join(axes)
        else:
            group.attrs["signal"] = "counts"
            group.attrs["axes"] = list(axes)
    return path


def write_vigra(path: Path, axes: str) -> Path:
    tags = [{"key": a, "resolution": SPACING[a], "description": "micrometer"} for a in axes]
    with h5py.File(path, "w") as file:
        file.create_dataset("raw", data=turned(axes)).attrs["axistags"] = json.dumps({"axes": tags})
    return path


@pytest.mark.parametrize("axes", ["zyx", "xyz", "yzx"])
@pytest.mark.parametrize("kind", ["netcdf", "emd", "nexus", "old nexus", "vigra"])
def test_axes_and_spacings_follow_each_convention(tmp_path: Path, kind: str, axes: str) -> None:
    path = tmp_path / "a.h5"
    if kind == "netcdf":
        write_netcdf(path, axes)
    elif kind == "emd":
        write_emd(path, axes)
    elif kind == "vigra":
        write_vigra(path, axes)
    else:
        write_nexus(path, axes, is_old=kind == "old nexus")
    dataset = read.open(path)
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert dataset.levels[0].spacing_um == pytest.approx(tuple(SPACING.values()))
    assert dataset.notes == (dataset.notes[0],)  # the note on the only volume of the file


@pytest.mark.parametrize("unit", ["[n_m]", "nm", "nanometers"])
def test_units_of_emd_with_a_prefix_in_brackets_are_read(tmp_path: Path, unit: str) -> None:
    dataset = read.open(write_emd(tmp_path / "a.emd", "xyz", unit))
    expected = [value / 1000 for value in SPACING.values()]
    assert dataset.levels[0].spacing_um == pytest.approx(expected)


def test_a_tilt_series_is_refused_as_projections(tmp_path: Path) -> None:
    path = write_emd(tmp_path / "a.emd", "zyx", z="angles")
    with pytest.raises(SourceError, match="angles is an angle, so these are projections"):
        read.open(path)


def test_projections_of_data_exchange_are_refused_unless_axes_are_given(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["exchange/data"] = f_phantom()
        file["exchange/theta"] = np.linspace(0, 180, len(f_phantom()))
    with pytest.raises(SourceError, match="theta is an angle, so these are projections"):
        read.open(tmp_path / "a.h5")
    dataset = read.open(tmp_path / "a.h5", axes="zyx", spacing_um=(1, 1, 1))
    np.testing.assert_array_equal(whole(dataset), f_phantom())


def test_a_movie_of_velox_is_refused_as_one_plane(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.emd", "w") as file:
        file["Data/Image/0f3a/Data"] = np.ones((40, 30, 12), np.uint16)
        file["Data/Image/0f3a/Metadata"] = np.zeros((500, 12), np.uint8)
    with pytest.raises(SourceError, match=r"found axes y, x, t.*--axes yxz reads"):
        read.open(tmp_path / "a.emd:/Data/Image/0f3a/Data")


def test_an_axis_with_descending_positions_is_reversed(tmp_path: Path) -> None:
    """The positions describe the mirror image of the volume as stored."""
    path = write_netcdf(tmp_path / "a.nc", "zyx", y=positions("y")[::-1])
    dataset = read.open(path)
    np.testing.assert_array_equal(whole(dataset), f_phantom()[:, ::-1])
    assert "positions of /y descend: that axis is reversed" in dataset.notes[1]
    assert dataset.levels[0].spacing_um == pytest.approx(tuple(SPACING.values()))


def test_positions_without_a_unit_are_named_where_the_spacing_is_missing(tmp_path: Path) -> None:
    path = write_netcdf(tmp_path / "a.nc", "zyx")
    with h5py.File(path, "a") as file:
        del file["z"].attrs["units"]
    line = r"y 0.2 um, x 0.25 um, but none along z \(positions of /z have steps of 0.5 without a"
    with pytest.raises(SourceError, match=line):
        read.open(path)


def test_uneven_positions_are_reported(tmp_path: Path) -> None:
    uneven = np.cumsum(np.where(np.arange(SIZES["z"]) < 8, 0.5, 2.0))
    dataset = read.open(write_netcdf(tmp_path / "a.nc", "zyx", z=uneven))
    (note,) = (note for note in dataset.notes if "uneven" in note)
    assert "positions of /z are uneven: found steps of 0.5 to 2 um: their mean" in note
    mean = (uneven[-1] - uneven[0]) / (SIZES["z"] - 1)
    assert dataset.levels[0].spacing_um[0] == pytest.approx(mean)


def test_rounded_positions_are_even(tmp_path: Path) -> None:
    rounded = (1e4 + positions("x")).astype(np.float32)
    dataset = read.open(write_netcdf(tmp_path / "a.nc", "zyx", x=rounded))
    assert not any("uneven" in note for note in dataset.notes)


def test_an_attribute_that_contradicts_positions_is_reported(tmp_path: Path) -> None:
    path = write_netcdf(tmp_path / "a.nc", "zyx")
    with h5py.File(path, "a") as file:
        file["ct"].attrs["element_size_um"] = (2.0, 0.2, 0.25)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(tuple(SPACING.values()))
    (note,) = (note for note in dataset.notes if "spacing" in note)
    assert note.startswith(
        "voxel spacing along z: the list of positions /z states 0.5 um, element_size_um of /ct "
        "states 2 um"
    )


def test_labels_that_contradict_the_scales_are_reported(tmp_path: Path) -> None:
    path = write_netcdf(tmp_path / "a.nc", "xyz")
    with h5py.File(path, "a") as file:
        for dim, label in zip(file["ct"].dims, "zyx", strict=True):
            dim.label = label
    dataset = read.open(path)
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert any(
        "the list of dimension scales states x, y, z, DIMENSION_LABELS states z, y, x" in note
        for note in dataset.notes
    )


@pytest.mark.parametrize("program", ["MATLAB", "Octave"])
def test_an_array_stored_by_columns_has_its_planes_first_and_its_rows_last(
    tmp_path: Path, program: str
) -> None:
    """V(y, x, z) is written with its axes reversed: z, x, y."""
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        name = "vol" if program == "MATLAB" else "vol/value"
        file[name] = turned("zxy")
        if program == "MATLAB":
            file[name].attrs["MATLAB_class"] = np.bytes_("uint16")
        else:
            file["vol"].attrs["OCTAVE_NEW_FORMAT"] = np.uint8(1)
    if program == "MATLAB":
        with path.open("r+b") as opened:
            opened.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    dataset = read.open(path, spacing_um=tuple(SPACING.values()))
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert any(f"z, x, y is assumed, since {program} stores" in note for note in dataset.notes)
    given = read.open(f"{path}:/{name}", spacing_um=(1, 1, 1), axes="zyx")
    np.testing.assert_array_equal(whole(given), turned("zxy"))
    assert not any("assumed" in note for note in given.notes)


def test_four_dimensions_of_matlab_ask_for_axes_in_its_order(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["vol"] = np.ones((2, 9, 8, 7), np.uint8)
        file["vol"].attrs["MATLAB_class"] = np.bytes_("uint8")
    with pytest.raises(SourceError, match="--axes czxy"):
        read.open(tmp_path / "a.h5")


def test_names_that_are_not_axes_are_quoted_with_the_assumption(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        made = file.create_dataset("raw", data=f_phantom())
        for dim, label in zip(made.dims, ("inline", "crossline", "twt"), strict=True):
            dim.label = label
    dataset = read.open(tmp_path / "a.h5", spacing_um=(1, 1, 1))
    assert "the names inline, crossline, twt are no axes of a volume" in dataset.notes[1]


def test_a_volume_of_minc_is_refused_with_a_remedy(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.mnc", "w") as file:
        file["minc-2.0/image/0/image"] = f_phantom()
    with pytest.raises(SourceError, match="mnc2nii"):
        read.open(tmp_path / "a.mnc")


@pytest.mark.slow
def test_factors_of_nexus_beside_a_field_are_applied(tmp_path: Path) -> None:
    path = write_nexus(tmp_path / "a.h5", "zyx", is_old=False)
    with h5py.File(path, "a") as file:
        group = file["entry/data"]
        group.attrs["NX_class"] = "NXdata"
        group["counts_scaling_factor"], group["counts_offset"] = 0.5, -10.0
    dataset = read.open(path)
    np.testing.assert_allclose(whole(dataset), (f_phantom() - 10.0) * 0.5)
    assert any("counts_scaling_factor and counts_offset are applied" in n for n in dataset.notes)
    other = write_nexus(tmp_path / "b.h5", "zyx", is_old=False)
    with h5py.File(other, "a") as file:
        file["entry/data"].attrs["NX_class"] = "NXdata"
        file["entry/data/counts_scaling_factor"] = 0.0
    with pytest.raises(SourceError, match="counts_scaling_factor: found 0, expected"):
        read.open(other)


def test_dimensions_of_emd_without_names_state_the_spacing(tmp_path: Path) -> None:
    path = write_emd(tmp_path / "a.emd", "zyx")
    with h5py.File(path, "a") as file:
        for number in (1, 2, 3):
            del file[f"data/tomography/dim{number}"].attrs["name"]
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(tuple(SPACING.values()))
    assert any("the axes have no names: z, y, x are assumed" in note for note in dataset.notes)


def test_a_resolution_that_seems_to_be_in_another_order_is_reported(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        variable = file.create_dataset("ct", data=f_phantom())
        variable.attrs.update({"resolution": [0.25, 0.25, 0.6], "units": "um"})
    dataset = read.open(tmp_path / "a.h5")
    assert dataset.levels[0].spacing_um == pytest.approx((0.25, 0.25, 0.6))
    assert any("its order may differ from that of the axes" in note for note in dataset.notes)


def test_edges_of_voxels_state_the_spacing_and_the_direction(tmp_path: Path) -> None:
    path = write_nexus(tmp_path / "a.h5", "zyx", is_old=False)
    with h5py.File(path, "a") as file:
        del file["entry/data/z"]
        edges = file["entry/data"].create_dataset("z", data=-0.5 * np.arange(SIZES["z"] + 1))
        edges.attrs["units"] = "um"
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(tuple(SPACING.values()))
    np.testing.assert_array_equal(whole(dataset), f_phantom()[::-1])


def test_each_scale_of_a_dimension_counts(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        variable = file.create_dataset("ct", data=f_phantom())
        for place, axis in enumerate("zyx"):
            for name, values in (
                (f"{axis}_index", np.arange(SIZES[axis])),
                (axis, positions(axis)),
            ):
                scale = file.create_dataset(name, data=values)
                scale.make_scale(name)
                variable.dims[place].attach_scale(scale)
            scale.attrs["units"] = "um"
    dataset = read.open(tmp_path / "a.h5")
    assert dataset.levels[0].spacing_um == pytest.approx(tuple(SPACING.values()))
