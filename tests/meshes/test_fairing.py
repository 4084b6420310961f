"""Sharp triangles go; borders stay, the surface stays, and no fault comes of it."""

from dataclasses import replace

import numpy as np
import pytest

from stereocell.isosurface.extract import RIM_SNAP, extract_surface
from stereocell.meshes import fairing
from stereocell.meshes.fairing import make_fair
from stereocell.meshes.validity import border, find_defects
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Mesh
from stereocell.model.tiling import Box
from stereocell.textures.lod_chain import sharpest_angle
from support.meshes import ball, joined, kinds, moved, turned

FLAT = np.array([[0, 0, 0], [8, 0, 0], [4, 1, 0], [4, -1, 0], [4, 0, -3]], np.float32)
# two slivers along the long diagonal 0-1, closed by a point below
ROOF = [[0, 1, 2], [1, 0, 3], [2, 1, 4], [1, 3, 4], [3, 0, 4], [0, 2, 4]]


def _roof(height: float = 0.0) -> Mesh:
    positions = FLAT.copy()
    positions[:2, 2] = height
    return Mesh(positions, np.array(ROOF, np.uint32), np.zeros_like(positions))


def _edges(mesh: Mesh) -> set[tuple[int, int]]:
    pairs = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return {(a, b) for a, b in pairs.tolist()}


def test_long_diagonal_becomes_the_short_one() -> None:
    fair = make_fair(_roof(), (), max_slide_um=0.0, max_turn_um=0.1)
    assert _edges(_roof()) - _edges(fair) == {(0, 1)}
    assert _edges(fair) - _edges(_roof()) == {(2, 3)}
    assert kinds(find_defects(fair)) == set()
    assert sharpest_angle(fair) > 1.4 * sharpest_angle(_roof())


def test_ridge_is_not_turned_beyond_the_bound() -> None:
    """Its two diagonals are `height` apart."""
    assert _edges(make_fair(_roof(0.2), (), max_slide_um=0.0, max_turn_um=0.1)) == _edges(_roof())
    assert _edges(make_fair(_roof(0.2), (), max_slide_um=0.0, max_turn_um=0.3)) != _edges(_roof())


def test_border_and_vertices_stay() -> None:
    squeezed = ball(5.0, 40)
    positions = np.round(squeezed.positions * np.float32([1, 0.3, 1]), 3)
    keep = (positions[squeezed.triangles][:, :, 0] >= 0).all(axis=1)
    half = replace(squeezed, positions=positions, triangles=squeezed.triangles[keep])
    fair = make_fair(half, ((0, 0.0),), max_slide_um=0.0, max_turn_um=0.5)
    assert (fair.triangles[: len(half.triangles)] != half.triangles).any()
    np.testing.assert_array_equal(fair.positions[: len(half.positions)], half.positions)
    np.testing.assert_array_equal(border(fair.triangles), border(half.triangles))


def test_turn_that_would_make_a_fault_is_not_made() -> None:
    """A point close below the ridge would pierce the face that the turn lowers."""
    roof = _roof(0.2)
    positions = np.concatenate([roof.positions, FLAT[[4, 0, 1, 2]] * np.float32(0.2)])
    positions[5:] = [[4, 0, 0.15], [3.9, 0.1, -1], [4.1, 0.1, -1], [4, -0.1, -1]]
    inner = np.array([[5, 6, 8], [5, 8, 7], [5, 7, 6], [6, 7, 8]], np.uint32)
    nested = Mesh(
        positions, np.concatenate([roof.triangles, inner[:, ::-1]]), np.zeros_like(positions)
    )
    before = find_defects(nested)
    assert "crossings" not in kinds(before)
    fair = make_fair(nested, (), max_slide_um=0.0, max_turn_um=0.3)
    assert "crossings" not in kinds(find_defects(fair))
    assert (0, 1) in _edges(fair)


@pytest.mark.parametrize("bound", [0.01, 0.5])
def test_turning_is_the_same_twice(bound: float) -> None:
    squeezed = replace(ball(), positions=ball().positions * np.float32([1, 1, 0.2]))
    first, second = (make_fair(squeezed, (), max_slide_um=0.1, max_turn_um=bound) for _ in range(2))
    np.testing.assert_array_equal(first.triangles, second.triangles)
    assert sharpest_angle(first) >= sharpest_angle(squeezed)


def _cut_ball() -> tuple[Mesh, tuple[int, float]]:
    """A ball's iso-surface, open at a plane through it; its normals are exact."""
    shape, radius = (40, 40, 40), 12.3
    z, y, x = np.indices(shape) - np.float64(19.6)
    distance = (radius - np.sqrt(z**2 + y**2 + x**2)).astype(np.float32)
    whole, part = Box((0, 0, 0), shape), Box((0, 0, 0), (40, 40, 23))
    mesh = extract_surface(
        np.clip(distance, -2, 2), Lattice(whole, part, whole, (1, 1, 1), (0, 0, 0))
    )
    return mesh, (0, 22.0)


def test_slides_make_an_iso_surface_fair_and_keep_it_on_the_ball() -> None:
    mesh, plane = _cut_ball()
    fair = make_fair(mesh, (plane,), max_slide_um=0.5, max_turn_um=0.05)
    assert sharpest_angle(mesh) < 5
    assert sharpest_angle(fair) > 15
    assert kinds(find_defects(fair, (plane,))) == set()
    rim = border(mesh.triangles)
    np.testing.assert_array_equal(border(fair.triangles), rim)
    np.testing.assert_array_equal(fair.positions[rim], mesh.positions[rim])
    assert fair.positions[:, 0].max() <= np.float32(22.0)
    assert set(np.flatnonzero(fair.positions[:, 0] == 22)) == set(rim.ravel().tolist())
    outward = fair.positions - np.float32([19.6, -19.6, 19.6])
    away = np.abs(np.linalg.norm(outward, axis=1) - 12.3)
    on_rim = np.isin(np.arange(len(away)), rim)
    assert away[~on_rim].max() < 0.1
    assert away[on_rim].max() < RIM_SNAP
    assert np.linalg.norm(fair.positions - mesh.positions, axis=1).max() <= 0.5 + 1e-5
    cosine = (fair.normals * outward).sum(axis=1) / np.linalg.norm(outward, axis=1)
    assert cosine.min() > np.cos(np.radians(3))


def _shell(thickness: float) -> Mesh:
    """A cavity in a ball: both walls are iso-surfaces of their own, with vertices of their own."""
    shape = (40, 40, 40)
    z, y, x = np.indices(shape) - np.float64(19.6)
    away, whole = np.sqrt(z**2 + y**2 + x**2), Box((0, 0, 0), shape)
    walls = [
        extract_surface(
            np.clip(radius - away, -2, 2).astype(np.float32), Lattice.of_whole(whole, (1, 1, 1))
        )
        for radius in (12.3, 12.3 - thickness)
    ]
    return joined(walls[0], turned(walls[1]))


def test_slide_that_would_make_a_fault_is_not_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Walls so close that they cross where vertices slide as they like."""
    shell = _shell(0.02)
    assert kinds(find_defects(shell)) == set()
    assert kinds(find_defects(make_fair(shell, (), max_slide_um=0.5, max_turn_um=0.05))) == set()
    with monkeypatch.context() as patch:
        patch.setattr(
            fairing, "find_defects", lambda *_: find_defects(ball())
        )  # as if all were well
        assert "crossings" in kinds(
            find_defects(make_fair(shell, (), max_slide_um=0.5, max_turn_um=0.05))
        )


LENGTH, SIDES = 32.0, 12


def _tube(radius: float, rings: int, apothem: bool = False) -> Mesh:
    """A prism along x, open at x = 0 and LENGTH; its normals are the cylinder's through its edges.

    `apothem`: the radius is that of its faces, not that of its edges.
    """
    if apothem:
        radius /= np.cos(np.pi / SIDES)
    ring, side = np.divmod(np.arange(rings * SIDES), SIDES)
    angle = 2 * np.pi * side / SIDES
    normals = np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)
    positions = radius * normals + np.outer(ring * LENGTH / (rings - 1), [1, 0, 0])
    a = np.arange((rings - 1) * SIDES)
    b = a - side[a] + (side[a] + 1) % SIDES
    triangles = np.concatenate(
        [np.stack([a, b, b + SIDES], 1), np.stack([a, b + SIDES, a + SIDES], 1)]
    )
    return Mesh(
        positions.astype(np.float32), triangles.astype(np.uint32), normals.astype(np.float32)
    )


ENDS = ((0, 0.0), (0, LENGTH))


def test_needles_of_a_thin_tube_are_split_and_its_surface_stays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tube = _tube(2.0, 5)
    assert kinds(find_defects(tube, ENDS)) == set()
    assert sharpest_angle(tube) < 8
    with monkeypatch.context() as patch:
        patch.setattr(fairing, "SPLITS", 0)
        assert sharpest_angle(make_fair(tube, ENDS, max_slide_um=0.5, max_turn_um=0.1)) < 8
    fair = make_fair(tube, ENDS, max_slide_um=0.5, max_turn_um=0.1)
    assert kinds(find_defects(fair, ENDS)) == set()
    assert sharpest_angle(fair) > 12
    rim = border(tube.triangles)
    np.testing.assert_array_equal(border(fair.triangles), rim)
    np.testing.assert_array_equal(fair.positions[rim], tube.positions[rim])
    assert ((fair.positions[:, 0] > 0) & (fair.positions[:, 0] < LENGTH)).sum() == len(
        fair.positions
    ) - len(np.unique(rim))
    across = fair.positions[:, 1:]
    away = np.linalg.norm(across, axis=1)
    sagitta = 2.0 * (1 - np.cos(np.pi / SIDES))
    assert np.abs(away - 2.0).max() < sagitta
    cosine = (fair.normals[:, 1:] * across).sum(axis=1) / away
    assert cosine.min() > np.cos(np.radians(3))


def test_split_that_would_make_a_fault_is_not_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """New vertices on the inner tube would rise through the outer one's faces; a third is split."""
    inner, outer = _tube(2.0, 5), _tube(1.95, 31, apothem=True)
    nested = joined(outer, turned(inner), moved(inner, (0.0, 9.0, 0.0)))
    assert kinds(find_defects(nested, ENDS)) == set()
    fair = make_fair(nested, ENDS, max_slide_um=0.5, max_turn_um=0.1)
    assert kinds(find_defects(fair, ENDS)) == set()
    new = fair.positions[len(nested.positions) :]
    assert (new[:, 1] > 5).sum() > 3 * SIDES
    with monkeypatch.context() as patch:
        patch.setattr(
            fairing, "find_defects", lambda *_: find_defects(ball())
        )  # as if all were well
        assert "crossings" in kinds(
            find_defects(make_fair(nested, ENDS, max_slide_um=0.5, max_turn_um=0.1), ENDS)
        )
