"""Collapses by blocks give results as valid and as coarse as collapses of the whole at once."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.kernels import collapse as collapses
from stereocell.kernels.near_order import order_triangles, order_vertices
from stereocell.meshes.distance import Nearest
from stereocell.meshes.simplify import NOTHING, STRAY, compact, simplify
from stereocell.meshes.validity import find_defects
from stereocell.model.mesh import Mesh
from support.meshes import ball, joined, moved

ERROR_UM = 0.03


@pytest.fixture
def bodies() -> Mesh:
    """Return two balls of several blocks each, so that there are seams between blocks."""
    mesh = joined(ball(5.0, 120), moved(ball(3.0, 80), (9.0, 0.0, 0.0)))
    assert len(mesh.positions) > 4 * collapses.BLOCK
    return mesh


def test_a_mesh_simplified_by_blocks_is_as_good_as_one_simplified_at_once(
    bodies: Mesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    by_blocks = simplify(bodies, ERROR_UM)
    monkeypatch.setattr(collapses, "BLOCK", len(bodies.positions))
    at_once = simplify(bodies, ERROR_UM)
    assert find_defects(by_blocks).total == 0
    assert len(by_blocks.triangles) < 1.02 * len(at_once.triangles)
    fine = bodies.positions.astype(np.float64)
    far, before = (Nearest(each, 10).distances(fine) for each in (by_blocks, at_once))
    assert far.mean() < 1.1 * before.mean()
    assert far.max() < STRAY * ERROR_UM


def test_locked_triangles_keep_their_order(bodies: Mesh) -> None:
    at, triangles = bodies.positions.astype(np.float64), bodies.triangles.astype(np.int32)
    count = len(at)
    left, moves = collapse(at, triangles, np.ones(count, bool))
    np.testing.assert_array_equal(left, triangles)
    assert not len(moves)


def test_earlier_collapses_are_repeated_except_around_newly_locked_vertices(bodies: Mesh) -> None:
    at, triangles = bodies.positions.astype(np.float64), bodies.triangles.astype(np.int32)
    locked = np.zeros(len(at), bool)
    first, moves = collapse(at, triangles, locked)
    again, same = collapse(at, triangles, locked, moves)
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(moves, same)
    moved = moves[len(moves) // 2, 0]
    locked[moved] = True
    left, now = collapse(at, triangles, locked, moves)
    assert moved in left
    assert moved not in now[:, 0]
    assert len(left) < 1.02 * len(first)
    # Nearly all triangles are the same.
    was, is_now = ({tuple(t) for t in some.tolist()} for some in (first, left))
    assert len(was & is_now) > 0.9 * len(first)
    # No vertex is farther from the surface than allowed.
    done = compact(bodies, left.astype(np.uint32))
    assert find_defects(done).total == 0
    assert Nearest(done, 10).distances(at).max() < STRAY * ERROR_UM


def collapse(
    at: NDArray[np.float64],
    triangles: NDArray[np.int32],
    locked: NDArray[np.bool_],
    past: NDArray[np.int32] = NOTHING,
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    planes, errors = np.zeros(len(at), np.uint8), np.full(len(at), ERROR_UM)
    corners, left, moves = collapses.collapse(
        at, triangles, locked, planes, errors, STRAY, 0.978, past
    )
    return corners[left], moves


def neighbours_apart(triangles: NDArray[np.int32], place: NDArray[np.int64]) -> float:
    return float(np.abs(place[triangles[:, 0]] - place[triangles[:, 1]]).mean())


def test_near_vertices_follow_each_other_in_the_order() -> None:
    rng = np.random.default_rng(0)
    mesh = ball(5.0, 100)
    count = len(mesh.positions)
    mixed = rng.permutation(count)
    number = np.empty(count, np.int64)
    number[mixed] = np.arange(count)
    at, triangles = (
        mesh.positions[mixed].astype(np.float64),
        number[mesh.triangles].astype(np.int32),
    )
    order = order_vertices(at)
    np.testing.assert_array_equal(np.sort(order), np.arange(count))
    np.testing.assert_array_equal(order, order_vertices(at))
    place = np.empty(count, np.int64)
    place[order] = np.arange(count)
    assert neighbours_apart(triangles, place) < 0.1 * neighbours_apart(triangles, np.arange(count))
    turns = order_triangles(triangles, place.astype(np.int32))
    first = place[triangles[turns]].min(axis=1)
    assert (np.diff(first) >= 0).all()
    np.testing.assert_array_equal(np.sort(turns), np.arange(len(triangles)))


def test_equal_points_keep_their_order_and_no_points_have_one() -> None:
    np.testing.assert_array_equal(order_vertices(np.zeros((3, 3))), [0, 1, 2])
    assert len(order_vertices(np.zeros((0, 3)))) == 0
