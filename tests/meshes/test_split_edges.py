"""Longest edges are split at points of the surface; borders and planes are left alone."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.meshes.split_edges import split_edges

# two triangles on the long diagonal 0-1
DIAMOND = np.array([[0, 0, 0], [8, 0, 0], [4, 1, 0], [4, -1, 0]], float)
PAIR = np.array([[0, 1, 2], [1, 0, 3]])
UP = np.tile([0.0, 0.0, 1.0], (4, 1))
BOTH = np.ones(2, bool)


def _on_ball(radius: float) -> NDArray[np.float64]:
    """The diamond on top of a ball at the origin, its diagonal level."""
    flat = np.concatenate([DIAMOND - [4, 0, 0], [[0, 0, 0]]])  # the ball's top, in no triangle
    flat[:, 2] = np.sqrt(radius**2 - (flat**2).sum(axis=1))
    return flat


def test_diagonal_is_split_into_four_triangles_that_cover_the_two() -> None:
    positions, normals, triangles, ends = split_edges(
        DIAMOND, UP, triangles=PAIR, wanted=BOTH, planes=(), max_lift_um=0.1
    )
    np.testing.assert_array_equal(positions[:4], DIAMOND)
    np.testing.assert_array_equal(positions[4:], [[4, 0, 0]])
    np.testing.assert_array_equal(normals[4:], [[0, 0, 1]])
    np.testing.assert_array_equal(np.sort(ends), [[0, 1]])
    a, b, c = positions[triangles].transpose(1, 0, 2)
    np.testing.assert_allclose(np.cross(b - a, c - a)[:, 2] / 2, [2, 2, 2, 2])


@pytest.mark.parametrize("radius", [16.0, 32.0])
def test_new_vertex_lies_on_the_ball_up_to_the_fourth_order(radius: float) -> None:
    corners = _on_ball(radius)
    positions, normals, *_ = split_edges(
        corners, corners / radius, triangles=PAIR, wanted=BOTH, planes=(), max_lift_um=2.0
    )
    half = np.arcsin(4 / radius)  # of the angle between the ends
    assert len(positions) == 6
    assert radius - np.linalg.norm(corners[:2].mean(axis=0)) > 0.4 * radius * half**2
    assert np.linalg.norm(positions[5]) == pytest.approx(radius, abs=radius * half**4 / 4)
    np.testing.assert_allclose(normals[5], [0, 0, 1], atol=1e-12)


def test_surface_that_would_move_too_far_is_not_split() -> None:
    corners = _on_ball(16.0)
    sagitta = 16 - np.sqrt(16**2 - 4**2)
    for bound, count in ((0.9 * sagitta, 5), (1.1 * sagitta, 6)):
        positions, *_ = split_edges(
            corners, corners / 16, triangles=PAIR, wanted=BOTH, planes=(), max_lift_um=bound
        )
        assert len(positions) == count


@pytest.mark.parametrize(
    ("first", "second", "height"),
    [
        (-0.1, 0.1, 0.2),
        (-0.1, 0.3, 0.2),
        (-0.3, 0.1, 0.2),
        (0.1, -0.3, -0.2),
        (0.0, 0.3, 0.0),
        (0.1, 0.3, 0.0),
    ],
)
def test_ends_that_disagree_lift_by_the_lesser(first: float, second: float, height: float) -> None:
    """As at rims, where one end has the normal of a flat face and one leans over.

    An end that leans by a slope `s` says 8 s / 4: an arc over a chord of 8 is as high, to first
    order.
    """
    lean = [[s, 0, np.sqrt(1 - s**2)] for s in (first, second)]
    positions = np.concatenate([DIAMOND, [[4, 0, 9], [4, 0, -9]]])  # room above and below
    normals = np.concatenate([lean, UP])
    split, *_ = split_edges(
        positions, normals, triangles=PAIR, wanted=BOTH, planes=(), max_lift_um=1.0
    )
    assert split[6, 2] == pytest.approx(height, rel=0.03)


@pytest.mark.parametrize(("widths", "count"), [((6, 6), 1), ((1, 6), 0), ((6, 1), 0)])
def test_split_that_would_fold_the_surface_is_not_made(widths: tuple[int, int], count: int) -> None:
    """The ridge that it makes is 1.8 high, and its sides are so wide."""
    lean = 0.9
    up = np.sqrt(1 - lean**2)
    positions = np.concatenate([DIAMOND, [[4, 0, 9]]])
    positions[2:4, 1] = widths[0], -widths[1]
    normals = np.concatenate([[[-lean, 0, up], [lean, 0, up]], UP[:3]])
    *_, ends = split_edges(
        positions, normals, triangles=PAIR, wanted=BOTH, planes=(), max_lift_um=10.0
    )
    assert len(ends) == count


def test_border_is_not_split() -> None:
    """Of a triangle alone, and of one whose longest edge is on the border."""
    for triangles in (PAIR[:1], np.array([[0, 1, 2], [2, 1, 3]])):
        corners = np.array([[0, 0, 0], [8, 0, 0], [4, 1, 0], [5, 1.5, 0]], float)
        positions, _, same, ends = split_edges(
            corners,
            UP,
            triangles=triangles,
            wanted=np.arange(len(triangles)) == 0,
            planes=(),
            max_lift_um=0.1,
        )
        assert len(ends) == 0
        np.testing.assert_array_equal(positions, corners)
        np.testing.assert_array_equal(same, triangles)


@pytest.mark.parametrize(("column", "value", "count"), [(1, 0.0, 0), (1, -1.0, 1), (0, 0.0, 1)])
def test_chord_between_two_vertices_on_a_plane_is_not_split(
    column: int, value: float, count: int
) -> None:
    *_, ends = split_edges(
        DIAMOND, UP, triangles=PAIR, wanted=BOTH, planes=((column, value),), max_lift_um=0.1
    )
    assert len(ends) == count


def test_point_that_rises_to_a_plane_is_not_made() -> None:
    corners = _on_ball(16.0)
    for above, count in ((0.01, 0), (1.5, 1)):
        plane = (2, 16 + above)
        *_, ends = split_edges(
            corners, corners / 16, triangles=PAIR, wanted=BOTH, planes=(plane,), max_lift_um=0.6
        )
        assert len(ends) == count


def test_of_two_edges_of_one_triangle_the_longer_is_split() -> None:
    """A strip: the triangle in the middle has both as sides."""
    corners = np.array([[0, 0, 0], [8, 0, 0], [4, -1, 0], [9, 1, 0], [4.5, 1.2, 0]], float)
    strip = np.array([[1, 0, 2], [0, 1, 3], [0, 3, 4]])
    *_, ends = split_edges(
        corners,
        np.tile([0.0, 0, 1], (5, 1)),
        triangles=strip,
        wanted=np.array([True, False, True]),
        planes=(),
        max_lift_um=0.1,
    )
    np.testing.assert_array_equal(np.sort(ends), [[0, 3]])
