"""Edges flip if that widens the sharpest angle, and otherwise stay."""

import numpy as np

from stereocell.kernels.flips import flip_edges
from stereocell.kernels.half_edges import match_twins

SHARP = float(np.cos(np.radians(20)))
# A flat kite, cut along its long diagonal 0-1 into two triangles with angles of 5 degrees
KITE = np.array([[-1, 0, 0], [1, 0, 0], [0, -0.09, 0], [0, 0.09, 0]], np.float64)
CUT = np.array([[0, 1, 3], [1, 0, 2]], np.int32)
NO_PLANES = np.zeros(4, np.uint8)
ERRORS = np.full(4, 0.1)
FREE = np.zeros(4, bool)


def test_long_diagonal_flips() -> None:
    triangles = np.array([[0, 1, 3], [1, 0, 2]], np.int32)
    narrow = KITE * [1, 12, 1]  # stretched, so that the diagonal 0-1 is the shorter one
    wide = KITE * [0.05, 1, 1]
    assert flip_edges(wide, triangles, FREE, NO_PLANES, NO_PLANES, ERRORS, SHARP) == 0
    assert (
        flip_edges(narrow, CUT.copy(), FREE, NO_PLANES, NO_PLANES, ERRORS, SHARP) == 0
    )  # no sharp triangle
    flat = CUT.copy()
    assert flip_edges(KITE, flat, FREE, NO_PLANES, NO_PLANES, ERRORS, SHARP) == 1
    assert sorted(map(sorted, flat.tolist())) == [[0, 2, 3], [1, 2, 3]]
    twins = match_twins(flat, 4)
    assert (twins >= 0).sum() == 2  # both triangles are still wound alike


def test_an_edge_stays_if_a_flip_would_move_the_surface_or_put_it_into_a_cut() -> None:
    bent = KITE.copy()
    bent[2:, 2] = 0.2
    assert flip_edges(bent, CUT.copy(), FREE, NO_PLANES, NO_PLANES, ERRORS, SHARP) == 0
    planes = np.array([1, 0, 1, 1], np.uint8)  # 0, 2 and 3 lie in a cut plane
    assert flip_edges(KITE, CUT.copy(), FREE, planes, NO_PLANES, ERRORS, SHARP) == 0


def test_an_edge_beside_a_locked_vertex_stays() -> None:
    for vertex in range(4):
        locked = np.arange(4) == vertex
        assert flip_edges(KITE, CUT.copy(), locked, NO_PLANES, NO_PLANES, ERRORS, SHARP) == 0
