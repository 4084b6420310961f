"""The levels of an array that fits into memory."""

import numpy as np
import pytest

from stereocell.isosurface.array_levels import find_array_levels
from stereocell.model.volume import Volume


@pytest.mark.parametrize("axis", [1, 2])
def test_levels_do_not_depend_on_the_axis_across_which_the_slices_lie(axis: int) -> None:
    """A head's bone in slices four times as far apart as pixels, along each axis in turn."""
    z, y, x = np.mgrid[:14, :64, :60] - np.array([6.5, 31.5, 29.5])[:, None, None, None]
    radius = np.sqrt((4 * z) ** 2 + y**2 + x**2)
    clean = np.where(radius < 26, 40, -1000) + 900 * (abs(radius - 24) < 1.5)
    voxels = (clean + np.random.default_rng(0).normal(0, 20, clean.shape)).astype(np.float32)
    expected = find_array_levels(Volume(voxels, (4.0, 1.0, 1.0)), modality="CT")
    spacing = [1.0, 1.0, 1.0]
    spacing[axis] = 4.0
    z_step, y_step, x_step = spacing
    turned = np.moveaxis(voxels, 0, axis)
    found = find_array_levels(Volume(turned, (z_step, y_step, x_step)), modality="CT")
    assert [level.value for level in found.levels.clear] == [
        level.value for level in expected.levels.clear
    ]
    assert len(found.levels.clear) == 2
    np.testing.assert_array_equal(found.field, np.moveaxis(expected.field, 0, axis))
