"""Edges turned: sharper triangles go, and nothing else changes."""

from dataclasses import replace

import numpy as np
import pytest

from stereocell.certify import border, certify
from stereocell.flips import turn_edges
from stereocell.levels import sharpest_angle
from stereocell.mesh import Mesh
from test_certify import ball, kinds

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
    turned = turn_edges(_roof(), (), 0.1)
    assert _edges(_roof()) - _edges(turned) == {(0, 1)}
    assert _edges(turned) - _edges(_roof()) == {(2, 3)}
    assert kinds(certify(turned)) == set()
    assert sharpest_angle(turned) > 1.4 * sharpest_angle(_roof())


def test_ridge_is_not_turned_beyond_the_bound() -> None:
    """Its two diagonals are `height` apart."""
    assert _edges(turn_edges(_roof(0.2), (), 0.1)) == _edges(_roof())
    assert _edges(turn_edges(_roof(0.2), (), 0.3)) != _edges(_roof())


def test_border_and_vertices_stay() -> None:
    squeezed = ball(5.0, 40)
    positions = np.round(squeezed.positions * np.float32([1, 0.3, 1]), 3)
    keep = (positions[squeezed.triangles][:, :, 0] >= 0).all(axis=1)
    half = replace(squeezed, positions=positions, triangles=squeezed.triangles[keep])
    turned = turn_edges(half, ((0, 0.0),), 0.5)
    assert (turned.triangles != half.triangles).any()
    np.testing.assert_array_equal(turned.positions, half.positions)
    np.testing.assert_array_equal(border(turned.triangles), border(half.triangles))


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
    turned = turn_edges(nested, (), 0.3)
    assert "crossings" not in kinds(certify(turned))
    assert (0, 1) in _edges(turned)


@pytest.mark.parametrize("bound", [0.01, 0.5])
def test_turning_is_the_same_twice(bound: float) -> None:
    squeezed = replace(ball(), positions=ball().positions * np.float32([1, 1, 0.2]))
    first, second = (turn_edges(squeezed, (), bound) for _ in range(2))
    np.testing.assert_array_equal(first.triangles, second.triangles)
    assert sharpest_angle(first) >= sharpest_angle(squeezed)
