"""Percentiles, medians and tables of voxel values are those of NumPy, bit by bit."""

import numpy as np
import pytest

from stereocell.filters.codes import codes_of, count_each, every_code, has_codes
from stereocell.filters.percentiles import find_median, find_percentile_in_place, find_percentiles

PERCENTS = (0, 0.001, 0.1, 15, 50, 99.7, 99.999, 100)


@pytest.mark.parametrize("kind", ["u1", "i1", "u2", "i2", ">u2", "i4", "f4"])
@pytest.mark.parametrize("count", [1, 2, 3, 10, 1001, 70_001])
def test_percentiles_and_medians_equal_those_of_numpy(kind: str, count: int) -> None:
    values = np.random.default_rng(count).integers(-128, 128, count).astype(kind)
    # NumPy subtracts integers in their own type, which overflows for signed ones.
    exact = values.astype(np.int64) if values.dtype.kind == "i" else values
    assert find_percentiles(values, PERCENTS) == np.percentile(exact, PERCENTS).tolist()
    assert find_median(values) == np.median(exact)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 7, 1000, 27_931])
def test_one_percentile_in_place_equals_that_of_numpy(count: int) -> None:
    values = np.random.default_rng(count).normal(100, 30, count).astype(np.float32)
    for percent in (0.0, 15.0, 50.0, 99.7, 100.0):
        assert find_percentile_in_place(values.copy(), percent) == np.percentile(values, percent)


@pytest.mark.parametrize("kind", ["u1", "i1", "u2", "i2"])
def test_codes_count_turned_and_read_only_voxels_by_their_value(kind: str) -> None:
    random = np.random.default_rng(0)
    voxels = random.integers(-99, 99, (40, 50, 60)).astype(kind).transpose(2, 0, 1)[:, ::-1]
    voxels.flags.writeable = False
    assert has_codes(voxels.dtype)
    assert (every_code(voxels.dtype)[codes_of(voxels)] == voxels.ravel()).all()
    values, times = count_each(voxels)
    expected, counts = np.unique(voxels, return_counts=True)
    assert (values == expected).all()
    assert (times == counts).all()
