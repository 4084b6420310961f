"""Rims of neighbouring tiles are thinned out alike, and stay valid on each side."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.isosurface.extract import extract_surface
from stereocell.meshes.distance import Nearest
from stereocell.meshes.rims import thin_rims
from stereocell.meshes.validity import border, find_defects
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box
from support.meshes import kinds

SPACING = (0.28, 0.14, 0.14)
SHAPE = (30, 80, 100)
HALO = (6, 6, 6)
ERROR = 0.04
Field = NDArray[np.float32]
Edges = set[tuple[bytes, ...]]


@pytest.fixture(scope="module", params=[2.2, 1.4])
def sponge(request: pytest.FixtureRequest) -> Field:
    """Return smoothed noise, whose surface has curves of all kinds in every plane."""
    noise = np.random.default_rng(3).normal(size=SHAPE)
    field = ndimage.gaussian_filter(noise, request.param)
    return np.clip(field / field.std() * 0.4, -0.56, 0.56).astype(np.float32)


def _tiles(field: Field, error_um: float) -> list[tuple[Mesh, Lattice]]:
    """Return four tiles, two by two, of different sizes."""
    region, tiles = Box((0, 0, 0), SHAPE), []
    for y0, y1 in ((0, 41), (40, 80)):
        for x0, x1 in ((0, 61), (60, 100)):
            own = Box((0, y0, x0), (SHAPE[0], y1, x1))
            window = own.grown(HALO, region)
            lattice = Lattice(window, own, region, SPACING, (0.0, 0.0, 0.0))
            mesh = extract_surface(field[window.slices], lattice)
            if error_um > 0:
                mesh = thin_rims(mesh, field[window.slices], lattice, error_um=error_um)
            tiles.append((mesh, lattice))
    return tiles


def _rims(tiles: list[tuple[Mesh, Lattice]]) -> dict[tuple[int, float, int], list[Edges]]:
    """Return the border edges of both tiles at each common plane."""
    found: dict[tuple[int, float, int], list[Edges]] = {}
    for number, (mesh, lattice) in enumerate(tiles):
        ends = mesh.positions[border(mesh.triangles)]
        for axis, value in lattice.cut_planes():
            on = (ends[:, :, axis] == np.float32(value)).all(axis=1)
            edges = {tuple(sorted(point.tobytes() for point in edge)) for edge in ends[on]}
            beside = number // 2 if axis == 0 else number % 2
            found.setdefault((axis, value, beside), []).append(edges)
    return found


@pytest.mark.slow
def test_both_tiles_keep_the_same_edges_and_fewer_of_them(sponge: Field) -> None:
    whole, thinned = (_rims(_tiles(sponge, error)) for error in (0.0, ERROR))
    assert len(thinned) == 4
    for plane, (one, other) in thinned.items():
        assert one == other
        assert 20 < len(one) < 0.6 * len(whole[plane][0])


@pytest.mark.slow
def test_each_tile_is_valid(sponge: Field) -> None:
    for mesh, lattice in _tiles(sponge, ERROR):
        assert kinds(find_defects(mesh, planes=lattice.cut_planes())) == set()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [4, 6])
def test_no_triangle_comes_to_lie_in_a_second_plane_where_two_planes_meet(seed: int) -> None:
    noise = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=SHAPE), 0.8)
    field = np.clip(noise / noise.std() * 0.4, -0.56, 0.56).astype(np.float32)
    for mesh, lattice in _tiles(field, 0.1):
        assert not len(find_defects(mesh, planes=lattice.cut_planes()).in_cut_plane)


@pytest.mark.slow
def test_no_vertex_of_the_fine_rim_is_farther_than_the_error(sponge: Field) -> None:
    for (fine, _), (thin, _) in zip(_tiles(sponge, 0.0), _tiles(sponge, ERROR), strict=True):
        away = Nearest(thin, 10).distances(fine.positions.astype(np.float64))
        assert 0 < away.max() <= ERROR * (1 + 1e-6)


@pytest.mark.slow
def test_vertices_beside_the_planes_stay(sponge: Field) -> None:
    for (fine, lattice), (thin, _) in zip(_tiles(sponge, 0.0), _tiles(sponge, ERROR), strict=True):
        inside = np.ones(len(fine.positions), bool)
        for axis, value in lattice.cut_planes():
            inside &= fine.positions[:, axis] != np.float32(value)
        kept = {point.tobytes() for point in thin.positions}
        assert all(point.tobytes() in kept for point in fine.positions[inside])
