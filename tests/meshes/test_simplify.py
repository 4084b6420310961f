"""Levels of detail: error, borders, measured distance."""

import numpy as np
import pytest
import pyvista as pv

from stereocell.meshes.distance import Nearest, measure_distance
from stereocell.meshes.options import LodOptions
from stereocell.meshes.simplify import FEWEST, drop_doubles, simplify
from stereocell.model.errors import UsageError
from stereocell.model.mesh import Mesh
from support.meshes import open_edges


def _sphere(radius: float = 5.0, sides: int = 96) -> Mesh:
    sphere = pv.Sphere(radius=radius, theta_resolution=sides, phi_resolution=sides)
    positions = np.asarray(sphere.points, np.float32)
    triangles = sphere.regular_faces.astype(np.uint32)
    return Mesh(positions, triangles, (positions / radius).astype(np.float32))


def _open_half() -> Mesh:
    sphere = _sphere()
    keep = (sphere.positions[sphere.triangles][:, :, 0] >= 0).all(axis=1)
    used = np.unique(sphere.triangles[keep])
    renumber = np.zeros(len(sphere.positions), np.uint32)
    renumber[used] = np.arange(len(used))
    return Mesh(sphere.positions[used], renumber[sphere.triangles[keep]], sphere.normals[used])


def _border(mesh: Mesh) -> set[bytes]:
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    once, count = np.unique(edges, axis=0, return_counts=True)
    return {p.tobytes() for p in mesh.positions[np.unique(once[count == 1])]}


@pytest.mark.parametrize("error", [0.02, 0.1, 0.5])
def test_coarser_level_has_fewer_triangles_and_stays_near(error: float) -> None:
    fine = _sphere()
    coarse = simplify(fine, error)
    assert len(coarse.triangles) < 0.6 * len(fine.triangles)
    assert measure_distance(Nearest(fine, 4000), Nearest(coarse, 4000)) < 3 * error


def test_cut_edges_are_locked() -> None:
    half = _open_half()
    coarse = simplify(half, 1.0)
    assert len(coarse.triangles) < len(half.triangles)
    assert _border(half) == _border(coarse)


def test_distance_between_concentric_spheres_is_the_difference_of_radii() -> None:
    measured = measure_distance(Nearest(_sphere(5.0), 4000), Nearest(_sphere(4.0), 4000))
    assert measured == pytest.approx(1.0, abs=0.02)


def test_small_body_shrinks_to_its_simplest_beside_a_large_one() -> None:
    large, small = _sphere(), _sphere(0.4, 24)
    moved = small.positions + np.float32([9, 0, 0])
    both = Mesh(
        np.concatenate([large.positions, moved]),
        np.concatenate([large.triangles, small.triangles + np.uint32(len(large.positions))]),
        np.concatenate([large.normals, small.normals]),
    )
    coarse = simplify(both, 1.0)
    far = coarse.positions[:, 0] > 8
    assert 4 <= far[coarse.triangles].all(axis=1).sum() <= FEWEST
    assert np.ptp(coarse.positions[far], axis=0).min() > 0.1  # it doesn't lie flat
    assert open_edges(coarse) == 0
    again = simplify(coarse, 2.0)  # the next level has it too
    assert (again.positions[:, 0] > 8).sum() >= 4


def test_body_with_a_border_keeps_it_whatever_the_error() -> None:
    half = _open_half()
    coarse = simplify(half, 50.0)
    assert _border(half) == _border(coarse)
    edges = np.sort(coarse.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    assert (count == 1).sum() == len(_border(half))


def test_sheets_without_thickness_and_repeated_triangles_go() -> None:
    tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    sheet = [[4, 5, 6], [5, 4, 6]]
    leaf = [[0, 1, 4], [4, 1, 0]]  # hangs on an edge of the tetrahedron
    repeated = [[3, 0, 1]]
    collapsed = [[7, 7, 0], [7, 8, 7]]
    triangles = np.array(leaf + tetrahedron + sheet + repeated + collapsed, np.uint32)
    np.testing.assert_array_equal(drop_doubles(triangles), tetrahedron)
    # two one way and one the other: as many as they are worth stay, as the first of them has it
    odd = np.array([[5, 4, 6], [4, 5, 6], [6, 4, 5]], np.uint32)
    np.testing.assert_array_equal(drop_doubles(odd), [[4, 5, 6]])
    assert len(drop_doubles(np.zeros((0, 3), np.uint32))) == 0


def test_simplified_levels_of_a_thin_plate_stay_closed_and_without_sheets() -> None:
    """A plate far thinner than the error is what simplification folds onto itself."""
    sphere = _sphere(sides=48)
    plate = Mesh(sphere.positions * np.float32([1, 1, 0.01]), sphere.triangles, sphere.normals)
    mesh = plate
    for error in (0.1, 0.5, 2.0, 4.0):
        mesh = simplify(mesh, error)
        assert len(mesh.triangles) >= 4
        assert open_edges(mesh) == 0
        assert len(drop_doubles(mesh.triangles)) == len(mesh.triangles)


def test_errors_must_rise() -> None:
    with pytest.raises(UsageError, match="expected rising positive numbers"):
        LodOptions(errors=(0.5, 0.1))


def test_no_samples_is_wrong_usage() -> None:
    with pytest.raises(UsageError, match=r"lod\.samples is 0, expected 1 or more"):
        LodOptions(samples=0)
