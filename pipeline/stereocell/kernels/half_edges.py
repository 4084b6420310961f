"""Triangles as half-edges: half-edge 3 t + k goes from corner k of triangle t to the next."""

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.triangles import Points, doubled_area, smallest_angle_cosine
from stereocell.kernels.union_find import link, number_components

Ints = NDArray[np.int32]
# Values in place of a twin. BORDER: the edge has one triangle. CROWDED: it has more than two
# triangles, or two whose windings do not agree.
BORDER, CROWDED = -1, -2


@part
def following(h: int) -> int:
    """Return the half-edge after this one in its triangle."""
    return h + 1 if h % 3 < 2 else h - 2


@part
def preceding(h: int) -> int:
    """Return the half-edge before this one in its triangle."""
    return h - 1 if h % 3 > 0 else h + 2


@kernel
def match_twins(triangles: Ints, count: int) -> Ints:
    """Return the twin of each half-edge, int32 (3 m,), or BORDER or CROWDED.

    triangles  int32 (m, 3)
    count      number of vertices
    """
    corner = triangles.ravel()
    edges = len(corner)
    first = np.zeros(count + 1, np.int32)  # half-edges, listed by their lower vertex
    for h in range(edges):
        first[min(corner[h], corner[following(h)]) + 1] += 1
    for v in range(count):
        first[v + 1] += first[v]
    place, listed = first[:-1].copy(), np.empty(edges, np.int32)
    # For each listed half-edge, its higher vertex, and whether it ends there
    far, upward = np.empty(edges, np.int32), np.empty(edges, np.bool_)
    for h in range(edges):
        start, end = corner[h], corner[following(h)]
        v = min(start, end)
        p = place[v]
        listed[p], far[p], upward[p] = h, max(start, end), start < end
        place[v] += 1
    twins = np.full(edges, BORDER, np.int32)
    for v in range(count):
        for i in range(first[v], first[v + 1]):
            opposite, others = -1, 0
            for j in range(first[v], first[v + 1]):
                if far[j] != far[i] or j == i:
                    continue
                opposite = listed[j]
                others += 1 if upward[j] != upward[i] else 2
            if others == 1:
                twins[listed[i]] = opposite
            elif others > 1:
                twins[listed[i]] = CROWDED
    return twins


@kernel
def count_fans(triangles: Ints, twins: Ints, count: int) -> tuple[Ints, Ints]:
    """Return an outgoing half-edge of each vertex, or -1, and its number of triangles.

    The number is negative if the triangles form more than one fan. For a vertex of a border the
    half-edge is the first of its fan, which has no twin.
    """
    corner = triangles.ravel()
    leaving, valence = np.full(count, -1, np.int32), np.zeros(count, np.int32)
    for h in range(len(corner)):
        v = corner[h]
        valence[v] += 1
        if leaving[v] < 0 or twins[h] < 0:
            leaving[v] = h
    for v in range(count):
        if leaving[v] < 0:
            continue
        h, seen = leaving[v], 1
        while True:
            h = twins[preceding(h)]
            if h < 0 or h == leaving[v] or seen > valence[v]:
                break
            seen += 1
        if seen != valence[v]:
            valence[v] = -valence[v]
    return leaving, valence


@part
def find_fixed(
    locked: NDArray[np.bool_], corner: Ints, twins: Ints, valence: Ints
) -> NDArray[np.bool_]:
    """Return the vertices that no collapse moves: locked, on a border, or without a single fan."""
    fixed = locked | (valence <= 0)
    for h in range(len(corner)):
        if twins[h] < 0:
            fixed[corner[h]] = fixed[corner[following(h)]] = True
    return fixed


@kernel
def label_vertices(triangles: Ints, count: int) -> tuple[Ints, int]:
    """Return the connected component of each vertex, int32 (count,), and their number.

    Components are numbered by their first vertices.
    """
    parent = np.arange(count).astype(np.int32)
    for t in range(len(triangles)):
        link(parent, triangles[t, 0], triangles[t, 1])
        link(parent, triangles[t, 0], triangles[t, 2])
    return number_components(parent)


@kernel
def measure_volumes(at: Points, triangles: Ints, labels: Ints, bodies: int) -> Points:
    """Return the signed volume of each component (bodies,): the sum of tetrahedra from the origin.

    The volume of an open component has no meaning, but its changes do while its border stays.
    """
    volumes = np.zeros(bodies)
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        x, y, z = doubled_area(at, a, b, c)
        volumes[labels[a]] += (at[a, 0] * x + at[a, 1] * y + at[a, 2] * z) / 6
    return volumes


@kernel
def find_first(triangles: Ints, labels: Ints, bodies: int) -> Ints:
    """Return the first triangle of each component (bodies,), or -1 if it has none."""
    first = np.full(bodies, -1, np.int32)
    for t in range(len(triangles) - 1, -1, -1):
        first[labels[triangles[t, 0]]] = t
    return first


@kernel
def measure_windings(
    at: Points, normals: NDArray[np.float32], triangles: Ints, labels: Ints, zero: Points
) -> tuple[Points, Points, Points, Points]:
    """Return sums that show how each component is wound, over its triangles' doubled areas A.

    zero  (bodies, 3), a position on each axis for each component

    The first sum (bodies,) is of A times the corners' normals. The second (bodies, 3) has, for each
    axis k, A_k times the height of the corners above zero_k; by Gauss's law this is six times the
    volume. The last two are the least and the largest corner of each component's box (bodies, 3).
    """
    along, volumes = np.zeros(len(zero)), np.zeros((len(zero), 3))
    low, high = np.full((len(zero), 3), np.inf), np.full((len(zero), 3), -np.inf)
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        body = labels[a]
        area = doubled_area(at, a, b, c)
        share = 0.0
        for k in range(3):
            share += area[k] * (normals[a, k] + normals[b, k] + normals[c, k])
            height = at[a, k] + at[b, k] + at[c, k] - 3 * zero[body, k]
            volumes[body, k] += area[k] * height
            low[body, k] = min(low[body, k], at[a, k], at[b, k], at[c, k])
            high[body, k] = max(high[body, k], at[a, k], at[b, k], at[c, k])
        along[body] += share
    return along, volumes, low, high


@kernel
def measure_triangles(at: Points, triangles: Ints) -> Points:
    """Return the area of each triangle (m,)."""
    areas = np.empty(len(triangles))
    for t in range(len(triangles)):
        x, y, z = doubled_area(at, triangles[t, 0], triangles[t, 1], triangles[t, 2])
        areas[t] = np.sqrt(x * x + y * y + z * z) / 2
    return areas


@kernel
def measure_sides(at: Points, triangles: Ints) -> Points:
    """Return the lengths of the sides of all triangles (3 m,)."""
    sides = np.empty(3 * len(triangles))
    for t in range(len(triangles)):
        for k in range(3):
            a, b = triangles[t, k], triangles[t, (k + 1) % 3]
            x, y, z = at[b, 0] - at[a, 0], at[b, 1] - at[a, 1], at[b, 2] - at[a, 2]
            sides[3 * t + k] = np.sqrt(x * x + y * y + z * z)
    return sides


@kernel
def measure_sharpest(at: Points, triangles: Ints) -> Points:
    """Return the cosine of the smallest angle of each triangle (m,); 1 if it has no area."""
    cosines = np.empty(len(triangles))
    for t in range(len(triangles)):
        cosines[t] = smallest_angle_cosine(at, triangles[t, 0], triangles[t, 1], triangles[t, 2])
    return cosines


@kernel
def measure_areas(
    at: Points, triangles: Ints, twins: Ints, labels: Ints, bodies: int
) -> tuple[Points, NDArray[np.bool_]]:
    """Return the area of each component, and whether it is open; (bodies,)."""
    areas, is_open = np.zeros(bodies), np.zeros(bodies, np.bool_)
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        x, y, z = doubled_area(at, a, b, c)
        areas[labels[a]] += np.sqrt(x * x + y * y + z * z) / 2
        for k in range(3):
            is_open[labels[a]] |= twins[3 * t + k] < 0
    return areas, is_open


@kernel
def measure_boxes(at: Points, labels: Ints, bodies: int) -> Points:
    """Return the side lengths of the box of each component's vertices (bodies, 3)."""
    low, high = np.full((bodies, 3), np.inf), np.full((bodies, 3), -np.inf)
    for v in range(len(at)):
        body = labels[v]
        for k in range(3):
            low[body, k] = min(low[body, k], at[v, k])
            high[body, k] = max(high[body, k], at[v, k])
    return high - low


@kernel
def lie_within(
    low: Points, high: Points, asked: NDArray[np.int64], outer: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return which of the asked boxes lie within one of the outer boxes, bool (k,).

    low, high     (b, 3), corners of all boxes
    asked, outer  indices of boxes
    """
    within = np.zeros(len(asked), np.bool_)
    for i in range(len(asked)):
        a = asked[i]
        for b in outer:
            holds = True
            for k in range(3):
                holds &= low[b, k] <= low[a, k] and high[b, k] >= high[a, k]
            if holds:
                within[i] = True
                break
    return within


@kernel
def renumber_corners(
    triangles: NDArray[np.uint32], count: int
) -> tuple[NDArray[np.int64], NDArray[np.uint32]]:
    """Return the used vertices in order (k,), and the triangles by their indices among these."""
    place = np.zeros(count, np.uint32)
    for t in range(len(triangles)):
        for k in range(3):
            place[triangles[t, k]] = 1
    left = 0
    for v in range(count):
        left += place[v]
    used, own, left = np.empty(left, np.int64), np.empty_like(triangles), 0
    for v in range(count):
        if place[v] > 0:
            place[v], used[left] = left, v
            left += 1
    for t in range(len(triangles)):
        for k in range(3):
            own[t, k] = place[triangles[t, k]]
    return used, own


@kernel
def sum_normals(at: Points, triangles: Ints) -> Points:
    """Return the unit normal of each vertex (n, 3), weighted by area; 0 if it has none."""
    normals = np.zeros_like(at)
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        x, y, z = doubled_area(at, a, b, c)
        for v in (a, b, c):
            normals[v, 0] += x
            normals[v, 1] += y
            normals[v, 2] += z
    for v in range(len(at)):
        x, y, z = normals[v]
        length = np.sqrt(x * x + y * y + z * z)
        if length > 0:
            for k in range(3):
                normals[v, k] /= length
    return normals


@kernel
def sum_gains(
    at: Points, triangles: Ints, labels: Ints, bodies: int, moves: Points
) -> NDArray[np.float64]:
    """Return the first-order change of each component's volume if its vertices move (n, 3)."""
    gains = np.zeros(bodies)
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        x, y, z = doubled_area(at, a, b, c)
        mx = moves[a, 0] + moves[b, 0] + moves[c, 0]
        my = moves[a, 1] + moves[b, 1] + moves[c, 1]
        mz = moves[a, 2] + moves[b, 2] + moves[c, 2]
        gains[labels[a]] += (x * mx + y * my + z * mz) / 6
    return gains
