"""Positions beside a Zarr array, in the layout of xarray, written by zarr-python."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from numpy.typing import NDArray

from stereocell import read
from stereocell.model.errors import SourceError
from support.phantoms import f_phantom
from support.reading import whole

SPACING = {"z": 0.5, "y": 0.2, "x": 0.25}  # um
SIZES = dict(zip("zyx", f_phantom().shape, strict=True))


def positions(axis: str) -> NDArray[Any]:
    return 3.0 + SPACING[axis] * np.arange(SIZES[axis])


def write(path: Path, version: Any = 2, voxels: Any = None, group: str = "", **about: Any) -> Path:
    """Write an array `ct` in a group, and the positions of z, y and x in the root.

    about  attributes of `ct`, and positions along an axis by its letter
    """
    body = f_phantom() if voxels is None else voxels
    lists = {axis: about.pop(axis, positions(axis)) for axis in "zyx"}
    unit, dims = about.pop("unit", "um"), about.pop("dims", "zyx")
    root = zarr.open_group(path, mode="w", zarr_format=version)
    _write(root, f"{group}/ct".lstrip("/"), body, dims).attrs.update(about)
    for name, values in zip(dims, lists.values(), strict=True):
        beside = _write(root, name, values, name)
        if unit:
            beside.attrs["units"] = unit
    return path


def _write(group: zarr.Group, name: str, voxels: NDArray[Any], dims: str) -> Any:
    is_v3 = group.metadata.zarr_format == 3
    named: dict[str, Any] = {"dimension_names": list(dims)} if is_v3 else {}
    array = group.create_array(
        name, shape=voxels.shape, dtype=voxels.dtype, chunks=(9,) * voxels.ndim, **named
    )
    array[...] = voxels
    if not is_v3:
        array.attrs["_ARRAY_DIMENSIONS"] = list(dims)
    return array


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("given", [None, (1.0, 1.0, 1.0)])
def test_an_axis_whose_positions_descend_is_reversed(
    tmp_path: Path, version: int, given: Any
) -> None:
    path = write(tmp_path / "a.zarr", version, f_phantom()[:, ::-1], y=positions("y")[::-1])
    dataset = read.open(path, spacing_um=given)
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert dataset.levels[0].spacing_um == pytest.approx(given or tuple(SPACING.values()))
    assert any("positions of y descend" in note for note in dataset.notes)


@pytest.mark.parametrize("group", ["", "scans/first"])
@pytest.mark.parametrize("source", ["a.zarr", "a.zarr/ct"])
def test_positions_lie_in_a_group_around_the_array(tmp_path: Path, group: str, source: str) -> None:
    write(tmp_path / "a.zarr", group=group)
    if group and source != "a.zarr":
        return  # positions in a group two levels above a named array are out of reach
    dataset = read.open(tmp_path / source)
    assert dataset.levels[0].spacing_um == pytest.approx(tuple(SPACING.values()))


def test_positions_take_precedence_over_attributes(tmp_path: Path) -> None:
    path = write(tmp_path / "a.zarr", resolution=[1, 0.2, 0.25], units="um")
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(tuple(SPACING.values()))
    (note,) = [note for note in dataset.notes if "spacing along" in note]
    assert "list of positions z states 0.5 um, resolution of the array states 1 um" in note


@pytest.mark.slow
def test_uneven_and_unordered_positions_are_noted(tmp_path: Path) -> None:
    uneven = positions("z")
    uneven[8:] += 5
    dataset = read.open(write(tmp_path / "a.zarr", z=uneven))
    assert any("positions of z are uneven: found steps of 0.5 to 5.5" in n for n in dataset.notes)
    shuffled = positions("z")[[1, 0, *range(2, SIZES["z"])]]
    dataset = read.open(write(tmp_path / "b.zarr", z=shuffled), spacing_um=(1, 1, 1))
    assert any("positions of z neither rise nor fall" in note for note in dataset.notes)


def test_a_missing_unit_of_positions_is_reported_with_their_steps(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match=r"positions of z have steps of 0\.5 without a unit"):
        read.open(write(tmp_path / "a.zarr", unit=""))


def test_an_axis_attribute_of_positions_names_the_axis(tmp_path: Path) -> None:
    path = write(tmp_path / "a.zarr", voxels=f_phantom().transpose(2, 1, 0), dims="abc",
                 z=positions("x"), x=positions("z"))  # fmt: skip
    for name, axis in zip("abc", "XYZ", strict=True):
        zarr.open_array(path / name, mode="a").attrs["axis"] = axis
    dataset = read.open(path)
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert dataset.levels[0].spacing_um == pytest.approx(tuple(SPACING.values()))


def test_factors_of_a_group_are_noted_and_not_applied(tmp_path: Path) -> None:
    path = write(tmp_path / "a.zarr")
    zarr.open_group(path, mode="a").attrs["scale_factor"] = 2.0
    dataset = read.open(path)
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert any("scale_factor 2.0 of the group a.zarr are not applied" in n for n in dataset.notes)


def test_a_fill_value_written_as_text_marks_gaps(tmp_path: Path) -> None:
    voxels = f_phantom().astype("i2") + 10
    voxels[:, :4] = -9999
    dataset = read.open(write(tmp_path / "a.zarr", voxels=voxels, _FillValue="-9999"))
    assert np.isnan(dataset.arrays[0].array[0, 0, 0])
    dataset = read.open(write(tmp_path / "b.zarr", voxels=voxels, missing_value="none"))
    assert any("missing_value is 'none', which is not a number" in note for note in dataset.notes)
    np.testing.assert_array_equal(whole(dataset), voxels)


def test_positions_beside_an_image_of_ome_zarr_are_compared_with_its_scale(tmp_path: Path) -> None:
    um = tuple(SPACING.values())
    path = write(tmp_path / "a.zarr", y=positions("y")[::-1], z=positions("z") * 2)
    axes = [{"name": axis, "type": "space", "unit": "micrometer"} for axis in "zyx"]
    scale = [{"type": "scale", "scale": um}]
    image = {
        "version": "0.4",
        "axes": axes,
        "datasets": [{"path": "ct", "coordinateTransformations": scale}],
    }
    zarr.open_group(path, mode="a").attrs["multiscales"] = [image]
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx(um)
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    joined = "; ".join(dataset.notes)
    assert "along z: scale states 0.5 um, the list of positions z states 1 um: scale is" in joined
    assert "positions of y beside the image descend" in joined
    write(tmp_path / "b.zarr")
    zarr.open_group(tmp_path / "b.zarr", mode="a").attrs["multiscales"] = [image]
    assert read.open(tmp_path / "b.zarr").notes == ()
