"""The check of meshes passes valid ones, and finds each kind of defect that is put in by hand."""

from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv

from stereocell.isosurface.extract import extract_surface
from stereocell.meshes.validity import border, find_defects
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box
from support.meshes import SOUND, _with, ball, joined, kinds, moved, to_mesh, turned


@pytest.mark.parametrize("name", SOUND)
def test_valid_meshes_have_no_defects(name: str) -> None:
    assert kinds(find_defects(SOUND[name])) == set()


def test_a_missing_triangle_leaves_open_edges() -> None:
    defects = find_defects(_with(ball(), ball().triangles[1:]))
    assert kinds(defects) == {"open"}
    assert len(defects.open) == 3


def test_a_turned_triangle_has_non_manifold_edges() -> None:
    triangles = ball().triangles.copy()
    triangles[100] = triangles[100, ::-1]
    defects = find_defects(_with(ball(), triangles))
    assert kinds(defects) >= {"non_manifold_edges"}
    assert len(defects.non_manifold_edges) == 3


def test_a_triangle_that_is_listed_twice_is_found() -> None:
    triangles = np.concatenate([ball().triangles, ball().triangles[50:51]])
    defects = find_defects(_with(ball(), triangles))
    assert kinds(defects) >= {"non_manifold_edges", "crossings"}


def test_an_edge_of_four_triangles_is_found() -> None:
    """Two boxes share an edge and its two vertices."""
    a = SOUND["box"]
    b = moved(a, (1.0, 2.0, 0.0))
    both = joined(a, b)
    places, number = np.unique(both.positions, axis=0, return_inverse=True)
    welded = Mesh(places, number[both.triangles].astype(np.uint32), np.zeros_like(places))
    defects = find_defects(welded)
    assert len(defects.non_manifold_edges) == 1
    assert (welded.positions[defects.non_manifold_edges[0], :2] == [1, 2]).all()


def test_two_boxes_that_share_a_vertex_are_found() -> None:
    a = SOUND["box"]
    both = joined(a, moved(a, (1.0, 2.0, 3.0)))
    places, number = np.unique(both.positions, axis=0, return_inverse=True)
    welded = Mesh(places, number[both.triangles].astype(np.uint32), np.zeros_like(places))
    defects = find_defects(welded)
    assert kinds(defects) == {"non_manifold_vertices"}
    np.testing.assert_array_equal(welded.positions[defects.non_manifold_vertices], [[1, 2, 3]])
    # With a vertex for each box their topology is valid, but they still touch.
    assert kinds(find_defects(both)) == {"crossings"}


def test_a_triangle_in_a_cut_plane_is_found() -> None:
    """A ball is cut open at x = 0, and has a triangle of three vertices of its rim."""
    mesh = ball()
    x = mesh.positions[:, 0].copy()
    x[np.abs(x) < 1e-3] = 0
    mesh = replace(mesh, positions=np.column_stack([x, mesh.positions[:, 1:]]))
    half = _with(mesh, mesh.triangles[(x[mesh.triangles] >= 0).all(axis=1)])
    plane = (0, 0.0)
    assert kinds(find_defects(half, planes=(plane,))) == set()
    rim = border(half.triangles)
    after = dict(rim.tolist())
    first = int(rim[0, 0])
    second = after[first]
    lid = [[after[second], second, first]]
    defects = find_defects(_with(half, np.concatenate([half.triangles, lid])), planes=(plane,))
    assert kinds(defects) == {"in_cut_plane"}
    assert defects.in_cut_plane.tolist() == [len(half.triangles)]


def test_a_vertex_pushed_through_the_other_side_makes_crossings() -> None:
    positions = ball().positions.copy()
    top = int(positions[:, 2].argmax())
    positions[top, 2] = -6
    defects = find_defects(replace(ball(), positions=positions))
    assert kinds(defects) == {"crossings"}


def test_a_coplanar_fold_is_a_crossing() -> None:
    """A vertex of a box's flat face is moved over the next edge, within the face."""
    grid = pv.Box((0, 4, 0, 4, 0, 1), level=3).triangulate().clean()
    mesh = to_mesh(grid)
    assert kinds(find_defects(mesh)) == set()
    positions = mesh.positions.copy()
    inner = int(np.flatnonzero((positions == [1, 1, 1]).all(axis=1))[0])
    positions[inner] = [2.5, 1.25, 1]
    assert kinds(find_defects(replace(mesh, positions=positions))) == {"crossings"}


def test_a_sliver_without_area_is_degenerate() -> None:
    """Three corners lie on a line, but floating-point arithmetic gives an area that is not 0."""
    box = SOUND["box"]
    positions = np.concatenate([box.positions, box.positions[:1]])
    a, b, c = box.triangles[0]
    positions[-1] = (positions[a] + positions[b]) / 2
    new = len(positions) - 1
    split = np.array([[new, b, c], [a, new, c], [a, b, new]])
    defects = find_defects(Mesh(positions, np.concatenate([box.triangles[1:], split]), positions))
    assert kinds(defects) >= {"degenerate"}
    np.testing.assert_array_equal(defects.degenerate, [len(box.triangles) + 1])


def test_a_body_inside_out_and_a_cavity_without_a_solid_are_found() -> None:
    assert kinds(find_defects(turned(ball()))) == {"inside_out"}
    aside = joined(ball(), moved(turned(ball(2.0)), (20.0, 0.0, 0.0)))
    assert kinds(find_defects(aside)) == {"inside_out"}


def test_vertices_of_defects_are_those_around_the_hole() -> None:
    mesh = _with(ball(), ball().triangles[1:])
    np.testing.assert_array_equal(
        find_defects(mesh).vertices(mesh.triangles), np.sort(ball().triangles[0])
    )


def _half(at: int) -> tuple[Mesh, Box, Box]:
    region = Box((0, 0, 0), (20, 20, 20))
    lattice = Box((0, 0, 0), (20, 20, at + 1))
    z, y, x = np.indices(region.shape)
    distance = 6.3 - np.sqrt((z - 9.5) ** 2 + (y - 9.5) ** 2 + (x - 9.5) ** 2)
    part = np.clip(distance, -2, 2).astype(np.float32)[lattice.slices]
    origin = (0.0, 0.0, 0.0)
    return (
        extract_surface(part, Lattice(lattice, lattice, region, (1.0,) * 3, origin)),
        lattice,
        region,
    )


@pytest.mark.parametrize("at", [5, 10, 14])
def test_a_mesh_may_be_open_only_on_its_cut_planes(at: int) -> None:
    mesh, _, _ = _half(at)
    assert kinds(find_defects(mesh, planes=((0, float(at)),))) == set()
    assert kinds(find_defects(mesh)) >= {"open"}
    assert kinds(find_defects(mesh, planes=((0, float(at) + 1e-5),))) >= {"open"}
    assert len(border(mesh.triangles)) == len(find_defects(mesh).open)


@pytest.mark.parametrize("at", [5, 10, 14])
def test_a_cut_body_that_is_inside_out_is_found(at: int) -> None:
    """A small cap and all but a cap both enclose a volume with the plane."""
    mesh, _, _ = _half(at)
    assert kinds(find_defects(turned(mesh), planes=((0, float(at)),))) == {"inside_out"}


@pytest.mark.parametrize("seed", range(3))
def test_the_iso_surface_of_noise_is_valid(seed: int) -> None:
    """All cases of marching cubes occur next to each other in all combinations."""
    noise = np.random.default_rng(seed).normal(size=(24, 24, 24))
    distance = np.clip(noise, -2, 2).astype(np.float32)
    box = Box((0, 0, 0), (24, 24, 24))
    mesh = extract_surface(distance, Lattice.of_whole(box, (1.0,) * 3))
    assert len(mesh.triangles) > 30_000
    assert kinds(find_defects(mesh)) == set()
