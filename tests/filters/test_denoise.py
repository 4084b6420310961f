"""The median against SciPy's, and what it is for."""

from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from stereocell.filters.denoise import denoise, median_in_plane
from stereocell.model.volume import Volume


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_median_is_scipy_s(dtype: Any) -> None:
    voxels = np.random.default_rng(0).integers(0, 250, (5, 17, 23)).astype(dtype)
    found = median_in_plane(voxels)
    assert found.dtype == dtype
    np.testing.assert_array_equal(found, ndimage.median_filter(voxels, (1, 3, 3), mode="nearest"))


def test_hot_voxel_leaves_no_trace_and_a_body_stays() -> None:
    voxels = np.full((9, 20, 20), 100, np.uint16)
    voxels[2:7, 5:15, 5:15] = 200
    clean = denoise(Volume(voxels, (1.0, 1.0, 1.0)), 1.0)
    voxels[4, 2, 2] = 60_000
    hot = denoise(Volume(voxels, (1.0, 1.0, 1.0)), 1.0)
    np.testing.assert_array_equal(hot, clean)
    assert clean[4, 10, 10] == pytest.approx(200, abs=3)
