"""Vertices of levels of detail are placed nearer to the fine surface."""

from dataclasses import replace

import numpy as np
import pytest

from stereocell.meshes.distance import Nearest, measure_spread
from stereocell.meshes.keep_volume import FineVolumes
from stereocell.meshes.place_vertices import FinePlanes
from stereocell.meshes.simplify_valid import Simplifier, simplify_without_defects
from stereocell.meshes.validity import find_defects
from stereocell.model.mesh import Mesh
from support.meshes import ball, enclosed_volume


def wavy(waves: float) -> Mesh:
    """Return a ball of 120 x 120 vertices with bumps and dents, as tissue has."""
    mesh = ball(5.0, 120)
    x, y, z = mesh.normals.T
    height = 1 + 0.12 * np.sin(waves * x + 1) * np.sin(waves * y + 2) * np.sin(waves * z + 3)
    return replace(mesh, positions=(mesh.positions * height[:, None]).astype(np.float32))


@pytest.mark.parametrize("waves", [3.0, 5.0, 8.0])
def test_placed_vertices_bring_a_body_nearer_to_its_fine_surface(waves: float) -> None:
    fine = wavy(waves)
    simple = simplify_without_defects(fine, (), max_error_um=0.3)
    unmoved, reference, means = np.full_like(simple.owners, -1), Nearest(fine, 20_000), []
    for owners in (simple.owners, unmoved):
        found = FineVolumes(fine, ()).keep(simple.mesh, simple.vertices, owners, max_move_um=0.3)
        assert find_defects(found.mesh).total == 0
        assert enclosed_volume(found.mesh) == pytest.approx(enclosed_volume(fine), rel=1e-3)
        there = measure_spread(reference, Nearest(found.mesh, 20_000))
        back = measure_spread(Nearest(found.mesh, 20_000), reference)
        means.append(there.mean + back.mean)
    assert means[0] < 0.9 * means[1]


def test_vertices_of_a_cap_are_placed_within_its_plane() -> None:
    sphere = ball(5.0, 60)
    # All that lies above 3 is pressed flat, as a cap is.
    flat = np.minimum(sphere.positions, np.float32([9, 9, 3]))
    fine = replace(sphere, positions=flat)
    caps = ((2, 3.0),)
    simple = Simplifier(fine, (), None, caps).simplify(0.3)
    start, triangles = simple.mesh.positions.astype(np.float64), simple.topology.corners
    corners = np.ascontiguousarray(fine.triangles, np.int32)
    on_cap = start[:, 2] == 3
    for known, is_flat in ((caps, True), ((), False)):
        moves = FinePlanes(fine, corners, known).find_moves(start, triangles, simple.owners, 0.3)
        assert on_cap.sum() > 5
        assert (moves[on_cap, 2] == 0).all() == is_flat
        assert moves[on_cap, :2].any()
        assert moves[~on_cap].any()
