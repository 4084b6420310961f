"""Vertices that unwrapping copied are joined, and no others."""

from collections import Counter

import numpy as np
import pytest

from stereocell.meshes.weld import weld_seams
from stereocell.model.mesh import Mesh

# An octahedron: it is closed, and each vertex is its own normal
_PLACES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], "f4")
_FACES = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]


def cut_apart(objects: list[int] | None = None) -> Mesh:
    """Return the octahedron with separate vertices for each face, as if each were one chart."""
    corners = np.array(_FACES).ravel()
    places = _PLACES[corners]
    return Mesh(
        places,
        np.arange(24, dtype=np.uint32).reshape(8, 3),
        places,
        np.zeros((24, 2), np.float32),
        objects=None if objects is None else np.repeat(np.array(objects, np.int32), 3),
    )


def faces_at_edges(triangles: np.ndarray) -> set[int]:
    edges = Counter(
        tuple(sorted((int(face[k]), int(face[k - 1])))) for face in triangles for k in range(3)
    )
    return set(edges.values())


def test_a_surface_that_was_cut_into_charts_is_closed_after_welding():
    mesh = cut_apart()
    assert faces_at_edges(mesh.triangles) == {1}
    kept, welded = weld_seams(mesh)
    assert len(kept) == 6
    assert faces_at_edges(welded[mesh.triangles]) == {2}
    assert np.array_equal(mesh.positions[kept][welded], mesh.positions)
    assert (np.diff(kept) > 0).all()  # points keep their order


def test_surfaces_that_touch_stay_apart():
    mesh = cut_apart()
    turned = mesh.normals.copy()
    turned[:3] = -turned[:3]  # the first face belongs to a surface that faces the other way
    kept, _ = weld_seams(Mesh(mesh.positions, mesh.triangles, turned, mesh.uvs))
    assert len(kept) == 6 + 3


def test_vertices_of_different_objects_are_not_joined():
    kept, welded = weld_seams(cut_apart(objects=[0] * 4 + [1] * 4))
    assert len(kept) == 5 + 5
    assert set(welded[:12]).isdisjoint(welded[12:])


@pytest.mark.parametrize("size", [0, 24])
def test_a_mesh_without_uvs_does_not_change(size):
    mesh = cut_apart()
    plain = Mesh(mesh.positions[:size], mesh.triangles[: size // 3], mesh.normals[:size])
    kept, welded = weld_seams(plain)
    assert np.array_equal(kept, np.arange(size))
    assert np.array_equal(welded, np.arange(size))
