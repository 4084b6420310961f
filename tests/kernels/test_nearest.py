"""Nearest points by the grid, compared with those that libigl finds by its tree."""

import igl
import numpy as np
import pytest

from stereocell.meshes.distance import Nearest
from stereocell.model.mesh import Mesh
from support.exhaustive import examples
from support.meshes import ball, joined, moved


def scene() -> Mesh:
    """Return bodies of different sizes, and one triangle as large as all of them."""
    large = Mesh(
        np.float32([[-40, -40, 9], [40, -40, 9], [0, 60, 9]]),
        np.uint32([[0, 1, 2]]),
        np.zeros((3, 3), np.float32),
    )
    return joined(ball(5.0, 30), moved(ball(0.5, 30), (7.0, 0.0, 0.0)), large)


@pytest.mark.slow
@pytest.mark.parametrize("reach", [6.0, 60.0, 600.0])
def test_distances_equal_those_of_libigl(reach: float) -> None:
    mesh = scene()
    points = np.random.default_rng(0).uniform(-reach, reach, (examples(2000, 400), 3))
    vertices, triangles = mesh.positions.astype(np.float64), mesh.triangles.astype(np.int64)
    tree = igl.AABB()
    tree.init(vertices, triangles)
    squares, _, _ = tree.squared_distance(vertices, triangles, points)
    near = Nearest(mesh, 10)
    np.testing.assert_allclose(near.distances(points), np.sqrt(squares).ravel(), rtol=1e-9)
    chosen = mesh.positions[mesh.triangles[near.nearest_triangles(points)]].astype(np.float64)
    lone = Nearest(Mesh(chosen[0].astype(np.float32), np.uint32([[0, 1, 2]]), chosen[0]), 1)
    assert lone.distances(points[:1])[0] == pytest.approx(near.distances(points[:1])[0])


def test_sides_equal_those_of_libigl() -> None:
    mesh = joined(ball(5.0, 30), moved(ball(2.0, 7), (9.0, 0.0, 0.0)))
    points = np.random.default_rng(0).uniform(-12, 12, (5000, 3))
    signed, _, _, _ = igl.signed_distance(
        points,
        mesh.positions.astype(np.float64),
        mesh.triangles.astype(np.int64),
        sign_type=igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL,
    )
    np.testing.assert_array_equal(Nearest(mesh, 10).holds(points), signed <= 1e-6)


@pytest.mark.slow
def test_a_part_of_a_mesh_is_measured_with_the_grid_of_the_whole() -> None:
    mesh = joined(ball(5.0, 30), moved(ball(2.0, 7), (9.0, 0.0, 0.0)))
    alone, gone = ball(5.0, 30), np.zeros(len(mesh.positions), bool)
    gone[len(alone.positions) :] = True
    part, same = Nearest(mesh, 50).without(gone), Nearest(alone, 50)
    points = np.random.default_rng(0).uniform(-12, 12, (2000, 3))
    for _ in range(2):  # the second time, triangles that were examined before still count
        np.testing.assert_array_equal(part.distances(points), same.distances(points))
    np.testing.assert_array_equal(part.points, same.points)
    np.testing.assert_array_equal(part.vertices, same.vertices)
    part._tick = np.iinfo(np.int32).max - 1000
    np.testing.assert_array_equal(part.distances(points), same.distances(points))
