"""Passes over the corners of all triangles that array expressions would do with large copies."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel
from stereocell.kernels.half_edges import Ints

Corners = NDArray[np.integer[Any]]  # (m, 3)
Flags = NDArray[np.bool_]


@kernel
def touch(flags: Flags, triangles: Corners) -> Flags:
    """Return the triangles with a flagged corner, bool (m,). flags: bool (n,), of the vertices."""
    touched = np.empty(len(triangles), np.bool_)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        touched[t] = flags[a] | flags[b] | flags[c]
    return touched


@kernel
def differ(one: Corners, other: Corners) -> Flags:
    """Return the triangles (m,) that have another corner in one array than in the other."""
    changed = np.empty(len(one), np.bool_)
    for t in range(len(one)):
        is_same = (one[t, 0] == other[t, 0]) & (one[t, 1] == other[t, 1])
        changed[t] = not (is_same & (one[t, 2] == other[t, 2]))
    return changed


@kernel
def repeat_a_corner(triangles: Corners) -> Flags:
    """Return the triangles with two equal corners, bool (m,)."""
    repeats = np.empty(len(triangles), np.bool_)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        repeats[t] = (a == b) | (b == c) | (c == a)
    return repeats


@kernel
def share_a_plane(bits: NDArray[np.uint8], triangles: Corners) -> Flags:
    """Return the triangles whose corners lie in one plane, bool (m,).

    bits  uint8 (n,), a bit for each plane that a vertex lies in
    """
    share = np.empty(len(triangles), np.bool_)
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        share[t] = (bits[a] & bits[b] & bits[c]) != 0
    return share


@kernel
def rename(names: Ints, triangles: Ints, order: Ints) -> Ints:
    """Return triangles, in an order of their own, with other names of their corners (m, 3).

    names  (n,), the name of each vertex
    order  (m,), the triangle that comes at each place
    """
    renamed = np.empty((len(order), 3), np.int32)
    for i in range(len(order)):
        t = order[i]
        for k in range(3):
            renamed[i, k] = names[triangles[t, k]]
    return renamed


@kernel
def rename_back(names: Ints, triangles: Ints, order: Ints, is_left: Flags) -> tuple[Ints, Flags]:
    """Return triangles in their old order, with old names of their corners, and their flags.

    It is the reverse of `rename`: row i of `triangles` becomes row order[i].
    """
    renamed, left = np.empty((len(order), 3), np.int32), np.empty(len(order), np.bool_)
    for i in range(len(order)):
        t = order[i]
        left[t] = is_left[i]
        for k in range(3):
            renamed[t, k] = names[triangles[i, k]]
    return renamed, left
