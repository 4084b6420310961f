"""Sheets that touch along edges, or in a vertex, come apart, and nothing else changes."""

import numpy as np
import pytest

from stereocell.meshes.separate_sheets import separate_sheets
from stereocell.meshes.validity import border, find_defects, label_components
from stereocell.model.mesh import Mesh
from support.meshes import SOUND, ball, joined, kinds, moved

BOX = SOUND["box"]  # 1 x 2 x 3


def welded(mesh: Mesh) -> Mesh:
    places, number = np.unique(mesh.positions, axis=0, return_inverse=True)
    return Mesh(places, number[mesh.triangles].astype(np.uint32), np.zeros_like(places))


def parted(mesh: Mesh) -> tuple[Mesh, np.ndarray]:
    larger, triangles, source = separate_sheets(mesh, mesh.triangles)
    return Mesh(larger.positions, triangles, larger.normals), source


@pytest.mark.parametrize("by", [(1.0, 2.0, 0.0), (1.0, 2.0, 3.0)], ids=["an edge", "a corner"])
def test_boxes_that_touch_along_an_edge_or_in_a_corner_come_apart(
    by: tuple[float, float, float],
) -> None:
    both = welded(joined(BOX, moved(BOX, by)))
    assert kinds(find_defects(both)) & {"non_manifold_edges", "non_manifold_vertices"}
    done, source = parted(both)
    assert kinds(find_defects(done)) == set()
    # what was there stays where it was; what is new stands in for a vertex that was shared
    np.testing.assert_array_equal(done.positions[: len(both.positions)], both.positions)
    assert (both.positions[source, :2] == [1, 2]).all()
    np.testing.assert_allclose(np.linalg.norm(done.normals[len(both.positions) :], axis=1), 1)
    np.testing.assert_array_equal(np.isin(both.triangles, source), done.triangles != both.triangles)


def test_neck_that_collapsed_to_a_vertex_is_cut() -> None:
    """A ball whose equator is drawn into its centre: two cups, tip to tip."""
    mesh = ball()
    belt = np.abs(mesh.positions[:, 2]) < 0.5
    number = np.where(belt, np.flatnonzero(belt)[0], np.arange(len(belt)))[mesh.triangles]
    positions = mesh.positions.copy()
    positions[belt] = 0
    whole = number[(number != np.roll(number, 1, axis=1)).all(axis=1)]
    pinched = Mesh(positions, whole.astype(np.uint32), mesh.normals)
    assert kinds(find_defects(pinched)) == {"non_manifold_vertices"}
    done, source = parted(pinched)
    assert kinds(find_defects(done)) == set()
    assert len(source) == 2
    assert (
        len(np.unique(label_components(done.triangles, len(done.positions))[done.triangles])) == 2
    )


@pytest.mark.parametrize("name", SOUND)
def test_sound_meshes_stay_as_they_are(name: str) -> None:
    larger, triangles, source = separate_sheets(SOUND[name], SOUND[name].triangles)
    np.testing.assert_array_equal(triangles, SOUND[name].triangles)
    np.testing.assert_array_equal(larger.positions, SOUND[name].positions)
    assert not len(source)


def test_vertices_of_a_border_stay() -> None:
    """A border is the neighbour's too: two open boxes, corner to corner on their rims."""
    both = welded(joined(BOX, moved(BOX, (1.0, 2.0, 3.0))))
    at = int(np.flatnonzero((both.positions == [1, 2, 3]).all(axis=1))[0])
    round_it = np.flatnonzero((both.triangles == at).any(axis=1))
    opened = Mesh(both.positions, np.delete(both.triangles, round_it[:1], axis=0), both.normals)
    _, triangles, source = separate_sheets(opened, opened.triangles)
    assert at in border(opened.triangles)
    assert not len(source)
    np.testing.assert_array_equal(triangles, opened.triangles)
