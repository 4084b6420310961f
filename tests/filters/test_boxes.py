"""Erosion and dilation by boxes agree with scipy's filters."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.filters.boxes import dilate, erode


@given(
    arrays(bool, array_shapes(min_dims=3, max_dims=3, max_side=12)),
    st.tuples(*[st.integers(0, 4)] * 3),
)
def test_boxes_of_odd_size(flags: NDArray[np.bool_], reach: tuple[int, int, int]) -> None:
    size = [2 * n + 1 for n in reach]
    least, most = (
        each(flags.view(np.uint8), size, mode="nearest").view(bool)
        for each in (ndimage.minimum_filter, ndimage.maximum_filter)
    )
    np.testing.assert_array_equal(erode(flags, reach), least)
    np.testing.assert_array_equal(dilate(flags, reach), most)


@given(
    arrays(bool, array_shapes(min_dims=1, max_dims=1, max_side=30)),
    st.integers(0, 5),
    st.integers(0, 5),
)
def test_boxes_that_reach_farther_to_one_side(
    flags: NDArray[np.bool_], before: int, after: int
) -> None:
    indices = np.arange(len(flags))
    near = [flags[max(i - before, 0) : i + after + 1] for i in indices]
    assert erode(flags, (before,), (after,)).tolist() == [bool(part.all()) for part in near]
    assert dilate(flags, (before,), (after,)).tolist() == [bool(part.any()) for part in near]
