"""The axis across which images lie, and arrays turned so that it comes first."""

import numpy as np
import pytest

from stereocell.model.image_plane import (
    back_of_three,
    find_slice_axis,
    first_of_three,
    in_order,
    slices_back,
    slices_first,
)


@pytest.mark.parametrize(
    ("stated", "spacing_um", "axis"),
    [
        (0, (1.0, 1.0, 1.0), 0),
        (2, (1.0, 1.0, 1.0), 2),
        (0, (5.0, 1.0, 1.0), 0),
        (1, (1.0, 5.0, 1.0), 1),
        (0, (1.0, 5.0, 1.0), 1),  # resampled along other axes than the scanner's
        (0, (1.0, 2.0, 1.0), 0),  # not much coarser
        (0, (1.0, 4.0, 4.0), 0),  # a coarse level of a microscope's pyramid
    ],
)
def test_an_axis_much_coarser_than_the_others_is_the_slice_axis(
    stated: int, spacing_um: tuple[float, float, float], axis: int
) -> None:
    assert find_slice_axis(stated, spacing_um) == axis


@pytest.mark.parametrize("axis", range(3))
def test_arrays_and_triples_are_turned_in_the_same_way_and_back(axis: int) -> None:
    array = np.zeros((2, 3, 4))
    turned = slices_first(array, axis)
    assert turned.shape == first_of_three(array.shape, axis)
    assert turned.shape[0] == array.shape[axis]
    assert slices_back(turned, axis).shape == array.shape
    assert back_of_three(turned.shape, axis) == array.shape


@pytest.mark.parametrize("axes", [(0, 1, 2), (2, 0, 1), (1, 2, 0), (2, 1, 0)])
def test_turned_arrays_are_put_in_order(axes: tuple[int, int, int]) -> None:
    voxels = np.random.default_rng(0).integers(0, 999, (70, 65, 130)).astype(np.uint16)
    turned = voxels.transpose(axes)[:, ::-1, ::-1]
    for dtype in (None, np.float32):
        found = in_order(turned, dtype)
        assert found.flags.c_contiguous
        assert found.dtype == (dtype or np.uint16)
        assert (found == turned).all()
    assert in_order(voxels) is voxels
