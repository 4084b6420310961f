"""Simplify a mesh so that it stays valid: check exactly, lock around defects, simplify again.

Simplification keeps the topology and does not fold triangles over. But it sees only the triangles
around a vertex, so walls that are near each other may cross afterwards. Around each defect the
vertices of the given surface are then locked, in a ball that grows with every try. The bodies with
defects are simplified again, with the same moves except around newly locked vertices. A body that
still has defects after ROUNDS keeps the surface it had before. If MANY of a body's vertices cross,
as in a sponge, nearly all of it would be locked. Its error is halved instead, up to HALVINGS times.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from stereocell.kernels.half_edges import measure_sides
from stereocell.kernels.placement import follow_moves
from stereocell.kernels.triangle_rows import differ, touch
from stereocell.meshes.simplify import NOTHING, Moves, find_errors, renumber, simplify_part
from stereocell.meshes.validity import Defects, Topology, find_defects, find_topology
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Mesh

ROUNDS = 12  # largest number of rounds in which bodies with defects are simplified again
GROWTH = 2.0  # factor by which the ball of locked vertices grows with each try in a place
# Share and number of a body's vertices in defects, above which its error is halved
MANY = 0.05
COSTLY = 10_000
HALVINGS = 3
# Number of balls that are searched together, to limit the memory for their vertices
AT_A_TIME = 1000
# Every 8th vertex of a body that is inside out is locked first; later more of them
LOCKED_EVERY = 8

Triangles = NDArray[np.uint32]


@dataclass(frozen=True, slots=True)
class Simplified:
    """A simplified mesh without defects.

    topology          topology of the simplified mesh
    vertices          int64 (k,), index of each vertex in the given mesh, rising
    owners            int32 (n,), the vertex (0..k-1) that stands for each vertex of the given mesh;
                      -1: none does
    changed           bool (k,), vertices of bodies that were simplified in this call
    simplified_again  number of bodies that were simplified more than once
    fallbacks         number of bodies that kept their given surface
    """

    mesh: Mesh
    topology: Topology
    vertices: NDArray[np.int64]
    owners: NDArray[np.int32]
    changed: NDArray[np.bool_]
    simplified_again: int
    fallbacks: int


def simplify_without_defects(
    mesh: Mesh, planes: tuple[Plane, ...], *, max_error_um: float
) -> Simplified:
    """Return the mesh simplified and without defects. Boundary edges stay. See `Simplifier`."""
    return Simplifier(mesh, planes).simplify(max_error_um)


class Simplifier:
    """Simplifies all bodies of a mesh, and later some of them with another error.

    mesh      positions float32 (n, 3) in um, triangles uint32 (m, 3)
    planes    the cut planes, where the mesh may be open
    topology  topology of the mesh; None: it is computed
    caps      planes of caps, which stay flat

    Bodies with defects in the given mesh stay as they are.
    """

    def __init__(
        self,
        mesh: Mesh,
        planes: tuple[Plane, ...],
        topology: Topology | None = None,
        caps: tuple[Plane, ...] = (),
    ) -> None:
        vertices = len(mesh.positions)
        self._mesh, self._planes, self._caps = mesh, planes, caps
        self._bodies = (topology or find_topology(mesh.triangles, vertices)).bodies
        self._body_of = self._bodies[0][mesh.triangles[:, 0]]
        # For each given triangle, its present corners, and whether it is left
        self._corners, self._left = mesh.triangles.copy(), np.ones(len(mesh.triangles), bool)
        self._moves = NOTHING
        self._errors = np.zeros(vertices)
        # Number of times that each vertex was locked; a vertex that was locked does not move
        self._tries = np.zeros(vertices, np.int8)
        self._faulty = np.zeros(vertices, bool)  # vertices of the last draft's defects
        self._redone, self._kept = np.zeros((2, self._bodies[1]), bool)

    def simplify(self, max_error_um: float, bodies: NDArray[np.bool_] | None = None) -> Simplified:
        """Return the mesh simplified and without defects. Boundary edges stay.

        max_error_um  largest error of a vertex, um, see `simplify.simplify`
        bodies        bool (b,), the bodies that are simplified; None: all. The others stay as after
                      the last call, unless simplified ones cross them.
        """
        mesh, (body, count) = self._mesh, self._bodies
        chosen = np.ones(count, bool) if bodies is None else bodies
        changed, halvings, rounds = chosen.copy(), np.zeros(count, np.int64), 0
        tree: cKDTree | None = None
        here = chosen[body]
        self._errors[here] = find_errors(mesh, max_error_um, self._bodies)[here]
        self._tries[here] = 0
        self._redone[chosen] = self._kept[chosen] = False
        fresh = self._simplify_again(chosen) | self._are_faulty()
        if bodies is None:
            fresh[:] = True
        while True:
            used, own = renumber(self._corners[self._left], len(mesh.positions))
            draft = Mesh(mesh.positions[used], own, mesh.normals[used])
            found = find_topology(own, len(used))
            defects = find_defects(
                draft, planes=self._planes, fresh=fresh[self._left], topology=found
            )
            at_fault = used[defects.vertices(own)]
            hits, size = (np.bincount(body[some], minlength=count) for some in (at_fault, used))
            worst = (hits > 0) & ~self._kept
            self._faulty[:] = False
            self._faulty[at_fault] = True
            if not worst.any():
                break
            many = worst & (hits > np.maximum(MANY * size, COSTLY))
            ended = (worst & (rounds == ROUNDS)) | (many & (halvings == HALVINGS))
            # Crossings of given triangles cannot be repaired by simplifying less.
            given = ~differ(self._corners, mesh.triangles)[self._left]
            as_given = defects.crossings[given[defects.crossings].all(axis=1)]
            ended[body[used[own[as_given, 0]]]] = True
            ended &= worst
            # Triangles that passed the last check and have not changed are not checked again.
            fresh = self._are_faulty()
            if ended.any():
                self._kept |= ended
                chosen = ended
                fresh |= self._put_back(chosen)
            elif many.any():
                chosen = many
                halvings[chosen] += 1
                self._errors[chosen[body]] /= 2
                fresh |= self._simplify_again(chosen)
            else:
                chosen = worst
                # Few places are looked up, and a balanced tree takes three times as long to build.
                tree = tree or cKDTree(mesh.positions, balanced_tree=False, compact_nodes=False)
                self._tries[_around(tree, draft, defects, self._tries)] += 1
                turned = body[used[own[defects.inside_out, 0]]]
                self._tries[_some_of(body, turned, max(1, LOCKED_EVERY >> rounds))] += 1
                fresh |= self._simplify_again(chosen, repeats_moves=True)
                rounds += 1
            self._redone |= chosen
            changed |= chosen
        again, fallbacks = int((self._redone & ~self._kept).sum()), int(self._kept.sum())
        place = np.full(len(mesh.positions), -1, np.int32)
        place[used] = np.arange(len(used), dtype=np.int32)
        owners = place[follow_moves(self._moves, len(place))]
        return Simplified(draft, found, used, owners, changed[body[used]], again, fallbacks)

    def _are_faulty(self) -> NDArray[np.bool_]:
        """Return which of all triangles touch a defect of the last draft, bool (m,)."""
        return touch(self._faulty, self._corners)

    def _simplify_again(
        self, chosen: NDArray[np.bool_], *, repeats_moves: bool = False
    ) -> NDArray[np.bool_]:
        """Simplify the chosen bodies (b,); return which of all triangles have changed (m,).

        repeats_moves  whether earlier moves are repeated, except around newly locked vertices
        """
        part = self._mesh.triangles[chosen[self._body_of]]
        past = self._moves[chosen[self._bodies[0][self._moves[:, 0]]]]
        corners, left, moves = simplify_part(
            self._mesh,
            part,
            self._errors,
            locked=self._tries > 0,
            planes=self._planes,
            caps=self._caps,
            past=past if repeats_moves else NOTHING,
        )
        return self._put(chosen, corners, left, moves)

    def _put_back(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Restore the given triangles of the chosen bodies (b,); return which have changed (m,)."""
        part = self._mesh.triangles[chosen[self._body_of]]
        return self._put(chosen, part, np.ones(len(part), bool), NOTHING)

    def _put(
        self,
        chosen: NDArray[np.bool_],
        corners: Triangles,
        left: NDArray[np.bool_],
        moves: Moves,
    ) -> NDArray[np.bool_]:
        rows = np.flatnonzero(chosen[self._body_of])
        other = np.zeros(len(self._corners), bool)
        other[rows] = ~self._left[rows] | differ(corners, self._corners[rows])
        self._corners[rows], self._left[rows] = corners, left
        stay = ~chosen[self._bodies[0][self._moves[:, 0]]]
        self._moves = np.concatenate([self._moves[stay], moves])
        return other


def _some_of(body: NDArray[np.int32], chosen: NDArray[np.int32], every: int) -> NDArray[np.int64]:
    """Return every `every`-th vertex of each of the chosen bodies."""
    vertices = np.flatnonzero(np.isin(body, chosen))
    vertices = vertices[np.argsort(body[vertices], kind="stable")]
    first = np.flatnonzero(np.diff(body[vertices], prepend=-1))
    place = np.arange(len(vertices)) - np.repeat(first, np.diff(first, append=len(vertices)))
    return vertices[place % every == 0]


def _around(
    tree: cKDTree, draft: Mesh, defects: Defects, tries: NDArray[np.int8]
) -> NDArray[np.int64]:
    """Return vertices of the tree in balls around the defects. A ball grows with each try."""
    at = draft.positions.astype(np.float64)
    one, other, whole = (
        at[draft.triangles[some]]
        for some in (
            *defects.crossings.T,
            np.concatenate([defects.degenerate, defects.in_cut_plane]),
        )
    )
    edges = at[np.concatenate([defects.open, defects.non_manifold_edges])]
    vertices = at[defects.non_manifold_vertices]
    # Two triangles can meet only where their boxes do.
    lows = [np.maximum(one.min(axis=1), other.min(axis=1)), edges.min(axis=1), vertices]
    highs = [np.minimum(one.max(axis=1), other.max(axis=1)), edges.max(axis=1), vertices]
    lows, highs = [*lows, whole.min(axis=1)], [*highs, whole.max(axis=1)]
    start, end = np.concatenate(lows), np.concatenate(highs)
    if not len(start):
        return np.zeros(0, np.int64)
    side = np.median(measure_sides(at, np.ascontiguousarray(draft.triangles, np.int32)))
    size = np.maximum(np.linalg.norm(end - start, axis=1) / 2, float(side) / 4)
    nearest = tree.query((start + end) / 2)[1]
    # One ball for each vertex that is nearest to a defect, not for each defect, of which there may
    # be very many. A ball holds at least its vertex.
    places, which = np.unique(nearest, return_inverse=True)
    radius = np.zeros(len(places))
    np.maximum.at(radius, which, size * GROWTH ** tries[nearest].astype(np.float64))
    found = np.zeros(tree.n, bool)
    for first in range(0, len(places), AT_A_TIME):
        some = slice(first, first + AT_A_TIME)
        for ball in tree.query_ball_point(tree.data[places[some]], radius[some]):
            found[ball] = True
    return np.flatnonzero(found)
