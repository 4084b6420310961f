"""Simplified interfaces keep the lines and corners between them."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.collapse import collapse_interfaces
from stereocell.kernels.interface_rings import find_orders

SHARPEST = float(np.cos(np.radians(12)))


def sheets(
    angles_deg: tuple[float, ...], cells: int = 8
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return half planes that meet in the z axis, each a grid of `cells` squares."""
    along = np.arange(cells + 1.0)
    at: list[tuple[float, float, float]] = [(0.0, 0.0, z) for z in along]
    triangles = []
    for angle in np.radians(angles_deg):
        first = len(at)
        for r in along[1:]:
            at += [(r * np.cos(angle), r * np.sin(angle), z) for z in along]

        def number(r: int, z: int, first: int = first) -> int:
            return z if r == 0 else first + (r - 1) * (cells + 1) + z

        for r in range(cells):
            for z in range(cells):
                a, b = number(r, z), number(r + 1, z)
                c, d = number(r + 1, z + 1), number(r, z + 1)
                triangles += [(a, b, c), (a, c, d)]
    return np.array(at), np.array(triangles, np.int32)


def simplified(
    at: NDArray[np.float64], triangles: NDArray[np.int32], error: float = 0.05
) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    free = np.zeros(len(at), bool)
    left, is_left, _ = collapse(at, triangles, free, error)
    return left[is_left], is_left


def collapse(
    at: NDArray[np.float64],
    triangles: NDArray[np.int32],
    locked: NDArray[np.bool_],
    error: float,
    past: NDArray[np.int32] | None = None,
) -> tuple[NDArray[np.int32], NDArray[np.bool_], NDArray[np.int32]]:
    past = np.zeros((0, 2), np.int32) if past is None else past
    errors, orders = np.full(len(at), error), find_orders(triangles, len(at))
    return collapse_interfaces(at, triangles, locked, errors, 3.0, SHARPEST, orders, past)


def test_three_half_planes_keep_their_line_and_their_borders() -> None:
    at, triangles = sheets((0, 110, 230))
    left, is_left = simplified(at, triangles)
    assert len(left) < 0.6 * len(triangles)
    on_line = np.unique(left[np.isin(left, np.arange(9))])
    assert {0, 8} <= set(on_line.tolist())  # the ends lie on borders
    assert len(on_line) < 9  # vertices between the ends have moved along the line
    borders = np.isclose(np.hypot(at[:, 0], at[:, 1]), 8)
    assert set(np.flatnonzero(borders)) <= set(left.ravel().tolist())
    # No sheet has gained or lost area, and each triangle still belongs to its sheet.
    sheet = np.repeat(np.arange(3), len(triangles) // 3)
    area = np.linalg.norm(
        np.cross(at[left[:, 1]] - at[left[:, 0]], at[left[:, 2]] - at[left[:, 0]]), axis=1
    )
    np.testing.assert_allclose(np.bincount(sheet[is_left], area), np.full(3, 128.0), rtol=1e-9)


def test_a_line_between_interfaces_keeps_its_bend() -> None:
    at, triangles = sheets((0, 110, 230))
    at[:, 0] += np.maximum(at[:, 2] - 4, 0)  # all sheets shear from the middle on
    left, _ = simplified(at, triangles)
    assert 4 in left


def test_an_interface_between_only_two_objects_is_simplified_like_a_surface() -> None:
    at, triangles = sheets((0, 180))
    left, _ = simplified(at, triangles)
    inner = (np.abs(at[:, 0]) < 8) & (at[:, 2] > 0) & (at[:, 2] < 8)
    assert len(np.intersect1d(left, np.flatnonzero(inner))) < 0.35 * inner.sum()


def test_one_tetrahedron_and_two_with_a_common_face_do_not_change() -> None:
    """Any collapse would put two interfaces on top of each other."""
    at = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.9, 0], [0.5, 0.3, 0.8], [0.5, 0.3, -0.8]])
    faces = [(0, 1, 2), (0, 1, 3), (1, 2, 3), (2, 0, 3), (1, 0, 4), (2, 1, 4), (0, 2, 4)]
    for triangles in (faces[:4], faces):
        given = np.array(triangles, np.int32)
        left, is_left = simplified(at, given, error=10.0)
        assert is_left.all()
        np.testing.assert_array_equal(left, given)


def test_locked_vertices_stay() -> None:
    at, triangles = sheets((0, 110, 230))
    locked = np.ones(len(at), bool)
    _, is_left, _ = collapse(at, triangles, locked, 1.0)
    assert is_left.all()


def test_earlier_collapses_are_repeated_except_around_newly_locked_vertices() -> None:
    at, triangles = sheets((0, 110, 230), cells=20)
    at += np.random.default_rng(4).normal(scale=0.02, size=at.shape)
    free = np.zeros(len(at), bool)
    first, is_left, made = collapse(at, triangles, free, 0.1)
    again, is_left_again, same = collapse(at, triangles, free, 0.1, made)
    np.testing.assert_array_equal(first[is_left], again[is_left_again])
    np.testing.assert_array_equal(made, same)
    locked = free.copy()
    locked[made[len(made) // 2]] = True
    moved, kept = made[len(made) // 2]
    left, is_left_now, _ = collapse(at, triangles, locked, 0.1, made)
    assert {moved, kept} <= set(left[is_left_now].ravel().tolist())
    # All triangles far from the locked vertices are the same.
    far = np.linalg.norm(at - at[kept], axis=1) > 8
    was, now = ({tuple(t) for t in some if far[t].all()} for some in
                (first[is_left].tolist(), left[is_left_now].tolist()))  # fmt: skip
    assert len(was & now) > 0.8 * len(was) > 50
