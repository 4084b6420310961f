"""Simplify a mesh so that it stays sound: check exactly, lock what went wrong, simplify again.

Simplification knows of no neighbours: it lets walls cross, and pinches bodies. Round each fault the
vertices of the surface before are locked, wider with every try, and the bodies at fault are
simplified anew. A body that still has faults after ROUNDS keeps the surface it had before.

Its error is a mean over planes, and says little of a thin process that it cuts off: vertices that
would be left too far away are locked as well.
"""

from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from stereocell.certify import Faults, Plane, bodies, border, certify
from stereocell.distance import Nearest
from stereocell.lod import compact, renumber, simplify_part
from stereocell.mesh import Mesh

ROUNDS = 14
FAR_ROUNDS = 4  # in which vertices too far away are looked for: each lock may make another stray
GROWTH = 2.0  # of the balls in which vertices are locked, with each try in a place

Triangles = NDArray[np.uint32]


@dataclass(frozen=True, slots=True)
class Mended:
    """`mended`: bodies simplified again; `fallbacks`: bodies that stayed as they were."""

    mesh: Mesh
    mended: int
    fallbacks: int


def simplify_soundly(
    mesh: Mesh, planes: tuple[Plane, ...], max_error_um: float, max_away_um: float = np.inf
) -> Mended:
    """Return the mesh simplified and without faults, its borders as they are.

    `planes` are where it may be open. A mesh that has faults itself keeps bodies with faults.
    Vertices that would lie further than `max_away_um` from what is returned stay, but for a few in
    bodies that still have such after FAR_ROUNDS.
    """
    body = bodies(mesh.triangles, len(mesh.positions))
    rim = border(mesh.triangles)
    tries = np.zeros(len(mesh.positions), np.int64)
    tree: cKDTree | None = None
    triangles = simplify_part(mesh, mesh.triangles, max_error_um, tries > 0)
    chosen = np.ones(int(body.max(initial=0)) + 1, bool)
    redone: set[int] = set()
    mended: set[int] = set()
    kept: set[int] = set()
    for number in count():
        faults = _faults(mesh, triangles, planes, rim, body, redone if number else None)
        worst = np.unique(body[faults.vertices(triangles)])
        far = _strays(mesh, triangles, body, chosen, max_away_um if number < FAR_ROUNDS else np.inf)
        if kept.issuperset(worst.tolist()) and not len(far):  # no faults but the given mesh's own
            break
        mended.update(worst.tolist())
        tries[far] += 1
        chosen[:] = False
        chosen[worst] = chosen[body[far]] = True
        redone.update(np.flatnonzero(chosen).tolist())
        again = mesh.triangles[chosen[body[mesh.triangles[:, 0]]]]
        if number < ROUNDS:
            if tree is None:
                tree = cKDTree(mesh.positions)
            if faults.total:
                tries[_around(tree, mesh, triangles, faults, tries)] += 1
            again = simplify_part(mesh, again, max_error_um, tries > 0)
        else:
            kept.update(worst.tolist())
        triangles = np.concatenate([triangles[~chosen[body[triangles[:, 0]]]], again])
    return Mended(compact(mesh, triangles), len(mended - kept), len(kept))


def _faults(
    mesh: Mesh,
    triangles: Triangles,
    planes: tuple[Plane, ...],
    rim: NDArray[np.int64],
    body: NDArray[np.int32],
    changed: set[int] | None,
) -> Faults:
    """Return the faults by numbers of these triangles; a border that changed counts as open.

    With `changed`, bodies whose boxes lie clear of these bodies' are as sound as they were.
    """
    part = np.arange(len(triangles))
    if changed is not None:
        part = np.flatnonzero(_near(mesh, triangles, body, changed)[body[triangles[:, 0]]])
        rim = rim[np.isin(body[rim[:, 0]], np.unique(body[triangles[part, 0]]))]
    used, own = renumber(triangles[part], len(mesh.positions))
    found = certify(Mesh(mesh.positions[used], own, mesh.normals[used]), planes)
    now = border(triangles[part])
    key = len(mesh.positions)
    differs = np.setxor1d(now[:, 0] * key + now[:, 1], rim[:, 0] * key + rim[:, 1])
    return replace(
        found,
        degenerate=part[found.degenerate],
        open=np.concatenate([used[found.open], np.stack(np.divmod(differs, key), axis=1)]),
        crowded=used[found.crowded],
        pinched=used[found.pinched],
        inside_out=part[found.inside_out],
        crossings=part[found.crossings],
        walls=part[found.walls],
    )


def _strays(
    mesh: Mesh,
    triangles: Triangles,
    body: NDArray[np.int32],
    chosen: NDArray[np.bool_],
    limit_um: float,
) -> NDArray[np.int64]:
    """Return the vertices of the chosen bodies that are further than the limit from them."""
    if limit_um == np.inf:
        return np.zeros(0, np.int64)
    vertices = np.flatnonzero(chosen[body])
    own = triangles[chosen[body[triangles[:, 0]]]]
    away = Nearest(compact(mesh, own), 1).distances(mesh.positions[vertices].astype(np.float64))
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
    tree: cKDTree, mesh: Mesh, triangles: Triangles, faults: Faults, tries: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the vertices in balls round the faults, larger by GROWTH for each of the tries."""
    corners = mesh.positions[triangles].astype(np.float64)
    low, high = corners.min(axis=1), corners.max(axis=1)
    first, second = faults.crossings.T
    edges = mesh.positions[np.concatenate([faults.open, faults.crowded])].astype(np.float64)
    pinched = mesh.positions[faults.pinched].astype(np.float64)
    whole = np.concatenate([faults.degenerate, faults.inside_out, faults.walls])
    # two triangles can meet only where their boxes do
    lows = [np.maximum(low[first], low[second]), edges.min(axis=1), pinched, low[whole]]
    highs = [np.minimum(high[first], high[second]), edges.max(axis=1), pinched, high[whole]]
    start, end = np.concatenate(lows), np.concatenate(highs)
    sides = corners - np.roll(corners, 1, axis=1)
    least = float(np.median(np.linalg.norm(sides, axis=2))) / 4
    size = np.maximum(np.linalg.norm(end - start, axis=1) / 2, least)
    _, nearest = tree.query((start + end) / 2)
    found = tree.query_ball_point((start + end) / 2, size * GROWTH ** tries[nearest])
    return np.unique(np.concatenate([np.asarray(each, np.int64) for each in found]))
