"""Place the vertices of a simplified mesh, and restore the volume of each of its bodies.

Simplification keeps some of the fine surface's vertices. Flat triangles between the vertices of a
round body lie inside of it, so coarse levels would lose a third of a body's volume. Here each
vertex first moves to its place near the fine surface (meshes/place_vertices.py). Then all vertices
of a body move along their normals by one distance, until its volume is that of the fine body or the
distance reaches its bound.

- The move fades out towards a cut, so that vertices of the cut keep their exact position and no
  other vertex reaches it.
- Vertices of caps, the flat ends of bodies, move within their planes.
- No vertex leaves the tile's box, or the box of the fine mesh where caps at the end of the data lie
  outside of the tile's.

Moves may make bodies cross each other or themselves. Vertices there move half as far with each try,
and finally not at all. The other vertices of the body move farther to make up for them, unless
fewer than FEW are held back. A body that still crosses after TRIES tries does not move at all. If
MANY vertices cross in the first try, these bodies stop moving at once. Noise is an example, where
walls are nearer to each other than the moves are long: more tries would cost more than the rest of
the level.

A body between near walls may have no space to grow. It then lacks volume, and
textures/lod_chain.py simplifies it less.
"""

import itertools
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stereocell.kernels.half_edges import measure_volumes, sum_gains, sum_normals
from stereocell.kernels.placement import move_along
from stereocell.kernels.triangle_rows import touch
from stereocell.meshes.place_vertices import FinePlanes
from stereocell.meshes.validity import (
    Defects,
    Topology,
    find_defects,
    find_topology,
    measure_sizes,
)
from stereocell.model.lattice import Plane
from stereocell.model.mesh import Mesh

STEPS = 4  # number of Newton steps; volume is a cubic function of the distance
# Distance from a cut at which vertices make their whole move, as a multiple of the largest move
FADE = 1.25
TRIES = 12  # number of tries with shorter moves, after which a body with defects does not move
SHORTENING = 0.5  # factor on the moves of vertices in defects, in each try
MIN_WAY = 0.05  # share of its whole move; a vertex in a defect that is left with less does not move
MAX_VOLUME_ERROR = 0.03  # largest error of a body's volume, as a share of that volume

FEW = 0.02  # share of a body's vertices; if fewer are held back, others do not move farther
# If more than this share and more than this number of a level's vertices are in defects after the
# first try, all bodies with defects stop moving
MANY = 0.05
COSTLY = 10_000

Points = NDArray[np.float64]
Box = tuple[Points, Points]  # least and largest corner, (x, y, z), um


@dataclass(frozen=True, slots=True)
class RestoredLevel:
    """A level of detail whose bodies have their volumes back, as far as possible.

    defects  defects that remain in the mesh
    lacks    bool (n,), vertices of bodies whose volume is off by more than MAX_VOLUME_ERROR; all
             False if MANY vertices crossed
    moves    float64 (n, 3), moves of the vertices
    share    float64 (n,), share of the whole move that each vertex makes
    """

    mesh: Mesh
    defects: Defects
    lacks: NDArray[np.bool_]
    moves: Points
    share: Points


@dataclass(frozen=True, slots=True)
class EarlierLevel:
    """A level with its volumes, some bodies of which have been simplified differently since.

    vertices  int64 (n,), index of each vertex in the fine mesh, rising
    changed   bool (k,), vertices of the new level that belong to bodies that changed
    """

    kept: RestoredLevel
    vertices: NDArray[np.int64]
    changed: NDArray[np.bool_]

    @property
    def at_fault(self) -> NDArray[np.int64]:
        """Return the vertices of the level's defects, int64 (n,), as indices in the fine mesh."""
        return self.vertices[self.kept.defects.vertices(self.kept.mesh.triangles)]


class FineVolumes:
    """The volumes of a fine mesh's bodies, for levels whose vertices are a part of its vertices.

    planes    the cut planes
    box       box of the tile, which vertices do not leave; None: vertices may move anywhere
    topology  topology of the mesh; None: it is computed
    caps      planes of caps, which stay flat
    """

    def __init__(
        self,
        mesh: Mesh,
        planes: tuple[Plane, ...],
        box: Box | None = None,
        topology: Topology | None = None,
        caps: tuple[Plane, ...] = (),
    ) -> None:
        topology = topology or find_topology(mesh.triangles, len(mesh.positions))
        self._label, count = topology.bodies
        self._fine_planes = FinePlanes(mesh, topology.corners, caps)
        self._planes, self._caps = planes, caps
        low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
        self._origin = (low.astype(np.float64) + high) / 2
        self._low, self._high = np.full(3, -np.inf), np.full(3, np.inf)
        if box is not None:
            self._low, self._high = np.minimum(low, box[0]), np.maximum(high, box[1])
        self._volume = self._measure(mesh.positions, mesh.triangles, self._label, count)
        sizes = measure_sizes(mesh, planes, topology)
        boxes = (sizes.high - sizes.low).prod(axis=1)
        self._solid = np.where(sizes.are_known, np.abs(sizes.volumes), boxes)

    def _measure(
        self,
        positions: NDArray[np.floating],
        triangles: NDArray[np.integer],
        label: NDArray[np.int32],
        count: int,
    ) -> Points:
        corners = np.ascontiguousarray(triangles, np.int32)
        return measure_volumes(positions - self._origin, corners, label, count)

    def keep(
        self,
        mesh: Mesh,
        vertices: NDArray[np.int64],
        owners: NDArray[np.int32],
        *,
        max_move_um: float,
        topology: Topology | None = None,
        earlier: EarlierLevel | None = None,
    ) -> RestoredLevel:
        """Return a level of detail whose bodies have the volumes of the fine mesh's bodies.

        vertices     int64 (n,), index of each vertex in the fine mesh
        owners       int32, the vertex that stands for each vertex of the fine mesh; -1: none does
        max_move_um  largest distance of a move
        topology     topology of the level's mesh; None: it is computed
        earlier      an earlier result, valid for all bodies that have not changed
        """
        planes = self._planes
        topology = topology or find_topology(mesh.triangles, len(mesh.positions))
        triangles, (label, count) = topology.corners, topology.bodies
        of_fine = self._label[vertices[np.unique(label, return_index=True)[1]]]
        wanted = self._volume[of_fine]
        start = mesh.positions.astype(np.float64)
        whole = _fade(mesh, topology, planes, FADE * max_move_um)
        places = self._fine_planes.find_moves(start, triangles, owners, max_move_um)
        share, size = whole.copy(), np.bincount(label, minlength=count)
        fresh = np.ones(len(triangles), bool)
        if earlier is not None:
            same = np.flatnonzero(~earlier.changed)
            place = np.searchsorted(earlier.vertices, vertices[same])
            share[same] = earlier.kept.share[place]
            # Triangles in earlier defects are checked again.
            was_faulty = np.isin(vertices, earlier.at_fault)
            fresh = touch(earlier.changed | was_faulty, triangles)
        moves = self._find_moves(
            start, triangles, (label, count), wanted, share, max_move_um, places
        )
        if earlier is not None:
            moves[same] = earlier.kept.moves[place]
        placed: Mesh | None = None
        faulty, are_many = np.zeros(0, np.int64), False
        # The loop ends, because after TRIES tries at least one more body stops moving in each try.
        for number in itertools.count():
            # A vertex that does not move stays bit by bit: a sum would lose the sign of a zero.
            positions = np.where(moves == 0, mesh.positions, (start + moves).astype(np.float32))
            if placed is not None:
                # Only triangles that moved, or were in a defect, are checked again.
                other = (positions != placed.positions).any(axis=1)
                other[faulty] = True
                fresh = touch(other, triangles)
            placed = replace(mesh, positions=positions)
            defects = find_defects(placed, planes=planes, fresh=fresh, topology=topology)
            faulty = defects.vertices(mesh.triangles)
            worst = np.zeros(count, bool)
            worst[label[faulty]] = True
            worst &= np.bincount(label, share, count) > 0
            if not worst.any():
                break
            before = share.copy()
            are_many |= number == 0 and len(faulty) > max(MANY * len(start), COSTLY)
            if are_many or number >= TRIES:
                share[worst[label]] = 0.0
            else:
                share[faulty] *= np.where(share[faulty] > MIN_WAY * whole[faulty], SHORTENING, 0.0)
            eased = np.divide(share, before, out=np.zeros_like(share), where=before > 0)[:, None]
            few = np.bincount(label, whole - share, count) < FEW * size
            moved = self._find_moves(
                start, triangles, (label, count), wanted, share, max_move_um, places
            )
            moves = np.where(few[label][:, None], moves * eased, moved)
        assert placed is not None
        missing = wanted - self._measure(start + moves, triangles, label, count)
        lacks = (np.abs(missing) > MAX_VOLUME_ERROR * self._solid[of_fine]) & (not are_many)
        return RestoredLevel(placed, defects, lacks[label], moves, share)

    def _find_moves(
        self,
        start: Points,
        triangles: NDArray[np.int32],
        bodies: tuple[NDArray[np.int32], int],
        wanted: Points,
        share: Points,
        max_move_um: float,
        places: Points,
    ) -> Points:
        """Return the moves of the vertices, (n, 3), that give each body its volume.

        start   float64 (n, 3), positions before the move
        places  moves (n, 3) that bring the vertices nearer to the fine surface
        bodies  body of each vertex, and the number of bodies
        wanted  volumes that the bodies should have, um^3
        share   share of the move that each vertex makes
        """
        label, count = bodies
        at = np.clip(start + places * share[:, None], self._low, self._high)
        moved = np.zeros(count)
        flat = [(axis, start[:, axis] == np.float32(value)) for axis, value in self._caps]
        for _ in range(STEPS):
            missing = wanted - self._measure(at, triangles, label, count)
            ways = sum_normals(at, triangles) * share[:, None]
            for axis, on_cap in flat:
                ways[on_cap, axis] = 0.0
            gain = sum_gains(at, triangles, label, count, ways)
            step = np.divide(missing, gain, out=np.zeros(count), where=gain > 1e-12)
            step = np.clip(moved + step, -max_move_um, max_move_um) - moved
            moved += step
            move_along(at, ways, step[label], start, max_move_um, self._low, self._high)
        return at - start


def _fade(mesh: Mesh, topology: Topology, planes: tuple[Plane, ...], reach_um: float) -> Points:
    """Return the share of the move that each vertex makes (n,): 0 at a cut, 1 far from it."""
    share = np.ones(len(mesh.positions))
    for column, value in planes:
        away = np.abs(mesh.positions[:, column].astype(np.float64) - value)
        share = np.minimum(share, away / reach_um)
    share[topology.rim] = share[topology.crowded] = 0.0
    return share
