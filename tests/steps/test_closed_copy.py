"""Closed copies of tiles are manifolds by another library, and their union is the whole."""

from itertools import pairwise
from pathlib import Path

import manifold3d
import numpy as np
import pytest
import pyvista as pv
from numpy.typing import NDArray

from stereocell.formats.stl import write_stl
from stereocell.meshes.simplify_valid import Simplified
from stereocell.meshes.validity import find_defects, find_topology
from stereocell.model.lattice import Lattice, Plane
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box, cut
from stereocell.model.unit import Closed, Unit
from stereocell.steps import closed_copy
from stereocell.steps.closed_copy import close_tile
from stereocell.steps.unit_files import find_closed, load_record, save_unit

SPACING = (0.5, 0.25, 0.25)
REGION = Box((0, 0, 0), (30, 60, 60))
ERROR = 0.02


@pytest.fixture(scope="module")
def distance() -> NDArray[np.float32]:
    """Distances in um to two balls: one where four tiles meet, and one that leaves the region."""
    z, y, x = (i * h for i, h in zip(np.indices(REGION.shape), SPACING, strict=True))
    away = [
        np.sqrt((z - c) ** 2 + (y - b) ** 2 + (x - a) ** 2) - radius
        for c, b, a, radius in ((7.3, 7.6, 7.4, 4.2), (14.0, 2.0, 2.0, 3.0))
    ]
    return np.clip(-np.minimum(*away), -1, 1).astype(np.float32)


def close(field: NDArray[np.float32], lattice: Box) -> Closed:
    copy = close_tile(
        field, Lattice(REGION, lattice, REGION, SPACING, (0, 0, 0)), max_error_um=ERROR
    )
    assert copy is not None
    return copy


def as_manifold(mesh: Mesh) -> manifold3d.Manifold:
    return manifold3d.Manifold(manifold3d.Mesh(mesh.positions, mesh.triangles))


def test_copies_are_manifolds_and_their_union_is_the_whole(distance: NDArray[np.float32]) -> None:
    tiles = cut(REGION, (30, 30, 30))
    whole = as_manifold(close(distance, REGION).mesh)
    copies = []
    for tile in tiles:
        copy = close(distance, tile.lattice(REGION))
        mesh = copy.mesh
        assert (copy.faults, copy.fallbacks) == (find_defects(mesh).total, 0) == (0, 0)
        copies.append(as_manifold(mesh))
        assert copies[-1].status() == manifold3d.Error.NoError
        # at most a voxel past the cuts
        reach = mesh.positions.max(axis=0)[[2, 0]] / [SPACING[0], SPACING[2]]
        ends = [tile.lattice(REGION).stop[0], tile.lattice(REGION).stop[2]]
        assert (reach < np.array(ends)).all()
    assert len(copies) == 4
    union = manifold3d.Manifold.batch_boolean(copies, manifold3d.OpType.Add)
    assert union.status() == manifold3d.Error.NoError
    assert union.genus() == whole.genus() == -1  # two balls
    assert union.volume() == pytest.approx(whole.volume(), rel=0.01)
    assert sum(copy.volume() for copy in copies) > union.volume()
    for one, other in pairwise(copies):
        assert (one ^ other).volume() < 0.1 * one.volume()


def test_stl_is_read_back_by_vtk(distance: NDArray[np.float32], tmp_path: Path) -> None:
    mesh = close(distance, REGION).mesh
    write_stl(tmp_path / "a.stl", mesh)
    read = pv.read(tmp_path / "a.stl")  # VTK merges equal corners
    assert read.n_cells == len(mesh.triangles)
    assert read.is_manifold
    assert read.volume == pytest.approx(as_manifold(mesh).volume(), rel=1e-5)
    assert (tmp_path / "a.stl").stat().st_size == 84 + 50 * len(mesh.triangles)
    again = Mesh(np.float32(read.points), np.uint32(read.regular_faces), np.float32(read.points))
    assert as_manifold(again).volume() > 0  # triangles are wound outwards


def test_a_tile_without_a_solid_has_no_copy(distance: NDArray[np.float32]) -> None:
    nothing = -abs(distance) - 1
    assert close_tile(nothing, Lattice.of_whole(REGION, SPACING), max_error_um=1) is None


def test_a_copy_with_defects_after_simplification_stays_unsimplified(
    distance: NDArray[np.float32], monkeypatch: pytest.MonkeyPatch
) -> None:
    def spoil(mesh: Mesh, planes: tuple[Plane, ...], max_error_um: float) -> Simplified:
        damaged = Mesh(mesh.positions, mesh.triangles[1:], mesh.normals)
        topology = find_topology(damaged.triangles, len(damaged.positions))
        everywhere = np.ones(len(mesh.positions), bool)
        vertices = np.flatnonzero(everywhere)
        owners = vertices.astype(np.int32)
        return Simplified(damaged, topology, vertices, owners, everywhere, 0, 0)

    simple = close(distance, REGION)
    monkeypatch.setattr(closed_copy, "simplify_without_defects", spoil)
    copy = close(distance, REGION)
    assert len(copy.mesh.triangles) > len(simple.mesh.triangles)
    assert copy.faults == find_defects(copy.mesh).total == 0
    assert copy.fallbacks == 2  # both balls


def test_a_unit_s_record_describes_its_closed_copy(
    tmp_path: Path, distance: NDArray[np.float32]
) -> None:
    copy = close(distance, REGION)
    volume = np.zeros((3, 3, 3), np.uint8)
    save_unit(tmp_path / "with", Unit((), copy, volume, "", 0, 0, {}))
    count = len(copy.mesh.triangles)
    record = load_record(tmp_path / "with")
    assert record["closed"] == {"triangles": count, "faults": 0, "fallbacks": 0}
    assert record["files"]["closed.stl"]["bytes"] == 84 + 50 * count
    save_unit(tmp_path / "without", Unit((), None, volume, "", 0, 0, {}))
    assert load_record(tmp_path / "without")["closed"] is None
    assert find_closed(tmp_path / "without") is None
