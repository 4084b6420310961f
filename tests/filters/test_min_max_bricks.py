import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import ndimage

from stereocell.filters.min_max_bricks import SKIP_BRICK, min_max_bricks, mip_levels

shapes = st.tuples(*[st.integers(1, 21)] * 3)
volumes = shapes.flatmap(lambda shape: arrays(np.uint8, shape))


@pytest.mark.slow
@given(volumes, st.integers(0, 2**32 - 1))
def test_bricks_hold_every_value_that_trilinear_interpolation_gives(volume, seed):
    bricks = min_max_bricks(volume)
    assert bricks.shape == (*(-(-n // SKIP_BRICK) for n in volume.shape), 2)
    # Texture coordinates anywhere in the texture, in voxels from its corner: centres are at + 0.5.
    points = np.random.default_rng(seed).uniform(0, 1, (64, 3)) * volume.shape
    samples = ndimage.map_coordinates(
        volume.astype(np.float64), (points - 0.5).T, order=1, mode="nearest"
    )
    ranges = bricks[tuple((points // SKIP_BRICK).astype(int).T)]
    assert (samples >= ranges[:, 0] - 1e-6).all()
    assert (samples <= ranges[:, 1] + 1e-6).all()


@pytest.mark.slow
@given(volumes)
def test_bricks_cover_exactly_their_voxels_and_one_more_on_each_side(volume):
    bricks = min_max_bricks(volume)
    for brick in np.ndindex(bricks.shape[:3]):
        first = [SKIP_BRICK * b for b in brick]
        reach = tuple(slice(max(i - 1, 0), i + SKIP_BRICK + 1) for i in first)
        assert tuple(bricks[brick]) == (volume[reach].min(), volume[reach].max())


@given(shapes)
def test_mip_levels_halve_down_to_four(shape):
    levels = mip_levels(np.zeros(shape, np.uint8))
    for k, level in enumerate(levels):
        assert level.shape == tuple(max(1, n >> k) for n in shape)
    assert max(levels[-1].shape) <= 4
    assert all(max(level.shape) > 4 for level in levels[:-1])


@given(shapes, st.integers(0, 255))
def test_mip_levels_of_a_constant_volume_are_constant(shape, value):
    for level in mip_levels(np.full(shape, value, np.uint8)):
        assert (level == value).all()


def test_mip_levels_of_a_ramp_keep_its_place_in_the_box():
    # A linear ramp over the box [0, 1] is the same ramp at every resolution, also for odd sizes.
    n = 39
    ramp = (np.arange(n) + 0.5) / n * 200
    volume = np.broadcast_to(np.rint(ramp).astype(np.uint8), (7, 5, n))
    for level in mip_levels(volume):
        m = level.shape[2]
        expected = (np.arange(m) + 0.5) / m * 200
        assert np.abs(level[0, 0] - expected).max() <= 1.01


def test_odd_axes_are_weighted_by_covered_area():
    # 5 -> 2: each coarse voxel covers 2.5 fine ones. Its mean is over (0, 0, .5 * 100) or reversed.
    volume = np.zeros((1, 1, 5), np.uint8)
    volume[0, 0, 2] = 100
    assert mip_levels(volume)[1].tolist() == [[[20, 20]]]
