"""Sharp triangles go; borders stay, the surface stays, and no fault comes of it."""

from dataclasses import replace

import numpy as np
import pytest

from stereocell import fairing
from stereocell.certify import border, certify
from stereocell.fairing import make_fair
from stereocell.levels import sharpest_angle
from stereocell.mesh import Mesh
from stereocell.surface import RIM_SNAP, extract_surface
from stereocell.tiling import Box
from test_certify import ball, joined, kinds, turned

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
    fair = make_fair(_roof(), (), 0.0, 0.1)
    assert _edges(_roof()) - _edges(fair) == {(0, 1)}
    assert _edges(fair) - _edges(_roof()) == {(2, 3)}
    assert kinds(certify(fair)) == set()
    assert sharpest_angle(fair) > 1.4 * sharpest_angle(_roof())


def test_ridge_is_not_turned_beyond_the_bound() -> None:
    """Its two diagonals are `height` apart."""
    assert _edges(make_fair(_roof(0.2), (), 0.0, 0.1)) == _edges(_roof())
    assert _edges(make_fair(_roof(0.2), (), 0.0, 0.3)) != _edges(_roof())


def test_border_and_vertices_stay() -> None:
    squeezed = ball(5.0, 40)
    positions = np.round(squeezed.positions * np.float32([1, 0.3, 1]), 3)
    keep = (positions[squeezed.triangles][:, :, 0] >= 0).all(axis=1)
    half = replace(squeezed, positions=positions, triangles=squeezed.triangles[keep])
    fair = make_fair(half, ((0, 0.0),), 0.0, 0.5)
    assert (fair.triangles != half.triangles).any()
    np.testing.assert_array_equal(fair.positions, half.positions)
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
    before = certify(nested)
    assert "crossings" not in kinds(before)
    fair = make_fair(nested, (), 0.0, 0.3)
    assert "crossings" not in kinds(certify(fair))
    assert (0, 1) in _edges(fair)


@pytest.mark.parametrize("bound", [0.01, 0.5])
def test_turning_is_the_same_twice(bound: float) -> None:
    squeezed = replace(ball(), positions=ball().positions * np.float32([1, 1, 0.2]))
    first, second = (make_fair(squeezed, (), 0.1, bound) for _ in range(2))
    np.testing.assert_array_equal(first.triangles, second.triangles)
    assert sharpest_angle(first) >= sharpest_angle(squeezed)


def _cut_ball() -> tuple[Mesh, tuple[int, float]]:
    """A ball's iso-surface, open at a plane through it; its normals are exact."""
    shape, radius = (40, 40, 40), 12.3
    z, y, x = np.indices(shape) - np.float64(19.6)
    distance = (radius - np.sqrt(z**2 + y**2 + x**2)).astype(np.float32)
    whole, part = Box((0, 0, 0), shape), Box((0, 0, 0), (40, 40, 23))
    mesh = extract_surface(np.clip(distance, -2, 2), whole, part, whole, (1, 1, 1), (0, 0, 0))
    return mesh, (0, 22.0)


def test_slides_make_an_iso_surface_fair_and_keep_it_on_the_ball() -> None:
    mesh, plane = _cut_ball()
    fair = make_fair(mesh, (plane,), 0.5, 0.05)
    assert sharpest_angle(mesh) < 5
    assert sharpest_angle(fair) > 15
    assert kinds(certify(fair, (plane,))) == set()
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
            np.clip(radius - away, -2, 2).astype(np.float32),
            whole,
            whole,
            whole,
            (1, 1, 1),
            (0, 0, 0),
        )
        for radius in (12.3, 12.3 - thickness)
    ]
    return joined(walls[0], turned(walls[1]))


def test_slide_that_would_make_a_fault_is_not_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Walls so close that they cross where vertices slide as they like."""
    shell = _shell(0.02)
    assert kinds(certify(shell)) == set()
    assert kinds(certify(make_fair(shell, (), 0.5, 0.05))) == set()
    with monkeypatch.context() as patch:
        patch.setattr(fairing, "certify", lambda *_: certify(ball()))  # as if all were well
        assert "crossings" in kinds(certify(make_fair(shell, (), 0.5, 0.05)))
