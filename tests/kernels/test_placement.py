"""Vertices move to the least squared distance from planes, unless a triangle would suffer."""

import numpy as np
import pytest

from stereocell.kernels.placement import (
    find_places,
    follow_moves,
    move_along,
    shorten_moves,
    sum_planes,
)


def test_a_vertex_moves_to_the_corner_in_which_the_planes_of_its_triangles_meet() -> None:
    # three triangles in the planes x = 1, y = 2, z = 3, of which vertex 0 owns all corners
    at = np.array(
        [[1, 0, 0], [1, 1, 0], [1, 0, 1], [0, 2, 0], [0, 2, 1], [1, 2, 0], [0, 0, 3], [1, 0, 3],
         [0, 1, 3]], float,
    )  # fmt: skip
    triangles = np.arange(9, dtype=np.int32).reshape(3, 3)
    start = np.array([[0.8, 2.3, 2.9]])
    sums = sum_planes(at, triangles, np.zeros(9, np.int32), start)
    np.testing.assert_allclose(start + find_places(sums, 1e-9, 5.0), [[1, 2, 3]], atol=1e-6)
    short = find_places(sums, 1e-9, 0.1)
    assert np.linalg.norm(short) == pytest.approx(0.1)
    nobody = np.full(9, -1, np.int32)
    assert not find_places(sum_planes(at, triangles, nobody, start), 0.05, 5.0).any()


def test_a_vertex_of_a_flat_surface_moves_straight_onto_it() -> None:
    at = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    triangles, owners = np.array([[0, 1, 2]], np.int32), np.zeros(3, np.int32)
    moves = find_places(sum_planes(at, triangles, owners, np.array([[0.3, 0.2, 0.7]])), 1e-3, 5.0)
    np.testing.assert_allclose(moves, [[0, 0, -0.7]], atol=1e-3)


@pytest.mark.parametrize(
    ("move", "is_shortened"),
    [((0.1, 0.1, 0.1), False), ((-2.0, 1.0, 0.0), True), ((0, 0, 6.0), True)],
)
def test_a_move_that_turns_or_sharpens_a_triangle_is_shortened(
    move: tuple[float, float, float], is_shortened: bool
) -> None:
    start = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    triangles, sharpest = np.array([[0, 1, 2]], np.int32), float(np.cos(np.radians(12)))
    moves = np.zeros((3, 3))
    moves[1] = move
    shorten_moves(start, triangles, moves, sharpest, 4)
    assert (np.linalg.norm(moves[1]) < np.linalg.norm(move)) == is_shortened
    at = start + moves
    before, after = (np.cross(p[1] - p[0], p[2] - p[0]) for p in (start, at))
    assert before @ after >= 0.5 * np.linalg.norm(before) * np.linalg.norm(after)


def test_moves_end_at_the_box_and_at_the_largest_distance() -> None:
    start, high = np.zeros((2, 3)), np.array([0.2, 9.0, 9.0])
    at, ways = start.copy(), np.array([[1.0, 0, 0], [0, 3.0, 4.0]])
    move_along(at, ways, np.ones(2), start, 0.5, -high, high)
    np.testing.assert_allclose(at, [[0.2, 0, 0], [0, 0.3, 0.4]])


def test_a_vertex_is_owned_by_the_last_vertex_of_its_chain_of_collapses() -> None:
    moves = np.array([[0, 1], [3, 4], [1, 2], [2, 4]], np.int32)
    assert follow_moves(moves, 6).tolist() == [4, 4, 4, 4, 4, 5]
