"""Make triangles less sharp: slide vertices, flip and split edges. Boundary edges stay.

A corner of a sharp triangle slides half-way to the centroid of the triangles around it, along its
tangent plane (Botsch & Kobbelt), and never farther than a bound from its start. Then the diagonal
of two neighbouring triangles is flipped where that makes their smallest angle larger (Lawson) and
moves the surface by less than a bound. The triangles that are still sharp lie along thin tubes and
at boundary edges, where vertices are few: their long edges are split (meshes/split_edges.py), so
that slides and flips have a vertex to work with.

References
M. Botsch & L. Kobbelt, "A remeshing approach to multiresolution modeling", Symposium on Geometry
Processing 2004. doi:10.1145/1057432.1057457
C. L. Lawson, "Transforming triangulations", Discrete Mathematics 3, 1972.
doi:10.1016/0012-365X(72)90093-3
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stereocell.meshes.split_edges import split_edges
from stereocell.meshes.validity import border, find_defects, match_edges
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Mesh

SLIDES = 3  # rounds of slides; more rounds make no triangle better and more triangles cross
STEP = 0.5  # share of the way to the centroid
SLIDE_DEG = 15.0  # degrees; corners of triangles with a smaller angle slide; a slide costs accuracy
TURN_DEG = 20.0  # degrees; edges of triangles with a smaller angle flip
TURNS = 8  # most rounds of flips
TRIES = 6  # attempts, each with more vertices held
SPLITS = 2  # rounds of splits
SPLIT_DEG = 11.0  # degrees; triangles with a smaller angle are split
GAIN = 1.02  # least factor by which a flip must enlarge the smallest angle
COSINE = 0.7  # least cosine of a new triangle's normal to the old two's mean: no folds

Points = NDArray[np.float64]
Triangles = NDArray[np.int64]


def make_fair(
    mesh: Mesh, planes: tuple[Plane, ...], *, max_slide_um: float, max_turn_um: float
) -> Mesh:
    """Return the mesh with fairer triangles and without new defects.

    planes        the cut planes, where the mesh may be open
    max_slide_um  largest distance by which a vertex slides
    max_turn_um   largest distance by which a flip or a split moves the surface

    Where the result has a defect, its vertices are held, and the work is repeated. If the last of
    TRIES still has defects, the mesh is returned as it was. New vertices come last.
    """
    count = len(mesh.positions)
    held = np.zeros(count, bool)
    for _ in range(TRIES):
        fair, ends = _fair(mesh, planes, held, max_slide_um, max_turn_um)
        defects = find_defects(fair, planes)
        if not defects.total:
            return fair
        defective = np.zeros(len(fair.positions), bool)
        defective[defects.vertices(fair.triangles)] = True
        # their neighbours too: a neighbour that slides may cross a vertex that stays
        defective[fair.triangles[_any(defective[fair.triangles])]] = True
        for _ in range(SPLITS):  # for a new vertex, the ends of its edge; they may be new too
            defective[ends[defective[count:]]] = True
        held |= defective[:count]
    return mesh


def _fair(
    mesh: Mesh,
    planes: tuple[Plane, ...],
    held: NDArray[np.bool_],
    max_slide_um: float,
    max_turn_um: float,
) -> tuple[Mesh, Triangles]:
    """Return the fairer mesh, and the ends (k, 2) of the edges that its new vertices split."""
    start = mesh.positions.astype(np.float64)
    positions, normals = start.copy(), mesh.normals.astype(np.float64)
    triangles = mesh.triangles.astype(np.int64)
    fixed = held.copy()
    fixed[border(triangles)] = True
    near = _find_near(start, planes, max_slide_um)
    _turn_edges(positions, triangles, held, max_turn_um)
    for _ in range(SLIDES):
        _slide(positions, normals, triangles, fixed, start, max_slide_um)
        positions[near] = start[near]
        _turn_edges(positions, triangles, held, max_turn_um)
    fixed[:] = True  # from here on only new vertices slide
    ends = np.zeros((0, 2), np.int64)
    for _ in range(SPLITS):
        sharp = _angle(*positions[triangles].transpose(1, 0, 2)) < np.radians(SPLIT_DEG)
        sharp &= ~_any(held[triangles])
        positions, normals, triangles, new = split_edges(
            positions,
            normals,
            triangles=triangles,
            wanted=sharp,
            planes=planes,
            max_lift_um=max_turn_um,
        )
        ends = np.concatenate([ends, new])
        start = np.concatenate([start, positions[len(start) :]])
        held, fixed = (np.append(kept, np.zeros(len(new), bool)) for kept in (held, fixed))
        near = _find_near(start, planes, max_slide_um)
        _turn_edges(positions, triangles, held, max_turn_um)
        _slide(positions, normals, triangles, fixed, start, max_slide_um)
        positions[near] = start[near]
        _turn_edges(positions, triangles, held, max_turn_um)
    fair = replace(
        mesh,
        positions=positions.astype(np.float32),
        normals=normals.astype(np.float32),
        triangles=triangles.astype(np.uint32),
    )
    return fair, ends


def _find_near(
    positions: Points, planes: tuple[Plane, ...], max_slide_um: float
) -> NDArray[np.bool_]:
    """Return which coordinates (n, 3) stay: those close to a cut plane.

    The neighbour's mesh lies beyond the plane, so no vertex may reach it.
    """
    near = np.zeros(positions.shape, bool)
    for column, value in planes:
        near[:, column] |= np.abs(positions[:, column] - value) <= 1.01 * max_slide_um
    return near


def _slide(
    positions: Points,
    normals: Points,
    triangles: Triangles,
    held: NDArray[np.bool_],
    start: Points,
    max_slide_um: float,
) -> None:
    """Move the corners of sharp triangles, in place, and turn their normals with the surface."""
    triangles = triangles[_any(~held[triangles])]
    corners = positions[triangles]
    a, b, c = corners.transpose(1, 0, 2)
    free = np.zeros(len(positions), bool)
    free[triangles[_angle(a, b, c) < np.radians(SLIDE_DEG)]] = True
    free &= ~held
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    total = _sum_round(triangles, area[:, None], len(positions))
    total = np.maximum(total, 1e-30)
    way = _sum_round(triangles, area[:, None] * corners.mean(axis=1), len(positions)) / total
    way -= positions
    way -= normals * (way * normals).sum(axis=1, keepdims=True)
    around = _sum_round(triangles, area[:, None] * normals[triangles].mean(axis=1), len(positions))
    moved = positions + STEP * way - start
    length = np.linalg.norm(moved, axis=1, keepdims=True)
    moved *= np.minimum(1, max_slide_um / np.maximum(length, 1e-30))
    # inside the mesh's bounding box: caps at the data's end have sharp edges
    positions[free] = np.clip(start + moved, start.min(axis=0), start.max(axis=0))[free]
    normals[free] = _unit((1 - STEP) * normals + STEP * around / total)[free]


def _sum_round(triangles: Triangles, values: Points, count: int) -> Points:
    """Return, for each vertex, the sum (count, k) of its triangles' values (m, k)."""
    corners = triangles.ravel()
    columns = [np.bincount(corners, np.repeat(column, 3), count) for column in values.T]
    return np.stack(columns, axis=1)


def _turn_edges(
    positions: Points, triangles: Triangles, held: NDArray[np.bool_], max_move_um: float
) -> None:
    """Flip edges, in place, until no flip is worth it, or for TURNS rounds."""
    for _ in range(TURNS):
        if not _turn(positions, triangles, held, max_move_um):
            break


def _turn(
    positions: Points, triangles: Triangles, held: NDArray[np.bool_], max_move_um: float
) -> bool:
    """Flip edges of sharp triangles, in place; return whether any was flipped.

    An edge is flipped if no neighbour gains more, and if no triangle has a held vertex.
    """
    sharp = _angle(*positions[triangles].transpose(1, 0, 2)) < np.radians(TURN_DEG)
    corner = np.zeros(len(positions), bool)
    corner[triangles[sharp]] = True
    # all triangles that share a corner: no other triangle has their edges, before or after a flip
    part = np.flatnonzero(_any(corner[triangles]))
    everything, triangles, sharp = triangles, triangles[part], sharp[part]
    free = ~_any(held[triangles])
    edges, twins, _ = match_edges(triangles)
    near = np.flatnonzero(twins > np.arange(len(twins)))
    far = twins[near]
    wanted = (sharp[near // 3] | sharp[far // 3]) & free[near // 3] & free[far // 3]
    near, far = near[wanted], far[wanted]
    left, right = near // 3, far // 3
    u, v = edges[near].T
    a = triangles[left, (near - 3 * left + 2) % 3]
    b = triangles[right, (far - 3 * right + 2) % 3]
    p, q, r, s = positions[u], positions[v], positions[a], positions[b]
    before = np.minimum(_angle(p, q, r), _angle(q, p, s))
    after = np.minimum(_angle(r, p, s), _angle(s, q, r))
    axis = _unit(np.cross(q - p, r - p) + np.cross(p - q, s - q))
    across = np.cross(q - p, s - r)
    move = np.abs((_unit(across) * (r - p)).sum(axis=1))
    turns = (after > GAIN * before) & (move < max_move_um) & (a != b)
    for normal in (np.cross(p - r, s - r), np.cross(q - s, r - s)):
        turns &= (_unit(normal) * axis).sum(axis=1) > COSINE
    count = len(positions)
    key = np.minimum(a, b) * count + np.maximum(a, b)
    chosen = np.flatnonzero(turns)
    if not len(chosen):
        return False
    one, other = edges.T
    wanted_keys, known = (
        np.sort(key[chosen]),
        np.minimum(one, other) * count + np.maximum(one, other),
    )
    place = np.minimum(np.searchsorted(wanted_keys, known), len(wanted_keys) - 1)
    there = known[wanted_keys[place] == known]
    chosen = chosen[~np.isin(key[chosen], there)]  # the surface has such an edge elsewhere
    chosen = chosen[np.argsort((before - after)[chosen], kind="stable")]
    rank = np.arange(len(chosen))
    first = np.full(len(triangles), len(chosen))
    np.minimum.at(first, left[chosen], rank)
    np.minimum.at(first, right[chosen], rank)
    chosen = chosen[(first[left[chosen]] == rank) & (first[right[chosen]] == rank)]
    _, once = np.unique(key[chosen], return_index=True)
    chosen = chosen[np.sort(once)]
    a, b, u, v = a[chosen], b[chosen], u[chosen], v[chosen]
    everything[part[left[chosen]]] = np.stack([a, u, b], axis=1)
    everything[part[right[chosen]]] = np.stack([b, v, a], axis=1)
    return len(chosen) > 0


def _any(corners: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which rows (n, 3) have any True; numpy's own `any` is slow over three columns."""
    return corners[:, 0] | corners[:, 1] | corners[:, 2]


def _angle(a: Points, b: Points, c: Points) -> NDArray[np.float64]:
    """Return the smallest angle of each triangle in radians; it is opposite the shortest side."""
    # the sides' squares; no sort, which is slow over three
    x, y, z = (np.einsum("ij,ij->i", side, side) for side in (b - c, c - a, a - b))
    shortest = np.minimum(np.minimum(x, y), z)
    others = np.sqrt(np.maximum(np.maximum(x * y, y * z), z * x))
    cosine = (x + y + z - 2 * shortest) / np.maximum(2 * others, 1e-30)
    return np.arccos(np.clip(cosine, -1, 1))


def _unit(vectors: Points) -> Points:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
