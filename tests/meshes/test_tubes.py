"""Tubes are closed, face outwards, and have the volumes of prisms and cones."""

import numpy as np
import pytest

from stereocell.meshes.tubes import SIDES, sweep_tubes


def volume(mesh):
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(float) for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6


def polygon_area(diameter):
    return SIDES / 2 * (diameter / 2) ** 2 * np.sin(2 * np.pi / SIDES)


@pytest.mark.parametrize("end", [(7, 0, 0), (0, 7, 0), (0, 0, -7), (2, 3, 6)])
def test_a_straight_tube_has_the_volume_of_its_prism(end):
    mesh = sweep_tubes([(np.array([(0, 0, 0), end], float), np.array([2.0, 2.0]))])
    assert volume(mesh) == pytest.approx(7 * polygon_area(2), rel=1e-5)


def test_a_tube_is_closed_and_its_normals_point_outwards():
    points = np.array([(0, 0, 0), (5, 0, 0), (5, 5, 0), (5, 5, 5)], float)
    mesh = sweep_tubes([(points, np.full(4, 0.5))])
    _, where = np.unique(mesh.positions, axis=0, return_inverse=True)
    edges = where.ravel()[mesh.triangles][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    forward = {tuple(edge) for edge in edges.tolist()}
    assert len(forward) == len(edges)  # no edge is used twice in one direction
    assert forward == {(b, a) for a, b in forward}
    a, b, c = (mesh.positions[mesh.triangles[:, k]] for k in range(3))
    facing = np.cross(b - a, c - a)
    assert (np.einsum("ij,ij->i", facing, mesh.normals[mesh.triangles[:, 0]]) > 0).all()


def test_a_tapering_tube_has_the_volume_of_a_pyramid():
    mesh = sweep_tubes([(np.array([(0, 0, 0), (0, 0, 6)], float), np.array([2.0, 0.0]))])
    assert volume(mesh) == pytest.approx(6 * polygon_area(2) / 3, rel=1e-5)


def test_lines_without_a_length_have_no_tube():
    assert sweep_tubes([(np.zeros((3, 3)), np.ones(3))]) is None
    assert sweep_tubes([]) is None
