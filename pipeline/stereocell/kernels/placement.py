"""Places for the vertices of a coarse surface, nearer to the fine surface that they stand for.

The best place of a vertex is the point with the least sum of squared distances from the planes of
the triangles that it stands for. See meshes/place_vertices.py.

References
M. Garland & P. S. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.
doi:10.1145/258734.258849
"""

import numpy as np

from stereocell.kernels.compiled import kernel, part
from stereocell.kernels.half_edges import Ints
from stereocell.kernels.triangles import Points, doubled_area, smallest_angle_cosine

TURN = 0.25  # squared cosine of the largest turn of a triangle: 60 degrees


@kernel
def sum_planes(at: Points, triangles: Ints, owners: Ints, start: Points) -> Points:
    """Return the quadrics of coarse vertices (n, 10) around their own positions.

    at, triangles  fine surface (k, 3), (m, 3)
    owners         int32 (k,), the coarse vertex that stands for each fine one; -1: none does
    start          (n, 3), positions of the coarse vertices
    result         of the matrix xx, yy, zz, xy, xz, yz; of the slope x, y, z; and the weight. A
                   plane's weight is the doubled area of its triangle.
    """
    sums = np.zeros((len(start), 10))
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        x, y, z = doubled_area(at, a, b, c)
        w = np.sqrt(x * x + y * y + z * z)
        if w <= 0:
            continue
        for k in range(3):
            v = owners[triangles[t, k]]
            if v < 0:
                continue
            # w times the distance of the vertex from the plane
            h = x * (start[v, 0] - at[a, 0]) + y * (start[v, 1] - at[a, 1])
            h = (h + z * (start[v, 2] - at[a, 2])) / w
            sums[v, 0] += x * x / w
            sums[v, 1] += y * y / w
            sums[v, 2] += z * z / w
            sums[v, 3] += x * y / w
            sums[v, 4] += x * z / w
            sums[v, 5] += y * z / w
            sums[v, 6] += x * h
            sums[v, 7] += y * h
            sums[v, 8] += z * h
            sums[v, 9] += w
    return sums


@kernel
def find_places(sums: Points, softness: float, most: float) -> Points:
    """Return the moves (n, 3) to the least sum of squared distances, at most `most` long.

    sums      see `sum_planes`
    softness  weight of the move's own squared length, as a share of the weight of all planes. It
              keeps a vertex from sliding along a flat surface.
    """
    moves = np.zeros((len(sums), 3))
    for v in range(len(sums)):
        soft = softness * sums[v, 9]
        if soft <= 0:
            continue
        # Cholesky's factors L D L^T of the matrix, which the softness makes positive
        d1 = sums[v, 0] + soft
        l21, l31 = sums[v, 3] / d1, sums[v, 4] / d1
        d2 = sums[v, 1] + soft - l21 * sums[v, 3]
        m32 = sums[v, 5] - l21 * sums[v, 4]
        l32 = m32 / d2
        d3 = sums[v, 2] + soft - l31 * sums[v, 4] - l32 * m32
        p = -sums[v, 6]
        q = -sums[v, 7] - l21 * p
        r = -sums[v, 8] - l31 * p - l32 * q
        z = r / d3
        y = q / d2 - l32 * z
        x = p / d1 - l21 * y - l31 * z
        length = np.sqrt(x * x + y * y + z * z)
        share = most / length if length > most else 1.0
        moves[v, 0], moves[v, 1], moves[v, 2] = share * x, share * y, share * z
    return moves


@part
def _is_worse(start: Points, at: Points, a: int, b: int, c: int, sharpest: float) -> bool:
    """Return whether a triangle turns too far between two positions, or gets too sharp."""
    ax, ay, az = doubled_area(start, a, b, c)
    nx, ny, nz = doubled_area(at, a, b, c)
    along = ax * nx + ay * ny + az * nz
    size = (ax * ax + ay * ay + az * az) * (nx * nx + ny * ny + nz * nz)
    if along <= 0 or along * along < TURN * size:
        return True
    after = smallest_angle_cosine(at, a, b, c)
    return after > sharpest and after > smallest_angle_cosine(start, a, b, c)


@kernel
def shorten_moves(
    start: Points, triangles: Ints, moves: Points, sharpest: float, halvings: int
) -> None:
    """Halve moves, in place, until no triangle turns by 60 degrees or gets too sharp.

    start, triangles  the surface before the moves (n, 3), (m, 3)
    moves             (n, 3)
    sharpest          largest cosine of a triangle's smallest angle, unless it was sharper before
    halvings          number of times that a move is shortened; the last time, it becomes 0
    """
    at, shortened = start + moves, np.zeros(len(start), np.int8)
    has_changed, is_due = np.ones(len(start), np.bool_), np.zeros(len(start), np.bool_)
    any_due = True
    while any_due:
        any_due = False
        for t in range(len(triangles)):
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            if not (has_changed[a] | has_changed[b] | has_changed[c]):
                continue
            least = min(shortened[a], min(shortened[b], shortened[c]))
            if least < halvings and _is_worse(start, at, a, b, c, sharpest):
                is_due[a] = is_due[b] = is_due[c] = any_due = True
        for v in range(len(start)):
            has_changed[v] = is_due[v]
            if is_due[v]:
                shortened[v] = min(shortened[v] + 1, halvings)
                factor = 0.5 if shortened[v] < halvings else 0.0
                for k in range(3):
                    moves[v, k] *= factor
                    at[v, k] = start[v, k] + moves[v, k]
                is_due[v] = False


@kernel
def move_along(
    at: Points, ways: Points, steps: Points, start: Points, most: float, low: Points, high: Points
) -> None:
    """Move positions (n, 3), in place, along their ways (n, 3), each by its step (n,).

    start      (n, 3), positions from which no vertex moves farther than `most`
    low, high  (3,), corners of the box that holds all positions
    """
    for v in range(len(at)):
        length = 0.0
        for k in range(3):
            at[v, k] = min(max(at[v, k] + ways[v, k] * steps[v], low[k]), high[k])
            length += (at[v, k] - start[v, k]) ** 2
        if length > most * most:
            for k in range(3):
                at[v, k] = start[v, k] + (at[v, k] - start[v, k]) * most / np.sqrt(length)


@kernel
def follow_moves(moves: Ints, vertices: int) -> Ints:
    """Return the vertex that stands for each vertex after collapses, int32 (vertices,).

    moves  int32 (k, 2), collapses in their order: a vertex, and the one onto which it moved
    """
    owners = np.arange(vertices).astype(np.int32)
    for i in range(len(moves) - 1, -1, -1):
        owners[moves[i, 0]] = owners[moves[i, 1]]
    return owners
