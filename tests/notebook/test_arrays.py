"""Arrays as sources: arrays that are accepted or refused, and the reduction of a large one."""

from types import SimpleNamespace

import dask.array
import numpy as np
import pytest
import zarr

from stereocell import open_volume
from stereocell.model.errors import UsageError
from stereocell.notebook.arrays import (
    MAX_VOXELS,
    as_source,
    describe_quality,
    find_blocks,
    is_array,
    write_source,
)

SPACING = (2.0, 0.5, 0.25)


def of_xarray(data, z=(0.0, 2.0, 4.0, 6.0), units="um", **others):
    """The attributes of an xarray.DataArray that the code uses."""
    places = {
        "z": np.array(z),
        "y": 0.5 * np.arange(data.shape[-2]),
        "x": 0.25 * np.arange(data.shape[-1]),
    }
    coords = {
        axis: SimpleNamespace(data=place, attrs={"units": units}) for axis, place in places.items()
    }
    dims = tuple("czyx"[-data.ndim :])
    about = {"dims": dims, "coords": coords, "name": None, **others}
    return SimpleNamespace(data=data, shape=data.shape, dtype=data.dtype, **about)


def written(array, tmp_path, *, channels=None, spacing_um=SPACING, blocks=(1, 1, 1)):
    file = tmp_path / "array.ome.tif"
    write_source(as_source(array, spacing_um, channels), file, blocks)
    return open_volume(file)


@pytest.mark.parametrize("kind", ["numpy", "dask", "zarr", "xarray"])
def test_an_array_is_read_back_with_its_spacing_and_its_channels(tmp_path, kind):
    voxels = np.random.default_rng(0).integers(0, 4000, (2, 4, 6, 8), np.uint16)
    array = {
        "numpy": lambda: voxels,
        "dask": lambda: dask.array.from_array(voxels, chunks=(1, 2, 6, 8)),
        "zarr": lambda: zarr.array(voxels),
        "xarray": lambda: of_xarray(voxels),
    }[kind]()
    assert is_array(array)
    spacing = None if kind == "xarray" else SPACING
    dataset = written(array, tmp_path, channels=["DNA", "CD3"], spacing_um=spacing)
    assert [channel.name for channel in dataset.channels] == ["DNA", "CD3"]
    assert dataset.levels[0].spacing_um == pytest.approx(SPACING)
    for c in range(2):
        assert (dataset.read(c, dataset.levels[0].box, 0).voxels == voxels[c]).all()


def test_xarray_s_units_are_lengths_and_its_channels_have_names(tmp_path):
    array = of_xarray(np.zeros((2, 4, 6, 8), np.uint8), units="nm")
    array.coords["c"] = SimpleNamespace(data=np.array(["DNA", "CD3"]), attrs={})
    source = as_source(array, None, None)
    assert source.spacing_um == pytest.approx((0.002, 0.0005, 0.00025))
    assert source.channels == ("DNA", "CD3")


@pytest.mark.parametrize(
    ("array", "more", "message"),
    [
        (np.zeros((4, 4)), {}, r"has 2 axes \(4 x 4\), expected \(z, y, x\) or \(c, z, y, x\)"),
        (np.zeros((3, 9, 9)), {}, "3 x 9 x 9 voxels, expected at least 4 along z, y and x"),
        (np.zeros((4, 4, 4), complex), {}, "type is complex128"),
        (
            np.zeros((4, 4, 4)),
            {"spacing_um": None},
            "states no voxel spacing, expected one: pass it as spacing_um=",
        ),
        (np.zeros((4, 4, 4)), {"spacing_um": (1, 0, 1)}, "each above 0"),
        (np.zeros((4, 4, 4)), {"spacing_um": (1, 1)}, "expected z, y, x in um"),
        (np.zeros((4, 4, 4)), {"spacing_um": 2}, "spacing_um is 2, expected z, y, x in um"),
        (np.zeros((4, 4, 4)), {"spacing_um": "2,1,1"}, "expected z, y, x in um"),
        (np.zeros((2, 4, 4, 4)), {"channels": ["a"]}, "expected 2 different names"),
        (np.zeros((2, 4, 4, 4)), {"channels": ["a", "a"]}, "expected 2 different names"),
        (
            dask.array.zeros((3, 4000, 40000, 40000), dtype=np.uint16),
            {},
            r"19,200,000,000,000 voxels .* at most 1,073,741,824 .*`stereocell build",
        ),
        (
            of_xarray(np.zeros((4, 4, 4)), dims=("x", "y", "z")),
            {},
            "axes are x, y, z, expected z, y, x: transpose",
        ),
        (
            of_xarray(np.zeros((4, 4, 4)), z=(0, 1, 2, 9)),
            {"spacing_um": None},
            "along z are uneven, expected even ones: pass spacing_um",
        ),
        (
            of_xarray(np.zeros((4, 4, 4)), units="s"),
            {"spacing_um": None},
            "'s', expected a length: pass spacing_um",
        ),
    ],
)
def test_array_that_is_not_a_volume_is_refused_in_one_line(array, more, message):
    with pytest.raises(UsageError, match=message) as refused:
        as_source(array, **{"spacing_um": SPACING, "channels": None, **more})
    assert "\n" not in str(refused.value)


def test_types_that_a_build_cannot_read_are_converted(tmp_path):
    for kind, given, expected in (
        (bool, [0, 1], np.uint8),
        (np.int64, [0, 60000], np.uint16),
        (np.int32, [-5, 300], np.int16),
        (np.uint32, [0, 70000], np.float32),
        (np.float64, [0.5, 1.5], np.float32),
        (">u2", [1, 500], np.uint16),
    ):
        voxels = np.resize(np.array(given, kind), (4, 4, 4))
        dataset = written(voxels, tmp_path)
        read = dataset.read(0, dataset.levels[0].box, 0).voxels
        assert read.dtype == expected
        assert (read == voxels).all()


def test_a_large_array_is_made_coarser_as_cubes_where_that_can_be():
    source = as_source(dask.array.zeros((2, 100, 1000, 1000)), (2.0, 0.5, 0.5), None)
    z, y, x = find_blocks(source)
    assert (z, y, x) == (2, 8, 8)  # cubes of 4 um
    assert 2 * 50 * 125 * 125 <= MAX_VOXELS < 2 * 100 * 143 * 143  # those of 3.5 um were too many
    words = describe_quality(source, (z, y, x))
    assert "2 x 8 x 8" in words
    assert "200,000,000" in words
    assert find_blocks(as_source(np.zeros((50, 100, 100)), SPACING, None)) == (1, 1, 1)
    assert describe_quality(source, (1, 1, 1)) == ""
    # four voxels stay along each axis, however many channels there are
    many = as_source(dask.array.zeros((300, 4, 400, 400)), SPACING, None)
    assert find_blocks(many, most=1000) == (1, 100, 100)


def test_a_coarse_voxel_is_the_mean_of_its_block_at_the_far_side_too(tmp_path):
    voxels = np.random.default_rng(1).random((9, 10, 11)).astype(np.float32)
    dataset = written(voxels, tmp_path, blocks=(2, 3, 2))
    read = dataset.read(0, dataset.levels[0].box, 0)
    assert read.voxels.shape == (5, 4, 6)
    assert read.spacing_um == pytest.approx((4.0, 1.5, 0.5))
    assert read.voxels[1, 2, 3] == pytest.approx(voxels[2:4, 6:9, 6:8].mean(), rel=1e-5)
    assert read.voxels[4, 3, 5] == pytest.approx(voxels[8, 9, 10], rel=1e-5)
