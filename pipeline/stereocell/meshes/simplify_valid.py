"""Simplify a mesh so that it stays valid: check exactly, lock the defects, simplify again.

Simplification does not see neighbours: it lets walls cross, and pinches bodies. Pinched sheets are
separated. Around each remaining defect the vertices of the given surface are locked, in a ball that
grows with every try, and the bodies with defects are simplified again. A body that still has
defects after ROUNDS keeps the surface it had before.

Simplification's error is a mean over planes, and can be small although it cuts off a thin process:
vertices that would be too far from the result are locked as well.
"""

from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from stereocell.meshes.distance import Nearest
from stereocell.meshes.self_intersections import MARGIN
from stereocell.meshes.separate_sheets import separate_sheets
from stereocell.meshes.simplify import compact, renumber, simplify_part
from stereocell.meshes.validity import Defects, border, find_defects, label_components
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Mesh

ROUNDS = 14  # most rounds in which defective bodies are simplified again
FAR_ROUNDS = 4  # rounds that look for vertices too far away: each lock may make another one stray
GROWTH = 2.0  # factor by which the ball of locked vertices grows with each try in a place

# large odd factors, one for each corner: sums modulo 2^64 distinguish triangles
MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)

Triangles = NDArray[np.uint32]


@dataclass(frozen=True, slots=True)
class Simplified:
    """The result, and how many bodies were simplified again, and how many stayed as they were."""

    mesh: Mesh
    simplified_again: int
    fallbacks: int


def simplify_without_defects(
    mesh: Mesh, planes: tuple[Plane, ...], *, max_error_um: float, max_away_um: float = np.inf
) -> Simplified:
    """Return the mesh simplified and without defects; its boundary edges stay.

    mesh          positions float32 (n, 3) in um, triangles uint32 (m, 3)
    planes        the cut planes, where the mesh may be open
    max_error_um  largest quadric error
    max_away_um   vertices that would be farther from the result stay, but for a few in bodies that
                  still have such vertices after FAR_ROUNDS

    A mesh that has defects itself keeps the bodies with defects.
    """
    draft = _Draft(mesh, planes)
    body = draft.body  # bodies of the mesh's own vertices
    tries = np.zeros(len(mesh.positions), np.int64)
    tree: cKDTree | None = None
    triangles = draft.separate(
        simplify_part(mesh, mesh.triangles, max_error_um=max_error_um, locked=tries > 0)
    )
    chosen = np.ones(int(body.max(initial=0)) + 1, bool)
    redone: set[int] = set()
    defective: set[int] = set()
    kept: set[int] = set()
    for number in count():
        defects = draft.defects(triangles, redone if number else None)
        worst = np.unique(draft.body[defects.vertices(triangles)])
        far = _strays(
            draft, triangles, body, chosen, max_away_um if number < FAR_ROUNDS else np.inf
        )
        if kept.issuperset(worst.tolist()) and not len(far):  # only given defects are left
            break
        defective.update(worst.tolist())
        tries[far] += 1
        chosen[:] = False
        chosen[worst] = chosen[body[far]] = True
        redone.update(np.flatnonzero(chosen).tolist())
        again = mesh.triangles[chosen[body[mesh.triangles[:, 0]]]]
        if number < ROUNDS:
            if tree is None:
                tree = cKDTree(mesh.positions)
            if defects.total:
                tries[_around(tree, draft.mesh, triangles, defects, tries)] += 1
            again = draft.separate(
                simplify_part(mesh, again, max_error_um=max_error_um, locked=tries > 0)
            )
        else:
            kept.update(worst.tolist())
        triangles = np.concatenate([triangles[~chosen[draft.body[triangles[:, 0]]]], again])
    return Simplified(compact(draft.mesh, triangles), len(defective - kept), len(kept))


class _Draft:
    """A series of simplifications of one mesh, and their defects.

    mesh          the mesh, with the vertices that separated sheets at its end
    body          the body of the mesh that each vertex belongs to
    border_edges  of the mesh
    triangles     the triangles of the last check
    crossings     the pairs of these that meet

    Vertices never move, so that two old triangles meet now if they met before: crossings are
    looked for only in pairs with a fresh triangle. `find_defects` finds the same ones.
    """

    def __init__(self, mesh: Mesh, planes: tuple[Plane, ...]) -> None:
        self.mesh, self.planes = mesh, planes
        self.body = label_components(mesh.triangles, len(mesh.positions))
        self.border_edges = border(mesh.triangles)
        self.triangles = np.zeros((0, 3), np.uint32)
        self.crossings = np.zeros((0, 2), np.int64)

    def separate(self, triangles: Triangles) -> Triangles:
        """Return the triangles with sheets separated; the mesh gets the vertices for it."""
        self.mesh, parted, source = separate_sheets(self.mesh, triangles)
        self.body = np.concatenate([self.body, self.body[source]])
        return parted

    def defects(self, triangles: Triangles, changed: set[int] | None) -> Defects:
        """Return the defects by numbers of these triangles; a changed boundary edge counts as open.

        changed  bodies that changed; others whose boxes don't touch theirs are not checked again
        """
        mesh, body, border_edges = self.mesh, self.body, self.border_edges
        part, past = np.arange(len(triangles)), np.arange(len(self.triangles))
        if changed is not None:
            near = _near(mesh, triangles, body, changed)
            part, past = (
                np.flatnonzero(near[body[of[:, 0]]]) for of in (triangles, self.triangles)
            )
            border_edges = border_edges[
                np.isin(body[border_edges[:, 0]], np.unique(body[triangles[part, 0]]))
            ]
        before = _find(triangles[part], self.triangles[past])
        used, own = renumber(triangles[part], len(mesh.positions))
        found = find_defects(
            Mesh(mesh.positions[used], own, mesh.normals[used]), self.planes, before < 0
        )
        now = np.full(len(self.triangles), -1, np.int64)
        stayed = before >= 0
        now[past[before[stayed]]] = part[stayed]
        # old crossings are near: their bodies are among those that changed
        old = now[self.crossings]
        both = np.concatenate([old[(old >= 0).all(axis=1)], part[found.crossings]])
        self.triangles, self.crossings = triangles, np.unique(np.sort(both, axis=1), axis=0)
        open_now = border(triangles[part])
        key = len(mesh.positions)
        differs = np.setxor1d(
            open_now[:, 0] * key + open_now[:, 1], border_edges[:, 0] * key + border_edges[:, 1]
        )
        return replace(
            found,
            degenerate=part[found.degenerate],
            open=np.concatenate([used[found.open], np.stack(np.divmod(differs, key), axis=1)]),
            non_manifold_edges=used[found.non_manifold_edges],
            non_manifold_vertices=used[found.non_manifold_vertices],
            inside_out=part[found.inside_out],
            crossings=self.crossings,
            walls=part[found.walls],
        )


def _find(triangles: Triangles, among: Triangles) -> NDArray[np.int64]:
    """Return the index of each triangle among the others; -1 for none, and for repeated ones.

    It compares sums. Different triangles may share a sum: then one of them counts as not found.
    """
    if not len(among):
        return np.full(len(triangles), -1, np.int64)
    sums, others = ((of.astype(np.uint64) * MIX).sum(axis=1) for of in (triangles, among))
    order = np.argsort(others, kind="stable")
    at = order[np.minimum(np.searchsorted(others, sums, sorter=order), len(order) - 1)]
    place = np.where((among[at] == triangles).all(axis=1), at, -1)
    repeated = np.bincount(place[place >= 0], minlength=len(among)) > 1
    return np.where(repeated[place], -1, place)


def _strays(
    draft: _Draft,
    triangles: Triangles,
    body: NDArray[np.int32],
    chosen: NDArray[np.bool_],
    limit_um: float,
) -> NDArray[np.int64]:
    """Return the vertices of the chosen bodies that are farther than the limit from the result.

    body  body of each vertex (n,) that is checked
    """
    if limit_um == np.inf:
        return np.zeros(0, np.int64)
    vertices = np.flatnonzero(chosen[body])
    own = compact(draft.mesh, triangles[chosen[draft.body[triangles[:, 0]]]])
    away = Nearest(own, 1).distances(draft.mesh.positions[vertices].astype(np.float64))
    return vertices[away > limit_um]


def _near(
    mesh: Mesh, triangles: Triangles, body: NDArray[np.int32], changed: set[int]
) -> NDArray[np.bool_]:
    """Return which bodies have boxes that touch those of the changed ones."""
    number = int(body.max()) + 1
    low, high = np.full((number, 3), np.inf), np.full((number, 3), -np.inf)
    used = np.unique(triangles)
    used = used[np.argsort(body[used], kind="stable")]
    starts = np.flatnonzero(np.diff(body[used], prepend=-1))
    low[body[used[starts]]] = np.minimum.reduceat(mesh.positions[used], starts)
    high[body[used[starts]]] = np.maximum.reduceat(mesh.positions[used], starts)
    near = np.zeros(number, bool)
    for one in sorted(changed):
        near |= ((low <= high[one]) & (high >= low[one])).all(axis=1)
    return near


def _around(
    tree: cKDTree, mesh: Mesh, triangles: Triangles, defects: Defects, tries: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the vertices in balls around the defects; a ball grows by GROWTH with each try."""
    corners = mesh.positions[triangles].astype(np.float64)
    low, high = corners.min(axis=1), corners.max(axis=1)
    first, second = defects.crossings.T
    edges = mesh.positions[np.concatenate([defects.open, defects.non_manifold_edges])].astype(
        np.float64
    )
    vertices = mesh.positions[defects.non_manifold_vertices].astype(np.float64)
    whole = np.concatenate([defects.degenerate, defects.inside_out, defects.walls])
    # two triangles can meet only where their boxes do
    lows = [np.maximum(low[first], low[second]), edges.min(axis=1), vertices, low[whole]]
    highs = [np.minimum(high[first], high[second]), edges.max(axis=1), vertices, high[whole]]
    start, end = np.concatenate(lows), np.concatenate(highs)
    sides = corners - np.roll(corners, 1, axis=1)
    least = float(np.median(np.linalg.norm(sides, axis=2))) / 4
    size = np.maximum(np.linalg.norm(end - start, axis=1) / 2, least)
    away, nearest = tree.query((start + end) / 2)
    # at least one vertex, or the next try would equal this one
    radius = np.maximum(size * GROWTH ** tries[nearest], (1 + MARGIN) * away)
    found = tree.query_ball_point((start + end) / 2, radius)
    return np.unique(np.concatenate([np.asarray(each, np.int64) for each in found]))
