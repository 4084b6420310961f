"""Bricks and the tree over them, compared with brute force and with the needs of sampling."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from scipy import ndimage

from stereocell.formats.voxel_bvh import (
    EMPTY,
    STORED,
    STREAM_BRICK,
    build,
    upsampling,
)
from support.server.brick_bundles import phantom
from support.server.brick_decoder import first_children, reassemble

VOLUME = phantom()
THRESHOLD = 20


@pytest.fixture(scope="module")
def bvh():
    return build(VOLUME, THRESHOLD)


def bricks_of(bvh):
    """Yield pairs of a node and its brick, or None."""
    stored = iter(bvh.bricks)
    for node in bvh.nodes:
        yield node, None if node["flags"] & EMPTY else next(stored)


def box_of(node, reach=0):
    """Return the texels of a node's box, cut off at the volume's ends, and `reach` more."""
    edge = STREAM_BRICK << int(node["level"])
    return tuple(
        slice(max(0, int(node[a]) * edge - reach), min(n, (int(node[a]) + 1) * edge + reach))
        for a, n in zip("zyx", VOLUME.shape, strict=True)
    )


def clamped(level, at):
    """Return texels of an array at integer positions (3, ...); outside, the nearest texel."""
    limits = np.array(level.shape).reshape(3, *[1] * (at.ndim - 1)) - 1
    return level[tuple(np.clip(at, 0, limits))]


def cells(count):
    return np.stack(np.meshgrid(*[np.arange(count)] * 3, indexing="ij"))


def test_a_leaf_holds_its_texels_and_one_more_on_each_side(bvh):
    leaves = [(n, b) for n, b in bricks_of(bvh) if n["level"] == 0 and b is not None]
    assert leaves
    for node, brick in leaves:
        first = STREAM_BRICK * np.array([node["z"], node["y"], node["x"]]).reshape(3, 1, 1, 1)
        np.testing.assert_array_equal(brick, clamped(VOLUME, first + cells(STORED) - 1))


def test_a_trilinear_sample_inside_a_leaf_needs_no_other_brick(bvh):
    """A GPU samples like this: texel i has its centre at i + 1/2, and faces repeat texels."""
    rng = np.random.default_rng(1)
    for node, brick in bricks_of(bvh):
        if brick is None or node["level"] > 0:
            continue
        inside = rng.uniform(0, STREAM_BRICK, (3, 40))
        first = STREAM_BRICK * np.array([[node["z"]], [node["y"]], [node["x"]]])
        inside = np.minimum(inside, np.array(VOLUME.shape)[:, None] - first)
        alone = ndimage.map_coordinates(brick.astype(float), inside + 0.5, order=1)
        place = first + inside - 0.5
        whole = ndimage.map_coordinates(VOLUME.astype(float), place, order=1, mode="nearest")
        np.testing.assert_allclose(alone, whole, atol=1e-9)


def test_a_coarse_texel_is_the_mean_of_its_cell(bvh):
    """If the volume's end cuts no cell: 2^level texels along an axis, rounded half up."""
    checked = 0
    for node, brick in bricks_of(bvh):
        level = int(node["level"])
        if brick is None or level == 0:
            continue
        edge = 1 << level
        for place in itertools.product(range(0, STREAM_BRICK, 5), repeat=3):
            first = [int(node[axis]) * STREAM_BRICK for axis in "zyx"]
            low = [(i + p) * edge for i, p in zip(first, place, strict=True)]
            if any(at + edge > n for at, n in zip(low, VOLUME.shape, strict=True)):
                continue
            cell = VOLUME[tuple(slice(at, at + edge) for at in low)]
            mean = (2 * int(cell.sum()) + cell.size) // (2 * cell.size)
            assert brick[tuple(p + 1 for p in place)] == mean
            checked += 1
    assert checked > 500


def test_errors_are_those_of_trilinear_interpolation(bvh):
    for node, brick in bricks_of(bvh):
        if brick is None or node["level"] == 0:
            assert node["error_max"] == 0
            assert node["error_rms"] == 0
            continue
        box = box_of(node)
        truth = VOLUME[box].astype(float)
        places = np.stack(
            np.meshgrid(*[np.arange(n) + 0.5 for n in truth.shape], indexing="ij")
        ) / (1 << int(node["level"]))
        drawn = ndimage.map_coordinates(brick.astype(float), places + 0.5, order=1)
        difference = np.abs(drawn - truth)
        assert difference.max() <= node["error_max"] + 1.1e-3
        assert node["error_max"] < difference.max() + 1
        assert node["error_rms"] == pytest.approx(np.sqrt(np.mean(difference**2)), rel=1e-4)


@pytest.mark.parametrize("turn", [1, -1])
def test_all_samples_in_a_node_lie_in_its_range(bvh, turn):
    """On a ramp, the apron of a coarse node reaches further than those of leaves."""
    check_ranges(bvh)
    ramp = np.broadcast_to(np.arange(10, 250, 3, dtype=np.uint8)[::turn], (40, 40, 80))
    check_ranges(build(ramp.copy(), 0))


def check_ranges(bvh):
    starts = first_children(bvh.nodes)
    stored = [b for _, b in bricks_of(bvh)]
    for i, node in enumerate(bvh.nodes):
        if stored[i] is None:
            assert node["min"] == node["max"] == node["constant"]
            continue
        assert node["min"] <= stored[i].min()
        assert stored[i].max() <= node["max"]
        below = range(starts[i], starts[i + 1]) if node["level"] else []
        for child in below:
            assert node["min"] <= bvh.nodes[child]["min"]
            assert bvh.nodes[child]["max"] <= node["max"]


def test_a_node_is_empty_if_no_sample_in_it_exceeds_the_threshold(bvh):
    empties = 0
    for node, brick in bricks_of(bvh):
        reach = VOLUME[box_of(node, 1)]
        if brick is None:
            empties += 1
            box = VOLUME[box_of(node)]
            assert reach.max() <= THRESHOLD
            assert node["constant"] == np.floor(box.mean() + 0.5)
            assert node["child_mask"] == 0
        else:
            assert reach.max() > THRESHOLD
    assert empties > 5


def test_children_lie_in_their_parent_s_box_in_the_order_of_their_bits(bvh):
    starts = first_children(bvh.nodes)
    assert starts[-1] == len(bvh.nodes)
    covered = np.zeros(VOLUME.shape, dtype=int)
    for i, node in enumerate(bvh.nodes):
        bits = [b for b in range(8) if node["child_mask"] >> b & 1]
        children = bvh.nodes[starts[i] : starts[i + 1]]
        assert len(bits) == len(children)
        for bit, child in zip(bits, children, strict=True):
            assert child["level"] == node["level"] - 1
            for k, axis in enumerate("xyz"):
                assert child[axis] == 2 * node[axis] + (bit >> k & 1)
        if not bits:
            covered[box_of(node)] += 1
    assert (covered == 1).all()


def test_leaves_make_up_the_visible_part_of_the_volume(bvh):
    again = reassemble(bvh)
    differs = again != VOLUME
    assert VOLUME[differs].max(initial=0) <= THRESHOLD
    assert again[differs].max(initial=0) <= THRESHOLD


@settings(max_examples=25, deadline=None)
@given(
    npst.arrays(np.uint8, npst.array_shapes(min_dims=3, max_dims=3, max_side=40)),
    st.integers(-1, 254),
)
def test_any_volume_is_read_back(volume, threshold):
    again = reassemble(build(volume, threshold))
    differs = again != volume
    assert volume[differs].max(initial=0) <= max(threshold, 0)
    assert again[differs].max(initial=0) <= max(threshold, 0)
    if threshold < 0:
        assert not differs.any()


def test_a_volume_below_the_threshold_is_one_empty_node():
    bvh = build(np.full((40, 50, 70), 9, np.uint8), 9)
    (node,) = bvh.nodes
    assert (node["flags"], node["constant"], node["level"]) == (EMPTY, 9, 3)
    assert len(bvh.bricks) == 0


def test_a_constant_volume_has_no_error():
    bvh = build(np.full((33, 33, 33), 200, np.uint8), 9)
    assert (bvh.nodes["error_rms"] == 0).all()
    assert (bvh.bricks == 200).all()


def test_weights_interpolate_a_ramp_exactly():
    """The centre of coarse texel k lies (k - 1/2) 2^level finest texels from the box's low side."""
    for level in range(1, 5):
        count = STREAM_BRICK << level
        centres = (np.arange(STORED) - 0.5) * 2**level
        np.testing.assert_allclose(upsampling(level, count) @ centres, np.arange(count) + 0.5)


@pytest.mark.parametrize("shape", [(0, 3, 3), (3, 3), (1, 1, (16 << 15) + 1)])
def test_empty_flat_and_oversized_arrays_are_refused(shape):
    with pytest.raises(ValueError, match="a volume of"):
        build(np.zeros(shape, np.uint8), 0)
