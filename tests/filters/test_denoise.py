"""The median and the Gaussian, compared with SciPy's, and the purpose of each."""

from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from stereocell.filters.denoise import denoise, smooth
from stereocell.model.volume import Volume


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int32, np.float32])
@pytest.mark.parametrize("shape", [(5, 17, 23), (1, 2, 9), (3, 1, 1)])
def test_the_median_equals_that_of_scipy(dtype: Any, shape: tuple[int, int, int]) -> None:
    voxels = np.random.default_rng(0).integers(0, 250, shape).astype(dtype)
    found = denoise(Volume(voxels, (1.0, 1.0, 1.0)), 0.0)
    wanted = ndimage.median_filter(voxels, (1, 3, 3), mode="nearest")
    np.testing.assert_array_equal(found, wanted.astype(np.float32))


@pytest.mark.parametrize("axis", range(3))
def test_denoising_follows_the_plane_of_the_images(axis: int) -> None:
    voxels = np.random.default_rng(0).integers(0, 60_000, (9, 14, 11)).astype(np.uint16)
    spacing, size = [1.0, 1.0, 1.0], [3, 3, 3]
    spacing[axis], size[axis] = 5.0, 1
    found = denoise(Volume(voxels, tuple(spacing), slice_axis=axis), 1.0)
    median = ndimage.median_filter(voxels.astype(np.float64), size, mode="nearest")
    wanted = ndimage.gaussian_filter(median, 1 / np.array(spacing), mode="nearest", truncate=4.0)
    np.testing.assert_allclose(found, wanted, rtol=1e-6)
    assert found.flags.c_contiguous


@pytest.mark.parametrize("shape", [(5, 17, 23), (3, 2, 9), (1, 5, 2), (3, 1, 1), (2, 6, 1)])
@pytest.mark.parametrize("sigma_um", [0.0, 1.0])
def test_no_value_changes_by_more_than_the_limit(
    shape: tuple[int, int, int], sigma_um: float
) -> None:
    voxels = np.random.default_rng(0).integers(0, 250, shape).astype(np.float64)
    others = np.ones((3, 3, 3), bool)
    others[:, 1, 1] = False
    low = ndimage.minimum_filter(voxels, footprint=others, mode="mirror")
    high = ndimage.maximum_filter(voxels, footprint=others, mode="mirror")
    measured = np.clip(voxels, low, high)
    median = ndimage.median_filter(voxels, (1, 3, 3), mode="nearest")
    smooth = ndimage.gaussian_filter(median, sigma_um, mode="nearest", truncate=4.0)
    wanted = np.clip(smooth, measured - 20.0, measured + 20.0)
    found = denoise(Volume(voxels.astype(np.uint8), (1.0, 1.0, 1.0)), sigma_um, 20.0)
    np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-4)


@pytest.mark.parametrize("max_shift", [None, 0.0])
@pytest.mark.parametrize("place", [(4, 10, 10), (4, 0, 0), (4, 0, 9), (4, 19, 19)])
def test_one_hot_voxel_is_removed_at_any_place_and_with_any_limit(
    place: tuple[int, int, int], max_shift: float | None
) -> None:
    voxels = np.full((9, 20, 20), 100, np.uint16)
    voxels[place] = 60_000
    found = denoise(Volume(voxels, (1.0, 1.0, 1.0)), 1.0, max_shift)
    np.testing.assert_array_equal(found, np.full(voxels.shape, 100, np.float32))


@pytest.mark.parametrize("axis", range(3))
def test_a_camera_s_hot_pixel_is_removed_from_all_planes(axis: int) -> None:
    voxels = np.full((20, 20, 20), 100, np.uint16)
    np.moveaxis(voxels, axis, 0)[:, 8, 9] = 60_000
    found = denoise(Volume(voxels, (1.0, 1.0, 1.0), slice_axis=axis), 1.0, 0.0)
    np.testing.assert_array_equal(found, np.full(voxels.shape, 100, np.float32))


@pytest.mark.parametrize("slope", [-1, 1])
def test_a_bar_of_one_voxel_that_leans_against_the_planes_stays(slope: int) -> None:
    """The bar has no neighbours of its own brightness in the plane."""
    voxels = np.full((20, 20, 20), 100, np.uint16)
    for z in range(4, 16):
        voxels[z, 4 + z // 2, 10 + slope * (z - 10)] = 1100
    is_bar = voxels > 600
    is_bar[[4, 15]] = False  # ends of the bar
    found = denoise(Volume(voxels, (1.0, 1.0, 1.0)), 1.0, 1.0)
    assert (found[is_bar] > 1098).all()
    assert (found > 600).sum() <= 12


def test_no_median_reaches_across_a_coarse_axis_of_the_plane() -> None:
    voxels = np.random.default_rng(0).integers(0, 250, (5, 9, 8)).astype(np.uint8)
    found = denoise(Volume(voxels, (9.0, 3.0, 1.0)), 0.0)
    np.testing.assert_array_equal(found, voxels)


@pytest.mark.parametrize("shape", [(11, 17, 23), (2, 3, 40), (1, 1, 1)])
@pytest.mark.parametrize("sigma_um", [0.1, 0.28, 1.1])
def test_the_gaussian_equals_that_of_scipy(shape: tuple[int, int, int], sigma_um: float) -> None:
    """Results are equal up to the last digits of float32, because sums run in another order."""
    spacing = (0.56, 0.28, 0.14)
    voxels = np.random.default_rng(0).integers(0, 60_000, shape).astype(np.uint16)
    wanted = ndimage.gaussian_filter(
        voxels.astype(np.float64), sigma_um / np.array(spacing), mode="nearest", truncate=4.0
    )
    found = smooth(Volume(voxels, spacing), sigma_um)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, wanted, rtol=1e-6)


def test_an_even_volume_and_the_argument_do_not_change() -> None:
    voxels = np.full((6, 7, 8), 700.3, np.float32)
    np.testing.assert_array_equal(denoise(Volume(voxels, (0.28, 0.14, 0.14)), 0.3), voxels)
    noise = np.random.default_rng(0).random((6, 7, 8)).astype(np.float32)
    before = noise.copy()
    denoise(Volume(noise, (0.28, 0.14, 0.14)), 0.3)
    np.testing.assert_array_equal(noise, before)


@pytest.mark.parametrize("max_shift", [None, 500.0])
def test_each_result_depends_only_on_the_voxel_s_neighbours(max_shift: float | None) -> None:
    """Results are equal bit by bit, because neighbouring tiles read different windows."""
    voxels = np.random.default_rng(0).integers(0, 60_000, (20, 40, 50)).astype(np.uint16)
    spacing = (0.28, 0.14, 0.14)
    whole = denoise(Volume(voxels, spacing), 0.2, max_shift)
    part = denoise(Volume(voxels[3:17, 5:33, 7:48], spacing), 0.2, max_shift)
    np.testing.assert_array_equal(part[4:-4, 8:-8, 8:-8], whole[7:13, 13:25, 15:40])


def test_a_hot_voxel_leaves_no_trace_and_a_body_stays() -> None:
    voxels = np.full((9, 20, 20), 100, np.uint16)
    voxels[2:7, 5:15, 5:15] = 200
    clean = denoise(Volume(voxels, (1.0, 1.0, 1.0)), 1.0)
    voxels[4, 2, 2] = 60_000
    hot = denoise(Volume(voxels, (1.0, 1.0, 1.0)), 1.0)
    np.testing.assert_array_equal(hot, clean)
    assert clean[4, 10, 10] == pytest.approx(200, abs=3)
