"""Simplify a mesh so that it stays valid: check exactly, lock around the defects, simplify again.

Simplification keeps topology and does not fold triangles over, but sees only the triangles around
a vertex: walls that are near each other may come to cross. Around each defect the vertices of the
given surface are locked, in a ball that grows with every try, and the bodies with defects are
simplified again. A body that still has defects after ROUNDS keeps the surface it had before.
"""

from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from stereocell.kernels.half_edges import measure_sides
from stereocell.meshes.simplify import find_errors, renumber, simplify_part
from stereocell.meshes.validity import Defects, Topology, find_defects, find_topology
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Mesh

ROUNDS = 12  # most rounds in which defective bodies are simplified again
GROWTH = 2.0  # factor by which the ball of locked vertices grows with each try in a place
HAIR = 1e-6  # share by which a ball is larger than the way to its nearest vertex
LOCKED_EVERY = 8  # every 8th vertex of a body that is inside out is locked first, then more of them

Triangles = NDArray[np.uint32]


@dataclass(frozen=True, slots=True)
class Simplified:
    """The result.

    topology          of the mesh
    vertices          int64 (k,), the number that each vertex has in the given mesh
    simplified_again  bodies
    fallbacks         bodies that stayed as they were
    """

    mesh: Mesh
    topology: Topology
    vertices: NDArray[np.int64]
    simplified_again: int
    fallbacks: int


def simplify_without_defects(
    mesh: Mesh,
    planes: tuple[Plane, ...],
    *,
    max_error_um: float | NDArray[np.float64],
    topology: Topology | None = None,
) -> Simplified:
    """Return the mesh simplified and without defects; its boundary edges stay.

    mesh          positions float32 (n, 3) in um, triangles uint32 (m, 3)
    planes        the cut planes, where the mesh may be open
    max_error_um  see `simplify`; of all vertices, or of each (n,), alike in a body
    topology      of the mesh; None: it is found

    A mesh that has defects itself keeps the bodies with defects.
    """
    topology = topology or find_topology(mesh.triangles, len(mesh.positions))
    body = topology.bodies[0]
    tries = np.zeros(len(mesh.positions), np.int64)  # a vertex that was locked once stays
    body_of = body[mesh.triangles[:, 0]]
    tree: cKDTree | None = None

    errors = find_errors(mesh, max_error_um, topology.bodies)

    def again(triangles: Triangles) -> Triangles:
        return simplify_part(mesh, triangles, errors, locked=tries > 0, planes=planes)

    triangles = again(mesh.triangles)
    fresh = np.ones(len(triangles), bool)
    redone: set[int] = set()
    kept: set[int] = set()
    for number in count():
        used, own = renumber(triangles, len(mesh.positions))
        draft = Mesh(mesh.positions[used], own, mesh.normals[used])
        found = find_topology(own, len(used))
        defects = find_defects(draft, planes=planes, fresh=fresh, topology=found)
        worst = set(body[used[defects.vertices(own)]].tolist()) - kept
        if not worst:
            break
        chosen = np.zeros(int(body.max()) + 1, bool)
        chosen[sorted(worst)] = True
        part = mesh.triangles[chosen[body_of]]
        if number < ROUNDS:
            redone |= worst
            # few places are asked for: a balanced tree takes three times as long to make
            tree = tree or cKDTree(mesh.positions, balanced_tree=False, compact_nodes=False)
            tries[_around(tree, draft, defects, tries)] += 1
            turned = body[used[own[defects.inside_out, 0]]]
            tries[_some_of(body, turned, max(1, LOCKED_EVERY >> number))] += 1
            part = again(part)
        else:
            kept |= worst
        stays = ~chosen[body[triangles[:, 0]]]
        rest, before = triangles[stays], triangles[~stays]
        triangles = np.concatenate([rest, part])
        faulty = np.zeros(len(mesh.positions), bool)
        faulty[used[defects.vertices(own)]] = True
        # what was found sound in the draft before, and is there still, need not be looked at again
        fresh = np.asarray(faulty[triangles].any(axis=1))
        fresh[len(rest) :] |= ~_are_among(part, before)
    return Simplified(draft, found, used, len(redone - kept), len(kept))


def _some_of(body: NDArray[np.int32], chosen: NDArray[np.int32], every: int) -> NDArray[np.int64]:
    """Return every so manieth vertex of each of the chosen bodies."""
    vertices = np.flatnonzero(np.isin(body, chosen))
    vertices = vertices[np.argsort(body[vertices], kind="stable")]
    first = np.flatnonzero(np.diff(body[vertices], prepend=-1))
    place = np.arange(len(vertices)) - np.repeat(first, np.diff(first, append=len(vertices)))
    return vertices[place % every == 0]


def _are_among(triangles: Triangles, others: Triangles) -> NDArray[np.bool_]:
    """Return which triangles, wound alike, are among the others, bool (m,)."""
    count = int(max(triangles.max(initial=0), others.max(initial=0))) + 1
    (a, b, c), (d, e, f) = _least_first(triangles), _least_first(others)
    keys, known = a * count + b, d * count + e
    order = np.argsort(known)
    place = np.minimum(np.searchsorted(known, keys, sorter=order), len(others) - 1)
    # where an edge has several triangles one of them may be missed: it is looked at once more
    found = order[place]
    return np.asarray((known[found] == keys) & (f[found] == c))


def _least_first(triangles: Triangles) -> NDArray[np.int64]:
    """Return the corners, int64 (3, m), turned so that the least comes first."""
    first = triangles.argmin(axis=1)
    turn = (first[:, None] + np.arange(3)) % 3
    return np.take_along_axis(triangles, turn, axis=1).astype(np.int64).T


def _around(
    tree: cKDTree, draft: Mesh, defects: Defects, tries: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the tree's vertices in balls around the defects; a ball grows with each try there."""
    at = draft.positions.astype(np.float64)
    first, second, whole = (
        at[draft.triangles[some]]
        for some in (*defects.crossings.T, np.concatenate([defects.degenerate, defects.walls]))
    )
    edges = at[np.concatenate([defects.open, defects.non_manifold_edges])]
    vertices = at[defects.non_manifold_vertices]
    # two triangles can meet only where their boxes do
    lows = [np.maximum(first.min(axis=1), second.min(axis=1)), edges.min(axis=1), vertices]
    highs = [np.minimum(first.max(axis=1), second.max(axis=1)), edges.max(axis=1), vertices]
    lows, highs = [*lows, whole.min(axis=1)], [*highs, whole.max(axis=1)]
    start, end = np.concatenate(lows), np.concatenate(highs)
    if not len(start):
        return np.zeros(0, np.int64)
    side = np.median(measure_sides(at, np.ascontiguousarray(draft.triangles, np.int32)))
    size = np.maximum(np.linalg.norm(end - start, axis=1) / 2, float(side) / 4)
    away, nearest = tree.query((start + end) / 2)
    # at least one vertex, or the next try would equal this one
    radius = np.maximum(size * GROWTH ** tries[nearest], (1 + HAIR) * away)
    found = tree.query_ball_point((start + end) / 2, radius)
    return np.unique(np.concatenate([np.asarray(each, np.int64) for each in found]))
