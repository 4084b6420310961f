"""Levels of detail: error, borders, measured distance."""

import numpy as np
import pytest
import pyvista as pv

from stereocell.meshes.distance import Nearest, measure_spread
from stereocell.meshes.options import LodOptions
from stereocell.meshes.simplify import STRAY, simplify
from stereocell.model.errors import UsageError
from stereocell.model.mesh import Mesh
from support.meshes import joined, moved, open_edges, to_mesh


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


def _distance(a: Mesh, b: Mesh) -> float:
    one, other = Nearest(a, 4000), Nearest(b, 4000)
    return max(measure_spread(one, other).p99, measure_spread(other, one).p99)


def _border(mesh: Mesh) -> set[bytes]:
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    once, count = np.unique(edges, axis=0, return_counts=True)
    return {p.tobytes() for p in mesh.positions[np.unique(once[count == 1])]}


@pytest.mark.parametrize("error", [0.02, 0.1, 0.5])
def test_a_coarser_level_has_fewer_triangles_and_stays_near(error: float) -> None:
    fine = _sphere()
    coarse = simplify(fine, error)
    assert len(coarse.triangles) < 0.6 * len(fine.triangles)
    assert _distance(fine, coarse) < 3 * error


def test_cut_edges_are_locked() -> None:
    half = _open_half()
    coarse = simplify(half, 1.0)
    assert len(coarse.triangles) < len(half.triangles)
    assert _border(half) == _border(coarse)


@pytest.mark.slow
def test_distance_between_concentric_spheres_is_the_difference_of_radii() -> None:
    assert _distance(_sphere(5.0), _sphere(4.0)) == pytest.approx(1.0, abs=0.02)


def test_a_small_body_stays_a_solid_beside_a_large_one() -> None:
    large, small = _sphere(), _sphere(0.4, 24)
    both = joined(large, moved(small, (9.0, 0.0, 0.0)))
    coarse = simplify(both, 1.0)
    far = coarse.positions[:, 0] > 8
    assert 4 <= far[coarse.triangles].all(axis=1).sum() < 0.2 * len(small.triangles)
    assert np.ptp(coarse.positions[far], axis=0).min() > 0.1  # the small body is not flat
    assert open_edges(coarse) == 0
    again = simplify(coarse, 2.0)  # the next level has the small body too
    assert (again.positions[:, 0] > 8).sum() >= 4


@pytest.mark.parametrize("error", [0.1, 1.0])
def test_no_vertex_is_farther_than_three_errors_from_the_result(error: float) -> None:
    fine = _sphere()
    away = Nearest(simplify(fine, error), 10).distances(fine.positions.astype(np.float64))
    assert away.max() <= STRAY * error


def test_remaining_vertices_have_not_moved() -> None:
    fine = _sphere()
    there = {row.tobytes() for row in np.concatenate([fine.positions, fine.normals], axis=1)}
    coarse = simplify(fine, 0.1)
    assert {
        row.tobytes() for row in np.concatenate([coarse.positions, coarse.normals], axis=1)
    } < there


def test_a_handle_stays_at_any_error() -> None:
    torus = to_mesh(pv.ParametricTorus(u_res=60, v_res=30).triangulate().clean())
    coarse = simplify(torus, 5.0)
    edges = np.sort(coarse.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    euler = len(coarse.positions) - len(np.unique(edges, axis=0)) + len(coarse.triangles)
    assert euler == 0
    assert len(coarse.triangles) < 0.1 * len(torus.triangles)


def test_no_triangle_comes_to_lie_in_a_cut_plane() -> None:
    """A shallow dome over a square cut, whose corners would form triangles in the cut plane."""
    side = 9
    y, x = np.mgrid[:side, :side].astype(np.float32)
    rise = np.minimum(np.minimum(x, side - 1 - x), np.minimum(y, side - 1 - y)) * 0.1
    positions = np.stack([x, y, rise], axis=-1).reshape(-1, 3)
    at = np.arange(side * side).reshape(side, side)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[:-1, 1:], at[1:, :-1], at[1:, 1:]))
    triangles = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)]).astype(np.uint32)
    triangles = triangles[(rise.ravel()[triangles] > 0).any(axis=1)]  # removes two of the corners
    dome = Mesh(positions, triangles, np.zeros_like(positions))
    without, coarse = simplify(dome, 5.0), simplify(dome, 5.0, planes=((2, 0.0),))
    assert (without.positions[:, 2] == 0)[without.triangles].all(axis=1).any()
    assert not (coarse.positions[:, 2] == 0)[coarse.triangles].all(axis=1).any()


def test_a_body_keeps_its_border_at_any_error() -> None:
    half = _open_half()
    coarse = simplify(half, 50.0)
    assert _border(half) == _border(coarse)
    edges = np.sort(coarse.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    assert (count == 1).sum() == len(_border(half))


def test_simplified_levels_of_a_thin_plate_stay_closed_and_solid() -> None:
    """Simplification tends to fold a plate that is far thinner than the error onto itself."""
    sphere = _sphere(sides=48)
    plate = Mesh(sphere.positions * np.float32([1, 1, 0.01]), sphere.triangles, sphere.normals)
    mesh = plate
    for error in (0.1, 0.5, 2.0, 4.0):
        mesh = simplify(mesh, error)
        assert len(mesh.triangles) >= 4
        assert open_edges(mesh) == 0
        assert len(np.unique(np.sort(mesh.triangles, axis=1), axis=0)) == len(mesh.triangles)


def test_errors_must_rise() -> None:
    with pytest.raises(UsageError, match="expected rising positive numbers"):
        LodOptions(errors=(0.5, 0.1))


def test_no_samples_is_wrong_usage() -> None:
    with pytest.raises(UsageError, match=r"lod\.samples is 0, expected 1 to 1e"):
        LodOptions(samples=0)
