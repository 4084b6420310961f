"""The bricks that a view gets, and their order, compared with geometry computed in this test."""

import numpy as np
import pytest

from stereocell.formats.brick_stream import encode_tree, parse_table
from stereocell.formats.voxel_bvh import build
from stereocell.serve.brick_order import View, order, place
from support.server.brick_bundles import phantom
from support.server.brick_client import look_at

IDENTITY = np.eye(4).ravel().tolist()


def noise(shape=(66, 66, 66)):
    """Return a volume of noise round 200, whose bricks all have similar errors."""
    return np.random.default_rng(3).integers(150, 250, shape).astype(np.uint8)


def placed(volume, threshold=20, matrix=IDENTITY, low=(0, 0, 0), spacing=1.0):
    size = np.array(volume.shape[::-1])
    high = np.array(low) + (size - 3) * spacing
    entry = {
        "tile": "r0_c0",
        "bounds_um": {"min": list(low), "max": high.tolist()},
        "apron": 1,
        "matrix": matrix,
    }
    return place(parse_table(encode_tree(build(volume, threshold), bytes(16))), entry)


def view(eye, target, texel_px=0.0, error_grey=0.0, pixels=500.0, **camera):
    camera = look_at(eye, target, **camera)
    return View(
        np.array(camera["clip"]).reshape(4, 4).T,
        np.array(camera["eye"]),
        np.array(camera["gaze"]),
        pixels,
        texel_px,
        error_grey,
    )


TREE = placed(noise())
MIDDLE = (31.5, 31.5, 31.5)
FAR = (31.5, 31.5, 300.0)


def test_everything_in_sight_is_wanted_to_the_leaves():
    _, nodes, _ = order(view(FAR, MIDDLE), [TREE])
    # 66 texels are 5 bricks an axis; the last holds texels 64 and 65, drawn up to 64's centre
    assert sorted(nodes.tolist()) == list(range(len(TREE.level)))
    assert (TREE.level == 0).sum() == 5**3


def test_nodes_that_hold_only_apron_are_never_wanted_even_if_everything_is_in_sight():
    """49 texels along x: the fourth cell begins at 48, and what is drawn ends at 47.5."""
    volume = noise((34, 34, 49))
    tree = placed(volume)
    nodes = build(volume, 20).nodes
    _, wanted, _ = order(view(FAR, MIDDLE), [tree])
    is_apron = (nodes["level"] == 0) & (nodes["x"] == 3)
    assert is_apron.sum() == 3 * 3
    assert not tree.is_empty[is_apron].any()
    assert sorted(wanted.tolist()) == np.flatnonzero(~is_apron).tolist()


def test_boxes_lie_where_the_texels_are_drawn():
    """Texture y runs down: row 0's drawn side is the top of the box."""
    volume = phantom((35, 40, 50))
    tree = placed(volume, threshold=-1, low=(100, 200, 300), spacing=2.0)
    # the root's box is what the volume's entry says: between the centres inside the apron
    np.testing.assert_allclose(tree.center[0] - tree.half[0], [100, 200, 300])
    np.testing.assert_allclose(tree.center[0] + tree.half[0], [100 + 94, 200 + 74, 300 + 64])
    first = np.flatnonzero(tree.level == 0)[0]  # texels 0 to 15: 14.5 of them behind 1.5
    np.testing.assert_allclose(tree.center[first] - tree.half[first], [100, 274 - 29, 300])
    np.testing.assert_allclose(tree.center[first] + tree.half[first], [129, 274, 329])


def test_parents_come_before_their_children():
    for eye, target in ((FAR, MIDDLE), ((-5, 10, 20), MIDDLE), ((30, 30, 30), (0, 0, 0))):
        _, nodes, worth = order(view(eye, target), [TREE])
        when = {node: i for i, node in enumerate(nodes.tolist())}
        assert nodes[0] == 0
        assert all(when[TREE.parents[n]] < i for n, i in when.items() if n)
        assert (np.diff(worth) <= 0).all()


def test_the_nearer_of_two_equal_bricks_comes_first():
    """All bricks have similar errors, so of one level the nearest ones to the eye come first."""
    _, nodes, _ = order(view((31.5, 31.5, 90.0), MIDDLE), [TREE])
    level1 = [n for n in nodes.tolist() if TREE.level[n] == 1]
    depth = TREE.center[level1][:, 2]
    half = len(depth) // 3
    assert depth[:half].mean() > depth[-half:].mean() + 15


def test_the_brick_at_the_gaze_comes_first_among_equals():
    eye = (31.5, 31.5, 120.0)
    camera = view(eye, MIDDLE)
    for side in (-1, 1):
        gazed = View(camera.clip, camera.eye, np.array([0.4 * side, 0, -1.0]), 500.0, 0.0)
        _, nodes, _ = order(gazed, [TREE])
        leaves = [n for n in nodes.tolist() if TREE.level[n] == 0]
        x = TREE.center[leaves][:, 0]
        third = len(x) // 3
        assert side * (x[:third].mean() - x[-third:].mean()) > 5


def test_the_brick_with_the_larger_error_comes_first():
    volume = np.random.default_rng(3).integers(100, 110, (66, 66, 130)).astype(np.uint8)
    volume[:, :, 66:] = np.random.default_rng(3).integers(0, 255, (66, 66, 64))
    tree = placed(volume, threshold=-1)
    _, nodes, _ = order(view((63.5, 31.5, 400.0), (63.5, 31.5, 31.5)), [tree])
    fine = [n for n in nodes.tolist() if tree.level[n] == 0]
    x = tree.center[fine][:, 0]
    assert (x[: len(x) // 3] > 50).all()


def test_nothing_outside_the_frustum_is_wanted():
    """A box is wanted unless all of its corners lie outside of one plane of the frustum."""
    camera = view((31.5, 31.5, 100.0), (60.0, 50.0, 31.5), fov_y=np.radians(12))
    _, nodes, _ = order(camera, [TREE])
    corners = np.stack(np.meshgrid(*[[-1, 1]] * 3), -1).reshape(-1, 3)
    found = set(nodes.tolist())
    assert 3 < len(found) < len(TREE.level) / 2
    for node in range(len(TREE.level)):
        points = TREE.center[node] + corners * TREE.half[node]
        clip = np.c_[points, np.ones(8)] @ camera.clip.T
        w = clip[:, 3:]
        outside = np.any(np.all(clip[:, :3] > w, axis=0) | np.all(clip[:, :3] < -w, axis=0))
        assert (node in found) == (not outside)


def test_no_brick_behind_the_eye_is_wanted():
    _, nodes, _ = order(view((31.5, 31.5, 100.0), (31.5, 31.5, 200.0)), [TREE])
    assert len(nodes) == 0


def test_refinement_ends_where_a_texel_is_small_enough():
    """From 300 um, 500 px a radian: at 268.5 um a texel of 2 um is 3.7 px, one of 4 um 7.4."""
    for texel_px, finest in ((0.0, 0), (3.0, 0), (5.0, 1), (10.0, 2), (1000.0, 3)):
        _, nodes, _ = order(view(FAR, MIDDLE, texel_px), [TREE])
        assert TREE.level[nodes].min() == finest


def test_refinement_ends_where_the_error_is_small_enough():
    smooth = np.broadcast_to(np.arange(66, dtype=np.uint8), (66, 66, 66)).copy()  # a ramp
    tree = placed(smooth, threshold=-1)
    _, all_nodes, _ = order(view(FAR, MIDDLE), [tree])
    _, few, _ = order(view(FAR, MIDDLE, error_grey=9), [tree])
    assert len(few) < len(all_nodes)
    wanted = set(few.tolist())
    assert all(tree.error_max[tree.parents[n]] > 9 for n in wanted if n)
    constant = placed(np.full((66, 66, 66), 90, np.uint8))
    assert order(view(FAR, MIDDLE), [constant])[1].tolist() == [0]


def test_a_moved_tile_is_looked_at_where_it_is():
    """The tile is turned by 90 degrees about y and moved. An eye moved with it wants the same."""
    turn = np.array([[0, 0, 1, 1000.0], [0, 1, 0, -50], [-1, 0, 0, 7], [0, 0, 0, 1]])
    moved = placed(noise(), matrix=turn.T.ravel().tolist())

    def there(point):
        return (turn @ [*point, 1.0])[:3]

    plain = order(view((10, 20, 90), MIDDLE, texel_px=4.0), [TREE])
    carried = order(view(there((10, 20, 90)), there(MIDDLE), texel_px=4.0), [moved])
    assert set(plain[1].tolist()) == set(carried[1].tolist())
    same = np.isclose(np.sort(plain[2]), np.sort(carried[2]), rtol=1e-3)
    assert same.all()


def test_trees_are_merged_by_worth():
    near, far = placed(noise(), low=(0, 0, 100)), placed(noise(), low=(0, 0, -400))
    camera = view((31.5, 31.5, 300.0), MIDDLE)
    tree, nodes, worth = order(camera, [far, near])
    assert set(tree.tolist()) == {0, 1}
    assert (np.diff(worth) <= 0).all()
    assert (tree[0], nodes[0]) == (1, 0)  # the root of the nearer tree
    assert {(0, 0), (1, 0)} <= set(zip(tree[:12].tolist(), nodes[:12].tolist(), strict=True))


@pytest.mark.parametrize("gaze", [[0, 0, 0], [0, 0, -1e15]])
def test_any_gaze_gives_an_order(gaze):
    camera = view(FAR, MIDDLE)
    odd = View(camera.clip, camera.eye, np.array(gaze, float), 500.0, 0.0)
    _, nodes, worth = order(odd, [TREE])
    assert len(nodes) == len(TREE.level)
    assert np.isfinite(worth).all()
