"""Bodies get back the volume that simplification took."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from stereocell.isosurface.extract import extract_surface
from stereocell.meshes import keep_volume
from stereocell.meshes.keep_volume import EarlierLevel, FineVolumes
from stereocell.meshes.simplify_valid import Simplifier, simplify_without_defects
from stereocell.meshes.validity import Defects, border, find_defects, label_components
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box
from support.meshes import ball, crowd, enclosed_volume, joined, kinds, moved, turned

ERROR = 0.6


def kept(fine: Mesh, planes: tuple[tuple[int, float], ...] = ()) -> tuple[Mesh, Mesh]:
    """Return the simplified mesh, and the same mesh with its volumes restored."""
    simple = simplify_without_defects(fine, planes, max_error_um=ERROR)
    found = FineVolumes(fine, planes).keep(
        simple.mesh, simple.vertices, simple.owners, max_move_um=ERROR
    )
    assert found.defects.counts == find_defects(found.mesh, planes=planes).counts
    return simple.mesh, found.mesh


@pytest.mark.parametrize("fine", [ball(5.0, 60), joined(ball(5.0, 60), turned(ball(3.0, 40)))])
def test_bodies_and_cavities_get_their_volume_back(fine: Mesh) -> None:
    simple, mesh = kept(fine)
    assert abs(enclosed_volume(simple) / enclosed_volume(fine) - 1) > 0.03
    assert enclosed_volume(mesh) == pytest.approx(enclosed_volume(fine), rel=1e-3)
    assert np.linalg.norm(mesh.positions - simple.positions, axis=1).max() <= ERROR + 1e-6


def half_ball() -> tuple[Mesh, tuple[tuple[int, float], ...]]:
    """Return the upper half of a ball, open on a plane, and that plane."""
    sphere = ball(5.0, 60)
    flat = np.float32([[1, 1, 1]]) * sphere.positions
    flat[:, 2] = np.where(np.abs(flat[:, 2]) < 1e-3, 0, flat[:, 2])
    upper = (flat[:, 2] >= 0)[sphere.triangles].all(axis=1)
    half = Mesh(flat, sphere.triangles[upper], sphere.normals)
    planes = ((2, float(flat[np.unique(border(half.triangles)), 2].min())),)
    assert kinds(find_defects(half, planes=planes)) == set()
    return half, planes


def test_vertices_of_a_cut_stay_bit_by_bit_and_no_other_passes_it() -> None:
    half, planes = half_ball()
    simple, mesh = kept(half, planes)
    rim = np.unique(border(simple.triangles))
    np.testing.assert_array_equal(mesh.positions[rim], simple.positions[rim])
    assert mesh.positions[:, 2].min() == planes[0][1]
    whole = 2 / 3 * np.pi * 125
    assert abs(enclosed_volume(mesh) - enclosed_volume(half)) < 0.002 * whole
    assert abs(enclosed_volume(simple) - enclosed_volume(half)) > 0.02 * whole


def test_no_vertex_leaves_the_common_box_of_tile_and_fine_mesh() -> None:
    fine = ball(5.0, 60)
    simple = simplify_without_defects(fine, (), max_error_um=ERROR)
    box = np.array([-9.0, -9.0, -4.0]), np.array([9.0, 4.0, 9.0])
    bound, unbound = FineVolumes(fine, (), box), FineVolumes(fine, ())
    mesh, free = (
        each.keep(simple.mesh, simple.vertices, simple.owners, max_move_um=ERROR).mesh
        for each in (bound, unbound)
    )
    low, high = fine.positions.min(axis=0), fine.positions.max(axis=0)
    assert free.positions[:, 2].min() < low[2] - 0.05
    assert free.positions[:, 1].max() > high[1] + 0.05
    assert mesh.positions[:, 2].min() >= low[2]
    assert mesh.positions[:, 1].max() <= high[1]
    assert np.linalg.norm(mesh.positions, axis=1).max() > 5.05  # elsewhere vertices moved out
    assert enclosed_volume(mesh) == pytest.approx(enclosed_volume(fine), rel=0.003)


def test_bodies_stop_moving_at_once_if_very_many_vertices_would_cross(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In noise all tries would fail, and cost more than the rest of the level."""
    one = ball(5.0, 60)
    pair = joined(one, moved(one, (10.02, 0.0, 0.0)))
    checks = []

    def count_checks(*given: Any, **named: Any) -> Defects:
        checks.append(given)
        return find_defects(*given, **named)

    monkeypatch.setattr(keep_volume, "find_defects", count_checks)
    monkeypatch.setattr(keep_volume, "COSTLY", 1)
    simple, mesh = kept(pair)
    np.testing.assert_array_equal(mesh.positions, simple.positions)
    assert len(checks) == 2


def test_bodies_that_would_cross_stay_apart_and_grow_elsewhere() -> None:
    fine = crowd()
    simple, mesh = kept(fine)
    assert kinds(find_defects(mesh)) == set()
    assert enclosed_volume(simple) < 0.82 * enclosed_volume(fine)
    assert enclosed_volume(mesh) > 0.995 * enclosed_volume(fine)


def test_a_body_s_missing_volume_is_measured_against_its_own_even_if_a_cut_opens_it() -> None:
    half, planes = half_ball()
    fine = joined(half, moved(ball(5.0, 60), (12.0, 0.0, 8.0)))
    simple = simplify_without_defects(fine, planes, max_error_um=ERROR)
    volumes, lacks_volume = FineVolumes(fine, planes), []
    for move in (0.01, 0.05, 0.1, 0.2, ERROR):
        found = volumes.keep(simple.mesh, simple.vertices, simple.owners, max_move_um=move)
        for is_half, whole in ((True, 250 / 3 * np.pi), (False, 500 / 3 * np.pi)):
            before, after = (
                enclosed_volume(replace(mesh, triangles=mesh.triangles[
                    (mesh.positions[mesh.triangles[:, 0], 0] < 6) == is_half
                ])) for mesh in (fine, found.mesh)
            )  # fmt: skip
            lacks_volume.append(abs(after - before) > 0.03 * whole)
            own = (found.mesh.positions[:, 0] < 6) == is_half
            assert (found.lacks[own] == lacks_volume[-1]).all()
    assert lacks_volume[:2] == [True, True]
    assert lacks_volume[-2:] == [False, False]


def test_unchanged_bodies_keep_their_moves_and_are_not_checked_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fine = joined(crowd(), moved(ball(5.0, 60), (40.0, 0.0, 0.0)))
    volumes, simplifier = FineVolumes(fine, ()), Simplifier(fine, ())
    before = simplifier.simplify(ERROR)
    first = volumes.keep(before.mesh, before.vertices, before.owners, max_move_um=ERROR)
    chosen = np.zeros(label_components(fine.triangles, len(fine.positions)).max() + 1, bool)
    chosen[-1] = True
    after = simplifier.simplify(ERROR / 4, chosen)
    is_far = after.mesh.positions[:, 0] > 30
    np.testing.assert_array_equal(after.changed, is_far)
    counts = []

    def count_fresh(*given: Any, fresh: Any, **named: Any) -> Defects:
        counts.append(fresh.sum())
        return find_defects(*given, fresh=fresh, **named)

    monkeypatch.setattr(keep_volume, "find_defects", count_fresh)
    earlier = EarlierLevel(first, before.vertices, after.changed)
    second = volumes.keep(
        after.mesh, after.vertices, after.owners, max_move_um=ERROR, earlier=earlier
    )
    assert counts[0] == is_far[after.mesh.triangles[:, 0]].sum()
    assert len(counts) == 1
    was_far = before.mesh.positions[:, 0] > 30
    np.testing.assert_array_equal(second.mesh.positions[~is_far], first.mesh.positions[~was_far])
    assert second.defects.total == 0
    assert find_defects(second.mesh).total == 0
    assert enclosed_volume(second.mesh) > 0.995 * enclosed_volume(fine)


def test_defects_of_unchanged_bodies_are_reported_again() -> None:
    one = ball(5.0, 60)
    fine = joined(one, moved(one, (6.0, 0.0, 0.0)), moved(one, (40.0, 0.0, 0.0)))
    volumes, simplifier = FineVolumes(fine, ()), Simplifier(fine, ())
    before = simplifier.simplify(ERROR)
    first = volumes.keep(before.mesh, before.vertices, before.owners, max_move_um=ERROR)
    after = simplifier.simplify(ERROR / 4, np.array([False, False, True]))
    earlier = EarlierLevel(first, before.vertices, after.changed)
    second = volumes.keep(
        after.mesh, after.vertices, after.owners, max_move_um=ERROR, earlier=earlier
    )
    assert first.defects.total > 0
    assert second.defects.counts == first.defects.counts
    assert after.fallbacks == 2


def shells(seed: int) -> Mesh:
    """Return bent walls within walls, a voxel or two apart."""
    at = np.stack(np.indices((28,) * 3), -1).astype(float)
    bent = 5 * ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(28,) * 3), 2)
    away = np.linalg.norm(at - 14, axis=-1) + bent
    distance = np.clip((np.abs(away / 4 % 1 - 0.5) - 0.2) * 4, -2, 2).astype(np.float32)
    return extract_surface(distance, Lattice.of_whole(Box((0, 0, 0), (28,) * 3), (1.0,) * 3))


@pytest.mark.parametrize("seed", [19, 21])
def test_a_body_that_crosses_an_unmoved_body_is_not_moved_either(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keep_volume, "TRIES", 0)
    simple = simplify_without_defects(shells(seed), (), max_error_um=1.0)
    found = FineVolumes(shells(seed), ()).keep(
        simple.mesh, simple.vertices, simple.owners, max_move_um=1.0
    )
    assert find_defects(found.mesh).total == 0
    moved_to = simple.mesh.positions + found.moves
    np.testing.assert_allclose(found.mesh.positions, moved_to, atol=1e-5)
